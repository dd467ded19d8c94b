//! Errors of reading and writing logs.

use std::{
    io,
    path::{Path, PathBuf},
};

use crate::cdr::CdrError;

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
    /// The log needs more memory than the reader may use: messages of the same time, which are read
    /// together, or its index, which is names, metadata and positions.
    #[error("{what}")]
    Memory {
        /// Path of the file with which the log exceeds the limit.
        path: PathBuf,
        /// The memory that the messages or the index may use, bytes.
        budget: u64,
        /// What needs the memory, and what to do.
        what: String,
    },
    /// Something in the log is larger than in any recording, so that no memory or space is given
    /// to it: the content of compressed files, or a name.
    #[error("{what}")]
    Oversized {
        /// Path of the file.
        path: PathBuf,
        /// What is too large.
        what: String,
    },
    /// The watch has ended the opening of the log.
    #[error("the opening of the log was interrupted")]
    Interrupted,
    /// The file or folder is no log that can be read: neither MCAP nor a bag of SQLite or rosbag2,
    /// or a damaged one of these.
    #[error("{} {what}", path.display())]
    NotALog {
        /// Path of the file or folder.
        path: PathBuf,
        /// What it is not, and why.
        what: String,
    },
    /// Another process writes to an SQLite bag and lets nobody read meanwhile.
    #[error(
        "{} cannot be read as an SQLite bag: another process has locked it for longer than \
         {waited_s} s; try again when that process has ended, or read a copy of the file", path.display()
    )]
    Locked {
        /// Path of the file.
        path: PathBuf,
        /// Time for which the lock was awaited, s.
        waited_s: u64,
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
    /// A message was requested as another type than its topic has, or is not encoded as CDR.
    #[error("topic {topic} {what}")]
    WrongType {
        /// Name of the topic.
        topic: String,
        /// Which type or encoding the topic has.
        what: String,
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

    /// Returns the error of an SQLite bag that is not whole.
    pub(crate) fn not_a_bag(path: &Path, fault: &str) -> Self {
        Self::NotALog {
            path: path.to_owned(),
            what: format!("cannot be read as an SQLite bag: {fault}"),
        }
    }
}
