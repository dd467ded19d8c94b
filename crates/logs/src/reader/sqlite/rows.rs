//! Rows of messages: their order and their headers.

use rusqlite::{Connection, Row, types::ValueRef};

use super::database::Problem;
use crate::{database_fault::DatabaseFault, reader::storage::ChannelId};

/// Description of a valid time of a message.
const NANOSECONDS: &str = "nanoseconds since the epoch";

/// Order in which rows are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// By time, and by row at equal times, with the index that rosbag2 creates.
    Time,
    /// By row, as they were written, in a bag without this index.
    Row,
}

/// Time and number of a row of `messages`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    pub(super) timestamp: i64,
    pub(super) row: i64,
}

/// First and last of the rows that are read at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    pub(super) first: Key,
    pub(super) last: Key,
}

impl Order {
    /// Returns the order in which a bag is read.
    pub(super) fn of(connection: &Connection) -> rusqlite::Result<Self> {
        let has_index = "SELECT 1 FROM pragma_index_list('messages') AS list, \
                         pragma_index_info(list.name) AS part \
                         WHERE part.seqno = 0 AND part.name = 'timestamp' AND NOT list.partial";
        let mut found = connection.prepare(has_index)?;
        Ok(if found.exists([])? {
            Self::Time
        } else {
            Self::Row
        })
    }

    /// Returns the columns by which rows are ordered.
    pub(super) fn columns(self) -> &'static str {
        match self {
            Self::Time => "timestamp, rowid",
            Self::Row => "rowid",
        }
    }

    /// Returns the condition that a row is in a relation, such as `<=`, to a key.
    pub(super) fn condition(self, relation: &str, key: Key) -> String {
        let Key { timestamp, row } = key;
        match self {
            Self::Time => format!("(timestamp, rowid) {relation} ({timestamp}, {row})"),
            Self::Row => format!("rowid {relation} {row}"),
        }
    }
}

/// Header of a message, which the first three columns of a query are: `rowid, timestamp, topic_id`.
pub(super) struct MessageRow {
    pub(super) key: Key,
    pub(super) log_time_ns: u64,
    pub(super) topic: ChannelId,
}

impl MessageRow {
    pub(super) fn of(row: &Row<'_>) -> Result<Self, Problem> {
        let number = row.get(0)?;
        let unexpected =
            |column, value, expected| unexpected("messages", number, (column, value), expected);
        let (time, topic) = (row.get_ref(1)?, row.get_ref(2)?);
        let ValueRef::Integer(timestamp) = time else {
            return Err(unexpected("timestamp", time, NANOSECONDS));
        };
        let ValueRef::Integer(topic) = topic else {
            return Err(unexpected("topic_id", topic, "an integer"));
        };
        Ok(Self {
            key: Key {
                timestamp,
                row: number,
            },
            log_time_ns: u64::try_from(timestamp)
                .map_err(|_| unexpected("timestamp", time, NANOSECONDS))?,
            topic,
        })
    }
}

/// Returns the problem of a value in a column of a table that is not as expected.
pub(super) fn unexpected(
    table: &'static str,
    row: i64,
    (column, value): (&'static str, ValueRef<'_>),
    expected: &'static str,
) -> Problem {
    let found = match value {
        ValueRef::Null => "nothing".to_owned(),
        ValueRef::Integer(number) => format!("the integer {number}"),
        ValueRef::Real(number) => format!("the number {number}"),
        ValueRef::Text(_) => "a text".to_owned(),
        ValueRef::Blob(_) => "bytes".to_owned(),
    };
    let fault = DatabaseFault::Value {
        table,
        column,
        row,
        found,
        expected,
    };
    fault.into()
}
