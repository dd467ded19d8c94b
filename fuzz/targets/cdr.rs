//! Fuzz target of [`tactid_fuzz_checks::cdr`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::cdr::run);
