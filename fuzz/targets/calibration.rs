//! Reads any text as the file of a calibration. One that is read is written to a text of the same content.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::calibration;

fuzz_target!(|bytes: &[u8]| within_memory(|| calibration::run(bytes)));
