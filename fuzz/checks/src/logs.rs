//! Reading of a log of any bytes.

use std::fs;
use std::path::Path;

use tactid_logs::messages::{
    AccelStamped, Imu, JointState, Odometry, StringMsg, TFMessage, WrenchStamped,
};
use tactid_logs::{Damage, LogReader, RawMessage};

use crate::in_folder;

/// Memory for a second opening of the log, bytes.
const LITTLE_MEMORY: u64 = 1 << 12;

/// Reads a file of these bytes as a log to its end, and asserts that the messages of the log are in
/// the order of their times, that a second reading returns the same ones, the same damage and the
/// same error, that nothing follows an error, that the topics of a log without damage or index
/// count as many messages as it has, and that a log for which there is too little memory gives the
/// first of these messages.
///
/// # Panics
/// Panics if one of these does not hold, or if the file cannot be written.
pub fn run(bytes: &[u8]) {
    in_folder(|folder| check(&folder.join("log"), bytes));
}

/// What a reading of all messages gives.
#[derive(PartialEq)]
struct Reading {
    /// Time and content of each message.
    messages: Vec<(u64, Vec<u8>)>,
    damage: Vec<Damage>,
    error: Option<String>,
}

/// Writes the bytes to a file and checks what is read from it.
fn check(path: &Path, bytes: &[u8]) {
    fs::write(path, bytes).expect("space for the log");
    let Ok(log) = LogReader::open(path) else {
        return;
    };
    let first = read(&log);
    assert!(first == read(&log), "a second reading differs");
    if let Ok(log) = LogReader::open_within(path, LITTLE_MEMORY) {
        let little = read(&log);
        assert!(first.messages.starts_with(&little.messages));
        assert!(little.error.is_some() || little == first);
    }
    // The index of a finished MCAP file may claim anything; all others are scanned.
    let is_scanned = !bytes.ends_with(b"\x89MCAP0\r\n");
    if is_scanned && first.damage.is_empty() && first.error.is_none() {
        let times = first.messages.iter().map(|(time_ns, _)| *time_ns);
        let (earliest, latest) = (times.clone().min(), times.max());
        assert_eq!(log.times_ns(), earliest.zip(latest));
        let counted: u64 = log.topics().iter().map(|topic| topic.count).sum();
        assert_eq!(counted, first.messages.len() as u64);
    }
}

/// Reads all messages up to the first error.
fn read(log: &LogReader) -> Reading {
    let mut messages = log.messages();
    let (mut found, mut error) = (Vec::new(), None);
    let mut last_ns = 0;
    while let Some(message) = messages.next() {
        let message = match message {
            Ok(message) => message,
            Err(failed) => {
                error = Some(failed.to_string());
                assert!(messages.next().is_none(), "messages after an error");
                break;
            }
        };
        decode(&message);
        assert!(last_ns <= message.log_time_ns, "out of order");
        last_ns = message.log_time_ns;
        found.push((last_ns, message.data().to_vec()));
    }
    Reading {
        messages: found,
        damage: messages.damage().to_vec(),
        error,
    }
}

/// Decodes a message by the type of its topic, where this is one that a recording uses.
fn decode(message: &RawMessage) {
    let _ = message.decode::<JointState>();
    let _ = message.decode::<WrenchStamped>();
    let _ = message.decode::<Odometry>();
    let _ = message.decode::<Imu>();
    let _ = message.decode::<AccelStamped>();
    let _ = message.decode::<TFMessage>();
    let _ = message.decode::<StringMsg>();
}
