//! Errors of reading and writing logs.

use std::{
    io,
    path::{Path, PathBuf},
};

use crate::{cdr::CdrError, database_fault::DatabaseFault};

/// Reason why a log cannot be read or written. Each message names the file or the topic.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// An operation on a file failed.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The operation, for instance `read`.
        action: &'static str,
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The content of the compressed files of a log is far larger than that of measurements.
    #[error(
        "with {} the content of the log has more than {:.1} GiB, far more than measurements that compress to its size: it is no \
         recording, or it must be decompressed with zstd first", path.display(), *most_bytes as f64 / f64::from(1 << 30)
    )]
    Expansion {
        /// Path of the compressed file with which the content exceeds the limit.
        path: PathBuf,
        /// Most content that is decompressed, bytes: 1 GiB, or a thousand times the size of the files until then.
        most_bytes: u64,
    },
    /// A compressed file could not be decompressed to a temporary one.
    #[error(
        "cannot decompress {} to {}: {source}; set TMPDIR to a folder with enough space", path.display(), folder.display()
    )]
    Decompress {
        /// Path of the compressed file.
        path: PathBuf,
        /// Folder of temporary files.
        folder: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Messages of the same time, which are read together, need more memory than the reader may use.
    #[error(
        "reading {} needs more than {:.1} MiB of memory at once: its chunks or messages are too large, or its chunks overlap in \
         time; `ros2 bag convert` writes smaller ones in the order of time", path.display(), *budget as f64 / 1_048_576.0
    )]
    Memory {
        /// Path of the file.
        path: PathBuf,
        /// The memory that the reader may use, bytes.
        budget: u64,
    },
    /// The index of a log, its names, metadata and positions, needs more memory than the reader may use.
    #[error(
        "the index of {} needs more than {:.1} MiB of memory: it has too many chunks, names or metadata", path.display(),
        *budget as f64 / 1_048_576.0
    )]
    Index {
        /// Path of the file with which the index exceeds the limit.
        path: PathBuf,
        /// The memory that the index may use, bytes: half of that of messages.
        budget: u64,
    },
    /// A name in the log is longer than any that a robot uses.
    #[error(
        "{} names a topic, a type or an encoding with {bytes} bytes: names have at most {most_bytes}", path.display()
    )]
    LongName {
        /// Path of the file.
        path: PathBuf,
        /// Length of the name, bytes.
        bytes: usize,
        /// Most bytes of a name.
        most_bytes: usize,
    },
    /// The watch has ended the opening of the log.
    #[error("the opening of the log was interrupted")]
    Interrupted,
    /// The file is an SQLite database that cannot be read as a bag.
    #[error("{} cannot be read as an SQLite bag: {fault}", path.display())]
    Database {
        /// Path of the file.
        path: PathBuf,
        /// The reason.
        fault: DatabaseFault,
    },
    /// The file is neither an MCAP log nor an SQLite bag.
    #[error("{} is neither an MCAP log nor an SQLite bag: {what}", path.display())]
    NotALog {
        /// Path of the file.
        path: PathBuf,
        /// Description of what the file is instead.
        what: String,
    },
    /// The folder is not a rosbag2 bag, or is compressed in an unknown format.
    #[error("{} is not a rosbag2 bag that can be read: {what}", path.display())]
    NotABag {
        /// Path of the folder or of its `metadata.yaml`.
        path: PathBuf,
        /// The reason, and what to do.
        what: String,
    },
    /// The log does not have the requested topic.
    #[error("{} has no topic {topic}; it has {available}", path.display())]
    NoSuchTopic {
        /// Path of the log.
        path: PathBuf,
        /// The requested topic.
        topic: String,
        /// Names of existing topics: all of a few.
        available: String,
    },
    /// ROS 2 does not allow the topic's name, or the log already has the topic.
    #[error("topic {topic:?} cannot be logged: {why}")]
    BadTopic {
        /// Name of the topic.
        topic: String,
        /// The reason.
        why: &'static str,
    },
    /// A message was requested as another type than that of its topic.
    #[error("topic {topic} holds {type_name}, not {requested}")]
    WrongType {
        /// Name of the topic.
        topic: String,
        /// Type of the topic.
        type_name: String,
        /// The requested type.
        requested: &'static str,
    },
    /// The messages of the topic are not encoded as CDR.
    #[error("topic {topic} is encoded as {encoding:?}; only \"cdr\" can be decoded")]
    Encoding {
        /// Name of the topic.
        topic: String,
        /// Encoding of the messages.
        encoding: String,
    },
    /// A message could not be decoded.
    #[error("message on {topic} at {log_time_ns} ns: {source}")]
    Decode {
        /// Name of the topic.
        topic: String,
        /// Log time of the message, ns.
        log_time_ns: u64,
        /// Fault of the encoded message.
        source: CdrError,
    },
    /// A message could not be encoded.
    #[error("message for {topic} at {log_time_ns} ns: {source}")]
    Encode {
        /// Name of the topic.
        topic: String,
        /// Log time of the message, ns.
        log_time_ns: u64,
        /// Reason why it cannot be encoded.
        source: CdrError,
    },
    /// The log cannot store what is written to it.
    #[error("cannot write {}: {what}", path.display())]
    Write {
        /// Path of the log.
        path: PathBuf,
        /// The reason.
        what: String,
    },
}

impl LogError {
    /// Returns the error of an operation on a file.
    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self::Io {
            action,
            path: path.to_owned(),
            source,
        }
    }
}
