//! The bytes of a log file, or its content where the file is compressed as a whole.

use std::{
    fmt,
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use ::mcap::MAGIC;

use super::{
    compression::{self, Decompressed},
    opening::Opening,
    storage::Damage,
};
use crate::{
    cdr::ZSTD_MAGIC,
    error::LogError,
    system_file::{self, FileMark},
};

/// Beginning of what is wrong with a file in no known format.
const NEITHER: &str = "is neither an MCAP log nor an SQLite bag: ";

/// First bytes of an SQLite database.
const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";

/// Storage format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Mcap,
    Sqlite,
}

/// Bytes that are read by ranges, of a file, of an object in a store or of whatever else has a
/// length.
pub trait Ranges: Send + fmt::Debug {
    /// Returns the number of bytes.
    ///
    /// # Errors
    /// Returns the error of the file or of the store.
    fn length(&mut self) -> io::Result<u64>;

    /// Reads the bytes from an offset on: as many as `length`, or fewer where the content ends.
    ///
    /// # Errors
    /// Returns the error of the file or of the store.
    fn read_range(&mut self, at_byte: u64, length: u64) -> io::Result<Vec<u8>>;

    /// Takes note of ranges of which the first are read next, in this order, so that several may be
    /// fetched by one request.
    fn announce(&mut self, _ranges: &[Range<u64>]) {}

    /// Returns whether each read takes a request. Topics of types that this crate does not decode
    /// then have the times of their chunks, and not those of their messages.
    fn costs_requests(&self) -> bool {
        false
    }
}

/// A file, or, in a test, a stream that fails.
impl<S: Read + Seek + Send + fmt::Debug> Ranges for S {
    fn length(&mut self) -> io::Result<u64> {
        self.seek(SeekFrom::End(0))
    }

    fn read_range(&mut self, at_byte: u64, length: u64) -> io::Result<Vec<u8>> {
        self.seek(SeekFrom::Start(at_byte))?;
        let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or_default());
        self.take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

/// What the reader of an MCAP file reads.
pub(super) trait Content: Send + Sync + fmt::Debug {
    /// Returns the path by which errors name the content.
    fn path(&self) -> &Path;

    /// Opens the content for reading.
    fn open_ranges(&self) -> io::Result<Box<dyn Ranges>>;

    /// Returns the damage of the compressed file, after which the content is missing.
    fn damage(&self) -> Option<&Damage>;
}

/// Ranges that are no file.
#[derive(Debug)]
pub(super) struct Elsewhere<R> {
    /// Path by which errors name the content.
    pub(super) path: PathBuf,
    pub(super) ranges: R,
}

impl<R: Ranges + Clone + Sync + 'static> Content for Elsewhere<R> {
    fn path(&self) -> &Path {
        &self.path
    }

    fn open_ranges(&self) -> io::Result<Box<dyn Ranges>> {
        Ok(Box::new(self.ranges.clone()))
    }

    fn damage(&self) -> Option<&Damage> {
        None
    }
}

impl Content for Source {
    fn path(&self) -> &Path {
        &self.path
    }

    fn open_ranges(&self) -> io::Result<Box<dyn Ranges>> {
        Ok(Box::new(self.open_content()?))
    }

    fn damage(&self) -> Option<&Damage> {
        self.decompressed.as_ref()?.damage.as_ref()
    }
}

/// A log file, decompressed if it is compressed as a whole.
#[derive(Clone, Debug)]
pub(super) struct Source {
    /// Path of the file, by which errors name it.
    pub(super) path: PathBuf,
    /// Mark of the file.
    mark: FileMark,
    /// Deleted with the last clone.
    decompressed: Option<Arc<Decompressed>>,
}

impl Source {
    /// Opens a file, and decompresses it if it is compressed.
    pub(super) fn open(path: &Path, opening: &mut Opening<'_>) -> Result<Self, LogError> {
        let (file, metadata) =
            system_file::open(path).map_err(|e| LogError::io("open", path, e))?;
        // A pipe cannot be read twice.
        if !metadata.is_file() {
            return Err(LogError::NotALog {
                path: path.to_owned(),
                what: NEITHER.to_owned() + "it is no regular file; write the log to one first",
            });
        }
        let mut source = Self {
            path: path.to_owned(),
            mark: FileMark::of(&metadata),
            decompressed: None,
        };
        if source.start()?.starts_with(&ZSTD_MAGIC) {
            source.decompressed = Some(Arc::new(compression::decompress(file, path, opening)?));
        }
        Ok(source)
    }

    /// Opens the content for reading at any later time: a file that is another by then is an error.
    pub(super) fn open_content(&self) -> io::Result<File> {
        let (file, metadata) = system_file::open(self.content())?;
        if self.decompressed.is_none() && !self.mark.may_be_same_file(&FileMark::of(&metadata)) {
            return Err(io::Error::other(
                "another file has taken its place since it was opened",
            ));
        }
        Ok(file)
    }

    /// Returns the path of the content.
    pub(super) fn content(&self) -> &Path {
        match &self.decompressed {
            Some(decompressed) => &decompressed.path,
            None => &self.path,
        }
    }

    /// Returns the format of the content, which its first bytes show.
    pub(super) fn format(&self) -> Result<Format, LogError> {
        let start = self.start()?;
        if start.starts_with(MAGIC) {
            return Ok(Format::Mcap);
        }
        if start.starts_with(SQLITE_MAGIC) {
            return Ok(Format::Sqlite);
        }
        let what = if let Some(damage) = self.damage() {
            damage.what.as_str()
        } else if start.is_empty() {
            "it is empty"
        } else if start.starts_with(b"#ROSBAG") {
            "it is a ROS 1 bag; `rosbags-convert` makes an MCAP bag of it"
        } else if start.starts_with(&ZSTD_MAGIC) {
            "it is compressed twice; `zstd -d` decompresses it"
        } else {
            "it does not start with the bytes of one"
        };
        Err(LogError::NotALog {
            path: self.path.clone(),
            what: NEITHER.to_owned() + what,
        })
    }

    /// Reads the first bytes of the content.
    fn start(&self) -> Result<Vec<u8>, LogError> {
        let opened = self.open_content();
        let file = opened.map_err(|e| LogError::io("open", &self.path, e))?;
        let mut start = Vec::new();
        let read = file.take(16).read_to_end(&mut start);
        read.map_err(|e| LogError::io("read", &self.path, e))?;
        Ok(start)
    }
}
