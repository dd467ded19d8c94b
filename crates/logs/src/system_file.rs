//! Opening of files as the operating system has them: without waiting for another process, and with
//! a mark by which a file that was replaced is noticed.

use std::{
    fs::{File, Metadata, OpenOptions},
    io,
    path::Path,
    time::SystemTime,
};

/// Returns options that open a pipe without waiting for the process at its other end, as
/// `read_text` of `tactid-dynamics` does. Files are opened as ever.
pub(crate) fn options() -> OpenOptions {
    #[allow(unused_mut, reason = "mutable on Unix alone")]
    let mut options = File::options();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    options
}

/// Opens a file for reading and returns it with its metadata, which describe the open file whatever
/// happens to its path.
pub(crate) fn open(path: &Path) -> io::Result<(File, Metadata)> {
    let file = options().read(true).open(path)?;
    let metadata = file.metadata()?;
    Ok((file, metadata))
}

/// Mark of a file, which differs from the mark of a file that takes its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileMark {
    /// Device and inode, where the system has them.
    inode: Option<(u64, u64)>,
    /// Length, bytes, and time of the last change.
    content: (u64, Option<SystemTime>),
}

impl FileMark {
    pub(crate) fn of(metadata: &Metadata) -> Self {
        #[cfg(unix)]
        let inode = {
            use std::os::unix::fs::MetadataExt;
            Some((metadata.dev(), metadata.ino()))
        };
        #[cfg(not(unix))]
        let inode = None;
        Self {
            inode,
            content: (metadata.len(), metadata.modified().ok()),
        }
    }

    /// Returns device and inode, where the system has them.
    pub(crate) fn inode(&self) -> Option<(u64, u64)> {
        self.inode
    }

    /// Returns whether both marks may belong to one file. A file that is being recorded keeps its
    /// inode; a finished one keeps its length and time, also on network file systems that number a
    /// file anew whenever it is opened.
    pub(crate) fn may_be_same_file(&self, other: &Self) -> bool {
        (self.inode.is_some() && self.inode == other.inode) || self.content == other.content
    }
}
