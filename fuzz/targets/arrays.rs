//! Identifies from arrays of any lengths and numbers: one error, or a finite result.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::arrays;

fuzz_target!(|bytes: &[u8]| within_memory(|| arrays::run(bytes)));
