//! A live session: messages come one by one, and the estimate is known at any time.
//!
//! The first seconds of messages are a log in memory, from which topics, robot, frames, clock,
//! delay and cutoff follow by the same code as those of a recording. All messages, those of the
//! beginning included, then go through the same decoder and the same aligner to the online
//! identifier.

mod beginning;
mod running;
mod session;
mod snapshot;

pub use running::LiveContact;
pub use session::{LiveSession, LiveSettings, LiveStatus};
pub use snapshot::LiveSnapshot;
