//! Rows of messages: their order and their headers.

use rusqlite::{Connection, Row, types::ValueRef};

use super::database::Problem;
use crate::reader::storage::ChannelId;

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

/// The rows that are read at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    pub(super) first: Key,
    pub(super) last: Key,
    /// Number of bytes of their messages.
    pub(super) bytes: u64,
}

impl Order {
    /// Returns the order in which a bag is read.
    pub(super) fn of(connection: &Connection) -> rusqlite::Result<Self> {
        // With another column in the index, or times that descend, SQLite would sort all rows of
        // equal times for each segment.
        let has_index = "SELECT 1 FROM pragma_index_list('messages') AS list \
                         WHERE NOT list.partial AND (SELECT count(*) = 1 AND max(name) = 'timestamp' AND NOT max(desc) \
                         FROM pragma_index_xinfo(list.name) WHERE key)";
        let mut found = connection.prepare(has_index)?;
        Ok(if found.exists([])? {
            Self::Time
        } else {
            Self::Row
        })
    }

    /// Returns whether a row comes before another one in this order.
    pub(super) fn is_before(self, first: Key, second: Key) -> bool {
        match self {
            Self::Time => (first.timestamp, first.row) < (second.timestamp, second.row),
            Self::Row => first.row < second.row,
        }
    }

    /// Returns the query for columns of messages that meet a condition, up to a row, in this order.
    pub(super) fn select(self, columns: &str, condition: &str, last_row: i64) -> String {
        let order = match self {
            Self::Time => "timestamp, rowid",
            Self::Row => "rowid",
        };
        // A plus sign keeps SQLite from choosing another index; the rows are not in its order.
        format!(
            "SELECT {columns} FROM messages WHERE {condition} AND +rowid <= {last_row} ORDER BY {order}"
        )
    }

    /// Returns the conditions of queries that give, one after the other, the rows after a key, or
    /// all rows. Each uses the index of times to its end, which a comparison of pairs would not do.
    pub(super) fn after(self, key: Option<Key>) -> Vec<String> {
        match (self, key) {
            (_, None) => vec!["TRUE".to_owned()],
            (Self::Time, Some(Key { timestamp, row })) => vec![
                format!("timestamp = {timestamp} AND rowid > {row}"),
                format!("timestamp > {timestamp}"),
            ],
            (Self::Row, Some(Key { row, .. })) => vec![format!("rowid > {row}")],
        }
    }

    /// Returns the conditions of queries that give, one after the other, the rows of a range.
    pub(super) fn within(self, Rows { first, last, .. }: Rows) -> Vec<String> {
        match self {
            Self::Row => vec![format!("rowid BETWEEN {} AND {}", first.row, last.row)],
            Self::Time if first.timestamp == last.timestamp => vec![format!(
                "timestamp = {} AND rowid BETWEEN {} AND {}",
                first.timestamp, first.row, last.row
            )],
            Self::Time => vec![
                format!("timestamp = {} AND rowid >= {}", first.timestamp, first.row),
                format!(
                    "timestamp > {} AND timestamp < {}",
                    first.timestamp, last.timestamp
                ),
                format!("timestamp = {} AND rowid <= {}", last.timestamp, last.row),
            ],
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
    Problem::Fault(format!(
        "its table `{table}` has {found} as `{column}` in row {row}; expected {expected}"
    ))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use rusqlite::Connection;

    use super::Order;

    /// Only an index that has the rows of equal times in the order of their numbers is used.
    #[test]
    fn an_index_of_the_times_alone_gives_their_order() {
        let cases = [
            ("", Order::Row),
            ("CREATE INDEX i ON messages (timestamp)", Order::Time),
            (
                "CREATE UNIQUE INDEX i ON messages (timestamp ASC)",
                Order::Time,
            ),
            ("CREATE INDEX i ON messages (timestamp DESC)", Order::Row),
            ("CREATE INDEX i ON messages (timestamp, data)", Order::Row),
            (
                "CREATE INDEX i ON messages (timestamp, length(data))",
                Order::Row,
            ),
            ("CREATE INDEX i ON messages (timestamp + 1)", Order::Row),
            ("CREATE INDEX i ON messages (topic_id)", Order::Row),
            (
                "CREATE INDEX i ON messages (timestamp) WHERE topic_id = 1",
                Order::Row,
            ),
        ];
        for (index, expected) in cases {
            let bag = Connection::open_in_memory().unwrap();
            let table = "CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id, timestamp, data)";
            bag.execute_batch(&format!("{table}; {index}")).unwrap();
            assert_eq!(Order::of(&bag).unwrap(), expected, "{index}");
        }
    }
}
