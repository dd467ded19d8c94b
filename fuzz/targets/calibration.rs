//! Fuzz target of [`tactid_fuzz_checks::calibration`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::calibration::run);
