//! A clock that goes back.

/// Notices that the clock of samples has gone back: then more time has passed between the samples
/// before and after than they say, and no instant may hold both.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClockWatch {
    /// Number of samples in a row that were earlier than the last accepted one. One alone was late;
    /// more show that the clock has gone back.
    earlier: u32,
    is_interrupted: bool,
}

impl ClockWatch {
    /// Adds a sample that is later than the last accepted one by a time, s, and returns whether it
    /// is the first accepted one after the clock has gone back.
    pub(crate) fn has_gone_back(&mut self, passed_s: f64) -> bool {
        if passed_s > 0.0 {
            let before = std::mem::take(self);
            return before.is_interrupted || before.earlier > 1;
        }
        self.earlier = self.earlier.saturating_add(u32::from(passed_s < 0.0));
        false
    }

    /// Lets the next sample count as the first one after the clock has gone back.
    pub(crate) fn interrupt(&mut self) {
        self.is_interrupted = true;
    }
}
