//! Reads any text as an experiment. One that passes its checks is written to a text that is read as
//! the same experiment.

use crate::text_of;
use tactid_sim::Experiment;

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    let text = text_of(bytes);
    let Ok(experiment) = Experiment::from_toml(text) else {
        return;
    };
    if experiment.check().is_err() {
        return;
    }
    let written = experiment.to_toml().expect("a checked experiment");
    let read = Experiment::from_toml(&written).expect("a written experiment");
    assert_eq!(read, experiment, "{written}");
}
