//! Order, gaps and ends of the messages of each publisher.

use crate::Finding;
use crate::fault::{FaultCounts, FaultKind};

/// Streams that begin or end further apart than this are reported, s.
const UNEQUAL_ENDS_S: f64 = 1.0;

/// The messages of one publisher on one topic.
#[derive(Clone, Debug)]
struct Publisher {
    topic: String,
    /// Distinguishes the publishers of one topic.
    index: usize,
    first_s: f64,
    last_s: f64,
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

    /// Notes the time of a message, and counts a gap before it.
    ///
    /// # Errors
    /// Returns [`FaultKind::OutOfOrder`] if the message is not later than the one before of its publisher.
    pub(crate) fn push(
        &mut self,
        topic: &str,
        index: usize,
        time_s: f64,
        faults: &mut FaultCounts,
    ) -> Result<(), FaultKind> {
        let is_same = |known: &&mut Publisher| known.topic == topic && known.index == index;
        let Some(publisher) = self.publishers.iter_mut().find(is_same) else {
            self.publishers.push(Publisher {
                topic: topic.to_owned(),
                index,
                first_s: time_s,
                last_s: time_s,
            });
            return Ok(());
        };
        let last_s = publisher.last_s;
        if time_s <= last_s {
            return Err(FaultKind::OutOfOrder);
        }
        publisher.last_s = time_s;
        if time_s - last_s > self.max_gap_s {
            faults.add(topic, FaultKind::Gap, last_s);
        }
        Ok(())
    }

    /// Reports publishers that begin long after the others, or end long before them.
    pub(crate) fn unequal_ends(&self) -> Vec<Finding> {
        let times = |of: fn(&Publisher) -> f64| self.publishers.iter().map(of);
        let begin_s = times(|p| p.first_s).fold(f64::INFINITY, f64::min);
        let end_s = times(|p| p.last_s).fold(f64::NEG_INFINITY, f64::max);
        let mut findings = Vec::new();
        for publisher in &self.publishers {
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
