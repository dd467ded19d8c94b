//! Reads any text as a URDF. A robot has finite poses and torques at rest.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::urdf;

fuzz_target!(|bytes: &[u8]| within_memory(|| urdf::run(bytes)));
