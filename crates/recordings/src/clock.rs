//! The clock of a recording.

/// Which times the measurements were taken to belong to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// The stamps of the messages' headers.
    #[default]
    Stamps,
    /// The times of logging, because the messages have no stamps.
    LogTimes,
    /// The times that were given with the arrays.
    Given,
}
