//! Files and messages that rosbag2 compresses with zstd. The chunks of MCAP files are decompressed
//! in `mcap/chunk.rs`.

use std::{
    fs::File,
    io::{self, Read, Seek, Write},
    mem,
    path::Path,
};

use tempfile::{NamedTempFile, TempPath};

use super::{
    opening::Opening,
    storage::{Block, Damage, Entry, Selected},
    zstd_context::ZstdContext,
};
use crate::{cdr::ZSTD_MAGIC, error::LogError};

/// Number of bytes that are decompressed at once.
const STEP: usize = 1 << 17;

/// Content of a compressed file, in a temporary file that is deleted on drop.
#[derive(Debug)]
pub(super) struct Decompressed {
    pub(super) path: TempPath,
    /// Damage of the compressed file, after which the content is missing.
    pub(super) damage: Option<Damage>,
}

/// Decompresses a file to a temporary one, up to the damage if it is damaged, unless the content of
/// the files of the log is then far larger than measurements are.
pub(super) fn decompress(
    file: File,
    path: &Path,
    opening: &mut Opening<'_>,
) -> Result<Decompressed, LogError> {
    let metadata = file.metadata();
    let metadata = metadata.map_err(|source| LogError::io("read", path, source))?;
    let of_bytes = metadata.len();
    let most_bytes = opening.space.add_packed(of_bytes);
    let unreadable = |source| LogError::io("read", path, source);
    let not_decompressed = |source: io::Error| {
        let folder = std::env::temp_dir();
        let what = format!(
            "{source} in {}; set TMPDIR to a folder with enough space",
            folder.display()
        );
        LogError::io("decompress", path, io::Error::new(source.kind(), what))
    };
    let mut decoder = zstd::Decoder::new(file).map_err(unreadable)?;
    let mut decompressed = NamedTempFile::new().map_err(not_decompressed)?;
    let mut step = vec![0; STEP];
    let fault = loop {
        match decoder.read(&mut step) {
            Ok(0) => break None,
            Ok(count) => {
                opening.go_on()?;
                opening.space.add_content(count as u64, most_bytes, path)?;
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
                of_bytes,
                what,
            })
        }
    };
    Ok(Decompressed {
        path: decompressed.into_temp_path(),
        damage,
    })
}

/// Decompresses the messages of a block that are compressed one by one, and returns whether all of
/// its messages then need at most `room` bytes. A message that cannot be decompressed stays as it
/// is, so that the error names this message.
#[must_use]
pub(super) fn decompress_messages(
    zstd: &mut ZstdContext,
    block: &mut Block,
    selected: &Selected,
    room: u64,
) -> bool {
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
            is_packed(entry, &packed).then(|| unpack(zstd, data, &mut block.bytes, room));
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

/// Appends the content of a compressed message to some bytes. More than `room` of them are the
/// error `FileTooLarge`.
fn unpack(zstd: &mut ZstdContext, data: &[u8], bytes: &mut Vec<u8>, room: u64) -> io::Result<()> {
    let limit = room.saturating_sub(bytes.len() as u64);
    let count = zstd.stream(data).take(limit + 1).read_to_end(bytes)?;
    if count as u64 > limit {
        return Err(io::ErrorKind::FileTooLarge.into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::reader::{DEFAULT_MEMORY_LIMIT, opening::TemporarySpace};

    /// A log with content above its bound is refused, one at the bound is whole.
    #[test]
    fn content_beyond_its_bound_is_refused() {
        let mut packed = NamedTempFile::new().unwrap();
        let content = vec![0; 1 << 20];
        packed
            .write_all(&zstd::encode_all(content.as_slice(), 1).unwrap())
            .unwrap();
        let mut watch = || ControlFlow::Continue(());
        let mut opening = Opening::new(DEFAULT_MEMORY_LIMIT, &mut watch);
        let decompress = |opening: &mut Opening<'_>| {
            super::decompress(File::open(&packed).unwrap(), packed.path(), opening)
        };
        opening.space = TemporarySpace::of_small_content(2 << 20);
        for _ in 0..2 {
            let whole = decompress(&mut opening).unwrap();
            assert!(whole.damage.is_none());
            assert_eq!(whole.path.metadata().unwrap().len(), 1 << 20);
        }
        let error = decompress(&mut opening).unwrap_err();
        assert!(matches!(&error, LogError::Oversized { path, .. } if path == packed.path()));
        opening.space = TemporarySpace::of_small_content((1 << 20) - 1);
        decompress(&mut opening).unwrap_err();
        assert!(error.to_string().contains("more than 0.0 GiB"), "{error}");
    }
}
