//! The clock of a recording.

/// Which times of a log the messages were taken to be measured at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// The stamps of their headers, or the times of the arrays.
    #[default]
    Stamps,
    /// The times of logging, because the messages have no stamps.
    LogTimes,
}
