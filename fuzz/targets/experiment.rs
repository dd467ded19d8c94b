//! Fuzz target of [`tactid_fuzz_checks::experiment`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::experiment::run);
