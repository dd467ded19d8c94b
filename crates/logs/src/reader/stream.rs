//! Iteration over messages in the order of their log times. Chunks are read when their first
//! message is due.

use std::{
    cmp::Ordering,
    collections::{BTreeMap, BinaryHeap, binary_heap::PeekMut},
    fmt,
    ops::Range,
    sync::Arc,
};

use super::{
    Topic,
    chunk::{MessageHead, Records},
    file::{Damage, LogFile, Stop},
    index::{Channel, FileIndex},
};
use crate::{cdr, error::LogError, messages::Message};

/// A message as the log stores it.
#[derive(Clone)]
pub struct RawMessage {
    /// Topic of the message.
    pub topic: Arc<Topic>,
    /// Log time, ns.
    pub log_time_ns: u64,
    /// Publish time, ns.
    pub publish_time_ns: u64,
    /// Sequence number among its publisher's messages, or 0 if the writer has not counted them.
    pub sequence: u32,
    records: Arc<Records>,
    data: Range<usize>,
}

impl RawMessage {
    /// Returns the encoded message.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.records.body(self.data.clone())
    }

    /// Decodes the message.
    ///
    /// # Errors
    /// Returns [`LogError::WrongType`] or [`LogError::Encoding`] if the topic has another type or
    /// encoding, and [`LogError::Decode`] if the bytes are not exactly one message.
    pub fn decode<M: Message>(&self) -> Result<M, LogError> {
        self.check::<M>()?;
        cdr::decode(self.data()).map_err(|source| self.undecodable(source))
    }

    /// Decodes the message into an existing one, whose allocations are reused. After an error the
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
            return Err(LogError::WrongType {
                topic: self.topic.name.clone(),
                type_name: self.topic.type_name.clone(),
                requested: M::TYPE,
            });
        }
        if self.topic.encoding != "cdr" {
            return Err(LogError::Encoding {
                topic: self.topic.name.clone(),
                encoding: self.topic.encoding.clone(),
            });
        }
        Ok(())
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
/// Only chunks with overlapping times are in memory together. The messages of a damaged file end at
/// the damage, which [`damage`](Self::damage) reports; it is not an error of the iteration.
#[derive(Debug)]
pub struct Messages {
    files: Arc<[FileIndex]>,
    /// Selected topics by channel, for each file.
    selected: Vec<BTreeMap<u16, Arc<Topic>>>,
    /// File and segment of everything that is still to be read, the earliest last.
    due: Vec<(usize, usize)>,
    open: BinaryHeap<Cursor>,
    /// The file that was read last.
    file: Option<(usize, LogFile)>,
    damage: Vec<Damage>,
    failed: bool,
}

impl Messages {
    pub(super) fn new(
        files: Arc<[FileIndex]>,
        selected: Vec<BTreeMap<u16, Arc<Topic>>>,
        damage: Vec<Damage>,
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
            damage,
            failed: false,
        }
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
                Err(Stop::Damage(damage)) => self.stop_at(f, damage),
                Err(Stop::Error(error)) => return Err(error),
            }
        }
        Ok(())
    }

    fn read_segment(&mut self, f: usize, s: usize) -> Result<Option<Cursor>, Stop> {
        if self.file.as_ref().is_none_or(|(open, _)| *open != f) {
            self.file = Some((f, LogFile::open(&self.files[f].path)?));
        }
        let Some((_, file)) = &mut self.file else {
            return Ok(None);
        };
        let segment = &self.files[f].segments[s];
        let records = segment.read(file)?;
        let mut entries = Vec::new();
        let known = &self.files[f].channels;
        if let Err(what) = select(&records, known, &self.selected[f], &mut entries) {
            let damage = file.damage_at(segment.at_byte, what);
            self.stop_at(f, damage);
        }
        if entries.is_empty() {
            return Ok(None);
        }
        // The sort is stable, and costs almost nothing if the log is already in order.
        entries.sort_by_key(|(head, _)| head.log_time_ns);
        let records = Arc::new(records);
        Ok(Some(Cursor {
            file: f,
            segment: s,
            next: 0,
            entries,
            records,
        }))
    }

    /// Marks the rest of a file as read.
    fn stop_at(&mut self, f: usize, damage: Damage) {
        let at_byte = damage.at_byte;
        let files = &self.files;
        self.due
            .retain(|&(file, s)| file != f || files[f].segments[s].at_byte < at_byte);
        if !self.damage.iter().any(|known| known.path == damage.path) {
            self.damage.push(damage);
        }
    }

    fn advance(&mut self) -> Option<RawMessage> {
        let mut cursor = self.open.peek_mut()?;
        let (head, data) = cursor.entries.get(cursor.next)?.clone();
        let message = RawMessage {
            topic: self.selected[cursor.file].get(&head.channel)?.clone(),
            log_time_ns: head.log_time_ns,
            publish_time_ns: head.publish_time_ns,
            sequence: head.sequence,
            records: cursor.records.clone(),
            data,
        };
        if cursor.next + 1 == cursor.entries.len() {
            PeekMut::pop(cursor);
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

/// Collects the selected messages of a segment, up to the first damaged record.
fn select(
    records: &Records,
    known: &BTreeMap<u16, Channel>,
    selected: &BTreeMap<u16, Arc<Topic>>,
    entries: &mut Vec<(MessageHead, Range<usize>)>,
) -> Result<(), &'static str> {
    for message in records.messages() {
        let (head, data) = message?;
        if selected.contains_key(&head.channel) {
            entries.push((head, data));
        } else if !known.contains_key(&head.channel) {
            return Err("a message of an unknown channel");
        }
    }
    Ok(())
}

/// Messages of a segment in memory; `next` is the index of the next one.
struct Cursor {
    file: usize,
    segment: usize,
    next: usize,
    entries: Vec<(MessageHead, Range<usize>)>,
    records: Arc<Records>,
}

impl Cursor {
    fn time_ns(&self) -> u64 {
        self.entries
            .get(self.next)
            .map_or(u64::MAX, |(head, _)| head.log_time_ns)
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
