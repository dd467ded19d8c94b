//! Designs motions from any request with the least number of steps: one error, or a motion with finite states.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::excitation;

fuzz_target!(|bytes: &[u8]| within_memory(|| excitation::run(bytes)));
