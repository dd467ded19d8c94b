//! Reads any text as an experiment. One that passes its checks is written to a text that is read as the same experiment.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tactid_fuzz::within_memory;
use tactid_sim::Experiment;

fuzz_target!(|text: &str| within_memory(|| {
    let Ok(experiment) = Experiment::from_toml(text) else {
        return;
    };
    if experiment.check().is_err() {
        return;
    }
    let written = experiment.to_toml().expect("a checked experiment");
    let read = Experiment::from_toml(&written).expect("a written experiment");
    assert_eq!(read, experiment, "{written}");
}));
