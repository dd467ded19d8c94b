//! Fuzz target of [`tactid_fuzz_checks::urdf`].

#![no_main]

tactid_fuzz::target!(tactid_fuzz_checks::urdf::run);
