//! Index of an MCAP file.

use std::collections::BTreeMap;

use mcap::records::{Metadata as MetadataRecord, op};

use super::{
    chunk::{ChunkFault, Records},
    file::LogFile,
};
use crate::error::LogError;
use crate::reader::{
    opening::Opening,
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
    /// Number of bytes, at least those of the record's body.
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
        zstd: &mut ZstdContext,
    ) -> Result<Records, Stop> {
        if self.length > budget.remaining {
            return Err(budget.exceeded_error(&file.path));
        }
        if self.kind == PlaceKind::Plain {
            return Ok(Records::new(file.read(self.at_byte, self.length)?, false));
        }
        match file.record_at(self.at_byte)? {
            Some(record) if record.opcode == op::CHUNK => {
                let cut = self.kind == PlaceKind::CutChunk;
                if record.length > self.length {
                    return Err(
                        file.damage(self.at_byte, "a chunk that is longer than in the index")
                    );
                }
                let body = file.body(record)?;
                let records = Records::of_chunk(body, cut, budget, zstd);
                records.map_err(|fault| match fault {
                    ChunkFault::Damage(what) => file.damage(self.at_byte, what),
                    ChunkFault::TooLarge => budget.exceeded_error(&file.path),
                })
            }
            _ => Err(file.damage(self.at_byte, "no chunk at the position in the index")),
        }
    }
}

/// Counts the texts of a record of metadata among what the index keeps.
pub(super) fn keep_metadata(
    record: &MetadataRecord,
    file: &LogFile,
    opening: &mut Opening<'_>,
) -> Result<(), LogError> {
    let pairs = record.metadata.iter();
    let texts = pairs.flat_map(|(key, value)| [key.as_str(), value]);
    opening.keep_each(&file.path, texts.chain([record.name.as_str()]))
}
