//! Index of an MCAP file.

use std::collections::BTreeMap;

use mcap::records::op;

use super::{
    chunk::{ChunkHeader, Records},
    file::LogFile,
};
use crate::reader::{
    storage::{Channel, ChannelId, Damage, MemoryBudget, Metadata, Segment, Stop},
    zstd_context::ZstdContext,
};

/// Content of a file.
#[derive(Debug, Default)]
pub(super) struct McapIndex {
    /// In the order of the file.
    pub(super) segments: Vec<(Place, Segment)>,
    pub(super) channels: BTreeMap<ChannelId, Channel>,
    pub(super) metadata: Metadata,
    pub(super) damage: Option<Damage>,
}

/// A contiguous range of a file that is read at once: a chunk, or records outside of chunks.
#[derive(Debug)]
pub(super) struct Place {
    pub(super) at_byte: u64,
    /// Number of bytes, at least the length of the record's body.
    pub(super) length: u64,
    pub(super) is_chunk: bool,
}

impl Place {
    /// Reads the records and decompresses them.
    pub(super) fn read(
        &self,
        file: &mut LogFile,
        budget: MemoryBudget,
        zstd: &mut ZstdContext,
    ) -> Result<Records, Stop> {
        if self.length > budget.remaining {
            return Err(budget.exceeded_error(&file.path));
        }
        if !self.is_chunk {
            return Ok(Records::new(file.read(self.at_byte, self.length)?));
        }
        let record = file.record_at(self.at_byte)?;
        let Some(record) = record.filter(|record| record.opcode == op::CHUNK) else {
            return Err(file.damage(self.at_byte, "no chunk at the position in the index"));
        };
        if record.length > self.length {
            return Err(file.damage(self.at_byte, "a chunk that is longer than in the index"));
        }
        let body = file.body(record)?;
        let header = ChunkHeader::parse(&body, record.end() > file.length);
        let header = header.map_err(|what| file.damage(self.at_byte, what))?;
        if header.memory(body.len()) > budget.remaining {
            return Err(budget.exceeded_error(&file.path));
        }
        let records = header.decompress(body, zstd);
        records.map_err(|what| file.damage(self.at_byte, what))
    }
}
