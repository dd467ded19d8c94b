//! Index of the content of a file.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use mcap::records::op;

use super::{
    chunk::Records,
    file::{Damage, LogFile, Stop},
};

pub(super) type Metadata = BTreeMap<String, BTreeMap<String, String>>;

/// A contiguous range of a file that is read at once: a chunk, or records outside of chunks.
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) at_byte: u64,
    pub(super) length: u64,
    pub(super) kind: SegmentKind,
    /// Earliest log time of its messages, ns.
    pub(super) first_ns: u64,
    pub(super) channels: BTreeSet<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SegmentKind {
    Chunk,
    /// A chunk that the end of the file cuts off.
    CutChunk,
    Plain,
}

/// A channel of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Channel {
    pub(super) topic: String,
    pub(super) type_name: String,
    pub(super) encoding: String,
    pub(super) count: u64,
    /// First and last log time, ns.
    pub(super) times_ns: Option<(u64, u64)>,
}

/// Content of a file.
#[derive(Debug)]
pub(super) struct FileIndex {
    pub(super) path: PathBuf,
    pub(super) segments: Vec<Segment>,
    pub(super) channels: BTreeMap<u16, Channel>,
    pub(super) metadata: Metadata,
    pub(super) damage: Option<Damage>,
}

impl Segment {
    /// Reads the segment and decompresses its records.
    pub(super) fn read(&self, file: &mut LogFile) -> Result<Records, Stop> {
        if self.kind == SegmentKind::Plain {
            return Ok(Records::plain(file.read(self.at_byte, self.length)?));
        }
        match file.record_at(self.at_byte)? {
            Some(record) if record.opcode == op::CHUNK => {
                let cut = self.kind == SegmentKind::CutChunk;
                let body = file.body(record)?;
                Records::of_chunk(body, cut).map_err(|what| file.damage(self.at_byte, what))
            }
            _ => Err(file.damage(self.at_byte, "no chunk at the position in the index")),
        }
    }
}

impl Channel {
    pub(super) fn count_message(&mut self, log_time_ns: u64) {
        self.count += 1;
        self.extend_times((log_time_ns, log_time_ns));
    }

    pub(super) fn extend_times(&mut self, (first_ns, last_ns): (u64, u64)) {
        let (first, last) = self.times_ns.unwrap_or((first_ns, last_ns));
        self.times_ns = Some((first.min(first_ns), last.max(last_ns)));
    }
}
