//! SQLite bags to test with.

use std::path::Path;

use rusqlite::{Connection, params};
use tactid_logs::{Message, cdr, messages::JointState, messages::WrenchStamped};

use super::{STEP_NS, joint_state, wrench};

/// Tables of the four versions of rosbag2's schema.
const TOPICS: [&str; 4] = [
    "",
    ", offered_qos_profiles TEXT NOT NULL",
    ", offered_qos_profiles TEXT NOT NULL",
    ", offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL",
];

/// Creates a bag without messages, as the version of rosbag2 with this schema does.
pub(crate) fn create(path: &Path, schema: usize, index: bool) -> Connection {
    let bag = Connection::open(path).unwrap();
    let more = TOPICS[schema - 1];
    bag.execute_batch(&format!(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
         serialization_format TEXT NOT NULL{more}); \
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, \
         data BLOB NOT NULL);"
    ))
    .unwrap();
    if index {
        bag.execute_batch("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
            .unwrap();
    }
    if schema >= 3 {
        bag.execute_batch(
            "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL); \
             CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);",
        )
        .unwrap();
    }
    if schema >= 4 {
        bag.execute_batch(
            "INSERT INTO metadata VALUES (1, 8, 'storage_identifier: sqlite3'); \
             CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, \
             encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);",
        )
        .unwrap();
    }
    bag
}

/// Executes statements on a bag that is not open.
pub(crate) fn change(path: &Path, statements: &str) {
    let bag = Connection::open(path).unwrap();
    bag.execute_batch(statements).unwrap();
    bag.close().unwrap();
}

/// Adds a topic and returns its number.
pub(crate) fn topic(bag: &Connection, name: &str, type_name: &str, format: &str) -> i64 {
    let count = bag.prepare("SELECT * FROM topics").unwrap().column_count();
    let more = ", ''".repeat(count - 4);
    bag.execute(
        &format!("INSERT INTO topics VALUES (NULL, ?, ?, ?{more})"),
        params![name, type_name, format],
    )
    .unwrap();
    bag.last_insert_rowid()
}

/// Adds a message.
pub(crate) fn message(bag: &Connection, topic: i64, time_ns: u64, data: &[u8]) {
    bag.execute(
        "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
        params![topic, time_ns as i64, data],
    )
    .unwrap();
}

/// Adds the messages of `common::log` over these tenths of a second, each packed first.
pub(crate) fn fill(
    bag: &Connection,
    steps: impl IntoIterator<Item = u64>,
    pack: impl Fn(&[u8]) -> Vec<u8>,
) {
    let joints = topic(bag, "/joint_states", JointState::TYPE, "cdr");
    let wrenches = topic(bag, "/wrench", WrenchStamped::TYPE, "cdr");
    let transaction = bag.unchecked_transaction().unwrap();
    let mut data = Vec::new();
    for k in steps {
        cdr::encode(&joint_state(k), &mut data).unwrap();
        message(bag, joints, k * STEP_NS, &pack(&data));
        cdr::encode(&wrench(k), &mut data).unwrap();
        message(bag, wrenches, k * STEP_NS, &pack(&data));
    }
    transaction.commit().unwrap();
}

/// Writes a finished bag with the messages of `common::log`.
pub(crate) fn bag(path: &Path, steps: u64) {
    let bag = create(path, 4, true);
    fill(&bag, 0..steps, <[u8]>::to_vec);
}
