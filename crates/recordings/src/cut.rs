//! The part of a recording that is used.

/// A part of a recording, from one time to another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// Times since that of the first message or sample, s.
    pub(crate) begin_s: f64,
    pub(crate) end_s: f64,
}

impl Cut {
    /// The whole of a recording.
    pub(crate) const WHOLE: Self = Self {
        begin_s: f64::NEG_INFINITY,
        end_s: f64::INFINITY,
    };

    /// Returns whether a time, s, is known and lies outside of it.
    pub(crate) fn leaves_out(&self, time_s: f64) -> bool {
        time_s < self.begin_s || time_s > self.end_s
    }
}

impl Default for Cut {
    fn default() -> Self {
        Self::WHOLE
    }
}
