//! Reads any bytes as a log. The corpus has logs of this storage.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::{read_log, within_memory};

fuzz_target!(|bytes: &[u8]| within_memory(|| read_log(bytes)));
