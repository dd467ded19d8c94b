//! Logs that the writer leaves, also after an error.

use std::{fs, io::Cursor, ops::ControlFlow, path::Path};

use crate::common::{
    STEP_NS, golden, joint_state, log, read_file,
    sqlite::{create, fill},
};
use mcap::records::{Record, op};
use tactid_logs::{
    Durability, LogError, LogReader, LogWriter, merge_logs,
    messages::{JointState, StringMsg},
};

#[test]
fn the_same_messages_give_the_same_bytes() {
    assert_eq!(log(30), log(30));
}

/// Returns the bytes of a log of a description and a state of the joints.
fn two_messages() -> Vec<u8> {
    let mut log = LogWriter::new(Cursor::new(Vec::new())).unwrap();
    let urdf = log
        .channel("/robot_description", Durability::TransientLocal)
        .unwrap();
    let joints = log.channel("/joint_states", Durability::Volatile).unwrap();
    log.write(
        &urdf,
        5,
        &StringMsg {
            data: "<robot/>".to_owned(),
        },
    )
    .unwrap();
    log.write(&joints, 9, &joint_state(0)).unwrap();
    log.finish().unwrap().into_inner()
}

/// A log contains what rosbag2 needs: profile, encodings, quality of service, and an index of
/// messages for every chunk.
#[test]
fn a_log_is_as_rosbag2_writes_it() {
    let bytes = two_messages();
    let header = mcap::read::LinearReader::new(&bytes)
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let Record::Header(header) = header else {
        panic!("no header")
    };
    assert_eq!(header.profile, "ros2");
    assert_eq!(
        header.library,
        concat!("tactid ", env!("CARGO_PKG_VERSION"))
    );

    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let channel = |topic: &str| {
        summary
            .channels
            .values()
            .find(|c| c.topic == topic)
            .unwrap()
    };
    let qos = |topic| channel(topic).metadata["offered_qos_profiles"].as_str();
    assert!(qos("/robot_description").contains("\n  durability: transient_local\n"));
    assert!(qos("/joint_states").contains("\n  durability: volatile\n"));
    assert_eq!(channel("/joint_states").message_encoding, "cdr");
    assert_eq!(
        channel("/joint_states").schema.as_ref().unwrap().encoding,
        "ros2msg"
    );
    let indexed = |chunk: &mcap::records::ChunkIndex| !chunk.message_index_offsets.is_empty();
    assert!(summary.chunk_indexes.iter().all(indexed));
    assert_eq!(summary.stats.unwrap().message_count, 2);
}

/// A log has the metadata record of rosbag2.
#[test]
fn a_log_has_the_metadata_of_rosbag2() {
    let bytes = two_messages();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let index = &summary.metadata_indexes[0];
    let body = &bytes[index.offset as usize + 9..(index.offset + index.length) as usize];
    let Record::Metadata(record) = mcap::parse_record(op::METADATA, body).unwrap() else {
        panic!("no metadata")
    };
    let yaml = &record.metadata["serialized_metadata"];
    assert_eq!(record.name, "rosbag2");
    for line in [
        "version: 9",
        "message_count: 2",
        "  nanoseconds: 4",
        "  - log.mcap",
    ] {
        assert!(yaml.lines().any(|l| l == line), "{line} is not in\n{yaml}");
    }
}

/// The log of a killed writer has all messages except the last second's.
#[test]
fn a_killed_writer_leaves_all_but_the_last_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut log = LogWriter::create(&path).unwrap();
    assert!(LogReader::open(&path).unwrap().topics().is_empty());
    let joints = log.channel("/joint_states", Durability::Volatile).unwrap();
    for k in 0..35 {
        log.write(&joints, k * STEP_NS, &joint_state(k)).unwrap();
        let read = LogReader::open(&path).unwrap();
        let count = read.topic("/joint_states").map_or(0, |topic| topic.count);
        assert_eq!(count, k / 10 * 10, "at step {k}");
    }
    // As after a kill, no code of the writer runs any more.
    std::mem::forget(log);
    let log = LogReader::open(&path).unwrap();
    assert_eq!(log.messages().count(), 30);
    assert_eq!(log.damage().len(), 1);
}

/// The log of a writer that is dropped, as after an error of the program, has its index.
#[test]
fn a_dropped_writer_leaves_a_whole_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut log = LogWriter::create(&path).unwrap();
    let joints = log.channel("/joint_states", Durability::Volatile).unwrap();
    log.write(&joints, 1, &joint_state(1)).unwrap();
    drop(log);
    let log = LogReader::open(&path).unwrap();
    assert_eq!((log.topics()[0].count, log.damage().len()), (1, 0));
}

#[test]
fn an_empty_log_is_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut log = LogWriter::create(&path).unwrap();
    log.channel::<JointState>("/joint_states", Durability::Volatile)
        .unwrap();
    log.finish().unwrap();
    let log = LogReader::open(&path).unwrap();
    assert_eq!((log.times_ns(), log.messages().count()), (None, 0));
    assert_eq!(
        (log.topics()[0].count, log.topics()[0].frequency_hz()),
        (0, None)
    );
}

#[test]
fn a_path_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for path in [
        folder.path().join("no/such/run.mcap"),
        folder.path().to_owned(),
    ] {
        let error = LogWriter::create(&path).unwrap_err().to_string();
        assert!(
            error.starts_with(&format!("cannot create {}: ", path.display())),
            "{error}"
        );
    }
}

/// A full disk is reported by a write and not only at the end.
#[test]
fn a_full_disk_is_an_error() {
    let full = Path::new("/dev/full");
    if !full.exists() {
        eprintln!("skipped: there is no /dev/full");
        return;
    }
    let error = LogWriter::create(full).unwrap_err();
    assert!(
        error.to_string().starts_with("cannot write /dev/full: "),
        "{error}"
    );
}

#[test]
fn topics_are_checked() {
    let mut log = LogWriter::new(Cursor::new(Vec::new())).unwrap();
    log.channel::<JointState>("/joint_states", Durability::Volatile)
        .unwrap();
    for (topic, expected) in [
        ("/joint_states", "already"),
        ("joints", "starts with"),
        ("/a b", "letters, digits"),
    ] {
        let error = log
            .channel::<JointState>(topic, Durability::Volatile)
            .unwrap_err();
        assert!(matches!(error, LogError::BadTopic { .. }));
        assert!(error.to_string().contains(expected), "{error}");
    }
}

/// A channel can only be used with its own log.
#[test]
fn a_channel_of_another_log_is_refused() {
    let mut one = LogWriter::new(Cursor::new(Vec::new())).unwrap();
    let mut other = LogWriter::new(Cursor::new(Vec::new())).unwrap();
    let joints = one.channel("/joint_states", Durability::Volatile).unwrap();
    assert!(other.write(&joints, 0, &joint_state(0)).is_err());
}

/// An existing file is replaced, and a log can be read while it is written.
#[test]
fn an_existing_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    fs::write(&path, "something else that is longer than a header").unwrap();
    LogWriter::create(&path).unwrap().finish().unwrap();
    assert_eq!(LogReader::open(&path).unwrap().damage().len(), 0);
}

/// Two writers of one log would leave a file that is neither's. The second one is refused, and the
/// first log is whole.
#[test]
fn a_log_that_is_being_written_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    fs::write(&path, "an older file").unwrap();
    let first = LogWriter::create(&path).unwrap();
    let second = LogWriter::create(&path).map(drop).unwrap_err().to_string();
    assert!(
        second.contains("run.mcap: another program is writing"),
        "{second}"
    );
    first.finish().unwrap();
    assert!(LogReader::open(&path).unwrap().damage().is_empty());
    LogWriter::create(&path).unwrap().finish().unwrap();
}

/// A pipe that nobody reads is refused at once, instead of a wait that no signal ends.
#[cfg(unix)]
#[test]
fn a_pipe_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo")
        .arg(&path)
        .status()
        .unwrap();
    assert!(made.success());
    let error = LogWriter::create(&path).map(drop).unwrap_err().to_string();
    assert!(error.contains("pipe: a log needs a file"), "{error}");
}

/// Two logs become one, in which every message and every topic is as it was, of MCAP and of SQLite,
/// and the description of the bag is that of the new log.
#[test]
fn merged_logs_keep_their_messages() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second, merged] =
        ["a.db3", "b.mcap", "bag/log_0.mcap"].map(|n| folder.path().join(n));
    fs::create_dir(folder.path().join("bag")).unwrap();
    fill(&create(&first, 4, true), 0..25, <[u8]>::to_vec);
    fs::write(&second, two_messages()).unwrap();
    for other in [&first, &golden("bag")] {
        let logs = [other, &second].map(|path| LogReader::open(path).unwrap());
        let progress = &mut |_| ControlFlow::Continue(());
        let found = merge_logs(&[&logs[0], &logs[1]], &merged, "log_0.mcap", progress).unwrap();
        fs::write(folder.path().join("bag/metadata.yaml"), &found.bag_metadata).unwrap();
        assert!(found.damage.is_empty());
        let mut expected = [read_file(other).unwrap().0, read_file(&second).unwrap().0].concat();
        expected.sort_by_key(|message| message.1);
        assert_eq!(read_file(&folder.path().join("bag")).unwrap().0, expected);
        let log = LogReader::open(&merged).unwrap();
        for (topic, from) in log.topics().iter().zip(&logs).filter(|(topic, from)| {
            let same = from
                .topics()
                .iter()
                .filter(|other| other.name == topic.name);
            same.count() == 1
        }) {
            let (was, is) = (from.definition(topic), log.definition(topic));
            assert!(is.schema.starts_with(b"std_msgs/Header header") || was.schema == is.schema);
            assert!(is.metadata["offered_qos_profiles"].contains("durability"));
        }
        let yaml = &log.metadata()["rosbag2"]["serialized_metadata"];
        assert!(
            yaml.contains(&format!("message_count: {}", expected.len())),
            "{yaml}"
        );
        let stop = &mut |_| ControlFlow::Break(());
        let many = LogReader::open(&merged).unwrap();
        let stopped = merge_logs(&[&many; 8], &folder.path().join("c"), "c", stop);
        assert!(matches!(stopped, Err(LogError::Interrupted)), "{stopped:?}");
    }
}
