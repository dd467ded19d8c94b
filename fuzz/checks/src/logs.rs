//! Reading of a log of any bytes.

use std::fs;
use std::path::Path;

use tactid_logs::messages::{JointState, TFMessage, WrenchStamped};
use tactid_logs::{LogReader, RawMessage};
use tempfile::TempDir;

/// Reads a file of these bytes as a log to its end, and asserts that the messages of the log are in the order of their times,
/// that a second reading returns the same ones, and that a reading ends at the first error.
///
/// # Panics
/// Panics if one of these does not hold, or if the file cannot be written.
pub fn run(bytes: &[u8]) {
    thread_local! {
        /// A folder for each thread, so that checks that run at once do not write the same file.
        static FOLDER: TempDir = TempDir::new().expect("a folder for the log");
    }
    FOLDER.with(|folder| check(&folder.path().join("log"), bytes));
}

/// Writes the bytes to a file and checks what is read from it.
fn check(path: &Path, bytes: &[u8]) {
    fs::write(path, bytes).expect("space for the log");
    let Ok(log) = LogReader::open(path) else {
        return;
    };
    let first = messages(&log);
    assert_eq!(first, messages(&log), "a second reading differs");
    let _ = (log.times_ns(), log.damage().len());
}

/// Returns times and lengths of all messages up to the first error.
fn messages(log: &LogReader) -> Vec<(u64, usize)> {
    let mut messages = log.messages();
    let mut read: Vec<(u64, usize)> = Vec::new();
    for message in &mut messages {
        let Ok(message) = message else {
            break;
        };
        decode(&message);
        assert!(
            read.last().is_none_or(|last| last.0 <= message.log_time_ns),
            "out of order"
        );
        read.push((message.log_time_ns, message.data().len()));
    }
    read
}

/// Decodes a message by the type of its topic, where this is one that a recording uses.
fn decode(message: &RawMessage) {
    let _ = message.decode::<JointState>();
    let _ = message.decode::<WrenchStamped>();
    let _ = message.decode::<TFMessage>();
}
