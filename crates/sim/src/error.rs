//! Errors of reading an experiment and of running it.

use std::path::PathBuf;

use tactid_dynamics::ModelError;
use tactid_dynamics::words::counted;
use tactid_excitation::ExcitationError;
use tactid_logs::LogError;
use thiserror::Error;

/// Reason why an experiment cannot be read or why its run was aborted.
#[derive(Debug, Error)]
pub enum SimError {
    /// A file of the experiment cannot be read.
    #[error("cannot read `{path}`: {source}")]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A file has no motion of joints, or one that does not fit the robot.
    #[error("{}: {what}", path.display())]
    Motion {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, and in which line or point.
        what: String,
    },
    /// What an experiment's file describes cannot be simulated.
    #[error("{}: {source}", path.display())]
    InFile {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<SimError>,
    },
    /// The text is not TOML, or a field is unknown or of the wrong type. The message has the line.
    #[error("{0}")]
    Syntax(String),
    /// A field has a value that is not allowed.
    #[error("{}{field} = {value}: {why}", line.map(|l| format!("line {l}: ")).unwrap_or_default())]
    Value {
        /// Line of the experiment's file, from 1; `None` if the value does not come from a file.
        line: Option<usize>,
        /// The field with its table, for instance `payload.mass_kg`.
        field: String,
        /// Its value.
        value: String,
        /// The values that are allowed.
        why: String,
    },
    /// The URDF does not describe a robot that can be modelled.
    #[error("robot: {0}")]
    Model(#[from] ModelError),
    /// The robot does not fit the experiment. The field gives the reason.
    #[error("robot: {0}")]
    Robot(String),
    /// The fingers did not grasp the payload. The field gives the reason.
    #[error("the grasp failed: {0}")]
    Grasp(String),
    /// The motion of active excitation cannot be planned.
    #[error("the motion cannot be planned: {0}")]
    Planning(#[source] ExcitationError),
    /// A monitored quantity exceeds its bound.
    #[error(
        "at {time_s:.3} s: {what} is {value:.3e} {unit}, above the bound of {bound:.3e} {unit} (bounds.{field}); {advice}"
    )]
    Bound {
        /// Time since the excitation began.
        time_s: f64,
        /// The monitored quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its bound.
        bound: f64,
        /// Unit of value and bound, or what a ratio refers to.
        unit: &'static str,
        /// Field of the experiment's `[bounds]` table.
        field: &'static str,
        /// Change of the experiment that helps.
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
    /// A quantity of the simulation is infinite or NaN.
    #[error(
        "at {time_s:.3} s: the simulation diverged ({what} is not finite); make step_s shorter or the excitation weaker"
    )]
    Diverged {
        /// Time since the excitation began.
        time_s: f64,
        /// The quantity.
        what: &'static str,
    },
    /// The number of commanded accelerations is not the number of the arm's joints.
    #[error("{given} joint accelerations were given, but the arm has {}", counted(*.expected, "joint"))]
    Command {
        /// Number of accelerations given.
        given: usize,
        /// Number of joints of the arm.
        expected: usize,
    },
    /// A step of a run failed.
    #[error("{reason}.\nThe log up to there is `{}`.", log.display())]
    Aborted {
        /// Error of the step.
        reason: Box<SimError>,
        /// Path of the log, which is complete up to the step.
        log: PathBuf,
    },
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// Advice for a payload that slips.
pub(crate) const ADVICE_GRASP: &str = "raise gripper.grip_force_n or gripper.friction, lower the excitation, or take a lighter payload";
