//! The clock of a log: header stamps, or times of logging where there are none.

use tactid_logs::messages::Time;
use tactid_logs::{LogReader, RawMessage};

use crate::clock::LONGEST_STAMP_DELAY_S;
use crate::fault::FaultKind;
use crate::{Clock, RecordingError};

/// Number of messages whose stamps are compared with their times of logging.
const COMPARED: usize = 200;

/// Time zero of a log, and how its stamps relate to the times of logging.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogClock {
    /// Time zero, ns since the epoch: the first message, on the stamps' clock.
    origin_ns: i64,
    /// Median of stamp less time of logging, ns; `None` where the messages have no stamps.
    offset_ns: Option<i64>,
}

impl LogClock {
    /// Compares stamps with times of logging in the beginning of some topics.
    pub(crate) fn find(log: &LogReader, topics: &[String]) -> Result<Self, RecordingError> {
        let mut offsets = Vec::new();
        let mut first_ns = None;
        for message in log.messages_on(topics)?.take(COMPARED) {
            let message = message?;
            let log_ns = log_time_ns(&message);
            first_ns.get_or_insert(log_ns);
            match stamp(&message).map(Time::as_ns) {
                Some(0) | None => {}
                Some(stamp_ns) => offsets.push(stamp_ns.saturating_sub(log_ns)),
            }
        }
        offsets.sort_unstable();
        let offset_ns = offsets.get(offsets.len() / 2).copied();
        let first_ns = first_ns.unwrap_or(0);
        Ok(Self {
            origin_ns: first_ns.saturating_add(offset_ns.unwrap_or(0)),
            offset_ns,
        })
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

    /// Returns the time of logging of a message on the stamps' clock, s.
    pub(crate) fn log_time_s(&self, message: &RawMessage) -> f64 {
        let on_clock = log_time_ns(message).saturating_add(self.offset_ns.unwrap_or(0));
        on_clock.saturating_sub(self.origin_ns) as f64 * 1e-9
    }

    /// Returns the time of a message with a stamp, s. A stamp of zero is none: the time of logging then
    /// stands in, with a fault where other messages do have stamps.
    ///
    /// # Errors
    /// Returns [`FaultKind::FarStamp`] if the stamp is far from the time of logging.
    pub(crate) fn time_s(
        &self,
        message: &RawMessage,
        stamp: Time,
    ) -> Result<(f64, Option<FaultKind>), FaultKind> {
        let log_s = self.log_time_s(message);
        if stamp == Time::default() {
            return Ok((log_s, self.offset_ns.map(|_| FaultKind::NoStamp)));
        }
        let time_s = stamp.as_ns().saturating_sub(self.origin_ns) as f64 * 1e-9;
        if (time_s - log_s).abs() > LONGEST_STAMP_DELAY_S {
            return Err(FaultKind::FarStamp);
        }
        Ok((time_s, None))
    }
}

fn log_time_ns(message: &RawMessage) -> i64 {
    i64::try_from(message.log_time_ns).unwrap_or(i64::MAX)
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
