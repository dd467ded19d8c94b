//! Iteration over messages in the order of their log times. Segments of files are read when their
//! first message is due.

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, binary_heap::PeekMut},
    fmt,
    ops::Range,
    sync::Arc,
};

use super::{
    Topic,
    compression::decompress_messages,
    storage::{Block, Damage, FileIndex, MemoryBudget, SegmentReader, Selected, Stop},
    zstd_context::ZstdContext,
};
use crate::{cdr, error::LogError, messages::Message};

/// Largest message that is decoded, bytes, far above any that a type of this crate has: a decoded
/// message is a copy of it.
const MAX_DECODED: usize = 64 << 20;

/// A message as the log stores it.
#[derive(Clone)]
pub struct RawMessage {
    /// Topic of the message.
    pub topic: Arc<Topic>,
    /// Log time, ns.
    pub log_time_ns: u64,
    /// Publish time, ns; the log time where the file has no publish times, as SQLite bags.
    pub publish_time_ns: u64,
    /// Sequence number among its publisher's messages, or 0 if the writer has not counted them.
    pub sequence: u32,
    block: Arc<Block>,
    data: Range<usize>,
}

impl RawMessage {
    /// Creates a message that comes from no log: its encoded `data`, received on a topic at
    /// `log_time_ns`, ns.
    #[must_use]
    pub fn new(topic: Arc<Topic>, log_time_ns: u64, data: Vec<u8>) -> Self {
        Self {
            topic,
            log_time_ns,
            publish_time_ns: log_time_ns,
            sequence: 0,
            data: 0..data.len(),
            block: Arc::new(Block {
                bytes: data,
                ..Block::default()
            }),
        }
    }

    /// Returns the encoded message, decompressed where the bag compresses it, unless it is damaged.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.block.bytes.get(self.data.clone()).unwrap_or_default()
    }

    /// Decodes the message.
    ///
    /// # Errors
    /// Returns [`LogError::WrongType`] if the topic has another type or encoding, and
    /// [`LogError::Decode`] if the bytes are not exactly one message.
    pub fn decode<M: Message>(&self) -> Result<M, LogError> {
        self.check::<M>()?;
        cdr::decode(self.data()).map_err(|source| self.undecodable(source))
    }

    /// Decodes the message into an existing one, and reuses its allocations. After an error the
    /// fields of `message` are unspecified.
    ///
    /// # Errors
    /// Returns the errors of [`decode`](Self::decode).
    pub fn decode_into<M: Message>(&self, message: &mut M) -> Result<(), LogError> {
        self.check::<M>()?;
        cdr::decode_into(self.data(), message).map_err(|source| self.undecodable(source))
    }

    fn check<M: Message>(&self) -> Result<(), LogError> {
        if !self.topic.is::<M>() {
            return Err(self.wrong_type(format!(
                "holds {}, not {}",
                self.topic.type_name,
                M::TYPE
            )));
        }
        if self.topic.encoding != "cdr" {
            let encoding = &self.topic.encoding;
            let what = format!("is encoded as {encoding:?}; only \"cdr\" can be decoded");
            return Err(self.wrong_type(what));
        }
        let bytes = self.data.len();
        if bytes > MAX_DECODED {
            let (given, most) = (bytes >> 20, MAX_DECODED >> 20);
            let what = format!("has {given} MiB, but at most {most} MiB are decoded");
            return Err(self.undecodable(cdr::CdrError::Value(what)));
        }
        Ok(())
    }

    fn wrong_type(&self, what: String) -> LogError {
        LogError::WrongType {
            topic: self.topic.name.clone(),
            what,
        }
    }

    fn undecodable(&self, source: cdr::CdrError) -> LogError {
        LogError::Decode {
            topic: self.topic.name.clone(),
            log_time_ns: self.log_time_ns,
            source,
        }
    }
}

impl fmt::Debug for RawMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RawMessage")
            .field("topic", &self.topic.name)
            .field("log_time_ns", &self.log_time_ns)
            .field("bytes", &self.data.len())
            .finish_non_exhaustive()
    }
}

/// Iterator over the messages of a log in the order of their log times. Messages with the same time
/// keep the order of the log.
///
/// Only segments of the log with overlapping times are in memory together: chunks of an MCAP file,
/// or about a megabyte of a SQLite bag. Segments that need more memory together than the reader's
/// budget are an error. The messages of a damaged file end at the damage, which
/// [`damage`](Self::damage) reports; it is not an error of the iteration.
#[derive(Debug)]
pub struct Messages {
    files: Arc<[FileIndex]>,
    /// Selected topics by channel, for each file.
    selected: Vec<Selected>,
    /// File and segment of everything that is still to be read, the earliest last.
    due: Vec<(usize, usize)>,
    open: BinaryHeap<Cursor>,
    /// The file that was read last.
    file: Option<(usize, Box<dyn SegmentReader>)>,
    zstd: ZstdContext,
    /// Earlier messages are left out, ns.
    begin_ns: u64,
    /// Memory of the open segments, bytes, and the most that it may be.
    open_bytes: u64,
    budget: u64,
    damage: Vec<Damage>,
    failed: bool,
}

impl Messages {
    pub(super) fn new(
        files: Arc<[FileIndex]>,
        selected: Vec<Selected>,
        damage: Vec<Damage>,
        budget: u64,
    ) -> Self {
        let mut due: Vec<(usize, usize)> = Vec::new();
        for (f, (file, selected)) in files.iter().zip(&selected).enumerate() {
            let has_selected = |s: &usize| {
                let channels = &file.segments[*s].channels;
                channels
                    .iter()
                    .any(|channel| selected.contains_key(channel))
            };
            due.extend(
                (0..file.segments.len())
                    .filter(has_selected)
                    .map(|s| (f, s)),
            );
        }
        due.sort_by_key(|&(f, s)| std::cmp::Reverse((files[f].segments[s].first_ns, f, s)));
        Self {
            files,
            selected,
            due,
            open: BinaryHeap::new(),
            file: None,
            zstd: ZstdContext::default(),
            begin_ns: 0,
            open_bytes: 0,
            budget,
            damage,
            failed: false,
        }
    }

    /// Leaves out the messages before a log time, ns. Parts of the log that have no later ones are
    /// not read.
    #[must_use]
    pub fn since(mut self, log_time_ns: u64) -> Self {
        let last_ns = |&(f, s): &(usize, usize)| self.files[f].segments[s].last_ns;
        self.due.retain(|place| last_ns(place) >= log_time_ns);
        self.begin_ns = log_time_ns;
        self
    }

    /// Returns the damage found so far. It is complete when the iteration has ended.
    #[must_use]
    pub fn damage(&self) -> &[Damage] {
        &self.damage
    }

    /// Reads all segments that can contain the next message.
    fn read_due(&mut self) -> Result<(), LogError> {
        while let Some(&(f, s)) = self.due.last() {
            let first_ns = self.files[f].segments[s].first_ns;
            if self
                .open
                .peek()
                .is_some_and(|cursor| cursor.time_ns() < first_ns)
            {
                break;
            }
            self.due.pop();
            match self.read_segment(f, s) {
                Ok(cursor) => self.open.extend(cursor),
                Err(Stop::Damage(damage)) => self.stop_at(f, s, damage),
                Err(Stop::Error(error)) => return Err(error),
            }
        }
        Ok(())
    }

    fn read_segment(&mut self, f: usize, s: usize) -> Result<Option<Cursor>, Stop> {
        let reader = match &mut self.file {
            Some((open, reader)) if *open == f => reader,
            other => {
                let reader = &mut other.insert((f, self.files[f].storage.open()?)).1;
                let due = self.due.iter().rev().filter(|(file, _)| *file == f);
                reader.announce(
                    &[s].into_iter()
                        .chain(due.map(|&(_, s)| s))
                        .collect::<Vec<_>>(),
                );
                reader
            }
        };
        let selected = &self.selected[f];
        let budget = MemoryBudget {
            remaining: self.budget.saturating_sub(self.open_bytes),
            total: self.budget,
        };
        let mut block = reader.read(s, selected, budget)?;
        let left = budget.remaining.checked_sub(block.memory());
        if !left.is_some_and(|left| decompress_messages(&mut self.zstd, &mut block, selected, left))
        {
            return Err(budget.exceeded_error(&self.files[f].path));
        }
        let begin_ns = self.begin_ns;
        block.entries.retain(|entry| entry.log_time_ns >= begin_ns);
        // The sort is stable, and costs almost nothing if the log is already in order.
        block.entries.sort_by_key(|entry| entry.log_time_ns);
        if let Some(damage) = block.damage.take() {
            self.stop_at(f, s, damage);
        }
        if block.entries.is_empty() {
            return Ok(None);
        }
        self.open_bytes += block.memory();
        Ok(Some(Cursor {
            file: f,
            segment: s,
            next: 0,
            block: Arc::new(block),
        }))
    }

    /// Marks the rest of a file, after a damaged segment, as read.
    fn stop_at(&mut self, f: usize, s: usize, damage: Damage) {
        self.due.retain(|&(file, segment)| file != f || segment < s);
        if !self.damage.iter().any(|known| known.path == damage.path) {
            self.damage.push(damage);
        }
    }

    fn advance(&mut self) -> Option<RawMessage> {
        let mut cursor = self.open.peek_mut()?;
        let entry = cursor.block.entries.get(cursor.next)?;
        let message = RawMessage {
            topic: self.selected[cursor.file].get(&entry.channel)?.clone(),
            log_time_ns: entry.log_time_ns,
            publish_time_ns: entry.publish_time_ns,
            sequence: entry.sequence,
            block: cursor.block.clone(),
            data: entry.data.clone(),
        };
        if cursor.next + 1 == cursor.block.entries.len() {
            self.open_bytes -= PeekMut::pop(cursor).block.memory();
        } else {
            cursor.next += 1;
        }
        Some(message)
    }
}

impl Iterator for Messages {
    type Item = Result<RawMessage, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        if let Err(error) = self.read_due() {
            self.failed = true;
            return Some(Err(error));
        }
        self.advance().map(Ok)
    }
}

/// Messages of a segment in memory; `next` is the index of the next one.
struct Cursor {
    file: usize,
    segment: usize,
    next: usize,
    block: Arc<Block>,
}

impl Cursor {
    fn time_ns(&self) -> u64 {
        let next = self.block.entries.get(self.next);
        next.map_or(u64::MAX, |entry| entry.log_time_ns)
    }

    fn key(&self) -> (u64, usize, usize) {
        (self.time_ns(), self.file, self.segment)
    }
}

/// A binary heap returns its greatest element first, which has to be the earliest message.
impl Ord for Cursor {
    fn cmp(&self, other: &Self) -> Ordering {
        other.key().cmp(&self.key())
    }
}

impl PartialOrd for Cursor {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Cursor {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Cursor {}

impl fmt::Debug for Cursor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cursor")
            .field("key", &self.key())
            .finish_non_exhaustive()
    }
}
