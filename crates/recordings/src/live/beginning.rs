//! The latest messages of a live session, from which it is planned.

use std::collections::VecDeque;
use std::sync::Arc;

use tactid_logs::messages::StringMsg;
use tactid_logs::{RawMessage, Topic};

/// Length of the messages that are kept, s: that of the beginning of a recording, with some more
/// that come while it is planned.
const LONGEST_S: f64 = 40.0;

/// Most bytes that are kept: tactile arrays have large messages.
const MOST_BYTES: usize = 128 << 20;

/// Most messages that are kept of what publishers send once.
const MOST_LATCHED: usize = 64;

/// Returns whether the publishers of a topic send what stays true once, and again to each new
/// subscriber: the description of the robot, and transforms that do not change.
fn is_latched(topic: &Topic) -> bool {
    topic.is::<StringMsg>() || topic.name.ends_with("tf_static")
}

/// The latest messages, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Beginning {
    latched: Vec<RawMessage>,
    /// Measurements.
    measured: VecDeque<RawMessage>,
    bytes: usize,
    /// Number of measurements since the latest [`restart`](Self::restart).
    pub(super) pushed: u64,
    /// Time that has passed between them, s. A clock that jumps adds a second at most.
    pub(super) elapsed_s: f64,
}

impl Beginning {
    /// Adds a message, and discards what is too old or too much. Measurements are left out unless
    /// it `keeps_measured`.
    pub(super) fn push(&mut self, message: RawMessage, keeps_measured: bool) {
        if is_latched(&message.topic) {
            return self.push_latched(message);
        }
        if !keeps_measured {
            return;
        }
        if let Some(last) = self.measured.back() {
            let passed_ns = message.log_time_ns.saturating_sub(last.log_time_ns);
            self.elapsed_s += (passed_ns as f64 * 1e-9).min(1.0);
        }
        self.bytes += message.data().len();
        self.measured.push_back(message);
        self.pushed += 1;
        while self.bytes > MOST_BYTES || self.length_s() > LONGEST_S {
            let Some(oldest) = self.measured.pop_front() else {
                break;
            };
            self.bytes -= oldest.data().len();
        }
    }

    /// A description takes the place of an earlier one, and what is known is not kept again.
    fn push_latched(&mut self, message: RawMessage) {
        let is_text = message.topic.is::<StringMsg>();
        self.latched.retain(|known| {
            !Arc::ptr_eq(&known.topic, &message.topic)
                || (!is_text && known.data() != message.data())
        });
        if self.latched.len() == MOST_LATCHED {
            self.latched.remove(0);
        }
        self.latched.push(message);
    }

    /// Returns the time between the first and the last measurement that are kept, s.
    fn length_s(&self) -> f64 {
        let ends = self.measured.front().zip(self.measured.back());
        ends.map_or(0.0, |(first, last)| {
            last.log_time_ns.saturating_sub(first.log_time_ns) as f64 * 1e-9
        })
    }

    /// Returns all messages.
    pub(super) fn messages(&self) -> Vec<RawMessage> {
        self.latched.iter().chain(&self.measured).cloned().collect()
    }

    /// Returns the measurements from a number of them on.
    pub(super) fn since(&self, pushed: u64) -> impl Iterator<Item = &RawMessage> {
        let count = usize::try_from(self.pushed - pushed).unwrap_or(usize::MAX);
        let skipped = self.measured.len().saturating_sub(count);
        self.measured.iter().skip(skipped)
    }

    /// Discards the measurements.
    pub(super) fn restart(&mut self) {
        self.measured.clear();
        self.bytes = 0;
        self.pushed = 0;
        self.elapsed_s = 0.0;
    }
}
