use std::{io, path::PathBuf};

use crate::cdr::CdrError;

/// What can go wrong with a log. Each message names the file or the topic.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// Such as `read`.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is not an MCAP log, or is none that can be read.
    #[error("{} is not an MCAP log: {what}", path.display())]
    NotALog {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        what: &'static str,
    },
    /// The folder is not a rosbag2 bag, or is none that can be read.
    #[error("{} is not a rosbag2 bag of MCAP files: {what}", path.display())]
    NotABag {
        /// The folder or its `metadata.yaml`.
        path: PathBuf,
        /// Why not, and what would help.
        what: String,
    },
    /// A topic was asked for that the log does not have.
    #[error("{} has no topic {topic}; it has {available}", path.display())]
    NoSuchTopic {
        /// The log.
        path: PathBuf,
        /// The topic that was asked for.
        topic: String,
        /// The topics that it has.
        available: String,
    },
    /// A topic name that ROS 2 would refuse, or one that the log has already.
    #[error("topic {topic:?} cannot be logged: {why}")]
    BadTopic {
        /// The name.
        topic: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A message was to be decoded as another type than its topic has.
    #[error("topic {topic} holds {type_name}, not {wanted}")]
    WrongType {
        /// The topic.
        topic: String,
        /// Its type.
        type_name: String,
        /// The type that was asked for.
        wanted: &'static str,
    },
    /// The topic's messages are not in CDR.
    #[error("topic {topic} is encoded as {encoding:?}; only \"cdr\" can be decoded")]
    Encoding {
        /// The topic.
        topic: String,
        /// Its message encoding.
        encoding: String,
    },
    /// A message could not be decoded.
    #[error("message on {topic} at {log_time_ns} ns: {source}")]
    Decode {
        /// The topic.
        topic: String,
        /// The message's log time in ns.
        log_time_ns: u64,
        /// What is wrong with its bytes.
        source: CdrError,
    },
    /// A message could not be encoded.
    #[error("message for {topic} at {log_time_ns} ns: {source}")]
    Encode {
        /// The topic.
        topic: String,
        /// The message's log time in ns.
        log_time_ns: u64,
        /// What is wrong with it.
        source: CdrError,
    },
    /// The log cannot take what was written to it.
    #[error("cannot write {}: {what}", path.display())]
    Write {
        /// The log.
        path: PathBuf,
        /// Why not.
        what: String,
    },
}
