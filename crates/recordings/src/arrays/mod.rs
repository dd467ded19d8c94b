//! Arrays as a recording.

mod base;
mod fields;
mod lengths;
mod recording;
mod robot;
mod samples;
mod unloaded;

pub use fields::{Arrays, UnloadedArrays};
pub(crate) use recording::ArrayRecording;
pub use robot::base_is_fixed;
