//! Every kept input of every fuzz target passes its check.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use tactid_fuzz_checks::TARGETS;

/// Returns the paths in a folder, in the order of their names.
fn paths(folder: &Path) -> BTreeSet<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    entries.map(|entry| entry.unwrap().path()).collect()
}

/// Checks the inputs in the folder of each target, and returns their number by target.
fn replay(kept: &str) -> Vec<(&'static str, usize)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .join(kept);
    for folder in paths(&root) {
        let name = folder.file_name().unwrap().to_str().unwrap();
        assert!(
            TARGETS.iter().any(|(target, _)| *target == name),
            "no target {name}"
        );
    }
    let replayed = TARGETS.map(|(target, run)| {
        let folder = root.join(target);
        let inputs = if folder.exists() {
            paths(&folder)
        } else {
            BTreeSet::new()
        };
        for input in &inputs {
            println!("{}", input.display());
            run(&fs::read(input).unwrap());
        }
        (target, inputs.len())
    });
    replayed.to_vec()
}

#[test]
fn corpus() {
    for (target, inputs) in replay("corpus") {
        assert!(inputs > 0, "{target} has no corpus");
    }
}

#[test]
fn regressions() {
    let inputs: usize = replay("regressions").iter().map(|(_, inputs)| inputs).sum();
    assert!(inputs > 0);
}

/// A check is also run on inputs that no format allows: none, and one that is too short for
/// anything.
#[test]
fn empty_inputs() {
    for (_, run) in TARGETS {
        run(&[]);
        run(&[0]);
    }
}
