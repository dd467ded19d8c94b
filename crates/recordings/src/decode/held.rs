//! Decoded messages that are held until no message of their publisher can come before them.

use std::collections::VecDeque;

use crate::alignment::Event;

/// Most messages that are held: a second of the fastest sensors, many times.
const MOST_HELD: usize = 1 << 16;

/// A message that is held.
#[derive(Clone, Debug)]
pub(super) struct Message {
    pub(super) time_s: f64,
    /// `None` where the message cannot be used.
    pub(super) event: Option<Event>,
    /// Whether it came after later ones.
    pub(super) is_late: bool,
}

/// The messages of the last second of the log. They leave in the order in which they came, but
/// where those of a publisher are not in the order of their times, the earliest one takes the place
/// that is due.
#[derive(Clone, Debug)]
pub(super) struct HeldMessages {
    /// Time for which a message is held, s.
    held_s: f64,
    /// Time of logging, s, and publisher of each message, as they came.
    arrivals: VecDeque<(f64, usize)>,
    /// Messages of each publisher in the order of their times.
    publishers: Vec<VecDeque<Message>>,
    /// Least time from a message of each publisher to its logging, s; zero where one came before it.
    least_lags_s: Vec<f64>,
    /// Latest time of logging, s.
    newest_s: f64,
}

impl HeldMessages {
    /// Holds each message for a time, s.
    pub(super) fn new(held_s: f64) -> Self {
        Self {
            held_s,
            arrivals: VecDeque::new(),
            publishers: Vec::new(),
            least_lags_s: Vec::new(),
            newest_s: 0.0,
        }
    }

    /// Adds the event of a message of a publisher, at its time, s, that was recorded at another
    /// one, s.
    pub(super) fn push(
        &mut self,
        publisher: usize,
        logged_s: f64,
        time_s: f64,
        event: Option<Event>,
    ) {
        while self.publishers.len() <= publisher {
            self.publishers.push(VecDeque::new());
            self.least_lags_s.push(f64::INFINITY);
        }
        // A single stamp that is far ahead says nothing about those that follow.
        let lag_s = (logged_s - time_s).max(0.0);
        let least_lag_s = &mut self.least_lags_s[publisher];
        *least_lag_s = least_lag_s.min(lag_s);
        let held = &mut self.publishers[publisher];
        // One that comes later still is out of order, as after a clock was set back, and stays where
        // it came: it is not mixed with those before.
        let is_in_time = lag_s - *least_lag_s <= self.held_s;
        let is_late = is_in_time && held.back().is_some_and(|last| time_s < last.time_s);
        let place = if is_late {
            held.partition_point(|message| message.time_s <= time_s)
        } else {
            held.len()
        };
        let message = Message {
            time_s,
            event,
            is_late,
        };
        held.insert(place, message);
        self.arrivals.push_back((logged_s, publisher));
        self.newest_s = self.newest_s.max(logged_s);
    }

    /// Removes the next message that is due, with its publisher; every one where the log
    /// `is_at_end`.
    pub(super) fn pop(&mut self, is_at_end: bool) -> Option<(usize, Message)> {
        let (logged_s, publisher) = *self.arrivals.front()?;
        let is_due =
            is_at_end || self.newest_s - logged_s >= self.held_s || self.arrivals.len() > MOST_HELD;
        if !is_due {
            return None;
        }
        self.arrivals.pop_front();
        let message = self.publishers.get_mut(publisher)?.pop_front()?;
        Some((publisher, message))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::LONGEST_LATENESS_S;

    /// Returns the times that leave, in seconds, of messages with times of logging and publishers.
    fn left(messages: &[(f64, usize, f64)]) -> Vec<(usize, f64)> {
        let mut held = HeldMessages::new(LONGEST_LATENESS_S);
        let mut left = Vec::new();
        for &(logged_s, publisher, time_s) in messages {
            held.push(publisher, logged_s, time_s, None);
            while let Some((publisher, message)) = held.pop(false) {
                left.push((publisher, message.time_s));
            }
        }
        while let Some((publisher, message)) = held.pop(true) {
            left.push((publisher, message.time_s));
        }
        left
    }

    /// Messages in order leave as they came, and late ones of a publisher before its later ones.
    #[test]
    fn messages_are_put_in_order_by_publisher() {
        let ordered = [(0.0, 0, 0.0), (0.1, 1, 0.1), (0.2, 0, 0.2), (2.0, 1, 2.0)];
        let expected: Vec<_> = ordered.iter().map(|&(_, of, s)| (of, s)).collect();
        assert_eq!(left(&ordered), expected);
        let late = [(0.0, 0, 0.0), (0.1, 0, 0.2), (0.2, 1, 0.15), (0.9, 0, 0.1)];
        assert_eq!(left(&late), [(0, 0.0), (0, 0.1), (1, 0.15), (0, 0.2)]);
        let too_late = [(0.0, 0, 0.0), (0.1, 0, 0.2), (1.15, 1, 1.15), (1.2, 0, 0.1)];
        assert_eq!(left(&too_late), [(0, 0.0), (0, 0.2), (1, 1.15), (0, 0.1)]);
        let set_back = [(3.0, 0, 3.0), (3.1, 0, 3.1), (3.2, 0, 0.2), (3.3, 0, 0.3)];
        let expected: Vec<_> = set_back.iter().map(|&(_, of, s)| (of, s)).collect();
        assert_eq!(left(&set_back), expected);
        // The stamps of a topic may be of another time than those of the others.
        let delayed = [(3.0, 0, 0.0), (3.1, 0, 0.1), (3.2, 0, 0.05)];
        assert_eq!(left(&delayed), [(0, 0.0), (0, 0.05), (0, 0.1)]);
        let ahead = [(0.0, 0, 0.0), (0.1, 0, 30.1), (0.2, 0, 0.2), (0.3, 0, 0.3)];
        assert_eq!(left(&ahead), [(0, 0.0), (0, 0.2), (0, 0.3), (0, 30.1)]);
    }
}
