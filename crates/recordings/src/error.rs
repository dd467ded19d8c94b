//! Errors of an identification from a recording.

use std::path::{Path, PathBuf};

use tactid_calibrate::CalibrateError;
use tactid_dynamics::ModelError;
use tactid_identify::IdentifyError;
use tactid_logs::LogError;
use thiserror::Error;

use crate::DataFault;

/// Why a payload cannot be identified from a recording.
///
/// The kind is for programs; the message says what is wrong, where, and what would be right. It
/// names [`option`](Self::option) in code quotes where the option is not what the message is about.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The robot, the settings or the samples do not allow an identification.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The arm cannot be calibrated, or its calibration cannot be used.
    #[error(transparent)]
    Calibrate(CalibrateError),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The unloaded recording is a log that cannot be read.
    #[error("the unloaded recording cannot be read: {0}")]
    UnloadedLog(#[source] LogError),
    /// The user interrupted the work before there was a result.
    #[error("interrupted before the recording was read")]
    Interrupted,
    /// An option is out of range, or does not fit the recording or another option.
    #[error("{what}")]
    Option {
        /// Name of the field of the request.
        option: &'static str,
        /// What is wrong with it, and what would be right.
        what: String,
    },
    /// Arrays do not fit each other, the robot or the method.
    #[error("{0}")]
    Arrays(String),
    /// Recordings cannot be used together: two are the same, or their results have nothing in
    /// common.
    #[error("{0}")]
    Together(String),
    /// The recording does not have what an identification needs.
    #[error("{what}")]
    Data {
        /// What is wrong, and what to do.
        what: String,
        /// Name of the field of the request that causes or resolves it, where there is one.
        option: Option<&'static str>,
    },
    /// There is no time at which all streams have a value.
    #[error("{what}")]
    NoOverlap {
        /// Which streams, and what to check.
        what: String,
        /// Faults of their messages.
        faults: Vec<DataFault>,
    },
    /// The robot does not have the end-effector frame.
    #[error("{0}; `tip` names the end-effector frame")]
    Tip(String),
    /// The file of a calibration cannot be read or written, or the arm cannot be calibrated before
    /// an option is given.
    #[error("{what}")]
    Calibration {
        /// What is wrong, and where.
        what: String,
        /// Name of the field of the request that resolves it, where there is one.
        option: Option<&'static str>,
    },
    /// A recording among several cannot be used.
    #[error("{}", named(path, source))]
    InRecording {
        /// Path of the recording.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<RecordingError>,
    },
    /// A damaged log gives too little for an estimate.
    #[error("{source}; the log is damaged: {damage}")]
    DamagedEarly {
        /// What there is too little of.
        source: Box<RecordingError>,
        /// Where the log is damaged, and what is wrong there.
        damage: String,
    },
}

impl From<ModelError> for RecordingError {
    fn from(error: ModelError) -> Self {
        Self::Identify(error.into())
    }
}

impl From<CalibrateError> for RecordingError {
    fn from(error: CalibrateError) -> Self {
        match error {
            CalibrateError::Identify(error) => Self::Identify(error),
            CalibrateError::Interrupted => Self::Interrupted,
            error => Self::Calibrate(error),
        }
    }
}

impl RecordingError {
    /// Returns the name of the field of the request that causes or resolves the error; `None` where
    /// there is none.
    #[must_use]
    pub fn option(&self) -> Option<&'static str> {
        match self {
            Self::Identify(error) => error.option(),
            Self::UnloadedLog(_) => Some("unloaded"),
            Self::Option { option, .. } => Some(option),
            Self::Data { option, .. } | Self::Calibration { option, .. } => *option,
            Self::Tip(_) => Some("tip"),
            Self::InRecording { source, .. } | Self::DamagedEarly { source, .. } => source.option(),
            Self::Calibrate(_)
            | Self::Log(_)
            | Self::Interrupted
            | Self::Arrays(_)
            | Self::Together(_)
            | Self::NoOverlap { .. } => None,
        }
    }

    /// Returns the error of a recording that does not have what an identification needs.
    pub(crate) fn data(what: impl Into<String>) -> Self {
        Self::Data {
            what: what.into(),
            option: None,
        }
    }

    /// Returns the error of a recording that an option causes or resolves.
    pub(crate) fn data_of(option: &'static str, what: impl Into<String>) -> Self {
        Self::Data {
            what: what.into(),
            option: Some(option),
        }
    }

    /// Returns the error of an unloaded recording, which needs the joint efforts of the effort
    /// method.
    pub(crate) fn unloaded_needs_effort() -> Self {
        Self::data_of(
            "method",
            "an unloaded recording is subtracted from the joint efforts, which needs the effort method: use this method, \
             or leave the unloaded recording out; `method` chooses the method",
        )
    }

    /// Returns the error of two recordings, by their paths or names, that are the same, and why
    /// each may be given once only.
    pub(crate) fn same_recording(paths: [&Path; 2], because: &str) -> Self {
        let [first, second] = paths.map(|path| path.display().to_string());
        let both = if first == second {
            format!("{first} is given twice")
        } else {
            format!("{first} and {second} are the same recording, which is given twice")
        };
        Self::Together(format!("{both}, but {because}"))
    }

    /// Names the recording, among several, that an error is about; an interruption is about none.
    pub(crate) fn in_recording(self, path: &Path) -> Self {
        match self {
            Self::Interrupted => self,
            other => Self::InRecording {
                path: path.to_owned(),
                source: Box::new(other),
            },
        }
    }
}

/// Puts the path of a recording in front of its error, unless the error has it.
fn named(path: &Path, error: &RecordingError) -> String {
    let (path, message) = (path.display().to_string(), error.to_string());
    if message.contains(&path) {
        message
    } else {
        format!("{path}: {message}")
    }
}
