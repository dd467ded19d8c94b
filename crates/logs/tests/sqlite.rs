//! SQLite bags have the same messages as MCAP logs: every version of their schema, in any order of
//! rows, finished or not, and while another process writes them.

use std::{fs, path::Path};

use crate::common::{
    STEP_NS, log, read, read_file,
    sqlite::{bag, create, fill, message, topic},
};
use rusqlite::Connection;
use tactid_logs::{LogReader, Message, messages::JointState};

/// Returns the names of the files in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn every_schema_has_the_messages_of_mcap() {
    let (expected, _) = read(&log(25)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for schema in 1..=4 {
        for index in [true, false] {
            let path = folder.path().join(format!("{schema}_{index}.db3"));
            fill(&create(&path, schema, index), 0..25, <[u8]>::to_vec);
            let (messages, damage) = read_file(&path).unwrap();
            assert_eq!(messages, expected, "schema {schema}, index {index}");
            assert!(damage.is_empty());

            let log = LogReader::open(&path).unwrap();
            let topic = log.topic("/joint_states").unwrap();
            assert_eq!((topic.count, topic.encoding.as_str()), (25, "cdr"));
            assert_eq!(topic.times_ns, Some((0, 24 * STEP_NS)));
            assert_eq!(topic.type_name, JointState::TYPE);
            assert_eq!(log.metadata().contains_key("rosbag2"), schema == 4);
        }
    }
}

/// Messages are in the order of their times, and of their rows at equal times, in any order of rows
/// and across the parts that are read at once.
#[test]
fn rows_out_of_order_are_put_in_order() {
    let count = 10_007;
    let folder = tempfile::tempdir().unwrap();
    let orders: [(&str, &dyn Fn(u64) -> u64); 5] = [
        ("in order", &|k| k),
        ("in order but the last", &|k| k % (count - 1)),
        ("backwards", &|k| count - k),
        ("shuffled", &|k| (k * 3571) % count),
        ("at one time", &|_| 7),
    ];
    for (name, time) in orders {
        for index in [true, false] {
            let path = folder.path().join(format!("{name} {index}.db3"));
            let bag = create(&path, 3, index);
            let transaction = bag.unchecked_transaction().unwrap();
            let ids = ["/a", "/b"].map(|name| topic(&bag, name, JointState::TYPE, "cdr"));
            let mut expected = Vec::new();
            for k in 0..count {
                message(&bag, ids[k as usize % 2], time(k), &k.to_le_bytes());
                expected.push((time(k), k));
            }
            transaction.commit().unwrap();
            expected.sort();
            let (messages, _) = read_file(&path).unwrap();
            let number = |data: Vec<u8>| u64::from_le_bytes(data.try_into().unwrap());
            let found: Vec<_> = messages
                .into_iter()
                .map(|(_, time_ns, data)| (time_ns, number(data)))
                .collect();
            assert!(found == expected, "{name}, index {index}");

            let log = LogReader::open(&path).unwrap();
            let counts: u64 = log.topics().iter().map(|topic| topic.count).sum();
            assert_eq!(counts, count, "{name}, index {index}");
            let only = log.messages_on(["/b"]).unwrap();
            assert_eq!(only.count() as u64, count / 2);
        }
    }
}

/// A row with an earlier time makes the rows be read in the order of their times. The index then
/// counts no more memory than that of a bag in order.
#[test]
fn a_late_row_needs_no_more_memory() {
    let folder = tempfile::tempdir().unwrap();
    let least_bytes = [3 * 4096, 3 * 4096 - 1].map(|late_row| {
        let path = folder.path().join(format!("{late_row}.db3"));
        let bag = create(&path, 3, true);
        let transaction = bag.unchecked_transaction().unwrap();
        let id = topic(&bag, "/a", JointState::TYPE, "cdr");
        for k in 0..3 * 4096 {
            message(&bag, id, k % late_row, &[]);
        }
        transaction.commit().unwrap();
        let sizes: Vec<u64> = (0..1 << 14).collect();
        sizes.partition_point(|&bytes| LogReader::open_within(&path, bytes).is_err())
    });
    assert_eq!(least_bytes[0], least_bytes[1]);
}

/// A bag that another process writes is read as far as it is committed, in every mode of the
/// journal, and nothing is added later.
#[test]
fn a_bag_is_read_while_it_is_written() {
    for mode in ["DELETE", "TRUNCATE", "PERSIST", "MEMORY", "WAL", "OFF"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.db3");
        let writer = create(&path, 4, true);
        writer.pragma_update(None, "journal_mode", mode).unwrap();
        fill(&writer, 0..10, <[u8]>::to_vec);
        writer.execute_batch("BEGIN IMMEDIATE").unwrap();
        message(&writer, 1, 10 * STEP_NS, b"not committed");
        assert_eq!(read_file(&path).unwrap().0.len(), 20, "{mode}");

        let log = LogReader::open(&path).unwrap();
        writer.execute_batch("COMMIT").unwrap();
        assert_eq!(log.messages().count(), 20, "{mode}");
        let mut messages = log.messages();
        messages.next().unwrap().unwrap();
        message(&writer, 1, 11 * STEP_NS, b"while it is read");
        assert_eq!(messages.count(), 19, "{mode}");
        assert_eq!(read_file(&path).unwrap().0.len(), 22, "{mode}");
    }
}

/// Reading changes neither a bag nor its folder, also where a finished bag uses a write-ahead log.
#[test]
fn reading_leaves_no_trace() {
    for mode in ["DELETE", "WAL"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a bag?#%20é.db3");
        let writer = create(&path, 4, true);
        writer.pragma_update(None, "journal_mode", mode).unwrap();
        fill(&writer, 0..10, <[u8]>::to_vec);
        writer.close().unwrap();
        let bytes = fs::read(&path).unwrap();
        assert_eq!(read_file(&path).unwrap().0.len(), 20);
        assert_eq!(fs::read(&path).unwrap(), bytes);
        assert_eq!(names(folder.path()), ["a bag?#%20é.db3"], "{mode}");
    }
}

/// Copies a bag as a killed recorder leaves it: with the file that it keeps beside the database.
fn killed(path: &Path, suffix: &str, to: &Path) {
    for suffix in ["", suffix] {
        let name = format!("run.db3{suffix}");
        fs::copy(path.with_file_name(&name), to.join(&name)).unwrap();
    }
}

#[test]
fn the_write_ahead_log_of_a_killed_recorder_is_read() {
    let (folder, copy) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = folder.path().join("run.db3");
    let writer = create(&path, 4, true);
    writer.pragma_update(None, "journal_mode", "WAL").unwrap();
    fill(&writer, 0..10, <[u8]>::to_vec);
    killed(&path, "-wal", copy.path());
    assert_eq!(read_file(copy.path()).unwrap().0.len(), 20);
}

/// A journal that must be rolled back needs write access, which a reader does not take.
#[test]
fn the_journal_of_a_killed_recorder_is_named() {
    let (folder, copy) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = folder.path().join("run.db3");
    let writer = create(&path, 4, true);
    fill(&writer, 0..10, <[u8]>::to_vec);
    writer
        .execute_batch("PRAGMA cache_size = 2; BEGIN IMMEDIATE")
        .unwrap();
    for k in 0..1000 {
        message(&writer, 1, k, &[0; 1000]);
    }
    killed(&path, "-journal", copy.path());
    let error = read_file(&copy.path().join("run.db3"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("run.db3-journal"), "{error}");
    assert!(error.contains("quick_check"), "{error}");
}

#[test]
fn a_locked_bag_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    bag(&path, 10);
    let other = Connection::open(&path).unwrap();
    other.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let error = read_file(&path).unwrap_err().to_string();
    assert!(
        error.contains("run.db3") && error.contains("another process has locked it"),
        "{error}"
    );
}

/// Recordings of others, with both ages of the schema, are read completely. They are not part of
/// the repository.
#[test]
fn the_bags_of_others_are_read() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/unisa");
    if !data.is_dir() {
        eprintln!("skipped: there is no {}", data.display());
        return;
    }
    for (name, count) in [("panda", 727), ("ur10", 3441)] {
        let path = data.join(format!("{name}_exciting_trajectory.db3"));
        let messages = LogReader::open(&path).unwrap().messages();
        let states = messages.map(|message| message.unwrap().decode::<JointState>().unwrap());
        let names = states.map(|state| state.name.len()).collect::<Vec<_>>();
        assert_eq!(names.len(), count, "{name}");
        assert!(names.iter().all(|count| *count >= 6));
    }
}
