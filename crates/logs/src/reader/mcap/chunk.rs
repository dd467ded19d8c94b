//! Records of a chunk, decompressed and checked.
//!
//! The messages of a chunk stay where it is decompressed to, and are read from there in the order
//! of their times. `mcap::sans_io` cannot do that: `LinearReader` and `IndexedReader` lend each
//! record from a buffer of their own, so that a copy takes memory of the same size again.
//! `IndexedReader` also keeps as many chunks as an index claims to overlap, and checks no checksum;
//! `LinearReader` computes with a length below zero after a record that goes beyond its chunk.

use std::{io::Read, ops::Range};

use mcap::records::op;

use super::file::RECORD_HEADER;
use crate::reader::{
    storage::{Entry, MAX_RECORD},
    zstd_context::{MOST_WINDOW, ZstdContext},
};

/// Size of a message's channel, sequence, log time and publish time, bytes.
const MESSAGE_HEADER: usize = 22;

/// Largest usual size of a chunk, bytes. It limits the memory that is reserved before the data is
/// known.
const USUAL_CHUNK: u64 = 8 << 20;

/// What is wrong with a file that ends within a record, be it in a chunk or not.
pub(super) const CUT: &str = "the file ends within a record";

/// Uncompressed records, one after the other.
pub(super) struct Records {
    /// The bytes to which the ranges of bodies and messages refer.
    pub(super) bytes: Vec<u8>,
    start: usize,
    /// Whether the end of the file cuts them off, which is an error after the last one.
    is_cut: bool,
}

/// Header of a chunk and the range of its data.
pub(super) struct ChunkHeader {
    uncompressed_size: u64,
    uncompressed_crc: u32,
    compression: Vec<u8>,
    data: Range<usize>,
    /// Whether the end of the file cuts the chunk off, which then has the records up to there.
    is_cut: bool,
}

impl ChunkHeader {
    /// Parses the header in the body of a chunk, of which a part may be missing if it is cut off.
    pub(super) fn parse(body: &[u8], is_cut: bool) -> Result<Self, &'static str> {
        let (header, size) = Self::fields(body, is_cut).ok_or(if is_cut {
            CUT
        } else {
            "a chunk without its header"
        })?;
        if !is_cut && header.uncompressed_size > MAX_RECORD {
            return Err("a chunk of impossible size");
        }
        let available = header.data.len() as u64;
        if !is_cut && size > available {
            return Err("a chunk that is shorter than the size in its header");
        }
        let end = header.data.start + size.min(available) as usize;
        let data = header.data.start..end;
        Ok(Self { data, ..header })
    }

    /// Returns the header, as if all that follows were its data, and the size of the data.
    fn fields(body: &[u8], is_cut: bool) -> Option<(Self, u64)> {
        let length = u32::from_le_bytes(field(body, 28)?) as usize;
        let compression = body.get(32..)?.get(..length)?.to_vec();
        let header = Self {
            uncompressed_size: u64::from_le_bytes(field(body, 16)?),
            uncompressed_crc: u32::from_le_bytes(field(body, 24)?),
            compression,
            data: 40 + length..body.len(),
            is_cut,
        };
        Some((header, u64::from_le_bytes(field(body, 32 + length)?)))
    }

    /// Returns the memory of the chunk while it is decompressed, beside a body of this length,
    /// bytes.
    pub(super) fn memory(&self, body_length: usize) -> u64 {
        let uncompressed = self.uncompressed_size.min(MAX_RECORD);
        match self.compression.as_slice() {
            // A chunk that is not compressed is not copied.
            b"" => uncompressed,
            // Only a chunk that is cut off is decompressed as a stream.
            b"zstd" if self.is_cut => {
                body_length as u64 + uncompressed + self.uncompressed_size.min(MOST_WINDOW)
            }
            _ => body_length as u64 + uncompressed,
        }
    }

    /// Returns the records of the chunk with this body.
    pub(super) fn decompress(
        &self,
        mut body: Vec<u8>,
        zstd: &mut ZstdContext,
    ) -> Result<Records, String> {
        let data = body.get(self.data.clone()).unwrap_or_default();
        let mut start = 0;
        let bytes = match self.compression.as_slice() {
            b"" => {
                start = self.data.start;
                // Bytes after the records would stay in memory.
                body.truncate(self.data.end);
                body.shrink_to_fit();
                Ok(body)
            }
            b"zstd" if self.is_cut => self.stream(zstd.stream(data)),
            b"zstd" => {
                // Memory that is not written to is not occupied, so that a damaged size costs none.
                let mut bytes = Vec::with_capacity(self.uncompressed_size as usize);
                let filled = zstd.fill(&mut bytes, data);
                filled.map(|()| bytes).map_err(str::to_owned)
            }
            b"lz4" => {
                let decoder = lz4::Decoder::new(data).map_err(|error| error.to_string())?;
                self.stream(decoder)
            }
            other => {
                let name = String::from_utf8_lossy(other);
                return Err(format!(
                    "a chunk compressed as {name:?}, not as zstd or lz4"
                ));
            }
        };
        let bytes = bytes.map_err(|why| format!("a chunk that cannot be decompressed: {why}"))?;
        self.verified(bytes, start)
    }

    /// Decompresses as many bytes as the header claims, or as there are in data that is cut off.
    fn stream(&self, decoder: impl Read) -> Result<Vec<u8>, String> {
        let size = self.uncompressed_size.min(MAX_RECORD);
        // The buffer grows with the output, so that a damaged size costs no memory. One byte more
        // than expected reveals excess data.
        let mut bytes = Vec::with_capacity(size.min(USUAL_CHUNK) as usize + 1);
        match decoder.take(size + 1).read_to_end(&mut bytes) {
            Err(error) if !self.is_cut => Err(error.to_string()),
            _ => Ok(bytes),
        }
    }

    /// Returns the records from an offset on, with the right size and checksum, unless the end of
    /// the file cuts them off.
    fn verified(&self, bytes: Vec<u8>, start: usize) -> Result<Records, String> {
        let records = bytes.get(start..).unwrap_or_default();
        let (given, size) = (records.len() as u64, self.uncompressed_size);
        if given != size && !self.is_cut {
            return Err(format!("a chunk of {given} bytes that should have {size}"));
        }
        // Zero means that the writer has calculated no checksum.
        let crc = self.uncompressed_crc;
        if given == size && crc != 0 && crc32fast::hash(records) != crc {
            return Err("a chunk whose checksum is wrong".to_owned());
        }
        Ok(Records {
            bytes,
            start,
            is_cut: given != size,
        })
    }
}

impl Records {
    /// Wraps whole records from the beginning of some bytes.
    pub(super) fn new(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            start: 0,
            is_cut: false,
        }
    }

    /// Iterates over the records: opcode and range of the body. The last item may be an error.
    pub(super) fn iter(&self) -> impl Iterator<Item = Result<(u8, Range<usize>), &'static str>> {
        let mut next = Some(self.start);
        std::iter::from_fn(move || {
            let start = next.take()?;
            if start == self.bytes.len() {
                return self.is_cut.then_some(Err(CUT));
            }
            let record = self.record(start);
            next = record.as_ref().map(|(_, body)| body.end);
            Some(record.ok_or(if self.is_cut {
                CUT
            } else {
                "a record that goes beyond its chunk"
            }))
        })
    }

    /// Returns the opcode and the range of the body of the record at an offset.
    fn record(&self, start: usize) -> Option<(u8, Range<usize>)> {
        let &[opcode] = self.bytes.get(start..)?.first_chunk()?;
        let length = u64::from_le_bytes(field(&self.bytes, start + 1)?);
        let start = start + RECORD_HEADER as usize;
        let body = start..start.checked_add(usize::try_from(length).ok()?)?;
        self.bytes.get(body.clone()).map(|_| (opcode, body))
    }

    /// Iterates over the messages. The last item may be an error.
    pub(super) fn messages(&self) -> impl Iterator<Item = Result<Entry, &'static str>> {
        self.iter().filter_map(|record| match record {
            Ok((op::MESSAGE, body)) => Some(message(&self.bytes, body)),
            Ok(_) => None,
            Err(what) => Some(Err(what)),
        })
    }
}

/// Returns the message of the record that has a range of some bytes as its body.
pub(super) fn message(bytes: &[u8], body: Range<usize>) -> Result<Entry, &'static str> {
    let parse = || {
        let header = bytes.get(body.clone())?;
        Some(Entry {
            channel: u16::from_le_bytes(field(header, 0)?).into(),
            sequence: u32::from_le_bytes(field(header, 2)?),
            log_time_ns: u64::from_le_bytes(field(header, 6)?),
            publish_time_ns: u64::from_le_bytes(field(header, 14)?),
            data: body.start + MESSAGE_HEADER..body.end,
        })
    };
    parse().ok_or("a message without its header")
}

/// Returns the field at an offset.
fn field<const N: usize>(bytes: &[u8], start: usize) -> Option<[u8; N]> {
    bytes.get(start..)?.first_chunk().copied()
}
