//! What must hold for any input: a function for each fuzz target, which panics where it does not.
//!
//! The programs of libFuzzer in `fuzz/targets` call these functions with mutated inputs. The tests
//! of this crate call them with the inputs that are kept in `fuzz/corpus` and `fuzz/regressions`,
//! so that `make test` repeats them in seconds.

#![expect(clippy::expect_used, reason = "a check fails by a panic")]

use std::path::Path;

use arbitrary::{Arbitrary, Unstructured};
use tempfile::TempDir;

pub mod arrays;
pub mod calibration;
pub mod cdr;
mod estimate;
pub mod estimators;
pub mod excitation;
pub mod experiment;
pub mod logs;
mod numbers;
pub mod push;
pub mod recording;
pub mod records;
mod robots;
pub mod urdf;

use numbers::{Number, numbers};
use robots::{base_kind, robot, urdf as arm_urdf};

/// A check of one input.
pub type Check = fn(&[u8]);

/// The fuzz targets, by the names of their folders in `fuzz/corpus`.
pub const TARGETS: [(&str, Check); 12] = [
    ("arrays", arrays::run),
    ("calibration", calibration::run),
    ("cdr", cdr::run),
    ("estimators", estimators::run),
    ("excitation", excitation::run),
    ("experiment", experiment::run),
    ("mcap", logs::run),
    ("push", push::run),
    ("recording", recording::run),
    ("records", records::run),
    // The check of `mcap`, which mutates another corpus.
    ("sqlite", logs::run),
    ("urdf", urdf::run),
];

/// Returns the value that bytes stand for; `None` where there are too few of them.
fn parsed<'a, T: Arbitrary<'a>>(bytes: &'a [u8]) -> Option<T> {
    T::arbitrary_take_rest(Unstructured::new(bytes)).ok()
}

/// Runs a check with a folder for its files. Each thread has one, so that checks that run at once
/// do not write the same file.
fn in_folder(check: impl FnOnce(&Path)) {
    thread_local! {
        static FOLDER: TempDir = TempDir::new().expect("a folder for the files of a check");
    }
    FOLDER.with(|folder| check(folder.path()));
}

/// Returns the text at the begin of bytes, up to the first that are not UTF-8.
fn text_of(bytes: &[u8]) -> &str {
    match str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => str::from_utf8(&bytes[..error.valid_up_to()]).expect("valid so far"),
    }
}
