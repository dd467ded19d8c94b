//! Calibration of an arm from recordings, its file, and payloads identified with it.

mod arm;
mod calibrate;
mod check;
mod file;
mod layout;
mod link;
mod payload;
mod record;
mod shortage;
mod text;

pub use arm::ArmCalibration;
pub use calibrate::{CalibratingLogs, CalibrationRun, LogRole, UsedLog, calibrate_logs};
pub(crate) use payload::{identify_calibrated_arrays, identify_calibrated_log};
