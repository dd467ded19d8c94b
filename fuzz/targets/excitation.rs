//! Fuzz target of [`tactid_fuzz_checks::excitation`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::excitation::run);
