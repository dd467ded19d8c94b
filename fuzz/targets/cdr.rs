//! Decodes any bytes as each of the messages. What is decoded is encoded to bytes that decode to the same message.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::cdr;

fuzz_target!(|bytes: &[u8]| within_memory(|| cdr::run(bytes)));
