//! Fuzz target of [`tactid_fuzz_checks::estimators`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::estimators::run);
