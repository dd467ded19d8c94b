//! Reading of a log of any bytes.

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use tactid_logs::messages::{JointState, TFMessage, WrenchStamped};
use tactid_logs::{LogReader, RawMessage};
use tempfile::TempDir;

/// Reads a file of these bytes as a log to its end, and asserts that the messages of the log are in the order of their times,
/// that a second reading returns the same ones, and that a reading ends at the first error.
///
/// # Panics
/// Panics if one of these does not hold, or if the file cannot be written.
pub fn run(bytes: &[u8]) {
    static FOLDER: LazyLock<TempDir> =
        LazyLock::new(|| TempDir::new().expect("a folder for the log"));
    static PATH: LazyLock<PathBuf> = LazyLock::new(|| FOLDER.path().join("log"));
    fs::write(&*PATH, bytes).expect("space for the log");
    let Ok(log) = LogReader::open(&*PATH) else {
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
