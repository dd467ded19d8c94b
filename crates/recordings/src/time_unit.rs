//! Units that times may have by mistake.

use std::fmt;

/// A unit of time that is taken for seconds by mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeUnit {
    /// Milliseconds.
    Milliseconds,
    /// Microseconds.
    Microseconds,
    /// Nanoseconds.
    Nanoseconds,
}

impl TimeUnit {
    /// The units with their lengths in s, from the longest to the shortest.
    pub(crate) const ALL: [(Self, f64); 3] = [
        (Self::Milliseconds, 1e-3),
        (Self::Microseconds, 1e-6),
        (Self::Nanoseconds, 1e-9),
    ];
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        })
    }
}

/// Says what to do where samples come too seldom.
pub(crate) fn rare_advice(unit: Option<TimeUnit>) -> String {
    unit.map_or_else(
        || "lower the cutoff, or raise the sample rate".to_owned(),
        |unit| format!("the times seem to be in {unit}, but must be in seconds"),
    )
}
