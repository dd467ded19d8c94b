//! When the payload changed.

/// Payload changes so far, and the times from which on windows contribute to an estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct PayloadTimes {
    /// Number of payload changes, those included that were taken back.
    pub(super) changes: u64,
    /// Time of the last payload change, s; minus infinity before one.
    pub(super) changed_s: f64,
    /// Time from which on windows contribute to the estimate, s.
    pub(super) since_s: f64,
    /// Time from which on windows contributed to the estimate before the last payload change, s.
    pub(super) since_before_s: f64,
}

impl PayloadTimes {
    /// Returns the times before the first window.
    pub(super) fn new() -> Self {
        Self {
            changes: 0,
            changed_s: f64::NEG_INFINITY,
            since_s: f64::NEG_INFINITY,
            since_before_s: f64::NEG_INFINITY,
        }
    }

    /// Adds a payload change at a time, s. `is_first` says that the estimate until then was not one
    /// that a contact might have explained.
    pub(super) fn change(&mut self, time_s: f64, is_first: bool) {
        self.changes += 1;
        self.changed_s = time_s;
        let since_s = std::mem::replace(&mut self.since_s, time_s);
        if is_first {
            self.since_before_s = since_s;
        }
    }

    /// Continues with the windows before the last payload change.
    pub(super) fn return_to_before(&mut self) {
        self.since_s = self.since_before_s;
    }
}
