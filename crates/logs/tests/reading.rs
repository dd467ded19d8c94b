//! Reading of logs by other writers, in any order and several files, and of other files.

use std::{fs, io::Cursor, path::Path};

use crate::common::{
    STEP_NS, foreign_log, golden, joint_state, joint_state_log, log, read, sqlite::bag,
};
use mcap::{Compression, WriteOptions, records::MessageHeader};
use tactid_logs::{
    LogReader, Message,
    messages::{JointState, Time, WrenchStamped},
};

const START_NS: u64 = 1_700_000_000_000_000_000;

/// Checks a bag of `make_golden.py`, with 40 joint states and 20 wrenches of another writer.
fn check_golden_bag(path: &Path) {
    let log = LogReader::open(path).unwrap();
    let topics: Vec<_> = log
        .topics()
        .iter()
        .map(|t| (t.name.as_str(), t.count))
        .collect();
    assert_eq!(topics, [("/joint_states", 40), ("/wrench", 20)]);
    assert_eq!(
        log.topic("/joint_states").unwrap().type_name,
        JointState::TYPE
    );
    assert_eq!(
        log.topics_of::<WrenchStamped>().next().unwrap().name,
        "/wrench"
    );
    assert!((log.topic("/wrench").unwrap().frequency_hz().unwrap() - 50.0).abs() < 1e-9);
    assert_eq!(log.times_ns(), Some((START_NS, START_NS + 390_000_000)));
    assert!(log.metadata().contains_key("rosbag2"));

    for (k, message) in log.messages_on(["/joint_states"]).unwrap().enumerate() {
        let message = message.unwrap();
        assert_eq!(message.log_time_ns, START_NS + k as u64 * 10_000_000);
        let state: JointState = message.decode().unwrap();
        assert_eq!(state.stamp().unwrap(), Time::from_ns(message.log_time_ns));
        assert_eq!(state.position, [k as f64, -(k as f64)]);
        assert!(state.effort.is_empty());
    }
    let wrench: WrenchStamped = log
        .messages_on(["/wrench"])
        .unwrap()
        .last()
        .unwrap()
        .unwrap()
        .decode()
        .unwrap();
    assert_eq!(wrench.wrench.torque.y, 38.0);

    let mut all = log.messages();
    let times: Vec<u64> = all
        .by_ref()
        .map(|message| message.unwrap().log_time_ns)
        .collect();
    assert!(times.is_sorted());
    assert_eq!((times.len(), all.damage().len()), (60, 0));
}

#[test]
fn a_bag_of_another_writer_is_read() {
    check_golden_bag(&golden("bag"));
    check_golden_bag(&golden("bag/bag.mcap"));
}

/// Messages have the order of their times although the bag lists its files in another order.
#[test]
fn a_split_bag_with_zstd_is_read() {
    check_golden_bag(&golden("split"));
}

#[test]
fn a_killed_recording_without_metadata_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for part in ["part_0.mcap", "part_1.mcap"] {
        fs::copy(golden("split").join(part), folder.path().join(part)).unwrap();
    }
    check_golden_bag(folder.path());
    fs::copy(golden("bag/bag.mcap"), folder.path().join("other.mcap")).unwrap();
    let error = LogReader::open(folder.path()).unwrap_err().to_string();
    assert!(error.contains("different names"), "{error}");
}

/// Messages of overlapping chunks and messages that are out of order are sorted by time, and keep
/// the order of the log at equal times.
#[test]
fn out_of_order_is_put_in_order() {
    let steps: Vec<u64> = (0..60).map(|i| (i * 37) % 53).collect();
    let mut sorted = steps.clone();
    sorted.sort_unstable();
    for chunks in [true, false] {
        for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
            let (messages, damage) = read(&foreign_log(compression, chunks, &steps)).unwrap();
            let times: Vec<u64> = messages.iter().map(|m| m.1 / STEP_NS).collect();
            assert_eq!(times, sorted);
            assert!(damage.is_empty());
        }
    }
}

/// A log has the same topics with its index, without it, and without chunks.
#[test]
fn topics_are_the_same_without_an_index() {
    let folder = tempfile::tempdir().unwrap();
    let open = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        LogReader::open(path).unwrap()
    };
    let whole = log(25);
    let indexed = open("whole.mcap", &whole);
    let cut = open("cut.mcap", &whole[..whole.len() - 1]);
    assert!(indexed.damage().is_empty() && !cut.damage().is_empty());
    assert_eq!(indexed.topics(), cut.topics());
    assert_eq!(indexed.metadata(), cut.metadata());
    assert_eq!(indexed.topics()[0].times_ns, Some((0, 24 * STEP_NS)));
    assert_eq!(indexed.metadata()["first"]["key"], "value");
}

/// A writer may leave the schemas out of the index, and with them the types of the topics.
#[test]
fn topics_have_types_without_schemas_in_the_index() {
    let options = WriteOptions::new().repeat_schemas(false);
    let bytes = joint_state_log(options, 0..10, <[u8]>::to_vec);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    fs::write(&path, bytes).unwrap();
    let log = LogReader::open(path).unwrap();
    let topic = log.topics_of::<JointState>().next().unwrap();
    assert_eq!((topic.name.as_str(), topic.count), ("/joint_states", 10));
    assert!(log.damage().is_empty());
}

#[test]
fn files_that_are_not_logs_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, &[u8], &str); 5] = [
        ("empty.mcap", b"", "it is empty"),
        (
            "text.mcap",
            b"hello, world, this is text",
            "does not start with the bytes of one",
        ),
        ("cut.db3", b"SQLite format 3\0aaaaaaa", "damaged or cut off"),
        ("one.bag", b"#ROSBAG V2.0\n1234567", "ROS 1 bag"),
        (
            "a.mcap.zstd",
            b"\x28\xb5\x2f\xfd12345678",
            "cannot be decompressed",
        ),
    ];
    for (name, bytes, expected) in cases {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = LogReader::open(&path).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(expected), "{error}");
    }
    let missing = folder.path().join("missing.mcap");
    let error = LogReader::open(&missing).unwrap_err().to_string();
    assert!(
        error.contains("cannot open") && error.contains("missing.mcap"),
        "{error}"
    );
}

#[test]
fn folders_that_are_not_bags_are_refused() {
    let bag = |yaml: Option<&str>| {
        let folder = tempfile::tempdir().unwrap();
        if let Some(yaml) = yaml {
            fs::write(folder.path().join("metadata.yaml"), yaml).unwrap();
        }
        let error = LogReader::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains(folder.path().to_str().unwrap()), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
        error
    };
    let info = |fields: &str| format!("rosbag2_bagfile_information:\n{fields}");
    assert!(bag(None).contains("neither metadata.yaml nor an .mcap or .db3 file"));
    assert!(bag(Some("{ not yaml")).contains("metadata.yaml"));
    assert!(bag(Some("other: 1")).contains("rosbag2_bagfile_information"));
    let other = info("  storage_identifier: leveldb\n  relative_file_paths: [a.ldb]\n");
    assert!(bag(Some(&other)).contains("stored as leveldb, not as mcap or sqlite3"));
    let packed = "  storage_identifier: mcap\n  relative_file_paths: [a.mcap]\n  \
                  compression_mode: FILE\n  compression_format: bz2\n";
    assert!(bag(Some(&info(packed))).contains("each file is compressed as \"bz2\""));
    let gone = info("  storage_identifier: mcap\n  relative_file_paths: [gone.mcap]\n");
    assert!(bag(Some(&gone)).contains("gone.mcap"));
}

#[test]
fn wrong_topics_and_types_are_named() {
    let log = LogReader::open(golden("bag")).unwrap();
    let error = log.messages_on(["/joints"]).unwrap_err().to_string();
    assert!(
        error.contains("/joints") && error.contains("/joint_states, /wrench"),
        "{error}"
    );
    let message = log
        .messages_on(["/wrench"])
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let error = message.decode::<JointState>().unwrap_err().to_string();
    let expected =
        "topic /wrench holds geometry_msgs/msg/WrenchStamped, not sensor_msgs/msg/JointState";
    assert_eq!(error, expected);
}

/// The errors for a message in another encoding and for one with too few bytes name the topic.
#[test]
fn messages_that_cannot_be_decoded_are_named() {
    let mut log = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    // The definition may be IDL, because messages are decoded by the name of their type.
    let schema = log
        .add_schema("sensor_msgs/msg/JointState", "ros2idl", b"")
        .unwrap();
    for (topic, encoding) in [("/json", "json"), ("/short", "cdr")] {
        let channel_id = log
            .add_channel(schema, topic, encoding, &[].into())
            .unwrap();
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time: 7,
            publish_time: 7,
        };
        log.write_to_known_channel(&header, &[0, 1, 0, 0, 9, 0, 0, 0])
            .unwrap();
    }
    log.finish().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    fs::write(&path, log.into_inner().into_inner()).unwrap();

    let log = LogReader::open(&path).unwrap();
    let error =
        |message: tactid_logs::RawMessage| message.decode::<JointState>().unwrap_err().to_string();
    let errors: Vec<String> = log
        .messages()
        .map(|message| error(message.unwrap()))
        .collect();
    assert_eq!(
        errors[0],
        "topic /json is encoded as \"json\"; only \"cdr\" can be decoded"
    );
    assert!(
        errors[1].starts_with("message on /short at 7 ns: ends within"),
        "{}",
        errors[1]
    );
}

/// Recordings of others are read completely. They are not part of the repository.
#[test]
fn the_logs_of_others_are_read() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/utias");
    if !data.is_dir() {
        eprintln!("skipped: there is no {}", data.display());
        return;
    }
    for entry in fs::read_dir(data).unwrap() {
        let path = entry.unwrap().path();
        if !path.is_dir() {
            continue;
        }
        let log = LogReader::open(&path).unwrap();
        let expected: u64 = log.topics().iter().map(|topic| topic.count).sum();
        let mut messages = log.messages();
        assert_eq!(
            messages.by_ref().filter(|m| m.is_ok()).count() as u64,
            expected
        );
        assert!(
            expected > 0 && messages.damage().is_empty(),
            "{}",
            path.display()
        );
        for topic in log.topics_of::<WrenchStamped>() {
            for message in log.messages_on([&topic.name]).unwrap() {
                message.unwrap().decode::<WrenchStamped>().unwrap();
            }
        }
    }
}

/// A log that another one replaces between the reading of its index and of its messages is an
/// error, and no mixture of both.
#[test]
fn a_replaced_file_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let (mcap, database) = (folder.path().join("a.mcap"), folder.path().join("a.db3"));
    fs::write(&mcap, log(50)).unwrap();
    bag(&database, 50);
    for path in [&mcap, &database] {
        let log = LogReader::open(path).unwrap();
        let copy = folder.path().join("copy");
        fs::copy(path, &copy).unwrap();
        fs::rename(&copy, path).unwrap();
        let mut messages = log.messages();
        let error = messages.next().unwrap().unwrap_err().to_string();
        let expected = "another file has taken its place since it was opened";
        assert!(
            error.contains("/a.") && error.ends_with(expected),
            "{error}"
        );
        assert!(messages.next().is_none());
    }
}

/// The bytes of a message stay valid after the reader is dropped.
#[test]
fn messages_outlive_the_reader() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    fs::write(&path, log(25)).unwrap();
    let messages: Vec<_> = LogReader::open(&path)
        .unwrap()
        .messages_on(["/joint_states"])
        .unwrap()
        .collect();
    for (k, message) in messages.into_iter().enumerate() {
        assert_eq!(
            message.unwrap().decode::<JointState>().unwrap(),
            joint_state(k as u64)
        );
    }
}

/// Messages since a time are the later ones of the whole log, in any storage and any order.
#[test]
fn messages_since_a_time_are_the_later_ones() {
    let folder = tempfile::tempdir().unwrap();
    let shuffled: Vec<u64> = (0..100).map(|k| (k * 37) % 100).collect();
    let mut logs = Vec::new();
    for (name, chunks) in [("chunks.mcap", true), ("plain.mcap", false)] {
        let path = folder.path().join(name);
        fs::write(&path, foreign_log(None, chunks, &shuffled)).unwrap();
        logs.push(LogReader::open(&path).unwrap());
    }
    let path = folder.path().join("bag.db3");
    bag(&path, 100);
    logs.push(LogReader::open(&path).unwrap());
    let in_memory: Vec<_> = logs[0].messages().map(Result::unwrap).collect();
    logs.push(LogReader::of_messages("memory", &in_memory));
    for log in logs {
        let times = |begin_ns: u64| -> Vec<u64> {
            let messages = log.messages_on(["/joint_states"]).unwrap().since(begin_ns);
            messages
                .map(|message| message.unwrap().log_time_ns)
                .collect()
        };
        for begin in [0, 1, 40, 99, 100] {
            let mut expected = times(0);
            assert_eq!(expected.len(), 100);
            expected.retain(|time_ns| *time_ns >= begin * STEP_NS);
            assert_eq!(times(begin * STEP_NS), expected, "{}", log.path().display());
        }
    }
}
