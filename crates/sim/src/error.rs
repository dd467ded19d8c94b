//! Everything that can go wrong, said so that one knows what to change.

use std::path::PathBuf;

use tactid_dynamics::ModelError;
use tactid_logs::LogError;
use thiserror::Error;

/// Why an experiment cannot be read or its run was given up.
#[derive(Debug, Error)]
pub enum SimError {
    /// A file of the experiment cannot be read.
    #[error("cannot read `{path}`: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Not TOML, a field that does not exist, or a value of the wrong type; says the line.
    #[error("{0}")]
    Syntax(String),
    /// A value that no experiment can have.
    #[error("{}{field} = {value}: {why}", line.map(|l| format!("line {l}: ")).unwrap_or_default())]
    Value {
        /// The line of the experiment's file, from 1; `None` where the value was not read from a file.
        line: Option<usize>,
        /// The field, with its table.
        field: String,
        /// What it was given.
        value: String,
        /// What would be right.
        why: String,
    },
    /// The URDF is not that of a robot.
    #[error("robot: {0}")]
    Model(#[from] ModelError),
    /// The robot does not fit the experiment.
    #[error("robot: {0}")]
    Robot(String),
    /// The fingers did not get hold of the payload.
    #[error("the grasp failed: {0}")]
    Grasp(String),
    /// A check that every run must pass exceeded its bound.
    #[error(
        "at {time_s:.3} s: {what} is {value:.3e} {unit}, above the bound of {bound:.3e} {unit} (bounds.{field}); {advice}"
    )]
    Bound {
        /// Time since the excitation began.
        time_s: f64,
        /// What is checked.
        what: &'static str,
        /// As it was found.
        value: f64,
        /// What was allowed.
        bound: f64,
        /// Unit of both, empty for a ratio.
        unit: &'static str,
        /// The field of the experiment's `[bounds]`.
        field: &'static str,
        /// What to change.
        advice: &'static str,
    },
    /// No finger touches the payload any more.
    #[error(
        "at {time_s:.3} s: the payload was lost, no finger touches it any more; {ADVICE_GRASP}"
    )]
    Lost {
        /// Time since the excitation began.
        time_s: f64,
    },
    /// The physics left the real numbers.
    #[error(
        "at {time_s:.3} s: the simulation diverged ({what} is not finite); make step_s shorter or the excitation weaker"
    )]
    Diverged {
        /// Time since the excitation began.
        time_s: f64,
        /// Where it was found.
        what: &'static str,
    },
    /// A command for another number of joints.
    #[error("{given} joint accelerations were given, but the arm has {expected} joints")]
    Command {
        /// How many were given.
        given: usize,
        /// How many are needed.
        expected: usize,
    },
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// What helps a payload that slips.
pub(crate) const ADVICE_GRASP: &str = "raise gripper.grip_force_n or gripper.friction, lower the excitation, or take a lighter payload";
