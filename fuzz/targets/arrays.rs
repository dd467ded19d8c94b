//! Fuzz target of [`tactid_fuzz_checks::arrays`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::arrays::run);
