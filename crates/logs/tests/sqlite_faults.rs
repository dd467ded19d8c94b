//! A database that is not a whole bag ends in one error that names the file and the fault.

use std::{fs, path::Path};

use crate::common::{
    Read, random, read_file,
    sqlite::{bag, change, create, fill, message, topic},
};
use tactid_logs::{LogReader, Message, messages::JointState};

/// Returns the error of a file, which is one line and names the file.
fn error(path: &Path) -> String {
    let error = read_file(path).unwrap_err().to_string();
    let name = path.file_name().unwrap().to_str().unwrap();
    assert!(error.contains(name), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    error
}

/// Returns the error of a bag after a change of its database.
fn error_after(statements: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    bag(&path, 3);
    change(&path, statements);
    error(&path)
}

/// Changes of a database after which it is no bag, and a part of the error that names them.
const NO_BAGS: [(&str, &str); 18] = [
    ("DROP TABLE topics", "no table `topics`"),
    ("DROP TABLE messages", "no table `messages`"),
    (
        "ALTER TABLE messages DROP COLUMN data",
        "table `messages` has no stored column `data`",
    ),
    (
        "ALTER TABLE topics RENAME COLUMN serialization_format TO format",
        "table `topics` has no stored column `serialization_format`",
    ),
    // A view could compute anything.
    (
        "ALTER TABLE messages RENAME TO other; CREATE VIEW messages AS SELECT * FROM other",
        "no table `messages`",
    ),
    (
        "ALTER TABLE messages DROP COLUMN data; \
         ALTER TABLE messages ADD COLUMN data BLOB AS (zeroblob(1000000000))",
        "table `messages` has no stored column `data`",
    ),
    (
        "UPDATE messages SET timestamp = 'noon' WHERE id = 4",
        "`messages` has a text as `timestamp` in row 4; expected nanoseconds since the epoch",
    ),
    (
        "UPDATE messages SET timestamp = -5 WHERE id = 4",
        "the integer -5 as `timestamp` in row 4; expected nanoseconds since the epoch",
    ),
    (
        "UPDATE messages SET data = 'text' WHERE id = 2",
        "a text as `data` in row 2",
    ),
    (
        "UPDATE messages SET topic_id = x'00' WHERE id = 2",
        "bytes as `topic_id` in row 2",
    ),
    (
        "UPDATE topics SET name = 1.5 + zeroblob(1) WHERE id = 2; \
         UPDATE topics SET type = x'00' WHERE id = 2",
        "bytes as `type` in row 2",
    ),
    (
        "CREATE TABLE other (id, name, type, serialization_format); \
         INSERT INTO other SELECT 1, name || id, type, serialization_format FROM topics; \
         DROP TABLE topics; ALTER TABLE other RENAME TO topics",
        "the integer 1 as `id` in row 2; expected another id for each topic",
    ),
    (
        "UPDATE topics SET name = '/' || hex(zeroblob(2048)) WHERE id = 2",
        "`topics` has 4097 bytes as `name` in row 2; expected at most 4096",
    ),
    (
        "UPDATE topics SET type = zeroblob(5000) WHERE id = 2",
        "`topics` has 5000 bytes as `type` in row 2; expected at most 4096",
    ),
    (
        "INSERT INTO metadata VALUES (3, 5, hex(zeroblob(8388608)) || 'a')",
        "`metadata` has 16777217 bytes as `metadata` in row 3; expected at most 16777216",
    ),
    (
        "ALTER TABLE messages RENAME TO other; CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id, timestamp, \
         data) WITHOUT ROWID; INSERT INTO messages SELECT * FROM other; DROP TABLE other",
        "table `messages` is WITHOUT ROWID",
    ),
    (
        "CREATE TABLE other (rowid TEXT, id, name, type, serialization_format); \
         INSERT INTO other SELECT 'a', id, name, type, serialization_format FROM topics; \
         DROP TABLE topics; ALTER TABLE other RENAME TO topics",
        "its table `topics` has a column `rowid`, which may hide its key",
    ),
    (
        "DELETE FROM topics WHERE id = 1",
        "message 1 belongs to topic 1, which is missing in its table `topics`",
    ),
];

#[test]
fn databases_that_are_not_bags_are_refused() {
    for (change, expected) in NO_BAGS {
        let error = error_after(change);
        assert!(error.contains(expected), "{change}: {error}");
    }
}

/// SQLite compares names of tables and columns without case, and a name may have 4096 bytes. A
/// description that is not by row numbers is not read.
#[test]
fn names_in_another_case_and_of_full_length_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    bag(&path, 3);
    let statements = "DROP TABLE metadata; CREATE TABLE metadata (metadata TEXT PRIMARY KEY) WITHOUT ROWID; \
                  INSERT INTO metadata VALUES ('text'); \
                  ALTER TABLE topics RENAME TO other; ALTER TABLE other RENAME TO Topics; \
                  ALTER TABLE messages RENAME COLUMN timestamp TO TimeStamp; \
                  UPDATE topics SET name = hex(zeroblob(2048)) WHERE id = 1";
    change(&path, statements);
    let (messages, _) = read_file(&path).unwrap();
    assert!(messages.iter().any(|(topic, ..)| topic.len() == 4096));
}

/// A table without constraints may lack the time of a message, which every order of reading finds.
#[test]
fn a_message_without_time_is_named() {
    for index in ["", "CREATE INDEX timestamp_idx ON messages (timestamp);"] {
        let error = error_after(&format!(
            "ALTER TABLE messages RENAME TO other; \
             CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id, timestamp, data); \
             INSERT INTO messages SELECT * FROM other; \
             UPDATE messages SET timestamp = NULL WHERE id = 3; \
             DROP TABLE other; {index}"
        ));
        assert!(error.contains("nothing as `timestamp` in row 3"), "{error}");
    }
}

#[test]
fn another_serialization_format_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    let bag = create(&path, 4, true);
    let id = topic(&bag, "/joints", JointState::TYPE, "protobuf");
    message(&bag, id, 5, b"{}");
    let first = tactid_logs::LogReader::open(&path)
        .unwrap()
        .messages()
        .next();
    let error = first.unwrap().unwrap().decode::<JointState>().unwrap_err();
    assert_eq!(
        error.to_string(),
        "topic /joints is encoded as \"protobuf\"; only \"cdr\" can be decoded"
    );
}

#[test]
fn a_cut_database_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    bag(&path, 100);
    let file = fs::File::options().write(true).open(&path).unwrap();
    let length = file.metadata().unwrap().len();
    for length in (16..length).rev().step_by(331) {
        file.set_len(length).unwrap();
        let error = error(&path);
        assert!(error.contains("damaged or cut off"), "{length}: {error}");
    }
}

/// Changed bytes cause no panic, and what is read is in order.
#[test]
fn changed_bytes_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    fill(&create(&path, 4, true), 0..100, <[u8]>::to_vec);
    let bytes = fs::read(&path).unwrap();
    let mut seed = 0x9e37_79b9_7f4a_7c15;
    let mut refused = 0;
    for _ in 0..1000 {
        let mut damaged = bytes.clone();
        for _ in 0..1 + random(&mut seed) % 20 {
            // Most of the structure is at the beginning of the pages.
            let page = random(&mut seed) % (bytes.len() / 4096) * 4096;
            let at = page + random(&mut seed) % [16, 200, 4096][random(&mut seed) % 3];
            damaged[at] ^= 1 << (random(&mut seed) % 8);
        }
        fs::write(&path, damaged).unwrap();
        match read_file(&path) {
            Ok((messages, _)) => assert!(messages.is_sorted_by_key(|message| message.1)),
            Err(error) => {
                refused += 1;
                assert_eq!(error.to_string().lines().count(), 1, "{error}");
            }
        }
        let _ = fs::remove_file(folder.path().join("run.db3-wal"));
    }
    assert!(refused > 100, "{refused}");
}

/// Returns a bag of three hundred small messages, and its messages.
fn small_bag(path: &Path) -> (Vec<u8>, Vec<Read>) {
    fill(&create(path, 4, true), 0..300, <[u8]>::to_vec);
    let (messages, damage) = read_file(path).unwrap();
    assert!(damage.is_empty());
    (fs::read(path).unwrap(), messages)
}

/// Asserts that a damaged bag is refused in one line, or has only messages of the whole bag.
fn assert_error_or_fewer(path: &Path, whole: &[Read], fault: &str) {
    match read_file(path) {
        Ok((messages, _)) => {
            let strange = messages.iter().find(|message| !whole.contains(message));
            assert!(strange.is_none(), "{fault}: {strange:?}");
            assert!(
                messages.len() <= whole.len(),
                "{fault}: a message is repeated"
            );
        }
        Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{fault}: {error}"),
    }
}

/// A bag that ends after any of its pages, or within it, is refused.
#[test]
fn a_bag_cut_at_any_page_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    let (bytes, _) = small_bag(&path);
    for page in 1..bytes.len() / 4096 {
        for length in [page * 4096, page * 4096 + 100] {
            fs::write(&path, &bytes[..length]).unwrap();
            error(&path);
        }
    }
}

/// A page that was lost, or overwritten by another one or by anything, is an error or costs
/// messages, but no number changes.
#[test]
fn a_bad_page_changes_no_message() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    let (bytes, whole) = small_bag(&path);
    let pages = bytes.len() / 4096;
    assert!(pages > 10, "{pages} pages");
    let mut seed = 0x9e37_79b9_7f4a_7c15;
    for page in 0..pages {
        let noise = (0..4096).map(|_| random(&mut seed) as u8).collect();
        let mut contents = vec![vec![0; 4096], vec![0xff; 4096], noise];
        contents.extend(bytes.chunks(4096).map(<[u8]>::to_vec));
        for (kind, content) in contents.iter().enumerate() {
            let mut damaged = bytes.clone();
            damaged[page * 4096..(page + 1) * 4096].copy_from_slice(content);
            fs::write(&path, damaged).unwrap();
            assert_error_or_fewer(&path, &whole, &format!("page {page}, content {kind}"));
            let _ = fs::remove_file(folder.path().join("run.db3-wal"));
        }
    }
}

/// A column that hides the key of the messages would make each block a search of the whole table.
#[test]
fn a_column_that_hides_the_key_is_refused() {
    for column in [
        "rowid",
        "RowId INTEGER",
        "rowid INTEGER PRIMARY KEY DESC",
        "rowid AS (hex(zeroblob(100000000)))",
    ] {
        let text = error_after(&format!(
            "DROP TABLE messages; \
             CREATE TABLE messages({column}, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        ));
        assert!(
            text.contains("a column `rowid`, which may hide its key"),
            "{text}"
        );
    }
}

/// A view in place of a table, which could run without end, is not read.
#[test]
fn views_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    bag(&path, 3);
    let view =
        "DROP TABLE IF EXISTS metadata; CREATE VIEW metadata AS SELECT 'of a view' AS metadata";
    change(&path, view);
    let log = LogReader::open(&path).unwrap();
    assert!(log.metadata().is_empty(), "{:?}", log.metadata());
}
