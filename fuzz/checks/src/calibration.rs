//! Reads any text as the file of a calibration. One that is read is written to a text of the same
//! content.

use crate::text_of;
use std::path::Path;

use tactid_recordings::ArmCalibration;

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    let text = text_of(bytes);
    let origin = Path::new("calibration.toml");
    let Ok(calibration) = ArmCalibration::from_toml(text, origin) else {
        return;
    };
    let written = calibration.to_toml().expect("a calibration that was read");
    let read = ArmCalibration::from_toml(&written, origin).expect("a written calibration");
    assert_eq!(read.to_toml().expect("as before"), written);
}
