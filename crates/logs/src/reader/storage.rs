//! What every storage gives to the stream of messages: an index of each file, and due segments.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::Topic;
use crate::error::LogError;

/// Number of a channel within its file.
pub(super) type ChannelId = i64;

pub(super) type Metadata = BTreeMap<String, BTreeMap<String, String>>;

/// Longest record, message or value that is read into memory, bytes, far above any real one. A
/// damaged length must not exhaust memory.
pub(super) const MAX_RECORD: u64 = 1 << 28;

/// Memory for the segments that are open together.
#[derive(Clone, Copy, Debug)]
pub(super) struct MemoryBudget {
    /// Bytes that the open segments leave.
    pub(super) remaining: u64,
    /// Bytes of the whole budget, for the error.
    pub(super) total: u64,
}

impl MemoryBudget {
    /// Returns a budget of which nothing is used.
    pub(super) fn whole(bytes: u64) -> Self {
        Self {
            remaining: bytes,
            total: bytes,
        }
    }

    /// Returns the error of a file where the next segment exceeds what is left.
    pub(super) fn exceeded_error(self, path: &Path) -> Stop {
        Stop::Error(LogError::Memory {
            path: path.to_owned(),
            budget: self.total,
            what: format!(
                "reading {} needs more than {:.1} MiB of memory at once: its chunks or messages are too large, or its \
                 chunks overlap in time; `ros2 bag convert` writes smaller ones in the order of time",
                path.display(),
                in_mib(self.total)
            ),
        })
    }
}

/// Returns a number of bytes in MiB, for an error.
pub(super) fn in_mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// Content of a file.
#[derive(Debug)]
pub(super) struct FileIndex {
    /// In the order of the file.
    pub(super) segments: Vec<Segment>,
    pub(super) channels: BTreeMap<ChannelId, Channel>,
    pub(super) metadata: Metadata,
    pub(super) damage: Option<Damage>,
    pub(super) storage: Box<dyn Storage>,
    pub(super) path: PathBuf,
}

/// A part of a file that is read at once.
#[derive(Debug)]
pub(super) struct Segment {
    /// Earliest and latest log time of its messages, ns.
    pub(super) first_ns: u64,
    pub(super) last_ns: u64,
    pub(super) channels: BTreeSet<ChannelId>,
}

/// A channel of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Channel {
    pub(super) topic: String,
    pub(super) type_name: String,
    pub(super) encoding: String,
    pub(super) count: u64,
    /// First and last log time, ns.
    pub(super) times_ns: Option<(u64, u64)>,
    pub(super) definition: Definition,
}

/// What a file states of the messages of a topic, as it stands there; empty where it is left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Definition {
    /// Language of the schema, such as `ros2msg`.
    pub schema_encoding: String,
    /// Definition of the type of the messages.
    pub schema: Arc<[u8]>,
    /// Metadata of the channel, such as the offered quality of service.
    pub metadata: BTreeMap<String, String>,
}

impl Definition {
    /// Returns the definition in the records of a channel and, where there is one, its schema.
    pub(super) fn new(metadata: BTreeMap<String, String>, schema: Option<(&str, &[u8])>) -> Self {
        let (encoding, schema) = schema.unwrap_or_default();
        Self {
            schema_encoding: encoding.to_owned(),
            schema: schema.into(),
            metadata,
        }
    }

    /// Texts of the definition.
    pub(super) fn texts(&self) -> impl Iterator<Item = &[u8]> {
        let metadata = self.metadata.iter();
        let texts = metadata.flat_map(|(key, value)| [key.as_bytes(), value.as_bytes()]);
        texts.chain([self.schema_encoding.as_bytes(), &*self.schema])
    }
}

impl Channel {
    /// Returns name, type and encoding of the channel's topic, which may have several channels in
    /// one or more files.
    pub(super) fn key(&self) -> [&str; 3] {
        [&self.topic, &self.type_name, &self.encoding]
    }
}

/// Topics that are read, by the channels of a file.
pub(super) type Selected = BTreeMap<ChannelId, Arc<Topic>>;

/// An indexed file with messages that can be read.
pub(super) trait Storage: fmt::Debug + Send + Sync {
    /// Opens the file for reading.
    fn open(&self) -> Result<Box<dyn SegmentReader>, LogError>;
}

/// An open file with segments that are read one by one.
pub(super) trait SegmentReader: fmt::Debug + Send {
    /// Takes note of segments of which the first are read next, in this order.
    fn announce(&mut self, _segments: &[usize]) {}

    /// Reads the messages of the selected channels in a segment, which is given by its place in
    /// [`FileIndex::segments`]. No segment is read that needs more memory than `budget.remaining`.
    fn read(
        &mut self,
        segment: usize,
        selected: &Selected,
        budget: MemoryBudget,
    ) -> Result<Block, Stop>;
}

/// Messages of a segment in memory, in the order of the file.
#[derive(Default)]
pub(super) struct Block {
    pub(super) bytes: Vec<u8>,
    pub(super) entries: Vec<Entry>,
    /// Damage after the last entry.
    pub(super) damage: Option<Damage>,
}

impl Block {
    /// Returns the memory that the block occupies, bytes.
    pub(super) fn memory(&self) -> u64 {
        (self.bytes.capacity() + self.entries.capacity() * size_of::<Entry>()) as u64
    }
}

/// Header of a message, and the place of its data within the bytes of its block.
#[derive(Clone)]
pub(super) struct Entry {
    pub(super) channel: ChannelId,
    pub(super) sequence: u32,
    pub(super) log_time_ns: u64,
    pub(super) publish_time_ns: u64,
    pub(super) data: Range<usize>,
}

/// Position and reason of the damage of a file, which is read up to there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Path of the file.
    pub path: PathBuf,
    /// Offset of the first byte that cannot be used.
    pub at_byte: u64,
    /// Size of the file, bytes.
    pub of_bytes: u64,
    /// Description of the fault.
    pub what: String,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} is damaged at byte {} of {}: {}",
            self.path.display(),
            self.at_byte,
            self.of_bytes,
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

impl Default for Segment {
    fn default() -> Self {
        Self {
            first_ns: u64::MAX,
            last_ns: 0,
            channels: BTreeSet::new(),
        }
    }
}

impl Segment {
    pub(super) fn add(&mut self, channel: ChannelId, log_time_ns: u64) {
        self.first_ns = self.first_ns.min(log_time_ns);
        self.last_ns = self.last_ns.max(log_time_ns);
        self.channels.insert(channel);
    }
}

impl Channel {
    pub(super) fn count_message(&mut self, log_time_ns: u64) {
        self.count += 1;
        self.extend_times((log_time_ns, log_time_ns));
    }

    pub(super) fn extend_times(&mut self, (first_ns, last_ns): (u64, u64)) {
        let (first, last) = self.times_ns.unwrap_or((first_ns, last_ns));
        self.times_ns = Some((first.min(first_ns), last.max(last_ns)));
    }
}
