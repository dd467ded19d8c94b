//! Order, gaps and ends of the messages of each publisher.

use super::held::Message;
use crate::Finding;
use crate::clock::LONGEST_LATENESS_S;
use crate::fault::{FaultCounts, FaultKind};

/// Streams that begin or end further apart than this are reported, s.
const UNEQUAL_ENDS_S: f64 = 1.0;

/// How a message follows the one before of its publisher.
enum Follows {
    AtOnce,
    AfterGap,
    AfterClockBack,
}

/// The messages of one publisher on one topic.
#[derive(Clone, Debug)]
struct Publisher {
    topic: String,
    /// Distinguishes the publishers of one topic.
    index: usize,
    /// Times of its first and its last message, s; minus infinity before there is one.
    first_s: f64,
    last_s: f64,
    /// First and last time of the messages since then that were earlier, s.
    earlier_s: Option<(f64, f64)>,
}

impl Publisher {
    /// Returns how a message at a time, s, follows the last one that did; `None` where it does not.
    ///
    /// Messages that are earlier for longer than `max_gap_s` show that the clock has gone back. The
    /// messages on both sides are then further apart than their times say: as many are left out as
    /// it takes for a gap between them.
    fn follows(&mut self, time_s: f64, max_gap_s: f64) -> Option<Follows> {
        let (from_s, to_s) = self.earlier_s.unwrap_or((time_s, time_s));
        if time_s <= self.last_s {
            self.earlier_s = Some((from_s, time_s));
            return None;
        }
        let passed_s = time_s - self.last_s;
        if to_s - from_s <= max_gap_s {
            self.earlier_s = None;
            return Some(match passed_s > max_gap_s && passed_s.is_finite() {
                true => Follows::AfterGap,
                false => Follows::AtOnce,
            });
        }
        (passed_s > (to_s - from_s).min(LONGEST_LATENESS_S)).then(|| {
            self.earlier_s = None;
            Follows::AfterClockBack
        })
    }
}

/// Times of all publishers' messages.
#[derive(Clone, Debug)]
pub(crate) struct Publishers {
    publishers: Vec<Publisher>,
    /// Longer times between two messages of a publisher are gaps, s.
    max_gap_s: f64,
}

impl Publishers {
    pub(crate) fn new(max_gap_s: f64) -> Self {
        Self {
            publishers: Vec::new(),
            max_gap_s,
        }
    }

    /// Returns the place of a publisher on a topic, by its index there.
    pub(crate) fn place(&mut self, topic: &str, index: usize) -> usize {
        let is_same = |known: &Publisher| known.topic == topic && known.index == index;
        let known = self.publishers.iter().position(is_same);
        known.unwrap_or_else(|| {
            self.publishers.push(Publisher {
                topic: topic.to_owned(),
                index,
                first_s: f64::NEG_INFINITY,
                last_s: f64::NEG_INFINITY,
                earlier_s: None,
            });
            self.publishers.len() - 1
        })
    }

    /// Notes the time of a message of the publisher at a place, and counts a gap before it. Returns
    /// whether the message follows the one before of its publisher, and counts one that does not,
    /// and one that came late.
    pub(super) fn push(
        &mut self,
        place: usize,
        message: &Message,
        faults: &mut FaultCounts,
    ) -> bool {
        let publisher = &mut self.publishers[place];
        let (time_s, last_s) = (message.time_s, publisher.last_s);
        let Some(follows) = publisher.follows(time_s, self.max_gap_s) else {
            faults.add(&publisher.topic, FaultKind::OutOfOrder, time_s);
            return false;
        };
        publisher.last_s = time_s;
        if message.is_late {
            faults.add(&publisher.topic, FaultKind::PutInOrder, time_s);
        }
        if publisher.first_s.is_infinite() {
            publisher.first_s = time_s;
        }
        match follows {
            Follows::AtOnce => {}
            Follows::AfterGap => faults.add(&publisher.topic, FaultKind::Gap, last_s),
            Follows::AfterClockBack => faults.add(&publisher.topic, FaultKind::ClockBack, last_s),
        }
        true
    }

    /// Reports publishers that begin long after the others, or end long before them.
    pub(crate) fn unequal_ends(&self) -> Vec<Finding> {
        let begun = || self.publishers.iter().filter(|p| p.first_s.is_finite());
        let times = |of: fn(&Publisher) -> f64| begun().map(of);
        let begin_s = times(|p| p.first_s).fold(f64::INFINITY, f64::min);
        let end_s = times(|p| p.last_s).fold(f64::NEG_INFINITY, f64::max);
        let mut findings = Vec::new();
        for publisher in begun() {
            let topic = &publisher.topic;
            let late_s = publisher.first_s - begin_s;
            if late_s > UNEQUAL_ENDS_S {
                findings.push(Finding::LateStart {
                    topic: topic.clone(),
                    late_s,
                });
            }
            let early_s = end_s - publisher.last_s;
            if early_s > UNEQUAL_ENDS_S {
                findings.push(Finding::EarlyEnd {
                    topic: topic.clone(),
                    end_s: publisher.last_s,
                    early_s,
                });
            }
        }
        findings
    }
}
