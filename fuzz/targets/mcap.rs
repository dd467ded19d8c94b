//! Fuzz target of [`tactid_fuzz_checks::logs`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::logs::run);
