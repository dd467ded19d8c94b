//! Files and messages that rosbag2 compresses with zstd. The chunks of MCAP files are decompressed in `mcap/chunk.rs`.

use std::{
    fmt,
    fs::File,
    io::{self, Read, Seek, Write},
    mem,
    path::Path,
};

use tempfile::{NamedTempFile, TempPath};
use zstd::zstd_safe::{DCtx, ResetDirective};

use super::storage::{Block, Damage, Entry, Selected};
use crate::{cdr::ZSTD_MAGIC, error::LogError};

/// Content of a compressed file that is decompressed however small the file is, bytes.
const SMALL_CONTENT: u64 = 1 << 30;

/// Largest ratio of a larger content to its compressed file. Measurements compress by factors of two to twenty, and a recording
/// of an arm at rest without noise by less than a hundred; zeros alone reach ten thousand, and would fill the disk.
const MAX_RATIO: u64 = 1000;

/// Number of bytes that are decompressed at once.
const STEP: usize = 1 << 17;

/// Content of a compressed file, in a temporary file that is deleted on drop.
#[derive(Debug)]
pub(super) struct Decompressed {
    pub(super) path: TempPath,
    /// Damage of the compressed file, after which the content is missing.
    pub(super) damage: Option<Damage>,
}

/// Decompresses a file to a temporary one, up to the damage if it is damaged.
pub(super) fn decompress(path: &Path) -> Result<Decompressed, LogError> {
    let file = File::open(path).map_err(|source| LogError::io("open", path, source))?;
    let metadata = file
        .metadata()
        .map_err(|source| LogError::io("read", path, source))?;
    let most_bytes = SMALL_CONTENT.max(MAX_RATIO.saturating_mul(metadata.len()));
    decompress_at_most(file, path, most_bytes)
}

/// Decompresses a file to a temporary one, up to the damage if it is damaged, unless its content has more than so many bytes.
fn decompress_at_most(file: File, path: &Path, most_bytes: u64) -> Result<Decompressed, LogError> {
    let unreadable = |source| LogError::io("read", path, source);
    let not_decompressed = |source| LogError::Decompress {
        path: path.to_owned(),
        folder: std::env::temp_dir(),
        source,
    };
    let mut decoder = zstd::Decoder::new(file).map_err(unreadable)?;
    let mut decompressed = NamedTempFile::new().map_err(not_decompressed)?;
    let mut step = vec![0; STEP];
    let mut size = 0;
    let fault = loop {
        match decoder.read(&mut step) {
            Ok(0) => break None,
            Ok(count) => {
                size += count as u64;
                if size > most_bytes {
                    let path = path.to_owned();
                    return Err(LogError::Expansion { path, most_bytes });
                }
                let bytes = step.get(..count).unwrap_or_default();
                decompressed.write_all(bytes).map_err(not_decompressed)?;
            }
            Err(error) => break Some(error.to_string()),
        }
    };
    let damage = match fault {
        None => None,
        Some(error) => {
            let at_byte = decoder.get_mut().stream_position().map_err(unreadable)?;
            let what = format!("it cannot be decompressed further ({error})");
            Some(Damage {
                path: path.to_owned(),
                at_byte,
                what,
            })
        }
    };
    Ok(Decompressed {
        path: decompressed.into_temp_path(),
        damage,
    })
}

/// Decompressor of messages that are compressed one by one.
pub(super) struct MessageDecompressor(DCtx<'static>);

impl MessageDecompressor {
    pub(super) fn new() -> Self {
        Self(DCtx::create())
    }

    /// Decompresses the messages of a block that are compressed, and returns whether all of its messages then need at most
    /// `room` bytes. A message that cannot be decompressed stays as it is, so that the error is that of this message.
    #[must_use]
    pub(super) fn decompress(&mut self, block: &mut Block, selected: &Selected, room: u64) -> bool {
        let is_cdr = |channel| {
            selected
                .get(&channel)
                .is_some_and(|topic| topic.encoding == "cdr")
        };
        let is_packed = |entry: &Entry, bytes: &[u8]| {
            let data = bytes.get(entry.data.clone()).unwrap_or_default();
            data.starts_with(&ZSTD_MAGIC) && is_cdr(entry.channel)
        };
        let mut entries = block.entries.iter();
        if !entries.any(|entry| is_packed(entry, &block.bytes)) {
            return true;
        }
        let packed = mem::take(&mut block.bytes);
        block.entries.iter_mut().all(|entry| {
            let data = packed.get(entry.data.clone()).unwrap_or_default();
            let start = block.bytes.len();
            let unpacked =
                is_packed(entry, &packed).then(|| self.unpack(data, &mut block.bytes, room));
            let fits = match unpacked {
                Some(Ok(())) => true,
                Some(Err(error)) if error.kind() == io::ErrorKind::FileTooLarge => false,
                _ => {
                    block.bytes.truncate(start);
                    block.bytes.extend_from_slice(data);
                    block.bytes.len() as u64 <= room
                }
            };
            entry.data = start..block.bytes.len();
            fits
        })
    }

    /// Appends the content of a compressed message to some bytes. More than `room` of them are the error `FileTooLarge`.
    fn unpack(&mut self, data: &[u8], bytes: &mut Vec<u8>, room: u64) -> io::Result<()> {
        // A frame that failed leaves its state behind. Resetting a session cannot fail.
        let _ = self.0.reset(ResetDirective::SessionOnly);
        let limit = room.saturating_sub(bytes.len() as u64);
        let decoder = zstd::Decoder::with_context(data, &mut self.0);
        let count = decoder.take(limit + 1).read_to_end(bytes)?;
        if count as u64 > limit {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        Ok(())
    }
}

impl fmt::Debug for MessageDecompressor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("MessageDecompressor")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file whose content is larger than its bound is refused, one at the bound is whole.
    #[test]
    fn content_beyond_its_bound_is_refused() {
        let mut packed = NamedTempFile::new().unwrap();
        let content = vec![0; 1 << 20];
        packed
            .write_all(&zstd::encode_all(content.as_slice(), 1).unwrap())
            .unwrap();
        let decompressed =
            |most| decompress_at_most(File::open(&packed).unwrap(), packed.path(), most);
        let whole = decompressed(1 << 20).unwrap();
        assert!(whole.damage.is_none());
        assert_eq!(whole.path.metadata().unwrap().len(), 1 << 20);
        let error = decompressed((1 << 20) - 1).unwrap_err();
        assert!(matches!(&error, LogError::Expansion { path, .. } if path == packed.path()));
        assert!(error.to_string().contains("more than 0.0 GiB"), "{error}");
    }
}
