//! Index of an MCAP file and the way from it to the messages.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use mcap::records::op;

use super::{chunk::Records, file::LogFile, scan};
use crate::{
    error::LogError,
    reader::{
        source::Source,
        storage::{
            Block, Channel, ChannelId, Damage, Entry, FileIndex, Metadata, Segment, SegmentReader,
            Selected, Stop, Storage,
        },
    },
};

/// Returns the index of a file.
pub(in crate::reader) fn index(source: Source) -> Result<FileIndex, LogError> {
    let index = scan::open(&source)?;
    let (places, segments): (Vec<Place>, Vec<Segment>) = index.segments.into_iter().unzip();
    // Damage of a compressed file is the reason for that of its content.
    let damage = source.damage().cloned().or(index.damage);
    Ok(FileIndex {
        segments,
        metadata: index.metadata,
        damage,
        storage: Box::new(McapStorage {
            source,
            places: places.into(),
            known: Arc::new(index.channels.keys().copied().collect()),
        }),
        channels: index.channels,
    })
}

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
    pub(super) fn read(&self, file: &mut LogFile) -> Result<Records, Stop> {
        if self.kind == PlaceKind::Plain {
            return Ok(Records::plain(file.read(self.at_byte, self.length)?));
        }
        match file.record_at(self.at_byte)? {
            Some(record) if record.opcode == op::CHUNK => {
                let cut = self.kind == PlaceKind::CutChunk;
                let body = file.body(record)?;
                Records::of_chunk(body, cut).map_err(|what| file.damage(self.at_byte, what))
            }
            _ => Err(file.damage(self.at_byte, "no chunk at the position in the index")),
        }
    }
}

#[derive(Debug)]
struct McapStorage {
    source: Source,
    places: Arc<[Place]>,
    known: Arc<BTreeSet<ChannelId>>,
}

impl Storage for McapStorage {
    fn open(&self) -> Result<Box<dyn SegmentReader>, LogError> {
        Ok(Box::new(McapReader {
            file: LogFile::open(&self.source)?,
            places: self.places.clone(),
            known: self.known.clone(),
        }))
    }
}

#[derive(Debug)]
struct McapReader {
    file: LogFile,
    places: Arc<[Place]>,
    /// All channels of the file, selected or not.
    known: Arc<BTreeSet<ChannelId>>,
}

impl SegmentReader for McapReader {
    fn read(&mut self, segment: usize, selected: &Selected) -> Result<Block, Stop> {
        let Some(place) = self.places.get(segment) else {
            return Ok(Block::default());
        };
        let records = place.read(&mut self.file)?;
        let mut entries = Vec::new();
        let outcome = self.select(&records, selected, &mut entries);
        let damage = outcome.map_err(|what| self.file.damage_at(place.at_byte, what));
        Ok(Block {
            bytes: records.into_bytes(),
            entries,
            damage: damage.err(),
        })
    }
}

impl McapReader {
    /// Collects the selected messages of a segment, up to the first damaged record.
    fn select(
        &self,
        records: &Records,
        selected: &Selected,
        entries: &mut Vec<Entry>,
    ) -> Result<(), &'static str> {
        for entry in records.messages() {
            let entry = entry?;
            if selected.contains_key(&entry.channel) {
                entries.push(entry);
            } else if !self.known.contains(&entry.channel) {
                return Err("a message of an unknown channel");
            }
        }
        Ok(())
    }
}
