//! The wrench of a contact: the measured wrench less the sensor's offset and the load. The online
//! identifier and whole recordings compute it from the same entries of an instant, each through its
//! own filter.

mod frame;
mod wrench;

pub use frame::WrenchFrame;
pub use wrench::{ContactState, Entries, LoadAndContact, Parts, WrenchEstimate, wrench_of};
