//! Reads any bytes as a log. The corpus has logs of this storage.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::logs;

fuzz_target!(|bytes: &[u8]| within_memory(|| logs::run(bytes)));
