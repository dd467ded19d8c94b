//! Opening of a file's index: from its summary, or from a scan of the whole file.

use std::collections::BTreeMap;

use mcap::records::{Record, op};

use super::{
    chunk::{CUT, Records},
    file::{LogFile, RecordHead},
    index::{McapIndex, Place, PlaceKind, keep_metadata},
    record,
    summary::{self, Summary},
};
use crate::{
    error::LogError,
    reader::{
        opening::Opening,
        source::Content,
        storage::{Channel, Entry, Segment, Stop},
        zstd_context::ZstdContext,
    },
};

/// Number of bytes of messages outside of chunks that are read at once.
const PLAIN_SEGMENT: u64 = 1 << 20;

/// Opens a file with the index in its summary. Without a complete summary the whole file is
/// read, which takes as long as reading every message.
pub(super) fn open(
    content: &dyn Content,
    opening: &mut Opening<'_>,
) -> Result<McapIndex, LogError> {
    let mut file = LogFile::open(content)?;
    let why = match summary::read(&mut file, opening)? {
        Summary::Whole(index) => return Ok(index),
        Summary::Absent => None,
        Summary::Broken(damage) => Some(damage),
    };
    let mut scan = Scan::new(opening);
    match scan.run(&mut file) {
        Ok(()) => scan.index.damage = why,
        Err(Stop::Damage(damage)) => scan.index.damage = Some(damage),
        Err(Stop::Error(error)) => return Err(error),
    }
    scan.close_plain();
    Ok(scan.index)
}

/// Scan of a file without a complete summary.
struct Scan<'a, 'b> {
    opening: &'a mut Opening<'b>,
    index: McapIndex,
    /// Names of message types by schema.
    schemas: BTreeMap<u16, String>,
    /// The range of messages outside of chunks that is being scanned.
    plain: Option<(Place, Segment)>,
    zstd: ZstdContext,
}

impl<'a, 'b> Scan<'a, 'b> {
    fn new(opening: &'a mut Opening<'b>) -> Self {
        Self {
            opening,
            index: McapIndex::default(),
            schemas: BTreeMap::new(),
            plain: None,
            zstd: ZstdContext::default(),
        }
    }

    /// Scans up to the end of the data or the first damage.
    fn run(&mut self, file: &mut LogFile) -> Result<(), Stop> {
        let mut at_byte = mcap::MAGIC.len() as u64;
        while let Some(record) = file.record_at(at_byte)? {
            self.opening.go_on()?;
            let cut = record.end() > file.length;
            match record.opcode {
                op::CHUNK => self.chunk(file, record, cut)?,
                _ if cut => {}
                op::DATA_END => return Ok(()),
                op::MESSAGE => self.message(file, record)?,
                op::SCHEMA | op::CHANNEL | op::METADATA => {
                    if record.length > self.opening.longest_record() {
                        return Err(self.opening.too_large(&file.path).into());
                    }
                    let body = file.body(record)?;
                    self.record(file, record, &body)?;
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
        let records = place.read(file, self.opening.memory, &mut self.zstd)?;
        let mut segment = Segment::default();
        let end = self.chunk_records(file, record, &records, &mut segment);
        self.opening
            .keep_segment(&file.path, segment.channels.len())?;
        self.index.segments.push((place, segment));
        end
    }

    /// Adds the records of a chunk to the index, up to the first that is damaged.
    fn chunk_records(
        &mut self,
        file: &LogFile,
        chunk: RecordHead,
        records: &Records,
        segment: &mut Segment,
    ) -> Result<(), Stop> {
        let damage = |what: &'static str| file.damage(chunk.at_byte, what);
        for record in records.iter() {
            let (opcode, body) = record.map_err(damage)?;
            match opcode {
                op::MESSAGE => {
                    let message = records.message(body).map_err(damage)?;
                    self.count(&message, segment).map_err(damage)?;
                }
                op::SCHEMA | op::CHANNEL => {
                    let head = RecordHead { opcode, ..chunk };
                    self.record(file, head, records.body(body))?;
                }
                // The format has metadata outside of chunks only.
                _ => {}
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
                self.opening.keep_segment(&file.path, 0)?;
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

    /// Adds a schema, a channel or metadata to the index. Damage is at the record, or at its chunk. Writers repeat schemas and
    /// channels in every chunk, which counts once.
    fn record(&mut self, file: &LogFile, head: RecordHead, body: &[u8]) -> Result<(), Stop> {
        let parsed = record::parse(head.opcode, body);
        let mut parsed = parsed.map_err(|what| file.damage(head.at_byte, what))?;
        match &mut parsed {
            Record::Schema { header, .. } => {
                let name = std::mem::take(&mut header.name);
                if self
                    .schemas
                    .get(&header.id)
                    .is_some_and(|known| *known != name)
                {
                    return Err(file.damage(head.at_byte, "a schema with the id of another one"));
                }
                if !self.schemas.contains_key(&header.id) {
                    self.opening.keep_names(&file.path, [name.as_str()])?;
                    self.schemas.insert(header.id, name);
                }
            }
            Record::Channel(record) => {
                let schema = self.schemas.get(&record.schema_id);
                let type_name = schema.map_or("", String::as_str);
                let key = [record.topic.as_str(), type_name, &record.message_encoding];
                let known = self.index.channels.get(&record.id.into());
                if known.is_some_and(|known| known.key() != key) {
                    return Err(file.damage(head.at_byte, "a channel with the id of another one"));
                }
                if known.is_none() {
                    self.opening.keep_names(&file.path, key)?;
                    let channel = Channel {
                        type_name: type_name.to_owned(),
                        topic: std::mem::take(&mut record.topic),
                        encoding: std::mem::take(&mut record.message_encoding),
                        ..Channel::default()
                    };
                    self.index.channels.insert(record.id.into(), channel);
                }
            }
            Record::Metadata(record) => {
                keep_metadata(record, file, self.opening)?;
                let (name, pairs) = (&mut record.name, &mut record.metadata);
                let kept = &mut self.index.metadata;
                kept.insert(std::mem::take(name), std::mem::take(pairs));
            }
            _ => {}
        }
        Ok(())
    }

    fn close_plain(&mut self) {
        self.index.segments.extend(self.plain.take());
    }
}
