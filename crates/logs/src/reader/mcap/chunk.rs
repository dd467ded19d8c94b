//! Records of a chunk, decompressed and checked.

use std::{io::Read, ops::Range};

use mcap::records::op;

use super::file::RECORD_HEADER;
use crate::reader::{
    storage::{Entry, MAX_RECORD, MemoryBudget},
    zstd_context::{MOST_WINDOW, ZstdContext},
};

/// Size of a message's channel, sequence, log time and publish time, bytes.
const MESSAGE_HEADER: usize = 22;

/// Largest usual size of a chunk, bytes. It limits the memory that is reserved before the data is
/// known.
const USUAL_CHUNK: u64 = 8 << 20;

/// What is wrong with a chunk whose compressed data are damaged.
const UNREADABLE: &str = "a chunk that cannot be decompressed";

/// What is wrong with a file that ends within a record, be it in a chunk or not.
pub(super) const CUT: &str = "the file ends within a record";

/// Uncompressed records, one after the other.
pub(super) struct Records {
    bytes: Vec<u8>,
    start: usize,
    /// Whether the end of the file cuts them off.
    cut: bool,
}

/// Reason why a chunk is not read.
pub(super) enum ChunkFault {
    /// It is damaged: the description of the fault.
    Damage(String),
    /// It needs more memory than is left.
    TooLarge,
}

impl<S: Into<String>> From<S> for ChunkFault {
    fn from(what: S) -> Self {
        Self::Damage(what.into())
    }
}

/// Header of a chunk and the position of its data.
struct ChunkHeader<'a> {
    uncompressed_size: u64,
    uncompressed_crc: u32,
    compression: &'a [u8],
    compressed_size: u64,
    data: usize,
}

impl Records {
    /// Wraps records from the beginning of some bytes. `cut` says whether the end of the file cuts them off.
    pub(super) fn new(bytes: Vec<u8>, cut: bool) -> Self {
        Self {
            bytes,
            start: 0,
            cut,
        }
    }

    /// Returns the records of a chunk. A chunk that the end of the file cuts off has the records up
    /// to there.
    pub(super) fn of_chunk(
        body: Vec<u8>,
        cut: bool,
        budget: MemoryBudget,
        zstd: &mut ZstdContext,
    ) -> Result<Self, ChunkFault> {
        let header = ChunkHeader::parse(&body);
        let header = header.ok_or(if cut {
            CUT
        } else {
            "a chunk without its header"
        })?;
        if header.uncompressed_size > MAX_RECORD && !cut {
            return Err("a chunk of impossible size".into());
        }
        // A chunk that is not compressed is not copied.
        let packed = if header.compression.is_empty() {
            0
        } else {
            body.len() as u64
        };
        // Only a chunk that is cut off is decompressed as a stream.
        let window = if cut && header.compression == b"zstd" {
            header.uncompressed_size.min(MOST_WINDOW)
        } else {
            0
        };
        if packed + window + header.uncompressed_size.min(MAX_RECORD) > budget.remaining {
            return Err(ChunkFault::TooLarge);
        }
        let (size, crc) = (header.uncompressed_size, header.uncompressed_crc);
        let compressed_size = usize::try_from(header.compressed_size).unwrap_or(usize::MAX);
        let end = header.data.saturating_add(compressed_size);
        if end > body.len() && !cut {
            return Err("a chunk that is shorter than the size in its header".into());
        }
        let end = end.min(body.len());
        let data = body.get(header.data..end).unwrap_or_default();
        let records = match header.compression {
            b"" => {
                let start = header.data;
                let mut bytes = body;
                // Bytes after the records would stay in memory.
                bytes.truncate(end);
                bytes.shrink_to_fit();
                Self { bytes, start, cut }
            }
            b"zstd" => Self::new(decompress_zstd(zstd, data, size, cut)?, cut),
            b"lz4" => {
                let decoder = lz4::Decoder::new(data);
                let decoder = decoder.map_err(|error| error.to_string())?;
                Self::new(decompress(decoder, size, cut)?, cut)
            }
            other => {
                let name = String::from_utf8_lossy(other);
                return Err(format!("a chunk compressed as {name:?}, not as zstd or lz4").into());
            }
        };
        Ok(records.verified(size, crc, cut)?)
    }

    /// Checks size and checksum. A chunk that is cut off cannot have the right ones.
    fn verified(self, size: u64, crc: u32, cut: bool) -> Result<Self, String> {
        let bytes = self.bytes.get(self.start..).unwrap_or_default();
        if bytes.len() as u64 != size {
            return if cut {
                Ok(self)
            } else {
                Err(format!(
                    "a chunk of {} bytes that should have {size}",
                    bytes.len()
                ))
            };
        }
        // Zero means that the writer has calculated no checksum.
        if crc != 0 && crc32fast::hash(bytes) != crc {
            return Err("a chunk whose checksum is wrong".to_owned());
        }
        Ok(self)
    }

    /// Iterates over the records: opcode and range of the body. The last item may be an error.
    pub(super) fn iter(&self) -> impl Iterator<Item = Result<(u8, Range<usize>), &'static str>> {
        let mut next = self.start;
        std::iter::from_fn(move || {
            let rest = self.bytes.get(next..).filter(|rest| !rest.is_empty())?;
            let Some(body) = body_range(rest, next) else {
                next = self.bytes.len();
                return Some(Err(if self.cut {
                    CUT
                } else {
                    "a record that goes beyond its chunk"
                }));
            };
            next = body.end;
            Some(Ok((rest[0], body)))
        })
    }

    /// Returns the bytes of a body from [`iter`](Self::iter).
    pub(super) fn body(&self, range: Range<usize>) -> &[u8] {
        self.bytes.get(range).unwrap_or_default()
    }

    /// Returns the range of all bytes.
    pub(super) fn all(&self) -> Range<usize> {
        self.start..self.bytes.len()
    }

    /// Returns how many bytes are in memory.
    pub(super) fn byte_count(&self) -> usize {
        self.bytes.len()
    }

    /// Returns the bytes to which the ranges of bodies and messages refer.
    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Iterates over the messages. The last item may be an error.
    pub(super) fn messages(&self) -> impl Iterator<Item = Result<Entry, &'static str>> {
        self.iter().filter_map(|record| match record {
            Ok((op::MESSAGE, body)) => Some(self.message(body)),
            Ok(_) => None,
            Err(what) => Some(Err(what)),
        })
    }

    /// Returns the message in the body of a record.
    pub(super) fn message(&self, body: Range<usize>) -> Result<Entry, &'static str> {
        let mut fields = Fields(self.body(body.clone()));
        fields.message(body).ok_or("a message without its header")
    }
}

impl<'a> ChunkHeader<'a> {
    fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        let _times = (fields.u64()?, fields.u64()?);
        let uncompressed_size = fields.u64()?;
        let uncompressed_crc = fields.u32()?;
        let length = fields.u32()? as usize;
        let compression = fields.bytes(length)?;
        let compressed_size = fields.u64()?;
        let data = body.len() - fields.0.len();
        Some(Self {
            uncompressed_size,
            uncompressed_crc,
            compression,
            compressed_size,
            data,
        })
    }
}

/// Reader of little-endian fields from the front of a slice.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(head)
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.bytes(N)?.try_into().ok()
    }

    /// Reads the header of a message whose record has this body.
    fn message(&mut self, body: Range<usize>) -> Option<Entry> {
        Some(Entry {
            channel: u16::from_le_bytes(self.take()?).into(),
            sequence: self.u32()?,
            log_time_ns: self.u64()?,
            publish_time_ns: self.u64()?,
            data: body.start + MESSAGE_HEADER..body.end,
        })
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }
}

/// Returns the range of the body of the record at the front of `rest`, which starts at `offset`.
fn body_range(rest: &[u8], offset: usize) -> Option<Range<usize>> {
    let length = rest.get(1..RECORD_HEADER as usize)?.try_into().ok()?;
    let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
    let start = offset + RECORD_HEADER as usize;
    let end = start.checked_add(length)?;
    (end <= offset + rest.len()).then_some(start..end)
}

/// Decompresses `size` bytes of zstd, or as many as there are in data that is cut off.
fn decompress_zstd(
    zstd: &mut ZstdContext,
    data: &[u8],
    size: u64,
    cut: bool,
) -> Result<Vec<u8>, String> {
    if cut {
        return decompress(zstd.stream(data), size, cut);
    }
    // Memory that is not written to is not occupied, so that a damaged size costs none.
    let mut bytes = Vec::with_capacity(size as usize);
    match zstd.fill(&mut bytes, data) {
        Ok(()) => Ok(bytes),
        Err(error) => Err(format!("{UNREADABLE}: {error}")),
    }
}

/// Decompresses `size` bytes, or as many as there are in data that is cut off.
fn decompress(decoder: impl Read, size: u64, cut: bool) -> Result<Vec<u8>, String> {
    let size = size.min(MAX_RECORD);
    // The buffer grows with the output, so that a damaged size costs no memory. One byte more than
    // expected reveals excess data.
    let mut bytes = Vec::with_capacity(size.min(USUAL_CHUNK) as usize + 1);
    match decoder.take(size + 1).read_to_end(&mut bytes) {
        Err(error) if !cut => Err(format!("{UNREADABLE}: {error}")),
        _ => Ok(bytes),
    }
}
