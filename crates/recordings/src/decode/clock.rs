//! The clock of a log: header stamps, or times of logging where there are none.

use tactid_logs::messages::Time;
use tactid_logs::{LogReader, RawMessage};

use crate::clock::LONGEST_STAMP_DELAY_S;
use crate::fault::FaultKind;
use crate::{Clock, Finding, RecordingError};

/// Least number of messages of each topic whose stamps are compared with their times of logging.
const COMPARED: usize = 200;

/// Most messages that are compared: a second of the fastest sensors has fewer.
const MOST_COMPARED: usize = 10_000;

/// Times that are shorter show no rate, ns: messages are logged late.
const SHORTEST_NS: i64 = 500_000_000;

/// Clocks of one robot differ far less than by this fraction, and simulated time by more.
const SAME_RATE: f64 = 0.05;

/// Time zero of a log, and how its stamps relate to the times of logging.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogClock {
    /// Time zero, ns since the epoch: the first message, on the stamps' clock.
    origin_ns: i64,
    /// Stamp less time of logging, ns: the median or, where the stamps' clock runs at another rate,
    /// that of the last stamp; `None` where the messages have no stamps.
    offset_ns: Option<i64>,
    /// Rate of the stamps' clock relative to that of logging, and the time of logging of the last
    /// stamp, ns; `None` where both clocks run at the same rate.
    simulated: Option<(f64, i64)>,
}

/// The stamps in the beginning of one topic.
#[derive(Default)]
struct FirstStamps {
    messages: usize,
    /// Time of logging of the first message, ns.
    first_ns: Option<i64>,
    /// Time of logging and stamp of each message with a stamp, ns.
    stamps: Vec<(i64, i64)>,
}

impl FirstStamps {
    fn read(log: &LogReader, topic: &str) -> Result<Self, RecordingError> {
        let mut found = Self::default();
        for message in log.messages_on([topic])?.take(MOST_COMPARED) {
            let message = message?;
            let log_ns = signed_ns(message.log_time_ns);
            let first_ns = *found.first_ns.get_or_insert(log_ns);
            if found.messages >= COMPARED && log_ns.saturating_sub(first_ns) > 2 * SHORTEST_NS {
                break;
            }
            found.messages += 1;
            if let Some(stamp) = stamp(&message).filter(|stamp| *stamp != Time::default()) {
                found.stamps.push((log_ns, stamp.as_ns()));
            }
        }
        Ok(found)
    }

    /// Returns stamp less time of logging of each message with a stamp, ns.
    fn offsets_ns(&self) -> impl Iterator<Item = i64> {
        let stamps = self.stamps.iter();
        stamps.map(|(log_ns, stamp_ns)| stamp_ns.saturating_sub(*log_ns))
    }

    /// Returns the rate of the stamps' clock relative to that of logging.
    fn rate(&self) -> Option<f64> {
        let ((from_ns, from_stamp), (to_ns, to_stamp)) =
            (self.stamps.first()?, self.stamps.last()?);
        let [passed, stamped] = [
            to_ns.checked_sub(*from_ns)?,
            to_stamp.checked_sub(*from_stamp)?,
        ];
        (passed > SHORTEST_NS && stamped > 0).then(|| stamped as f64 / passed as f64)
    }
}

impl LogClock {
    /// Compares stamps with times of logging in the beginning of some topics. The finding names
    /// topics without stamps where others have some.
    pub(crate) fn find(
        log: &LogReader,
        topics: &[String],
    ) -> Result<(Self, Option<Finding>), RecordingError> {
        let firsts = topics.iter().map(|topic| FirstStamps::read(log, topic));
        let firsts: Vec<FirstStamps> = firsts.collect::<Result<_, _>>()?;
        let stamps = || firsts.iter().flat_map(|first| &first.stamps);
        // Where topics have stamps of different clocks, that of the recorder is the right one.
        let of_topics = firsts
            .iter()
            .filter_map(|first| median(first.offsets_ns().collect()));
        let least_ns = of_topics.min_by_key(|offset_ns| offset_ns.saturating_abs());
        let is_near = |offset_ns: &i64| {
            let apart_ns = offset_ns.saturating_sub(least_ns.unwrap_or(0));
            apart_ns.unsigned_abs() as f64 * 1e-9 <= LONGEST_STAMP_DELAY_S
        };
        let offsets_ns = firsts.iter().flat_map(FirstStamps::offsets_ns);
        let offset_ns = median(offsets_ns.filter(is_near).collect());
        let first_ns = firsts.iter().filter_map(|first| first.first_ns).min();
        let rates = firsts.iter().filter_map(FirstStamps::rate);
        let rate = rates.reduce(|a, b| {
            if (a - 1.0).abs() < (b - 1.0).abs() {
                a
            } else {
                b
            }
        });
        let other_rate = rate.filter(|rate| (rate - 1.0).abs() > SAME_RATE);
        let first_stamp = stamps().min();
        let (offset_ns, simulated) = match (other_rate, first_stamp) {
            (Some(rate), Some((log_ns, stamp_ns))) => (
                Some(stamp_ns.saturating_sub(*log_ns)),
                Some((rate, *log_ns)),
            ),
            _ => (offset_ns, None),
        };
        let without = topics
            .iter()
            .zip(&firsts)
            .filter(|(_, first)| first.messages > 0 && 2 * first.stamps.len() < first.messages);
        let without: Vec<String> = without.map(|(topic, _)| topic.clone()).collect();
        let finding =
            (offset_ns.is_some() && !without.is_empty()).then_some(Finding::StampsMissing {
                topics: without,
                clock_rate: simulated.map_or(1.0, |(rate, _)| rate),
            });
        let clock = Self {
            origin_ns: first_ns.unwrap_or(0).saturating_add(offset_ns.unwrap_or(0)),
            offset_ns,
            simulated,
        };
        Ok((clock, finding))
    }

    /// Returns time zero, ns since the epoch.
    pub(crate) fn origin_ns(&self) -> i64 {
        self.origin_ns
    }

    /// Returns whether times are those of the stamps.
    pub(crate) fn kind(&self) -> Clock {
        match self.offset_ns {
            Some(_) => Clock::Stamps,
            None => Clock::LogTimes,
        }
    }

    /// Returns a time of logging, ns, on the stamps' clock, s.
    pub(crate) fn log_time_s(&self, log_time_ns: u64) -> f64 {
        let log_ns = signed_ns(log_time_ns);
        let on_clock = log_ns.saturating_add(self.offset_ns.unwrap_or(0));
        let time_s = on_clock.saturating_sub(self.origin_ns) as f64 * 1e-9;
        match self.simulated {
            Some((rate, last_ns)) => {
                time_s + (rate - 1.0) * log_ns.saturating_sub(last_ns) as f64 * 1e-9
            }
            None => time_s,
        }
    }

    /// Returns the time of logging, ns, of a time on the stamps' clock, s. Where that clock runs at
    /// another rate, which may change, it is not known: `None`.
    pub(crate) fn logged_ns(&self, time_s: f64) -> Option<u64> {
        let on_clock = self.origin_ns.saturating_add((time_s * 1e9) as i64);
        let log_ns = on_clock.saturating_sub(self.offset_ns.unwrap_or(0));
        self.simulated
            .is_none()
            .then(|| u64::try_from(log_ns).unwrap_or(0))
    }

    /// Returns the time of a message with a stamp, s. A stamp of zero is none: the time of logging
    /// then stands in, with a fault where other messages do have stamps.
    ///
    /// # Errors
    /// Returns [`FaultKind::FarStamp`] if the stamp is far from the time of logging.
    pub(crate) fn time_s(
        &mut self,
        message: &RawMessage,
        stamp: Time,
    ) -> Result<(f64, Option<FaultKind>), FaultKind> {
        let log_s = self.log_time_s(message.log_time_ns);
        if stamp == Time::default() {
            return Ok((log_s, self.offset_ns.map(|_| FaultKind::NoStamp)));
        }
        let time_s = stamp.as_ns().saturating_sub(self.origin_ns) as f64 * 1e-9;
        if (time_s - log_s).abs() > LONGEST_STAMP_DELAY_S {
            return Err(FaultKind::FarStamp);
        }
        if let Some((_, last_ns)) = &mut self.simulated {
            *last_ns = signed_ns(message.log_time_ns);
            self.offset_ns = Some(stamp.as_ns().saturating_sub(*last_ns));
        }
        Ok((time_s, None))
    }
}

fn median(mut values: Vec<i64>) -> Option<i64> {
    values.sort_unstable();
    values.get(values.len() / 2).copied()
}

fn signed_ns(log_time_ns: u64) -> i64 {
    i64::try_from(log_time_ns).unwrap_or(i64::MAX)
}

/// Reads the stamp with which every message with a header begins, without decoding the rest.
fn stamp(message: &RawMessage) -> Option<Time> {
    let bytes: &[u8] = message.data();
    let word = |at: usize| -> Option<[u8; 4]> { bytes.get(at..at + 4)?.try_into().ok() };
    let (sec, nanosec) = (word(4)?, word(8)?);
    // The second byte of the encapsulation header of CDR is the byte order, 1 for little-endian.
    let is_little_endian = bytes.get(1)? & 1 == 1;
    Some(if is_little_endian {
        Time {
            sec: i32::from_le_bytes(sec),
            nanosec: u32::from_le_bytes(nanosec),
        }
    } else {
        Time {
            sec: i32::from_be_bytes(sec),
            nanosec: u32::from_be_bytes(nanosec),
        }
    })
}
