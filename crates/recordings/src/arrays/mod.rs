//! Arrays as a recording.

mod base;
mod fields;
mod lengths;
mod recording;
mod samples;

pub use fields::Arrays;
pub(crate) use recording::ArrayRecording;
