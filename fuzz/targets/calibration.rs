//! Reads any text as the file of a calibration. One that is read is written to a text of the same content.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_recordings::ArmCalibration;

fuzz_target!(|text: &str| within_memory(|| {
    let origin = Path::new("calibration.toml");
    let Ok(calibration) = ArmCalibration::from_toml(text, origin) else {
        return;
    };
    let written = calibration.to_toml().expect("a calibration that was read");
    let read = ArmCalibration::from_toml(&written, origin).expect("a written calibration");
    assert_eq!(read.to_toml().expect("as before"), written);
}));
