//! Reading records from a file one by one. Every length is checked against the file's size.

use std::{
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::PathBuf,
};

use crate::{
    error::LogError,
    reader::{
        source::{Content, Stream},
        storage::{Damage, MAX_RECORD, Stop},
    },
};

/// Size of a record's opcode and length, bytes.
pub(super) const RECORD_HEADER: u64 = 9;

/// Number of bytes that a checksum reads at once.
const CHECKSUM_STEP: u64 = 1 << 20;

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
    stream: BufReader<Box<dyn Stream>>,
    /// Offset of the next byte to be read.
    position: u64,
}

impl LogFile {
    /// Opens a file.
    pub(super) fn open(content: &dyn Content) -> Result<Self, LogError> {
        let error = |e| LogError::io("open", content.path(), e);
        let mut stream = content.open_stream().map_err(error)?;
        let length = stream.seek(SeekFrom::End(0)).map_err(error)?;
        Ok(Self {
            path: content.path().to_owned(),
            length,
            stream: BufReader::new(stream),
            position: length,
        })
    }

    /// Reads a range of the file. The caller has checked that it is within the file.
    pub(super) fn read(&mut self, at_byte: u64, length: u64) -> Result<Vec<u8>, LogError> {
        let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or_default());
        self.seek(at_byte)
            .and_then(|()| self.stream.by_ref().take(length).read_to_end(&mut bytes))
            .map_err(|source| self.error(source))?;
        self.position += bytes.len() as u64;
        if (bytes.len() as u64) < length {
            return Err(self.error(io::ErrorKind::UnexpectedEof.into()));
        }
        Ok(bytes)
    }

    /// Returns the CRC-32 of a range of the file, up to the end of the file.
    pub(super) fn checksum(&mut self, start: u64, end: u64) -> Result<u32, LogError> {
        let mut hasher = crc32fast::Hasher::new();
        let mut at_byte = start;
        while at_byte < end {
            let part = self.read(at_byte, (end - at_byte).min(CHECKSUM_STEP))?;
            hasher.update(&part);
            at_byte += part.len() as u64;
        }
        Ok(hasher.finalize())
    }

    /// Returns the record that starts at a byte, or `None` if too few bytes follow for its opcode
    /// and length.
    pub(super) fn record_at(&mut self, at_byte: u64) -> Result<Option<RecordHead>, LogError> {
        if at_byte > self.length.saturating_sub(RECORD_HEADER) {
            return Ok(None);
        }
        let mut head = [0; RECORD_HEADER as usize];
        self.seek(at_byte)
            .and_then(|()| self.stream.read_exact(&mut head))
            .map_err(|source| self.error(source))?;
        self.position += RECORD_HEADER;
        let [opcode, length @ ..] = head;
        Ok(Some(RecordHead {
            opcode,
            at_byte,
            length: u64::from_le_bytes(length),
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
            what: what.into(),
        }
    }

    /// Moves to a byte and keeps the buffer where possible.
    fn seek(&mut self, at_byte: u64) -> io::Result<()> {
        match i64::try_from(i128::from(at_byte) - i128::from(self.position)) {
            Ok(offset) => self.stream.seek_relative(offset)?,
            Err(_) => drop(self.stream.seek(SeekFrom::Start(at_byte))?),
        }
        self.position = at_byte;
        Ok(())
    }

    fn error(&self, source: io::Error) -> LogError {
        LogError::io("read", &self.path, source)
    }
}
