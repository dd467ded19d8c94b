//! Logs to test with, and what to compare.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::{
    io::Cursor,
    path::{Path, PathBuf},
};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use tactid_logs::{
    Damage, Durability, LogError, LogReader, LogWriter, Message, cdr,
    messages::{Header, JointState, Time, Wrench, WrenchStamped},
};

pub(crate) mod sqlite;

pub(crate) const STEP_NS: u64 = 100_000_000;

/// The files that `make_golden.py` made.
pub(crate) fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/golden")
        .join(name)
}

pub(crate) fn header(time_ns: u64) -> Header {
    Header {
        stamp: Time::from_ns(time_ns),
        frame_id: "tool0".to_owned(),
    }
}

pub(crate) fn joint_state(k: u64) -> JointState {
    JointState {
        header: header(k * STEP_NS),
        name: vec!["shoulder".to_owned(), "elbow".to_owned()],
        position: vec![k as f64, -0.5],
        velocity: vec![0.1, k as f64],
        effort: vec![],
    }
}

pub(crate) fn wrench(k: u64) -> WrenchStamped {
    let wrench = Wrench {
        force: [k as f64, 1.0, 2.0].into(),
        ..Wrench::default()
    };
    WrenchStamped {
        header: header(k * STEP_NS),
        wrench,
    }
}

/// A log of our writer over `steps` tenths of a second.
pub(crate) fn log(steps: u64) -> Vec<u8> {
    let mut log = LogWriter::new(Cursor::new(Vec::new())).unwrap();
    let joints = log.channel("/joint_states", Durability::Volatile).unwrap();
    let wrenches = log.channel("/wrench", Durability::Volatile).unwrap();
    log.metadata("first", [("key".to_owned(), "value".to_owned())].into())
        .unwrap();
    for k in 0..steps {
        log.write(&joints, k * STEP_NS, &joint_state(k)).unwrap();
        log.write(&wrenches, k * STEP_NS, &wrench(k)).unwrap();
    }
    log.finish().unwrap().into_inner()
}

/// A log of another writer: any compression, chunks or none, any order of times.
pub(crate) fn foreign_log(
    compression: Option<Compression>,
    chunks: bool,
    steps: &[u64],
) -> Vec<u8> {
    let options = WriteOptions::new()
        .compression(compression)
        .use_chunks(chunks)
        .chunk_size(Some(500))
        .compression_threads(0);
    joint_state_log(options, steps.iter().copied(), <[u8]>::to_vec)
}

/// A log of joint states; each message is changed after its encoding.
pub(crate) fn joint_state_log(
    options: WriteOptions,
    steps: impl IntoIterator<Item = u64>,
    change: impl Fn(&[u8]) -> Vec<u8>,
) -> Vec<u8> {
    let mut log = options.create(Cursor::new(Vec::new())).unwrap();
    let schema = JointState::schema().as_bytes();
    let schema = log.add_schema(JointState::TYPE, "ros2msg", schema).unwrap();
    let channel_id = log
        .add_channel(schema, "/joint_states", "cdr", &[].into())
        .unwrap();
    let mut data = Vec::new();
    for k in steps {
        cdr::encode(&joint_state(k), &mut data).unwrap();
        let log_time = k * STEP_NS;
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time,
            publish_time: log_time,
        };
        log.write_to_known_channel(&header, &change(&data)).unwrap();
    }
    log.finish().unwrap();
    log.into_inner().into_inner()
}

/// Topic, log time and bytes of a message.
pub(crate) type Read = (String, u64, Vec<u8>);

/// All messages of a log, and its damage.
pub(crate) fn read(bytes: &[u8]) -> Result<(Vec<Read>, Vec<Damage>), LogError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    std::fs::write(&path, bytes).unwrap();
    read_file(&path)
}

/// All messages of a log in a file, and its damage.
pub(crate) fn read_file(path: &Path) -> Result<(Vec<Read>, Vec<Damage>), LogError> {
    let log = LogReader::open(path)?;
    let mut messages = log.messages();
    let read = messages
        .by_ref()
        .map(|message| message.map(|m| (m.topic.name.clone(), m.log_time_ns, m.data().to_vec())))
        .collect::<Result<_, _>>()?;
    Ok((read, messages.damage().to_vec()))
}

/// Returns a pseudorandom number and advances the seed.
pub(crate) fn random(seed: &mut u64) -> usize {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    (*seed >> 11) as usize
}
