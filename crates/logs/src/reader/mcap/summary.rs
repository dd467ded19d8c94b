//! The summary at the end of a finished log, which contains the index of the file.

use std::collections::BTreeMap;

use mcap::{
    MAGIC,
    records::{ChunkIndex, Footer, MetadataIndex, Record, Statistics, op},
};

use super::{
    file::{LogFile, RECORD_HEADER},
    index::{McapIndex, Place, PlaceKind},
    record,
};
use crate::{
    error::LogError,
    reader::storage::{Channel, Damage, MAX_RECORD, Metadata, Segment, Stop},
};

const FOOTER_BODY: u64 = 20;

/// Result of reading a file's summary.
pub(super) enum Summary {
    /// The summary contains everything that reading needs.
    Whole(McapIndex),
    /// There is no summary, or an incomplete one, as the writer left it.
    Absent,
    /// There should be a summary, but it is damaged.
    Broken(Damage),
}

/// Records of a summary.
#[derive(Default)]
struct Parts {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, (u16, Channel)>,
    chunks: Vec<ChunkIndex>,
    metadata: Vec<MetadataIndex>,
    statistics: Option<Statistics>,
}

/// Reads the summary of a file.
pub(super) fn read(file: &mut LogFile) -> Result<Summary, LogError> {
    let footer_at = match footer_position(file)? {
        Some(at_byte) => at_byte,
        None => {
            let stop = file.damage(file.length, "the file ends before the log's index does");
            return broken_or_error(stop);
        }
    };
    let summary = parse(file, footer_at).and_then(|parts| match parts {
        Some(parts) if parts.suffice() => parts.index(file).map(Summary::Whole),
        _ => Ok(Summary::Absent),
    });
    summary.or_else(broken_or_error)
}

fn broken_or_error(stop: Stop) -> Result<Summary, LogError> {
    match stop {
        Stop::Damage(damage) => Ok(Summary::Broken(damage)),
        Stop::Error(error) => Err(error),
    }
}

/// Returns the position of the footer, or `None` if the file does not end as a finished log.
fn footer_position(file: &mut LogFile) -> Result<Option<u64>, LogError> {
    let magic = MAGIC.len() as u64;
    let tail = RECORD_HEADER + FOOTER_BODY + magic;
    if file.length < magic + tail {
        return Ok(None);
    }
    let at_byte = file.length - tail;
    let end = file.read(file.length - magic, magic)?;
    let footer = file.record_at(at_byte)?;
    let found = footer.is_some_and(|f| f.opcode == op::FOOTER && f.length == FOOTER_BODY);
    Ok((found && end == MAGIC).then_some(at_byte))
}

/// Reads the records of the summary, or `None` if the file has no summary.
fn parse(file: &mut LogFile, footer_at: u64) -> Result<Option<Parts>, Stop> {
    let broken = |file: &LogFile, at| file.damage(at, "the log's index is damaged");
    let tail = file.read(footer_at, RECORD_HEADER + FOOTER_BODY)?;
    let body = tail.get(RECORD_HEADER as usize..).unwrap_or_default();
    let Ok(Record::Footer(footer)) = record::parse(op::FOOTER, body) else {
        return Err(broken(file, footer_at));
    };
    let start = footer.summary_start;
    if start == 0 {
        return Ok(None);
    }
    if start > footer_at || footer_at - start > MAX_RECORD {
        return Err(broken(file, footer_at));
    }
    // The checksum covers the summary and the footer up to the checksum itself.
    let bytes = file.read(start, footer_at - start + RECORD_HEADER + FOOTER_BODY - 4)?;
    if footer.summary_crc != 0 && crc32fast::hash(&bytes) != footer.summary_crc {
        return Err(broken(file, start));
    }
    let mut parts = Parts::default();
    parts.read(file, start, end_of_summary(&footer, footer_at))?;
    Ok(Some(parts))
}

fn end_of_summary(footer: &Footer, footer_at: u64) -> u64 {
    if (footer.summary_start..footer_at).contains(&footer.summary_offset_start) {
        footer.summary_offset_start
    } else {
        footer_at
    }
}

impl Parts {
    fn read(&mut self, file: &mut LogFile, start: u64, end: u64) -> Result<(), Stop> {
        let mut at_byte = start;
        while at_byte < end {
            let broken = |file: &LogFile| file.damage(at_byte, "the log's index is damaged");
            let Some(record) = file
                .record_at(at_byte)?
                .filter(|record| record.end() <= end)
            else {
                return Err(broken(file));
            };
            let body = file.body(record)?;
            let parsed = record::parse(record.opcode, &body).map_err(|_| broken(file))?;
            self.add(parsed);
            at_byte = record.end();
        }
        Ok(())
    }

    fn add(&mut self, record: Record<'_>) {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(record) => {
                let channel = Channel {
                    topic: record.topic,
                    encoding: record.message_encoding,
                    ..Channel::default()
                };
                self.channels.insert(record.id, (record.schema_id, channel));
            }
            Record::ChunkIndex(index) => self.chunks.push(index),
            Record::MetadataIndex(index) => self.metadata.push(index),
            Record::Statistics(statistics) => self.statistics = Some(statistics),
            _ => {}
        }
    }

    /// Returns whether the summary describes the whole content of the file. It does not if the
    /// writer omitted records or wrote messages outside of chunks, which no index lists.
    fn suffice(&self) -> bool {
        let Some(statistics) = &self.statistics else {
            return false;
        };
        statistics.metadata_count as usize == self.metadata.len()
            && statistics.channel_count as usize == self.channels.len()
            && statistics.chunk_count as usize == self.chunks.len()
            && statistics
                .channel_message_counts
                .values()
                .fold(0, |sum: u64, n| sum.wrapping_add(*n))
                == statistics.message_count
            && (statistics.message_count == 0
                || self
                    .chunks
                    .iter()
                    .any(|chunk| !chunk.message_index_offsets.is_empty()))
    }

    fn index(mut self, file: &mut LogFile) -> Result<McapIndex, Stop> {
        let counts = self
            .statistics
            .take()
            .map(|s| s.channel_message_counts)
            .unwrap_or_default();
        let mut lookup = Lookup::new(file);
        let mut chunks: BTreeMap<u16, Vec<&ChunkIndex>> = BTreeMap::new();
        for chunk in &self.chunks {
            for &channel in chunk.message_index_offsets.keys() {
                chunks.entry(channel).or_default().push(chunk);
            }
        }
        let mut channels = BTreeMap::new();
        for (id, (schema, mut channel)) in std::mem::take(&mut self.channels) {
            channel.type_name = self.schemas.get(&schema).cloned().unwrap_or_default();
            channel.count = counts.get(&id).copied().unwrap_or(0);
            if let Some(chunks) = chunks.get_mut(&id) {
                channel.times_ns = times(chunks, id, &mut lookup)?;
            }
            channels.insert(id.into(), channel);
        }
        let metadata = self.read_metadata(&mut lookup)?;
        self.chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
        Ok(McapIndex {
            segments: self.chunks.iter().map(segment).collect(),
            channels,
            metadata,
            damage: None,
        })
    }

    fn read_metadata(&self, lookup: &mut Lookup<'_>) -> Result<Metadata, Stop> {
        let mut metadata = Metadata::new();
        for index in &self.metadata {
            let body = lookup.body(op::METADATA, index.offset)?;
            match record::parse(op::METADATA, &body) {
                Ok(Record::Metadata(record)) => metadata.insert(record.name, record.metadata),
                _ => return Err(lookup.broken(index.offset)),
            };
        }
        Ok(metadata)
    }
}

/// Reads the records that an index names.
struct Lookup<'a> {
    file: &'a mut LogFile,
    /// Number of bytes that may still be read: a damaged index can name one long record for thousands of entries.
    bytes_left: u64,
}

impl<'a> Lookup<'a> {
    /// Allows twice the length of the file: an index names each record once, and the message index of a chunk may be read
    /// twice, for the first and for the last log time of its channel.
    fn new(file: &'a mut LogFile) -> Self {
        Self {
            bytes_left: 2 * file.length,
            file,
        }
    }

    /// Returns the body of the record at a position, which must have this opcode.
    fn body(&mut self, opcode: u8, at_byte: u64) -> Result<Vec<u8>, Stop> {
        let record = self.file.record_at(at_byte)?;
        let Some(record) = record.filter(|head| head.opcode == opcode) else {
            return Err(self.broken(at_byte));
        };
        let Some(bytes_left) = self.bytes_left.checked_sub(record.length) else {
            return Err(self.broken(at_byte));
        };
        self.bytes_left = bytes_left;
        self.file.body(record)
    }

    fn broken(&self, at_byte: u64) -> Stop {
        let what = "the log's index does not fit the record at this position";
        self.file.damage(at_byte, what)
    }
}

/// Returns first and last log time of a channel, ns, in the chunks that contain it. Only chunks that can contain the first or
/// the last one are looked up.
fn times(
    chunks: &mut [&ChunkIndex],
    channel: u16,
    lookup: &mut Lookup<'_>,
) -> Result<Option<(u64, u64)>, Stop> {
    let (mut first, mut last) = (None, None);
    chunks.sort_by_key(|chunk| chunk.message_start_time);
    for chunk in &*chunks {
        if first.is_some_and(|first| first <= chunk.message_start_time) {
            break;
        }
        let times = times_in(chunk, channel, lookup)?;
        first = times.map(|t| t.0).into_iter().chain(first).min();
    }
    chunks.sort_by_key(|chunk| std::cmp::Reverse(chunk.message_end_time));
    for chunk in &*chunks {
        if last.is_some_and(|last| last >= chunk.message_end_time) {
            break;
        }
        let times = times_in(chunk, channel, lookup)?;
        last = times.map(|t| t.1).into_iter().chain(last).max();
    }
    Ok(first.zip(last))
}

fn segment(chunk: &ChunkIndex) -> (Place, Segment) {
    let place = Place {
        at_byte: chunk.chunk_start_offset,
        length: chunk.chunk_length,
        kind: PlaceKind::Chunk,
    };
    let channels = chunk.message_index_offsets.keys();
    let segment = Segment {
        first_ns: chunk.message_start_time,
        channels: channels.map(|&channel| channel.into()).collect(),
    };
    (place, segment)
}

/// Returns first and last log time of a channel in a chunk from the index of the chunk, ns.
fn times_in(
    chunk: &ChunkIndex,
    channel: u16,
    lookup: &mut Lookup<'_>,
) -> Result<Option<(u64, u64)>, Stop> {
    let Some(&at_byte) = chunk.message_index_offsets.get(&channel) else {
        return Ok(None);
    };
    let body = lookup.body(op::MESSAGE_INDEX, at_byte)?;
    let Ok(Record::MessageIndex(index)) = record::parse(op::MESSAGE_INDEX, &body) else {
        return Err(lookup.broken(at_byte));
    };
    let times = || index.records.iter().map(|entry| entry.log_time);
    Ok(times().min().zip(times().max()))
}
