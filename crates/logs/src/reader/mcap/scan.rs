//! Opening of a file's index: from its summary, or from a scan of the whole file.

use std::collections::BTreeMap;

use mcap::records::{Record, op};

use super::{
    chunk::{CUT, message},
    file::{LogFile, RecordHead},
    index::{McapIndex, Place},
    record, summary,
};
use crate::{
    error::LogError,
    reader::{
        opening::Opening,
        source::Content,
        storage::{Channel, Definition, Entry, Segment, Stop},
        zstd_context::ZstdContext,
    },
};

/// Number of bytes of messages outside of chunks that are read at once.
const PLAIN_SEGMENT: u64 = 1 << 20;

/// What is wrong with a message before the definition of its channel.
pub(super) const UNKNOWN_CHANNEL: &str = "a message of an unknown channel";

/// Opens a file with the index in its summary. Without a complete summary the whole file is
/// read, which takes as long as reading every message.
pub(super) fn open(
    content: &dyn Content,
    opening: &mut Opening<'_>,
) -> Result<McapIndex, LogError> {
    let mut file = LogFile::open(content)?;
    let why = match summary::read(&mut file, opening) {
        Ok(Some(index)) => return Ok(index),
        Ok(None) => None,
        Err(Stop::Damage(damage)) => Some(damage),
        Err(Stop::Error(error)) => return Err(error),
    };
    let mut scan = Scan {
        opening,
        index: McapIndex::default(),
        schemas: BTreeMap::new(),
        plain: None,
        zstd: ZstdContext::default(),
    };
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
    /// Name, encoding and definition of message types by schema.
    schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    /// The range of messages outside of chunks that is being scanned.
    plain: Option<(Place, Segment)>,
    zstd: ZstdContext,
}

impl Scan<'_, '_> {
    /// Scans up to the end of the data or the first damage.
    fn run(&mut self, file: &mut LogFile) -> Result<(), Stop> {
        let mut at_byte = mcap::MAGIC.len() as u64;
        while let Some(record) = file.record_at(at_byte)? {
            self.opening.go_on()?;
            let cut = record.end() > file.length;
            match record.opcode {
                op::CHUNK => self.chunk(file, record)?,
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

    /// Adds a chunk to the index, with its records up to the first that is damaged.
    fn chunk(&mut self, file: &mut LogFile, chunk: RecordHead) -> Result<(), Stop> {
        self.close_plain();
        let place = Place {
            at_byte: chunk.at_byte,
            length: chunk.length,
            is_chunk: true,
        };
        let records = place.read(file, self.opening.memory, &mut self.zstd)?;
        let mut segment = Segment::default();
        let damage = |what: &str| file.damage(chunk.at_byte, what);
        let end = records.iter().try_for_each(|record| {
            let (opcode, body) = record.map_err(damage)?;
            match opcode {
                op::MESSAGE => message(&records.bytes, body)
                    .and_then(|message| self.count(&message, &mut segment))
                    .map_err(damage),
                op::SCHEMA | op::CHANNEL => {
                    let head = RecordHead { opcode, ..chunk };
                    let body = records.bytes.get(body).unwrap_or_default();
                    self.record(file, head, body)
                }
                // The format has metadata outside of chunks only.
                _ => Ok(()),
            }
        });
        self.opening
            .keep_segment(&file.path, segment.channels.len())?;
        self.index.segments.push((place, segment));
        end
    }

    /// Adds a message outside of chunks to the index.
    fn message(&mut self, file: &mut LogFile, record: RecordHead) -> Result<(), Stop> {
        let body = file.body(record)?;
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
                    is_chunk: false,
                };
                (place, Segment::default())
            }
        };
        let message = message(&body, 0..body.len());
        let counted = message.and_then(|message| self.count(&message, &mut segment));
        if counted.is_ok() {
            place.length = record.end() - place.at_byte;
        }
        self.plain = Some((place, segment));
        counted.map_err(|what| file.damage(record.at_byte, what))
    }

    fn count(&mut self, message: &Entry, segment: &mut Segment) -> Result<(), &'static str> {
        let channel = self.index.channels.get_mut(&message.channel);
        let channel = channel.ok_or(UNKNOWN_CHANNEL)?;
        channel.count_message(message.log_time_ns);
        segment.add(message.channel, message.log_time_ns);
        Ok(())
    }

    /// Adds a schema, a channel or metadata to the index. Damage is at the record, or at its
    /// chunk. Writers repeat schemas and channels in every chunk, which counts once.
    fn record(&mut self, file: &LogFile, head: RecordHead, body: &[u8]) -> Result<(), Stop> {
        let redefined = |what: &str| {
            let what = format!("a {what} with the id of another one");
            Err(file.damage(head.at_byte, what))
        };
        match record::parse(head, body, file, self.opening)? {
            Record::Schema { header, data } => match self.schemas.get(&header.id) {
                Some((known, ..)) if *known != header.name => return redefined("schema"),
                Some(_) => {}
                None => {
                    let name = [header.name.as_str()];
                    self.opening.keep_names(&file.path, name)?;
                    let schema = (header.name, header.encoding, data.into_owned());
                    self.schemas.insert(header.id, schema);
                }
            },
            Record::Channel(record) => {
                let schema = self.schemas.get(&record.schema_id);
                let text = schema.map(|(_, encoding, text)| (encoding.as_str(), text.as_slice()));
                let channel = Channel {
                    type_name: schema.map_or(String::new(), |(name, ..)| name.clone()),
                    definition: Definition::new(record.metadata, text),
                    topic: record.topic,
                    encoding: record.message_encoding,
                    ..Channel::default()
                };
                match self.index.channels.get(&record.id.into()) {
                    Some(known) if known.key() != channel.key() => return redefined("channel"),
                    Some(_) => {}
                    None => {
                        let definition = &channel.definition;
                        self.opening.keep_names(&file.path, channel.key())?;
                        self.opening.keep_definition(&file.path, definition)?;
                        self.index.channels.insert(record.id.into(), channel);
                    }
                }
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
