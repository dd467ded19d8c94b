//! The summary at the end of a finished log, which contains the index of the file.

use std::{collections::BTreeMap, ops::Range, path::Path};

use mcap::{
    MAGIC,
    records::{ChunkIndex, Footer, MetadataIndex, Record, Statistics, op},
};

use super::{
    file::{LogFile, RECORD_HEADER},
    index::{McapIndex, Place, PlaceKind, keep_metadata},
    record,
};
use crate::{
    error::LogError,
    reader::{
        opening::Opening,
        storage::{Channel, Damage, Metadata, Segment, Stop},
    },
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
pub(super) fn read(file: &mut LogFile, opening: &mut Opening<'_>) -> Result<Summary, LogError> {
    let footer_at = match footer_position(file)? {
        Some(at_byte) => at_byte,
        None => {
            let stop = file.damage(file.length, "the file ends before the log's index does");
            return broken_or_error(stop);
        }
    };
    let summary = parse(file, footer_at, opening).and_then(|parts| match parts {
        Some(parts) if parts.suffice() => parts.index(file, opening).map(Summary::Whole),
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
fn parse(
    file: &mut LogFile,
    footer_at: u64,
    opening: &mut Opening<'_>,
) -> Result<Option<Parts>, Stop> {
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
    if start > footer_at {
        return Err(broken(file, footer_at));
    }
    // What it is made of needs more memory than the summary itself.
    if footer_at - start > opening.longest_record() {
        return Err(opening.too_large(&file.path).into());
    }
    // The checksum covers the summary and the footer up to the checksum itself.
    let end = footer_at + RECORD_HEADER + FOOTER_BODY - 4;
    if footer.summary_crc != 0 && file.checksum(start, end)? != footer.summary_crc {
        return Err(broken(file, start));
    }
    let mut parts = Parts::default();
    parts.read(file, start..end_of_summary(&footer, footer_at), opening)?;
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
    fn read(
        &mut self,
        file: &mut LogFile,
        range: Range<u64>,
        opening: &mut Opening<'_>,
    ) -> Result<(), Stop> {
        let Range {
            start: mut at_byte,
            end,
        } = range;
        while at_byte < end {
            opening.go_on()?;
            let broken = |file: &LogFile| file.damage(at_byte, "the log's index is damaged");
            let Some(record) = file
                .record_at(at_byte)?
                .filter(|record| record.end() <= end)
            else {
                return Err(broken(file));
            };
            let body = file.body(record)?;
            let parsed = record::parse(record.opcode, &body).map_err(|_| broken(file))?;
            if self.redefines(&parsed) {
                return Err(broken(file));
            }
            self.add(parsed, &file.path, opening)?;
            at_byte = record.end();
        }
        Ok(())
    }

    /// Returns whether a record is a schema or a channel with the id of another one.
    fn redefines(&self, record: &Record<'_>) -> bool {
        match record {
            Record::Schema { header, .. } => {
                let known = self.schemas.get(&header.id);
                known.is_some_and(|known| *known != header.name)
            }
            Record::Channel(record) => {
                let known = self.channels.get(&record.id);
                known.is_some_and(|(schema, channel)| {
                    (*schema, &channel.topic, &channel.encoding)
                        != (record.schema_id, &record.topic, &record.message_encoding)
                })
            }
            _ => false,
        }
    }

    /// Adds a record, which counts among what the index keeps.
    fn add(
        &mut self,
        record: Record<'_>,
        path: &Path,
        opening: &mut Opening<'_>,
    ) -> Result<(), LogError> {
        match record {
            Record::Schema { header, .. } => {
                opening.keep_names(path, [header.name.as_str()])?;
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(record) => {
                let texts = [record.topic.as_str(), &record.message_encoding];
                opening.keep_names(path, texts)?;
                let channel = Channel {
                    topic: record.topic,
                    encoding: record.message_encoding,
                    ..Channel::default()
                };
                self.channels.insert(record.id, (record.schema_id, channel));
            }
            Record::ChunkIndex(index) => {
                opening.keep_segment(path, index.message_index_offsets.len())?;
                self.chunks.push(index);
            }
            Record::MetadataIndex(index) => {
                opening.keep_each(path, [index.name.as_str()])?;
                self.metadata.push(index);
            }
            Record::Statistics(statistics) => self.statistics = Some(statistics),
            _ => {}
        }
        Ok(())
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

    fn index(mut self, file: &mut LogFile, opening: &mut Opening<'_>) -> Result<McapIndex, Stop> {
        self.chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
        if let Some(at_byte) = self.overlap() {
            return Err(file.damage(at_byte, "the chunks in the log's index overlap"));
        }
        let counts = self
            .statistics
            .take()
            .map(|s| s.channel_message_counts)
            .unwrap_or_default();
        let mut lookup = Lookup::new(file, opening);
        let mut chunks: BTreeMap<u16, Vec<&ChunkIndex>> = BTreeMap::new();
        for chunk in &self.chunks {
            for &channel in chunk.message_index_offsets.keys() {
                chunks.entry(channel).or_default().push(chunk);
            }
        }
        let mut channels = BTreeMap::new();
        for (id, (schema, mut channel)) in std::mem::take(&mut self.channels) {
            channel.type_name = self.schemas.get(&schema).cloned().unwrap_or_default();
            let type_name = [channel.type_name.as_str()];
            lookup.opening.keep_each(&lookup.file.path, type_name)?;
            channel.count = counts.get(&id).copied().unwrap_or(0);
            if let Some(chunks) = chunks.get_mut(&id) {
                channel.times_ns = times(chunks, id, &mut lookup)?;
            }
            channels.insert(id.into(), channel);
        }
        let metadata = self.read_metadata(&mut lookup)?;
        Ok(McapIndex {
            segments: self.chunks.iter().map(segment).collect(),
            channels,
            metadata,
            damage: None,
        })
    }

    /// Returns the position of the first chunk that begins before the one before it ends. Each would be read as a whole.
    fn overlap(&self) -> Option<u64> {
        let end = |chunk: &ChunkIndex| chunk.chunk_start_offset.saturating_add(chunk.chunk_length);
        let pairs = self.chunks.iter().zip(self.chunks.iter().skip(1));
        let overlap = pairs
            .filter(|(chunk, next)| end(chunk) > next.chunk_start_offset)
            .map(|(_, next)| next.chunk_start_offset);
        overlap.min()
    }

    fn read_metadata(&self, lookup: &mut Lookup<'_, '_>) -> Result<Metadata, Stop> {
        let mut metadata = Metadata::new();
        for index in &self.metadata {
            let body = lookup.body(op::METADATA, index.offset)?;
            match record::parse(op::METADATA, &body) {
                Ok(Record::Metadata(record)) => {
                    keep_metadata(&record, lookup.file, lookup.opening)?;
                    metadata.insert(record.name, record.metadata)
                }
                _ => return Err(lookup.broken(index.offset)),
            };
        }
        Ok(metadata)
    }
}

/// Reads the records that an index names.
struct Lookup<'a, 'b> {
    file: &'a mut LogFile,
    opening: &'a mut Opening<'b>,
    /// Number of bytes that may still be read: a damaged index can name one long record for thousands of entries.
    bytes_left: u64,
}

impl<'a, 'b> Lookup<'a, 'b> {
    /// Allows twice the length of the file: an index names each record once, and the message index of a chunk may be read
    /// twice, for the first and for the last log time of its channel.
    fn new(file: &'a mut LogFile, opening: &'a mut Opening<'b>) -> Self {
        Self {
            bytes_left: 2 * file.length,
            file,
            opening,
        }
    }

    /// Returns the body of the record at a position, which must have this opcode.
    fn body(&mut self, opcode: u8, at_byte: u64) -> Result<Vec<u8>, Stop> {
        self.opening.go_on()?;
        let record = self.file.record_at(at_byte)?;
        let Some(record) = record.filter(|head| head.opcode == opcode) else {
            return Err(self.broken(at_byte));
        };
        let Some(bytes_left) = self.bytes_left.checked_sub(record.length) else {
            return Err(self.broken(at_byte));
        };
        self.bytes_left = bytes_left;
        if record.length > self.opening.longest_record() {
            return Err(self.opening.too_large(&self.file.path).into());
        }
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
    lookup: &mut Lookup<'_, '_>,
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
    lookup: &mut Lookup<'_, '_>,
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
