//! Gives samples of any lengths and numbers to the online identifier, whose estimate stays finite and physical.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::push;

fuzz_target!(|bytes: &[u8]| within_memory(|| push::run(bytes)));
