//! The clock of a recording.

use schemars::JsonSchema;
use serde::Serialize;

/// Longest delay of a stamp, in either direction, s. A stamp that is further from where the time of
/// logging puts it is a fault, and a request cannot correct a longer delay.
pub(crate) const LONGEST_STAMP_DELAY_S: f64 = 60.0;

/// Measurements that come at most so much after later ones of their stream are put in order, s.
pub(crate) const LONGEST_LATENESS_S: f64 = 1.0;

/// Which times the measurements were taken to belong to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// The stamps of the messages' headers.
    #[default]
    Stamps,
    /// The times of logging, because the messages have no stamps.
    #[serde(rename = "log times")]
    LogTimes,
    /// The times that were given with the arrays.
    Given,
    /// None: the measurements are poses at rest.
    None,
}
