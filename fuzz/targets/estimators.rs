//! Gives any rows to the estimators of one row at a time: their parameters and covariances stay finite.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::estimators;

fuzz_target!(|bytes: &[u8]| within_memory(|| estimators::run(bytes)));
