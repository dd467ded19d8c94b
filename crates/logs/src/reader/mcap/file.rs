//! Reading records from a file one by one. Every length is checked against the file's size.

use std::{io, ops::Range, path::PathBuf};

use crate::{
    error::LogError,
    reader::{
        source::{Content, Ranges},
        storage::{Damage, MAX_RECORD, Stop},
    },
};

/// Size of a record's opcode and length, bytes.
pub(super) const RECORD_HEADER: u64 = 9;

/// Number of bytes that are read at least, because short records follow each other.
const READ_AHEAD: u64 = 1 << 13;

/// Position and size of a record.
#[derive(Clone, Copy)]
pub(super) struct RecordHead {
    pub(super) opcode: u8,
    /// Offset of its opcode.
    pub(super) at_byte: u64,
    /// Length of its body, bytes.
    pub(super) length: u64,
}

impl RecordHead {
    pub(super) fn end(&self) -> u64 {
        self.body().saturating_add(self.length)
    }

    fn body(&self) -> u64 {
        self.at_byte.saturating_add(RECORD_HEADER)
    }
}

/// A log file that is open for reading.
#[derive(Debug)]
pub(super) struct LogFile {
    pub(super) path: PathBuf,
    pub(super) length: u64,
    ranges: Box<dyn Ranges>,
    /// The bytes that were read ahead, and the offset of the first of them.
    ahead: (u64, Vec<u8>),
}

impl LogFile {
    /// Opens a file.
    pub(super) fn open(content: &dyn Content) -> Result<Self, LogError> {
        let error = |e| LogError::io("open", content.path(), e);
        let mut ranges = content.open_ranges().map_err(error)?;
        Ok(Self {
            path: content.path().to_owned(),
            length: ranges.length().map_err(error)?,
            ranges,
            ahead: (0, Vec::new()),
        })
    }

    /// Announces ranges that are read next.
    pub(super) fn announce(&mut self, ranges: &[Range<u64>]) {
        self.ranges.announce(ranges);
    }

    /// Returns whether each read takes a request.
    pub(super) fn costs_requests(&self) -> bool {
        self.ranges.costs_requests()
    }

    /// Reads a range of the file. The caller has checked that it is within the file.
    pub(super) fn read(&mut self, at_byte: u64, length: u64) -> Result<Vec<u8>, LogError> {
        let (start, ahead) = &self.ahead;
        let ahead = at_byte.checked_sub(*start).and_then(|skipped| {
            let bytes = ahead.get(usize::try_from(skipped).ok()?..)?;
            bytes.get(..usize::try_from(length).ok()?)
        });
        if let Some(bytes) = ahead {
            return Ok(bytes.to_vec());
        }
        // What follows may be unreadable, although nobody needs it yet.
        let bytes = self.ranges.read_range(at_byte, length.max(READ_AHEAD));
        let bytes = bytes.or_else(|_| self.ranges.read_range(at_byte, length));
        let mut bytes = bytes.map_err(|source| LogError::io("read", &self.path, source))?;
        if (bytes.len() as u64) < length {
            let source = io::ErrorKind::UnexpectedEof.into();
            return Err(LogError::io("read", &self.path, source));
        }
        if length < READ_AHEAD {
            self.ahead = (at_byte, bytes.clone());
            bytes.truncate(length as usize);
        }
        Ok(bytes)
    }

    /// Returns the record that starts at a byte, or `None` if too few bytes follow for its opcode
    /// and length.
    pub(super) fn record_at(&mut self, at_byte: u64) -> Result<Option<RecordHead>, LogError> {
        if at_byte > self.length.saturating_sub(RECORD_HEADER) {
            return Ok(None);
        }
        let head = self.read(at_byte, RECORD_HEADER)?;
        let length = head.last_chunk().map(|length| u64::from_le_bytes(*length));
        let head = head.first().zip(length);
        Ok(head.map(|(&opcode, length)| RecordHead {
            opcode,
            at_byte,
            length,
        }))
    }

    /// Returns the body of a record, up to the end of the file.
    pub(super) fn body(&mut self, record: RecordHead) -> Result<Vec<u8>, Stop> {
        let available = self.length.saturating_sub(record.body());
        let length = record.length.min(available);
        if length > MAX_RECORD {
            return Err(self.damage(record.at_byte, "a record of impossible length"));
        }
        Ok(self.read(record.body(), length)?)
    }

    pub(super) fn damage(&self, at_byte: u64, what: impl Into<String>) -> Stop {
        Stop::Damage(self.damage_at(at_byte, what))
    }

    pub(super) fn damage_at(&self, at_byte: u64, what: impl Into<String>) -> Damage {
        Damage {
            path: self.path.clone(),
            at_byte,
            of_bytes: self.length,
            what: what.into(),
        }
    }
}
