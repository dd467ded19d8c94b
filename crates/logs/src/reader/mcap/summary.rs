//! The summary at the end of a finished log, which contains the index of the file.
//!
//! The library reads it, from a tidy copy: it believes every length, keeps everything it finds, and
//! panics at a record of an attachment that ends early.

use std::collections::BTreeMap;

use mcap::{
    MAGIC, McapError, Summary,
    records::{ChunkIndex, Footer, Record, op},
};

use super::{
    chunk::Records,
    file::{LogFile, RECORD_HEADER},
    index::{McapIndex, Place},
    record,
};
use crate::{
    messages::TYPES,
    reader::{
        opening::Opening,
        storage::{Channel, Definition, Segment, Stop},
    },
};

/// Opcode and length of a footer.
const FOOTER_HEAD: [u8; RECORD_HEADER as usize] = [op::FOOTER, 20, 0, 0, 0, 0, 0, 0, 0];

/// Size of the footer up to the checksum of the summary, which covers it, and after it, bytes.
const FOOTER_CHECKED: u64 = RECORD_HEADER + 16;
const AFTER_CHECKED: u64 = 4 + MAGIC.len() as u64;

/// What is wrong with a summary that cannot be parsed.
const BROKEN: &str = "the log's index is damaged";

/// Reads the index in the summary of a file, or `None` if there is no summary, or an incomplete
/// one, as the writer left it. Damage means that there should be one.
pub(super) fn read(
    file: &mut LogFile,
    opening: &mut Opening<'_>,
) -> Result<Option<McapIndex>, Stop> {
    let (footer_at, footer) = footer(file)?;
    let start = footer.summary_start;
    if start == 0 {
        return Ok(None);
    }
    let length = footer_at.checked_sub(start);
    let length = length.ok_or_else(|| file.damage(footer_at, BROKEN))?;
    // What it is made of needs more memory than the summary itself.
    if length > opening.longest_record() {
        return Err(opening.too_large(&file.path).into());
    }
    let mut bytes = file.read(start, length + FOOTER_CHECKED)?;
    if footer.summary_crc != 0 && crc32fast::hash(&bytes) != footer.summary_crc {
        return Err(file.damage(start, BROKEN));
    }
    let offsets = footer.summary_offset_start.checked_sub(start);
    bytes.truncate(offsets.filter(|end| *end < length).unwrap_or(length) as usize);
    let tidy = tidy(bytes, start, file, opening)?;
    match Summary::read(&tidy) {
        Ok(Some(summary)) if suffices(&summary) => index(summary, file, opening).map(Some),
        // A writer may omit the schemas.
        Ok(_) | Err(McapError::UnknownSchema(..)) => Ok(None),
        Err(_) => Err(file.damage(start, BROKEN)),
    }
}

/// Returns the footer and its position.
fn footer(file: &mut LogFile) -> Result<(u64, Footer), Stop> {
    let tail = FOOTER_CHECKED + AFTER_CHECKED;
    let at_byte = file.length.checked_sub(tail);
    if let Some(at_byte) = at_byte.filter(|at_byte| *at_byte >= MAGIC.len() as u64) {
        let tail = file.read(at_byte, tail)?;
        let body = tail.strip_prefix(&FOOTER_HEAD);
        if let Some(body) = body.and_then(|body| body.strip_suffix(MAGIC)) {
            return match mcap::parse_record(op::FOOTER, body) {
                Ok(Record::Footer(footer)) => Ok((at_byte, footer)),
                _ => Err(file.damage(at_byte, BROKEN)),
            };
        }
    }
    Err(file.damage(file.length, "the file ends before the log's index does"))
}

/// Returns a log without messages that has the summary with these bytes: checked, and without
/// records and texts that are not needed.
fn tidy(
    bytes: Vec<u8>,
    start: u64,
    file: &LogFile,
    opening: &mut Opening<'_>,
) -> Result<Vec<u8>, Stop> {
    let mut tidy = Vec::with_capacity(bytes.len() + 64);
    tidy.extend(MAGIC);
    let records = Records::new(bytes);
    for record in records.iter() {
        opening.go_on()?;
        let (opcode, body) = record.map_err(|_| file.damage(start, BROKEN))?;
        let at_byte = start + body.start as u64 - RECORD_HEADER;
        if !matches!(
            opcode,
            op::SCHEMA | op::CHANNEL | op::CHUNK_INDEX | op::METADATA_INDEX | op::STATISTICS
        ) {
            continue;
        }
        let body = records.bytes.get(body).unwrap_or_default();
        let body = record::checked((opcode, body), &file.path, opening)?;
        let body = body.ok_or_else(|| file.damage(at_byte, BROKEN))?;
        tidy.push(opcode);
        tidy.extend((body.len() as u64).to_le_bytes());
        tidy.extend(&*body);
    }
    tidy.extend(FOOTER_HEAD);
    tidy.extend((MAGIC.len() as u64).to_le_bytes());
    tidy.extend([0; 12]);
    tidy.extend(MAGIC);
    Ok(tidy)
}

/// Returns whether the summary describes the whole content of the file. It does not if the
/// writer omitted records or wrote messages outside of chunks, which no index lists.
fn suffices(summary: &Summary) -> bool {
    let Some(statistics) = &summary.stats else {
        return false;
    };
    let counts = statistics.channel_message_counts.values();
    let lists_messages = |chunk: &ChunkIndex| !chunk.message_index_offsets.is_empty();
    statistics.metadata_count as usize == summary.metadata_indexes.len()
        && statistics.channel_count as usize == summary.channels.len()
        && statistics.chunk_count as usize == summary.chunk_indexes.len()
        && counts.fold(0, |sum: u64, n| sum.wrapping_add(*n)) == statistics.message_count
        && (statistics.message_count == 0 || summary.chunk_indexes.iter().any(lists_messages))
}

/// Makes the index of a file from its summary.
fn index(
    mut summary: Summary,
    file: &mut LogFile,
    opening: &mut Opening<'_>,
) -> Result<McapIndex, Stop> {
    summary
        .chunk_indexes
        .sort_by_key(|chunk| chunk.chunk_start_offset);
    let chunks = &summary.chunk_indexes;
    let counts = summary.stats.take().unwrap_or_default();
    let counts = counts.channel_message_counts;
    if let Some(at_byte) = overlap(chunks) {
        return Err(file.damage(at_byte, "the chunks in the log's index overlap"));
    }
    let mut index = McapIndex {
        segments: chunks.iter().map(segment).collect(),
        ..McapIndex::default()
    };
    let mut chunks_of: BTreeMap<u16, Vec<&ChunkIndex>> = BTreeMap::new();
    for chunk in chunks {
        for &channel in chunk.message_index_offsets.keys() {
            chunks_of.entry(channel).or_default().push(chunk);
        }
    }
    // Each record is named once.
    let bytes_left = file.length;
    let mut lookup = Lookup {
        file,
        opening,
        bytes_left,
    };
    for (&id, defined) in summary.channels.iter().collect::<BTreeMap<_, _>>() {
        let mut channel = channel_of(defined);
        let (opening, path) = (&mut lookup.opening, &lookup.file.path);
        opening.keep_names(path, channel.key())?;
        opening.keep_definition(path, &channel.definition)?;
        channel.count = counts.get(&id).copied().unwrap_or(0);
        let chunks = chunks_of.remove(&id).unwrap_or_default();
        if lookup.file.costs_requests() && !is_decoded(&channel.type_name) {
            for chunk in chunks {
                channel.extend_times((chunk.message_start_time, chunk.message_end_time));
            }
        } else {
            lookup.find_times(id, &mut channel, chunks)?;
        }
        index.channels.insert(id.into(), channel);
    }
    for entry in &summary.metadata_indexes {
        let Record::Metadata(record) = lookup.record(op::METADATA, entry.offset)? else {
            return Err(lookup.broken(entry.offset));
        };
        index.metadata.insert(record.name, record.metadata);
    }
    Ok(index)
}

/// Returns a channel as the summary defines it.
fn channel_of(defined: &mcap::Channel<'_>) -> Channel {
    let schema = defined.schema.as_ref();
    let type_name = schema.map(|schema| schema.name.as_str());
    let text = schema.map(|schema| (schema.encoding.as_str(), &*schema.data));
    Channel {
        topic: defined.topic.clone(),
        type_name: type_name.unwrap_or_default().to_owned(),
        encoding: defined.message_encoding.clone(),
        definition: Definition::new(defined.metadata.clone(), text),
        ..Channel::default()
    }
}

/// Returns whether this crate decodes messages of a type, whose name may lack `/msg`.
fn is_decoded(type_name: &str) -> bool {
    let is_same = |known: &&str| *known == type_name || known.replace("/msg/", "/") == type_name;
    TYPES.iter().any(is_same)
}

/// Returns the position of the first chunk that begins before the one before it ends. Each would
/// be read as a whole.
fn overlap(chunks: &[ChunkIndex]) -> Option<u64> {
    let end = |chunk: &ChunkIndex| chunk.chunk_start_offset.saturating_add(chunk.chunk_length);
    let starts = chunks.iter().skip(1).map(|next| next.chunk_start_offset);
    let mut pairs = chunks.iter().zip(starts);
    let overlap = pairs.find(|(chunk, start)| end(chunk) > *start);
    overlap.map(|(_, start)| start)
}

fn segment(chunk: &ChunkIndex) -> (Place, Segment) {
    let place = Place {
        at_byte: chunk.chunk_start_offset,
        length: chunk.chunk_length,
        is_chunk: true,
    };
    let channels = chunk.message_index_offsets.keys();
    let segment = Segment {
        first_ns: chunk.message_start_time,
        last_ns: chunk.message_end_time,
        channels: channels.map(|&channel| channel.into()).collect(),
    };
    (place, segment)
}

/// Reads the records that an index names.
struct Lookup<'a, 'b> {
    file: &'a mut LogFile,
    opening: &'a mut Opening<'b>,
    /// Number of bytes that may still be read: a damaged index can name one long record for
    /// thousands of entries.
    bytes_left: u64,
}

impl Lookup<'_, '_> {
    /// Returns the record at a position, which must have this opcode.
    fn record(&mut self, opcode: u8, at_byte: u64) -> Result<Record<'static>, Stop> {
        self.opening.go_on()?;
        let head = self.file.record_at(at_byte)?;
        let head = head.filter(|head| head.opcode == opcode);
        let left = head.and_then(|head| self.bytes_left.checked_sub(head.length));
        let (Some(head), Some(left)) = (head, left) else {
            return Err(self.broken(at_byte));
        };
        self.bytes_left = left;
        if head.length > self.opening.longest_record() {
            return Err(self.opening.too_large(&self.file.path).into());
        }
        let body = self.file.body(head)?;
        match record::parse(head, &body, self.file, self.opening) {
            Err(Stop::Damage(_)) => Err(self.broken(at_byte)),
            parsed => parsed,
        }
    }

    /// Finds the first and the last log time of a channel in the chunks that contain it. Only
    /// chunks that can contain the first or the last one are looked up.
    fn find_times(
        &mut self,
        id: u16,
        channel: &mut Channel,
        mut chunks: Vec<&ChunkIndex>,
    ) -> Result<(), Stop> {
        chunks.sort_by_key(|chunk| chunk.message_start_time);
        // The first and the last chunk usually contain both.
        if let Some(after_first) = chunks.get_mut(1..) {
            after_first.reverse();
        }
        for chunk in chunks {
            let (start, end) = (chunk.message_start_time, chunk.message_end_time);
            let is_known = |(first, last): (u64, u64)| first <= start && end <= last;
            let at_byte = chunk.message_index_offsets.get(&id);
            let Some(&at_byte) = at_byte.filter(|_| !channel.times_ns.is_some_and(is_known)) else {
                continue;
            };
            let Record::MessageIndex(index) = self.record(op::MESSAGE_INDEX, at_byte)? else {
                return Err(self.broken(at_byte));
            };
            for entry in index.records {
                channel.extend_times((entry.log_time, entry.log_time));
            }
        }
        Ok(())
    }

    fn broken(&self, at_byte: u64) -> Stop {
        let what = "the log's index does not fit the record at this position";
        self.file.damage(at_byte, what)
    }
}
