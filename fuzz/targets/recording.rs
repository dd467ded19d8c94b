//! Fuzz target of [`tactid_fuzz_checks::recording`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::recording::run);
