//! Opening of a file's index: from its summary, or from a scan of the whole file.

use std::collections::BTreeMap;

use mcap::records::{Record, op};

use super::{
    chunk::{CUT, ChunkDecompressor, Records},
    file::{LogFile, RecordHead},
    index::{McapIndex, Place, PlaceKind},
    record,
    summary::{self, Summary},
};
use crate::{
    error::LogError,
    reader::{
        source::Content,
        storage::{Entry, MemoryBudget, Segment, Stop},
    },
};

/// Number of bytes of messages outside of chunks that are read at once.
const PLAIN_SEGMENT: u64 = 1 << 20;

/// Most bytes of names and metadata that an index keeps: a small file can decompress to any number of them.
const MAX_TEXT: usize = 64 << 20;

/// Opens a file with the index in its summary. Without a complete summary the whole file is
/// read, which takes as long as reading every message.
pub(super) fn open(content: &dyn Content, memory: MemoryBudget) -> Result<McapIndex, LogError> {
    let mut file = LogFile::open(content)?;
    let why = match summary::read(&mut file)? {
        Summary::Whole(index) => return Ok(index),
        Summary::Absent => None,
        Summary::Broken(damage) => Some(damage),
    };
    let mut scan = Scan::new(memory);
    match scan.run(&mut file) {
        Ok(()) => scan.index.damage = why,
        Err(Stop::Damage(damage)) => scan.index.damage = Some(damage),
        Err(Stop::Error(error)) => return Err(error),
    }
    scan.close_plain();
    Ok(scan.index)
}

/// Scan of a file without a complete summary.
struct Scan {
    index: McapIndex,
    /// Names of message types by schema.
    schemas: BTreeMap<u16, String>,
    /// The range of messages outside of chunks that is being scanned.
    plain: Option<(Place, Segment)>,
    decompressor: ChunkDecompressor,
    /// Number of bytes of names and metadata in the index so far.
    text_bytes: usize,
    memory: MemoryBudget,
}

impl Scan {
    fn new(memory: MemoryBudget) -> Self {
        Self {
            index: McapIndex::default(),
            schemas: BTreeMap::new(),
            plain: None,
            decompressor: ChunkDecompressor::default(),
            text_bytes: 0,
            memory,
        }
    }

    /// Scans up to the end of the data or the first damage.
    fn run(&mut self, file: &mut LogFile) -> Result<(), Stop> {
        let mut at_byte = mcap::MAGIC.len() as u64;
        while let Some(record) = file.record_at(at_byte)? {
            let cut = record.end() > file.length;
            match record.opcode {
                op::CHUNK => self.chunk(file, record, cut)?,
                _ if cut => {}
                op::DATA_END => return Ok(()),
                op::MESSAGE => self.message(file, record)?,
                op::SCHEMA | op::CHANNEL | op::METADATA => {
                    let body = file.body(record)?;
                    self.record(record.opcode, &body)
                        .map_err(|what| file.damage(at_byte, what))?;
                }
                0 => return Err(file.damage(at_byte, "no record")),
                // Indexes, attachments and records of later versions of MCAP are skipped.
                _ => {}
            }
            if cut {
                return Err(file.damage(at_byte, CUT));
            }
            at_byte = record.end();
        }
        Err(file.damage(at_byte, "the file ends before the log does"))
    }

    fn chunk(&mut self, file: &mut LogFile, record: RecordHead, cut: bool) -> Result<(), Stop> {
        self.close_plain();
        let place = Place {
            at_byte: record.at_byte,
            length: record.length,
            kind: if cut {
                PlaceKind::CutChunk
            } else {
                PlaceKind::Chunk
            },
        };
        let records = place.read(file, self.memory, &mut self.decompressor)?;
        let mut segment = Segment::default();
        let end = self.chunk_records(&records, &mut segment);
        self.index.segments.push((place, segment));
        end.map_err(|what| file.damage(record.at_byte, what))
    }

    /// Adds a chunk's records to the index, up to the first that is damaged.
    fn chunk_records(&mut self, records: &Records, segment: &mut Segment) -> Result<(), String> {
        for record in records.iter() {
            let (opcode, body) = record?;
            match opcode {
                op::MESSAGE => self.count(&records.message(body)?, segment)?,
                // The format has metadata outside of chunks only.
                op::METADATA => {}
                _ => self.record(opcode, records.body(body))?,
            }
        }
        Ok(())
    }

    /// Adds a message outside of chunks to the index.
    fn message(&mut self, file: &mut LogFile, record: RecordHead) -> Result<(), Stop> {
        let body = Records::new(file.body(record)?, false);
        let (mut place, mut segment) = match self.plain.take() {
            Some((place, segment)) if record.end() - place.at_byte <= PLAIN_SEGMENT => {
                (place, segment)
            }
            full => {
                self.index.segments.extend(full);
                let place = Place {
                    at_byte: record.at_byte,
                    length: 0,
                    kind: PlaceKind::Plain,
                };
                (place, Segment::default())
            }
        };
        let counted = body
            .message(body.all())
            .and_then(|message| self.count(&message, &mut segment));
        if counted.is_ok() {
            place.length = record.end() - place.at_byte;
        }
        self.plain = Some((place, segment));
        counted.map_err(|what| file.damage(record.at_byte, what))
    }

    fn count(&mut self, message: &Entry, segment: &mut Segment) -> Result<(), &'static str> {
        let channel = self
            .index
            .channels
            .get_mut(&message.channel)
            .ok_or("a message of an unknown channel")?;
        channel.count_message(message.log_time_ns);
        segment.add(message.channel, message.log_time_ns);
        Ok(())
    }

    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::METADATA) {
            return Ok(());
        }
        let too_much = || format!("more than {} MiB of names and metadata", MAX_TEXT >> 20);
        if body.len() > MAX_TEXT {
            return Err(too_much());
        }
        let parsed = record::parse(opcode, body)?;
        self.text_bytes += text_bytes(&parsed);
        if self.text_bytes > MAX_TEXT {
            return Err(too_much());
        }
        match parsed {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(record) => {
                let type_name = self
                    .schemas
                    .get(&record.schema_id)
                    .cloned()
                    .unwrap_or_default();
                let channel = self.index.channels.entry(record.id.into()).or_default();
                channel.topic = record.topic;
                channel.type_name = type_name;
                channel.encoding = record.message_encoding;
            }
            Record::Metadata(record) => {
                self.index.metadata.insert(record.name, record.metadata);
            }
            _ => {}
        }
        Ok(())
    }

    fn close_plain(&mut self) {
        self.index.segments.extend(self.plain.take());
    }
}

/// Returns the number of bytes of a record that an index keeps.
fn text_bytes(record: &Record<'_>) -> usize {
    match record {
        Record::Schema { header, .. } => header.name.len(),
        Record::Channel(channel) => channel.topic.len() + channel.message_encoding.len(),
        Record::Metadata(record) => {
            let pairs = record.metadata.iter();
            record.name.len()
                + pairs
                    .map(|(key, value)| key.len() + value.len())
                    .sum::<usize>()
        }
        _ => 0,
    }
}
