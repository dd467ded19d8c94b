//! What the opening of a log may use, and who may end it.

use std::{
    ops::ControlFlow,
    path::Path,
    time::{Duration, Instant},
};

use super::storage::{Definition, MemoryBudget, in_mib};
use crate::error::LogError;

/// Time from one call of the watch to the next, at least.
const WATCH_EVERY: Duration = Duration::from_millis(20);

/// Memory of a text of an index beside its bytes, and of a segment beside and for each of its
/// channels, bytes. Half of a log's memory is enough for 650 000 segments by default: half a
/// terabyte of rosbag2's chunks.
const OF_TEXT: u64 = 96;
const OF_SEGMENT: u64 = 192;
const OF_CHANNEL: u64 = 16;

/// Most bytes of a name of a topic, a type or an encoding: messages and reports repeat names.
pub(super) const MAX_NAME: usize = 4096;

/// Content of a compressed file that is decompressed however small the file is, bytes.
const SMALL_CONTENT: u64 = 1 << 30;

/// Largest ratio of a larger content to its compressed file. Measurements compress by factors of
/// two to twenty, and a recording of an arm at rest without noise by less than a hundred; zeros
/// alone reach ten thousand, and would fill the disk.
const MAX_RATIO: u64 = 1000;

/// Returns the memory of a segment with a number of channels, bytes.
fn of_segment(channels: usize) -> u64 {
    OF_SEGMENT + OF_CHANNEL * channels as u64
}

/// The opening of a log with all of its files.
pub(super) struct Opening<'a> {
    /// Memory of messages.
    pub(super) memory: MemoryBudget,
    /// Space for compressed files.
    pub(super) space: TemporarySpace,
    /// Memory of the index: half of the memory of messages.
    index: MemoryBudget,
    watch: &'a mut dyn FnMut() -> ControlFlow<()>,
    watched: Instant,
}

impl<'a> Opening<'a> {
    /// Starts the opening of a log with messages of at most `memory_bytes` bytes in memory. It ends
    /// where the watch breaks.
    pub(super) fn new(memory_bytes: u64, watch: &'a mut dyn FnMut() -> ControlFlow<()>) -> Self {
        Self {
            memory: MemoryBudget::whole(memory_bytes),
            space: TemporarySpace::of_small_content(SMALL_CONTENT),
            index: MemoryBudget::whole(memory_bytes / 2),
            watch,
            watched: Instant::now(),
        }
    }

    /// Returns the longest record that an index is made from, bytes.
    pub(super) fn longest_record(&self) -> u64 {
        self.index.remaining
    }

    /// Counts a number of texts with so many bytes together among what the index keeps of a file.
    pub(super) fn keep_texts(
        &mut self,
        path: &Path,
        (count, bytes): (u64, u64),
    ) -> Result<(), LogError> {
        self.keep(path, bytes.saturating_add(count.saturating_mul(OF_TEXT)))
    }

    /// Counts texts among what the index keeps of a file.
    pub(super) fn keep_each<'t>(
        &mut self,
        path: &Path,
        texts: impl IntoIterator<Item = &'t str>,
    ) -> Result<(), LogError> {
        let add = |(count, bytes), text: &str| (count + 1, bytes + text.len() as u64);
        self.keep_texts(path, texts.into_iter().fold((0, 0), add))
    }

    /// Counts the definition of a topic among what the index keeps of a file.
    pub(super) fn keep_definition(
        &mut self,
        path: &Path,
        definition: &Definition,
    ) -> Result<(), LogError> {
        let add = |(count, bytes), text: &[u8]| (count + 1, bytes + text.len() as u64);
        self.keep_texts(path, definition.texts().fold((0, 0), add))
    }

    /// Counts names of topics, types and encodings among what the index keeps of a file.
    pub(super) fn keep_names<'t>(
        &mut self,
        path: &Path,
        names: impl IntoIterator<Item = &'t str> + Clone,
    ) -> Result<(), LogError> {
        let bytes = names.clone().into_iter().map(str::len).max();
        match bytes.filter(|&bytes| bytes > MAX_NAME) {
            Some(bytes) => Err(LogError::Oversized {
                path: path.to_owned(),
                what: format!(
                    "{} names a topic, a type or an encoding with {bytes} bytes: names have at most {MAX_NAME}",
                    path.display()
                ),
            }),
            None => self.keep_each(path, names),
        }
    }

    /// Counts a segment with a number of channels among what the index keeps of a file.
    pub(super) fn keep_segment(&mut self, path: &Path, channels: usize) -> Result<(), LogError> {
        self.keep(path, of_segment(channels))
    }

    /// Takes segments, each with a number of channels, from what the index keeps.
    pub(super) fn drop_segments(&mut self, channels: impl Iterator<Item = usize>) {
        self.index.remaining += channels.map(of_segment).sum::<u64>();
    }

    /// Returns the error of a file with an index that does not fit.
    pub(super) fn too_large(&self, path: &Path) -> LogError {
        let budget = self.index.total;
        LogError::Memory {
            path: path.to_owned(),
            budget,
            what: format!(
                "the index of {} needs more than {:.1} MiB of memory: it has too many chunks, names or metadata",
                path.display(),
                in_mib(budget)
            ),
        }
    }

    fn keep(&mut self, path: &Path, bytes: u64) -> Result<(), LogError> {
        let left = self.index.remaining.checked_sub(bytes);
        self.index.remaining = left.ok_or_else(|| self.too_large(path))?;
        Ok(())
    }

    /// Lets the watch end the opening.
    pub(super) fn go_on(&mut self) -> Result<(), LogError> {
        if self.watched.elapsed() < WATCH_EVERY {
            return Ok(());
        }
        self.watched = Instant::now();
        match (self.watch)() {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(LogError::Interrupted),
        }
    }
}

/// Space in the folder of temporary files that the compressed files of a log may occupy together.
#[derive(Debug)]
pub(super) struct TemporarySpace {
    /// Content that may be decompressed however small the files are, bytes.
    small_content: u64,
    /// Length of the compressed files until now, and of their content, bytes.
    packed: u64,
    content: u64,
}

impl TemporarySpace {
    pub(super) fn of_small_content(small_content: u64) -> Self {
        Self {
            small_content,
            packed: 0,
            content: 0,
        }
    }

    /// Counts a compressed file of some bytes, and returns the most content of the log then.
    pub(super) fn add_packed(&mut self, bytes: u64) -> u64 {
        self.packed = self.packed.saturating_add(bytes);
        self.small_content
            .max(MAX_RATIO.saturating_mul(self.packed))
    }

    /// Counts content of a compressed file, and refuses more than `most_bytes` of the log.
    pub(super) fn add_content(
        &mut self,
        bytes: u64,
        most_bytes: u64,
        path: &Path,
    ) -> Result<(), LogError> {
        self.content += bytes;
        if self.content > most_bytes {
            return Err(LogError::Oversized {
                path: path.to_owned(),
                what: format!(
                    "with {} the content of the log has more than {:.1} GiB, far more than measurements that \
                     compress to its size: it is no recording, or it must be decompressed with zstd first",
                    path.display(),
                    in_mib(most_bytes) / 1024.0
                ),
            });
        }
        Ok(())
    }
}
