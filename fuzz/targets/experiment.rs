//! Reads any text as an experiment. One that passes its checks is written to a text that is read as the same experiment.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_fuzz_checks::experiment;

fuzz_target!(|bytes: &[u8]| within_memory(|| experiment::run(bytes)));
