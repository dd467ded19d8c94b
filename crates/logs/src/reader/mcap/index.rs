//! Index of an MCAP file.

use std::collections::BTreeMap;

use mcap::records::op;

use super::{
    chunk::{ChunkDecompressor, ChunkFault, Records},
    file::LogFile,
};
use crate::reader::storage::{Channel, ChannelId, Damage, MemoryBudget, Metadata, Segment, Stop};

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
    pub(super) length: u64,
    pub(super) kind: PlaceKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlaceKind {
    Chunk,
    /// A chunk that the end of the file cuts off.
    CutChunk,
    Plain,
}

impl Place {
    /// Reads the records and decompresses them.
    pub(super) fn read(
        &self,
        file: &mut LogFile,
        budget: MemoryBudget,
        decompressor: &mut ChunkDecompressor,
    ) -> Result<Records, Stop> {
        if self.length > budget.remaining {
            return Err(budget.exceeded(&file.path));
        }
        if self.kind == PlaceKind::Plain {
            return Ok(Records::new(file.read(self.at_byte, self.length)?, false));
        }
        match file.record_at(self.at_byte)? {
            Some(record) if record.opcode == op::CHUNK => {
                let cut = self.kind == PlaceKind::CutChunk;
                let body = file.body(record)?;
                let records = Records::of_chunk(body, cut, budget, decompressor);
                records.map_err(|fault| match fault {
                    ChunkFault::Damage(what) => file.damage(self.at_byte, what),
                    ChunkFault::TooLarge => budget.exceeded(&file.path),
                })
            }
            _ => Err(file.damage(self.at_byte, "no chunk at the position in the index")),
        }
    }
}
