//! Reading records from a file one by one. Every length is checked against the file's size.

use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use mcap::MAGIC;

use crate::error::LogError;

/// Size of a record's opcode and length, bytes.
pub(super) const RECORD_HEADER: u64 = 9;

/// Longest record that is read into memory, bytes, far above any real one. A damaged length must
/// not exhaust memory.
pub(super) const MAX_RECORD: u64 = 1 << 29;

/// Position and reason of damage, from which on a file cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Path of the file.
    pub path: PathBuf,
    /// Offset of the first byte that cannot be used.
    pub at_byte: u64,
    /// Description of the fault.
    pub what: String,
}

impl std::fmt::Display for Damage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} is damaged at byte {}: {}",
            self.path.display(),
            self.at_byte,
            self.what
        )
    }
}

/// Reason why reading a file ends early.
pub(super) enum Stop {
    Damage(Damage),
    Error(LogError),
}

impl From<LogError> for Stop {
    fn from(error: LogError) -> Self {
        Self::Error(error)
    }
}

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
    file: BufReader<File>,
    /// Offset of the next byte to be read.
    position: u64,
}

impl LogFile {
    /// Opens a file and checks that it starts with the magic bytes of MCAP.
    pub(super) fn open(path: &Path) -> Result<Self, LogError> {
        let error = |source| LogError::Io {
            action: "open",
            path: path.to_owned(),
            source,
        };
        let file = File::open(path).map_err(error)?;
        let length = file.metadata().map_err(error)?.len();
        let mut log = Self {
            path: path.to_owned(),
            length,
            file: BufReader::new(file),
            position: 0,
        };
        let start = log.read(0, 16.min(length))?;
        match what_instead(&start) {
            None => Ok(log),
            Some(what) => Err(LogError::NotALog {
                path: path.to_owned(),
                what,
            }),
        }
    }

    /// Reads a range of the file. The caller has checked that it is within the file.
    pub(super) fn read(&mut self, at_byte: u64, length: u64) -> Result<Vec<u8>, LogError> {
        let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or_default());
        self.seek(at_byte)
            .and_then(|()| self.file.by_ref().take(length).read_to_end(&mut bytes))
            .map_err(|source| self.error(source))?;
        self.position += bytes.len() as u64;
        if (bytes.len() as u64) < length {
            return Err(self.error(io::ErrorKind::UnexpectedEof.into()));
        }
        Ok(bytes)
    }

    /// Returns the record that starts at a byte, or `None` if too few bytes follow for its opcode
    /// and length.
    pub(super) fn record_at(&mut self, at_byte: u64) -> Result<Option<RecordHead>, LogError> {
        if at_byte > self.length.saturating_sub(RECORD_HEADER) {
            return Ok(None);
        }
        let mut head = [0; RECORD_HEADER as usize];
        self.seek(at_byte)
            .and_then(|()| self.file.read_exact(&mut head))
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
            Ok(offset) => self.file.seek_relative(offset)?,
            Err(_) => drop(self.file.seek(SeekFrom::Start(at_byte))?),
        }
        self.position = at_byte;
        Ok(())
    }

    fn error(&self, source: io::Error) -> LogError {
        LogError::Io {
            action: "read",
            path: self.path.clone(),
            source,
        }
    }
}

/// Returns what kind of file it is that does not start with the magic bytes of MCAP.
fn what_instead(start: &[u8]) -> Option<&'static str> {
    if start.starts_with(MAGIC) {
        None
    } else if start.is_empty() {
        Some("it is empty")
    } else if start.starts_with(b"SQLite format 3") {
        Some("it is an SQLite database; `ros2 bag convert` makes an MCAP bag of it")
    } else if start.starts_with(b"#ROSBAG") {
        Some("it is a ROS 1 bag; `rosbags-convert` makes an MCAP bag of it")
    } else if start.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        Some("it is compressed as a whole; `zstd -d` unpacks it")
    } else {
        Some("it does not start with the bytes of one")
    }
}
