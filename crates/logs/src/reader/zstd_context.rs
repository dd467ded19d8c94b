//! A zstd decompressor that is used for many contents.

use std::{fmt, io::Read};

use zstd::zstd_safe::{self, DCtx, ResetDirective};

/// Largest window of a stream, in bytes: the default of the library.
pub(super) const MOST_WINDOW: u64 = 1 << 27;

/// Context of a decompressor. Creating one costs more than decompressing a message.
pub(super) struct ZstdContext(DCtx<'static>);

impl ZstdContext {
    /// Decompresses the frames in `data` into the capacity of `bytes`, without the window and the
    /// copies of a stream. An error says why that is impossible: the capacity is too small, or the
    /// frames are damaged.
    pub(super) fn fill(&mut self, bytes: &mut Vec<u8>, data: &[u8]) -> Result<(), &'static str> {
        let filled = self.0.decompress(bytes, data);
        filled.map(|_| ()).map_err(zstd_safe::get_error_name)
    }

    /// Returns the content of the frames in `data` as a stream, which occupies as much as has been
    /// read of it, at most [`MOST_WINDOW`], beside what is read.
    pub(super) fn stream<'a>(&'a mut self, data: &'a [u8]) -> impl Read + 'a {
        // A frame that failed leaves its state behind. Resetting a session cannot fail.
        let _ = self.0.reset(ResetDirective::SessionOnly);
        zstd::Decoder::with_context(data, &mut self.0)
    }
}

impl Default for ZstdContext {
    fn default() -> Self {
        Self(DCtx::create())
    }
}

impl fmt::Debug for ZstdContext {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ZstdContext")
    }
}
