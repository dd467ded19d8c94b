//! The order of samples in time, and a clock that goes back.

use super::sample::Sample;

/// What a sample is to the last accepted one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// It cannot be used: a number of it is not finite, or it is not later.
    Rejected,
    Follows,
    /// It does not follow by the time that the two say: the clock had gone back.
    Interrupted,
}

/// Puts samples in order, and notices that their clock has gone back: then more time has passed
/// between the samples before and after than they say, and no instant may hold both.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClockWatch {
    /// Number of samples in a row that were earlier than the last accepted one. One alone was late;
    /// more show that the clock has gone back.
    earlier: u32,
    is_interrupted: bool,
}

impl ClockWatch {
    /// Adds a sample, and returns what it is to the last accepted one, which had the time `last_s`.
    pub(crate) fn observe(&mut self, sample: &Sample<'_>, last_s: f64) -> Order {
        if !sample.is_measurable() {
            return Order::Rejected;
        }
        let passed_s = sample.time_s - last_s;
        if passed_s <= 0.0 {
            self.earlier = self.earlier.saturating_add(u32::from(passed_s < 0.0));
            return Order::Rejected;
        }
        let before = std::mem::take(self);
        if before.is_interrupted || before.earlier > 1 {
            Order::Interrupted
        } else {
            Order::Follows
        }
    }

    /// Lets the next sample count as the first one after the clock has gone back.
    pub(crate) fn interrupt(&mut self) {
        self.is_interrupted = true;
    }
}
