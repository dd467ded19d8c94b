//! The wrench of a contact: the measured wrench less the sensor's offset and the load. The online
//! identifier and whole recordings compute it from the same entries of an instant, each through its
//! own filter.

mod frame;
mod load;
mod recorded;
mod wrench;

pub use frame::WrenchFrame;
pub use load::LoadEstimate;
pub use recorded::{ContactSample, RecordedContact, RecordedWrenches};
pub use wrench::{ContactState, LoadAndContact, WrenchEstimate};
pub(crate) use wrench::{Entries, Parts};
