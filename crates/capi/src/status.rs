//! What a call returns.

use std::ffi::CStr;

use tactid_identify::IdentifyError;

/// What a call returns; negative values are errors, and no estimate has changed then.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum tactid_status {
    /// Done. A sample was used.
    Ok = 0,
    /// The sample starts a new stretch without gaps: it is the first, comes after a gap, or follows
    /// samples that were earlier, because the clock had gone back.
    Started = 1,
    /// The sample was used, and shows that the payload has changed: the estimate starts again.
    PayloadChanged = 2,
    /// What is asked for is not known, or not known yet; nothing is written.
    Unknown = 3,
    /// The sample was used, and shows that the payload before the last change is held again, or
    /// that the change was a contact which has ended: the estimate before the change continues.
    PayloadReturned = 4,
    /// The sample was ignored: a number is not finite or has a magnitude of 1e30 or more, or the
    /// time is not later than that of the sample before. The estimate counts it as rejected.
    Rejected = -1,
    /// A pointer is null that must not be.
    NullPointer = -2,
    /// The `size` of a struct is that of no version, or the struct uses a member that this library
    /// does not have.
    WrongSize = -3,
    /// An array does not have one entry for each joint or six for each sensor, or `base` is given
    /// for a fixed base.
    WrongCount = -4,
    /// A text is not in UTF-8.
    InvalidText = -5,
    /// The URDF is invalid, or lacks a link or a joint; `tactid_last_error` says which.
    InvalidRobot = -6,
    /// An option is out of range, or does not fit the robot or another option; `tactid_last_error`
    /// says which.
    InvalidOption = -7,
    /// An error of tactid itself, which standard error describes: please report it. Replace the
    /// identifier.
    Internal = -8,
}

impl tactid_status {
    const ALL: [Self; 13] = [
        Self::Ok,
        Self::Started,
        Self::PayloadChanged,
        Self::Unknown,
        Self::PayloadReturned,
        Self::Rejected,
        Self::NullPointer,
        Self::WrongSize,
        Self::WrongCount,
        Self::InvalidText,
        Self::InvalidRobot,
        Self::InvalidOption,
        Self::Internal,
    ];

    fn meaning(self) -> &'static CStr {
        match self {
            Self::Ok => c"done",
            Self::Started => c"the sample starts a new stretch without gaps",
            Self::PayloadChanged => c"the payload has changed",
            Self::Unknown => c"not known, or not known yet",
            Self::PayloadReturned => c"the payload before the last change is held again",
            Self::Rejected => c"the sample was ignored: a number that is not finite, or a time that is not later than the one before",
            Self::NullPointer => c"a pointer is null that must not be",
            Self::WrongSize => c"the size of a struct is that of no version, or this library lacks a member that is used",
            Self::WrongCount => c"an array does not fit the joints or the sensors, or a base is given for a fixed one",
            Self::InvalidText => c"a text is not in UTF-8",
            Self::InvalidRobot => c"the URDF is invalid, or lacks a link or a joint",
            Self::InvalidOption => c"an option is out of range, or does not fit the robot or another option",
            Self::Internal => c"an error of tactid itself",
        }
    }

    /// Returns whether what is asked for is known.
    pub(crate) fn known(is_known: bool) -> Self {
        if is_known { Self::Ok } else { Self::Unknown }
    }
}

/// Returns what a status means, also of a number that is none.
pub(crate) fn meaning(status: i32) -> &'static CStr {
    let known = tactid_status::ALL.into_iter();
    let mut found = known.filter(|known| *known as i32 == status);
    found
        .next()
        .map_or(c"no status of this version", tactid_status::meaning)
}

/// Why an identifier cannot be created.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: tactid_status,
    /// What is wrong, and what would be right.
    pub(crate) text: String,
}

impl Failure {
    /// Returns the failure of a robot that lacks something.
    pub(crate) fn robot(text: String) -> Self {
        let status = tactid_status::InvalidRobot;
        Self { status, text }
    }

    /// Returns the failure of an option.
    pub(crate) fn option(text: &str) -> Self {
        let status = tactid_status::InvalidOption;
        Self {
            status,
            text: text.to_owned(),
        }
    }
}

impl From<tactid_status> for Failure {
    fn from(status: tactid_status) -> Self {
        let text = status.meaning().to_string_lossy().into_owned();
        Self { status, text }
    }
}

impl From<IdentifyError> for Failure {
    fn from(error: IdentifyError) -> Self {
        let status = match error {
            IdentifyError::Model(_) => tactid_status::InvalidRobot,
            IdentifyError::Option { .. } | IdentifyError::Method(_) => tactid_status::InvalidOption,
            IdentifyError::State(_) | IdentifyError::Wrenches { .. } => tactid_status::WrongCount,
            IdentifyError::TooLittle(_) | IdentifyError::NoPose => tactid_status::Internal,
        };
        Self {
            status,
            text: error.to_string(),
        }
    }
}
