//! The wrench of the contact in a recording, whose load is known from the whole of it.

mod load;
mod recorded;

pub use load::LoadEstimate;
pub use recorded::{ContactSample, RecordedContact, RecordedWrenches};
