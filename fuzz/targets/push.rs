//! Fuzz target of [`tactid_fuzz_checks::push`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::push::run);
