//! Fuzz target of [`tactid_fuzz_checks::records`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::records::run);
