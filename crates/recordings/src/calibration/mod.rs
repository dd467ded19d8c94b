//! Calibration of an arm from recordings, its file, and payloads identified with it.

mod calibrate;
mod check;
mod contradictions;
mod file;
mod held_out;
mod layout;
mod link;
mod payload;
mod record;
mod refusals;
mod request;
mod text;
mod used;

pub use calibrate::{
    CalibrationRecording, CalibrationRun, CalibrationSource, CalibrationSources, RecordingRole,
    calibrate_arm,
};
pub(crate) use payload::{identify_calibrated_arrays, identify_calibrated_log};
pub use request::CalibrationRequest;
