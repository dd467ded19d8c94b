//! Opening of a file's index: from its summary, or from a scan of the whole file.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use mcap::records::{Record, op};

use super::{
    chunk::{MessageHead, Records},
    file::{LogFile, RecordHead, Stop},
    index::{FileIndex, Metadata, Segment, SegmentKind},
    summary::{self, Summary},
};
use crate::error::LogError;

/// Number of bytes of messages outside of chunks that are read at once.
const PLAIN_SEGMENT: u64 = 1 << 20;

/// Opens a file with the index in its summary. Without a complete summary the whole file is
/// read, which takes as long as reading every message.
pub(super) fn open(path: &Path) -> Result<FileIndex, LogError> {
    let mut file = LogFile::open(path)?;
    let why = match summary::read(&mut file)? {
        Summary::Whole(index) => return Ok(index),
        Summary::Absent => None,
        Summary::Broken(damage) => Some(damage),
    };
    let mut scan = Scan::new(path);
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
    index: FileIndex,
    /// Names of message types by schema.
    schemas: BTreeMap<u16, String>,
    /// The range of messages outside of chunks that is being scanned.
    plain: Option<Segment>,
}

impl Scan {
    fn new(path: &Path) -> Self {
        let index = FileIndex {
            path: path.to_owned(),
            segments: Vec::new(),
            channels: BTreeMap::new(),
            metadata: Metadata::new(),
            damage: None,
        };
        Self {
            index,
            schemas: BTreeMap::new(),
            plain: None,
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
                return Err(file.damage(at_byte, "the file ends within a record"));
            }
            at_byte = record.end();
        }
        Err(file.damage(at_byte, "the file ends before the log does"))
    }

    fn chunk(&mut self, file: &mut LogFile, record: RecordHead, cut: bool) -> Result<(), Stop> {
        self.close_plain();
        let mut segment = Segment {
            at_byte: record.at_byte,
            length: record.length,
            kind: if cut {
                SegmentKind::CutChunk
            } else {
                SegmentKind::Chunk
            },
            first_ns: u64::MAX,
            channels: BTreeSet::new(),
        };
        let records = segment.read(file)?;
        let end = self.chunk_records(&records, &mut segment);
        self.index.segments.push(segment);
        end.map_err(|what| file.damage(record.at_byte, what))
    }

    /// Adds a chunk's records to the index, up to the first that is damaged.
    fn chunk_records(&mut self, records: &Records, segment: &mut Segment) -> Result<(), String> {
        for record in records.iter() {
            let (opcode, body) = record?;
            let body = records.body(body);
            if opcode == op::MESSAGE {
                self.count(body, segment)?;
            } else {
                self.record(opcode, body)?;
            }
        }
        Ok(())
    }

    /// Adds a message outside of chunks to the index.
    fn message(&mut self, file: &mut LogFile, record: RecordHead) -> Result<(), Stop> {
        let body = file.body(record)?;
        let mut segment = match self.plain.take() {
            Some(plain) if record.end() - plain.at_byte <= PLAIN_SEGMENT => plain,
            full => {
                self.index.segments.extend(full);
                Segment {
                    at_byte: record.at_byte,
                    length: 0,
                    kind: SegmentKind::Plain,
                    first_ns: u64::MAX,
                    channels: BTreeSet::new(),
                }
            }
        };
        let counted = self.count(&body, &mut segment);
        if counted.is_ok() {
            segment.length = record.end() - segment.at_byte;
        }
        self.plain = Some(segment);
        counted.map_err(|what| file.damage(record.at_byte, what))
    }

    fn count(&mut self, body: &[u8], segment: &mut Segment) -> Result<(), &'static str> {
        let head = MessageHead::parse(body).ok_or("a message without its header")?;
        let channel = self
            .index
            .channels
            .get_mut(&head.channel)
            .ok_or("a message of an unknown channel")?;
        channel.count_message(head.log_time_ns);
        segment.first_ns = segment.first_ns.min(head.log_time_ns);
        segment.channels.insert(head.channel);
        Ok(())
    }

    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::METADATA) {
            return Ok(());
        }
        match mcap::parse_record(opcode, body).map_err(|error| error.to_string())? {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(record) => {
                let type_name = self
                    .schemas
                    .get(&record.schema_id)
                    .cloned()
                    .unwrap_or_default();
                let channel = self.index.channels.entry(record.id).or_default();
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
