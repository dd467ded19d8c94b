//! The order of samples in time, and a clock that goes back.

use super::sample::Sample;

/// What a sample is to the last accepted one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// It cannot be used: a number of it is not finite, or it is not later.
    Rejected,
    Follows,
    /// The clock has gone back since the last accepted sample: the time between the two is unknown,
    /// and this one may be earlier.
    Interrupted,
}

/// Puts samples in order, and notices that their clock has gone back: then more time has passed
/// between the samples before and after than they say, and no instant may hold both. The clock may go
/// back by any time, as it seems to after one stamp far in the future.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClockWatch {
    /// Number of samples in a row that were earlier than the last accepted one. One alone was late;
    /// two show that the clock has gone back, and the next one is accepted at any time.
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
        let goes_on = self.is_interrupted || self.earlier > 1;
        if passed_s == 0.0 || (passed_s < 0.0 && !goes_on) {
            self.earlier += u32::from(passed_s < 0.0);
            return Order::Rejected;
        }
        *self = Self::default();
        if goes_on {
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
