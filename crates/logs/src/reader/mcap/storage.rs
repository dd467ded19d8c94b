//! Reading of the messages of an indexed MCAP file.

use std::{collections::BTreeSet, sync::Arc};

use super::{file::LogFile, index::Place, scan};
use crate::{
    error::LogError,
    reader::{
        opening::Opening,
        source::Content,
        storage::{
            Block, ChannelId, Entry, FileIndex, MemoryBudget, Segment, SegmentReader, Selected,
            Stop, Storage,
        },
        zstd_context::ZstdContext,
    },
};

/// Returns the index of a file.
pub(in crate::reader) fn index(
    content: impl Content + 'static,
    opening: &mut Opening<'_>,
) -> Result<FileIndex, LogError> {
    let index = scan::open(&content, opening)?;
    let (places, segments): (Vec<Place>, Vec<Segment>) = index.segments.into_iter().unzip();
    // Damage of a compressed file is the reason for the damage of its content.
    let damage = content.damage().cloned().or(index.damage);
    Ok(FileIndex {
        path: content.path().to_owned(),
        segments,
        metadata: index.metadata,
        damage,
        storage: Box::new(McapStorage {
            content: Box::new(content),
            places: places.into(),
            known: Arc::new(index.channels.keys().copied().collect()),
        }),
        channels: index.channels,
    })
}

#[derive(Debug)]
struct McapStorage {
    content: Box<dyn Content>,
    places: Arc<[Place]>,
    known: Arc<BTreeSet<ChannelId>>,
}

impl Storage for McapStorage {
    fn open(&self) -> Result<Box<dyn SegmentReader>, LogError> {
        Ok(Box::new(McapReader {
            file: LogFile::open(self.content.as_ref())?,
            zstd: ZstdContext::default(),
            places: self.places.clone(),
            known: self.known.clone(),
        }))
    }
}

#[derive(Debug)]
struct McapReader {
    file: LogFile,
    zstd: ZstdContext,
    places: Arc<[Place]>,
    /// All channels of the file, selected or not.
    known: Arc<BTreeSet<ChannelId>>,
}

impl SegmentReader for McapReader {
    fn announce(&mut self, segments: &[usize]) {
        let places = segments.iter().filter_map(|&s| self.places.get(s));
        let ranges = places.map(|place| place.at_byte..place.at_byte.saturating_add(place.length));
        self.file.announce(&ranges.collect::<Vec<_>>());
    }

    fn read(
        &mut self,
        segment: usize,
        selected: &Selected,
        budget: MemoryBudget,
    ) -> Result<Block, Stop> {
        let Some(place) = self.places.get(segment) else {
            return Ok(Block::default());
        };
        let records = place.read(&mut self.file, budget, &mut self.zstd)?;
        // The shortest messages need more memory for their headers than for themselves.
        let left = (budget.remaining as usize).saturating_sub(records.bytes.len());
        let most = left / size_of::<Entry>();
        // A vector that grows would occupy three times its content while it moves.
        let mut entries = Vec::with_capacity(records.messages().count().min(most));
        let mut fault = None;
        for entry in records.messages() {
            match entry {
                Ok(entry) if selected.contains_key(&entry.channel) => {
                    if entries.len() == most {
                        return Err(budget.exceeded_error(&self.file.path));
                    }
                    entries.push(entry);
                }
                Ok(entry) if self.known.contains(&entry.channel) => {}
                Ok(_) => fault = Some(scan::UNKNOWN_CHANNEL),
                Err(what) => fault = Some(what),
            }
            if fault.is_some() {
                break;
            }
        }
        Ok(Block {
            bytes: records.bytes,
            entries,
            damage: fault.map(|what| self.file.damage_at(place.at_byte, what)),
        })
    }
}
