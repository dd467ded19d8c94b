//! Index of an SQLite bag: its topics, and the rows of messages that are read at once.

use std::collections::BTreeMap;

use rusqlite::{Connection, OptionalExtension, Row, types::ValueRef};

use super::{
    database::{Database, Problem, damaged},
    reader::SqliteStorage,
    rows::{Key, MessageRow, Order, Rows, unexpected},
};
use crate::{
    error::LogError,
    reader::{
        opening::{MAX_NAME, Opening},
        source::{Content as _, Source},
        storage::{Channel, ChannelId, FileIndex, Metadata, Segment},
    },
};

/// Number of rows and of their bytes that are read at once. They bound the memory, and the time for
/// which a recorder cannot write.
const ROWS: usize = 4096;
const BYTES: u64 = 1 << 20;

/// Tables of a bag, with the columns that are needed. Those that were added later are `schema`,
/// `metadata` and `message_definitions`: messages are decoded by the names of their types.
const TABLES: [(&str, &[&str]); 2] = [
    ("topics", &["id", "name", "type", "serialization_format"]),
    ("messages", &["topic_id", "timestamp", "data"]),
];

/// Returns the index of a bag. Every row is visited, but not the bytes of its message.
pub(in crate::reader) fn index(
    source: Source,
    opening: &mut Opening<'_>,
) -> Result<FileIndex, LogError> {
    if let Some(damage) = source.damage() {
        return Err(LogError::not_a_bag(&source.path, &damaged(&damage.what)));
    }
    let database = Database::open(&source)?;
    let texts = texts(&database.connection).map_err(|problem| database.error(problem))?;
    opening.keep_texts(database.path(), texts)?;
    let bag = Bag::read(&database.connection);
    let mut bag = bag.map_err(|problem| database.error(problem))?;
    let parts = bag.segments(&database, opening)?;
    let (ranges, segments): (Vec<Rows>, Vec<Segment>) = parts.into_iter().unzip();
    Ok(FileIndex {
        path: source.path.clone(),
        segments,
        channels: bag.channels,
        metadata: bag.metadata,
        damage: None,
        storage: Box::new(SqliteStorage {
            source,
            order: bag.order,
            last_row: bag.last_row,
            ranges: ranges.into(),
        }),
    })
}

/// Topics of a bag, and what reading its messages needs.
struct Bag {
    channels: BTreeMap<ChannelId, Channel>,
    metadata: Metadata,
    order: Order,
    /// Largest number of a message. Later ones have larger numbers and are not read.
    last_row: i64,
}

impl Bag {
    fn read(connection: &Connection) -> Result<Self, Problem> {
        // In one transaction, so that each message has its topic.
        let transaction = connection.unchecked_transaction()?;
        check_tables(&transaction)?;
        let last_row: Option<i64> =
            transaction.query_row("SELECT max(rowid) FROM messages", [], |row| row.get(0))?;
        Ok(Self {
            channels: channels(&transaction)?,
            metadata: metadata(&transaction)?,
            order: Order::of(&transaction)?,
            last_row: last_row.unwrap_or(i64::MIN),
        })
    }

    /// Divides the messages into segments, counts the messages of each topic, and checks every row.
    ///
    /// Where the rows are in the order of their times, both orders are the same, and rows are read
    /// as they are stored: the index of times would take a search for each of them.
    fn segments(
        &mut self,
        database: &Database,
        opening: &mut Opening<'_>,
    ) -> Result<Vec<(Rows, Segment)>, LogError> {
        let given = std::mem::replace(&mut self.order, Order::Row);
        let mut segments: Vec<(Rows, Segment)> = Vec::new();
        loop {
            opening.go_on()?;
            let previous = segments.last().map(|(rows, _)| rows.last);
            let part = self.segment(&database.connection, previous);
            let part = part.map_err(|problem| database.error(problem))?;
            if part.is_late && self.order != given {
                self.order = given;
                let channels = |(_, segment): (Rows, Segment)| segment.channels.len();
                opening.drop_segments(segments.drain(..).map(channels));
                for channel in self.channels.values_mut() {
                    (channel.count, channel.times_ns) = (0, None);
                }
                continue;
            }
            let Some(rows) = part.rows else {
                return Ok(segments);
            };
            opening.keep_segment(database.path(), part.segment.channels.len())?;
            segments.push((rows, part.segment));
        }
    }

    /// Visits the rows after a key until they are enough for a segment. Between two segments a
    /// recorder can write.
    fn segment(&mut self, connection: &Connection, previous: Option<Key>) -> Result<Part, Problem> {
        let mut part = Part::default();
        let mut last = previous;
        for condition in self.order.after(previous) {
            let columns = "rowid, timestamp, topic_id, length(data)";
            let query = self.order.select(columns, &condition, self.last_row);
            let mut query = connection.prepare(&query)?;
            let mut rows = query.query([])?;
            while !part.is_full()
                && let Some(row) = rows.next()?
            {
                let message = MessageRow::of(row)?;
                // SQLite trusts the pages of an index. Rows of a damaged one come again and again.
                if last.is_some_and(|last| !self.order.is_before(last, message.key)) {
                    let what = "the rows of `messages` are not in the order of their index";
                    return Err(Problem::Fault(damaged(what)));
                }
                let is_late = |last: Key| message.key.timestamp < last.timestamp;
                part.is_late |= last.is_some_and(is_late);
                last = Some(message.key);
                self.channel(&message)?.count_message(message.log_time_ns);
                let ValueRef::Integer(length) = row.get_ref(3)? else {
                    let place = ("data", ValueRef::Null);
                    return Err(unexpected("messages", message.key.row, place, "bytes"));
                };
                part.add(&message, length.unsigned_abs());
            }
        }
        Ok(part)
    }

    /// Returns the channel of a message.
    fn channel(&mut self, message: &MessageRow) -> Result<&mut Channel, Problem> {
        let channel = self.channels.get_mut(&message.topic);
        channel.ok_or_else(|| {
            let (row, topic) = (message.key.row, message.topic);
            Problem::Fault(format!(
                "message {row} belongs to topic {topic}, which is missing in its table `topics`"
            ))
        })
    }
}

/// A segment to which rows are added.
#[derive(Default)]
struct Part {
    rows: Option<Rows>,
    segment: Segment,
    count: usize,
    /// Whether a row has an earlier time than the one before.
    is_late: bool,
}

impl Part {
    fn is_full(&self) -> bool {
        self.count >= ROWS || self.rows.is_some_and(|rows| rows.bytes >= BYTES)
    }

    fn add(&mut self, message: &MessageRow, bytes: u64) {
        let rows = self.rows.get_or_insert(Rows {
            first: message.key,
            last: message.key,
            bytes: 0,
        });
        rows.last = message.key;
        rows.bytes = rows.bytes.saturating_add(bytes);
        self.segment.add(message.topic, message.log_time_ns);
        self.count += 1;
    }
}

/// Checks that the tables of a bag exist and have the columns that are needed.
fn check_tables(connection: &Connection) -> Result<(), Problem> {
    for (name, needed) in TABLES {
        let fault = match Table::read(connection, name)? {
            None => format!(
                "it has no table `{name}`; a bag of rosbag2 has the tables `topics` and `messages`"
            ),
            Some(table) => {
                if let Some(column) = needed.iter().find(|column| !table.has(column)) {
                    format!(
                        "its table `{name}` has no stored column `{column}`, which every bag of rosbag2 has"
                    )
                } else if table.hides_key {
                    // Rows are read by their keys, a block at a time.
                    format!(
                        "its table `{name}` has a column `rowid`, which may hide its key; rosbag2 names the key `id`"
                    )
                } else if !table.has_row_numbers {
                    format!(
                        "its table `{name}` is WITHOUT ROWID, but messages are read by the numbers of their rows, \
                         which every table of rosbag2 has"
                    )
                } else {
                    continue;
                }
            }
        };
        return Err(Problem::Fault(fault));
    }
    Ok(())
}

/// A table of a database.
struct Table {
    /// Names of its stored columns in lower case.
    columns: Vec<String>,
    /// Whether a column is named `rowid`, as the key is.
    hides_key: bool,
    has_row_numbers: bool,
}

impl Table {
    /// Returns the table with a name, in which letters count without case; `None` where there is
    /// none. Views and virtual tables, which have no root page, do not count: reading them would
    /// run what the file says.
    ///
    /// `pragma_table_list` would expand all views of the file, and a few of them can double the
    /// size each time.
    fn read(connection: &Connection, name: &str) -> rusqlite::Result<Option<Self>> {
        let is_stored = "SELECT 1 FROM sqlite_schema \
                         WHERE type = 'table' AND rootpage > 0 AND name = ? COLLATE NOCASE";
        if !connection.prepare(is_stored)?.exists([name])? {
            return Ok(None);
        }
        let mut table = Self {
            columns: Vec::new(),
            hides_key: false,
            has_row_numbers: connection
                .prepare(&format!("SELECT rowid FROM {name}"))
                .is_ok(),
        };
        connection.pragma(None, "table_xinfo", name, |row| {
            let column: String = row.get::<_, String>(1)?.to_ascii_lowercase();
            let is_generated = row.get::<_, i64>(6)? != 0;
            table.hides_key |= column == "rowid";
            if !is_generated {
                table.columns.push(column);
            }
            Ok(())
        })?;
        Ok(Some(table))
    }

    fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|name| name == column)
    }
}

/// Returns whether the bag describes itself, as bags since ROS 2 Iron do.
fn has_description(connection: &Connection) -> rusqlite::Result<bool> {
    let table = Table::read(connection, "metadata")?;
    Ok(table
        .is_some_and(|table| table.has("metadata") && table.has_row_numbers && !table.hides_key))
}

/// Most bytes of the description of a bag, which is as in `metadata.yaml`.
const MAX_DESCRIPTION: usize = 16 << 20;

/// Returns the number of texts that an index keeps, and of their bytes. SQLite knows their lengths
/// without reading them.
///
/// # Errors
/// Returns the problem of a name or a description that is too long.
fn texts(connection: &Connection) -> Result<(u64, u64), Problem> {
    check_tables(connection)?;
    let mut columns = vec![
        ("name", "topics", MAX_NAME),
        ("type", "topics", MAX_NAME),
        ("serialization_format", "topics", MAX_NAME),
    ];
    if has_description(connection)? {
        columns.push(("metadata", "metadata", MAX_DESCRIPTION));
    }
    let (mut count, mut bytes) = (0, 0);
    for (column, table, most) in columns {
        check_lengths(connection, (table, column), most)?;
        let query = format!("SELECT count(*), total(octet_length({column})) FROM {table}");
        let total = |row: &Row<'_>| Ok((row.get::<_, i64>(0)?, row.get::<_, f64>(1)?));
        let (rows, length) = connection.query_row(&query, [], total)?;
        count += rows.unsigned_abs();
        bytes += length as u64;
    }
    Ok((count, bytes))
}

/// Checks that the values of a column have at most a number of bytes.
fn check_lengths(
    connection: &Connection,
    (table, column): (&'static str, &'static str),
    most_bytes: usize,
) -> Result<(), Problem> {
    let query = format!(
        "SELECT rowid, octet_length({column}) FROM {table} WHERE octet_length({column}) > {most_bytes}"
    );
    let too_long = |row: &Row<'_>| Ok((row.get::<_, i64>(0)?, row.get::<_, i64>(1)?));
    match connection.query_row(&query, [], too_long).optional()? {
        None => Ok(()),
        Some((row, bytes)) => {
            let expected = format!("expected at most {most_bytes}");
            Err(Problem::Fault(format!(
                "its table `{table}` has {bytes} bytes as `{column}` in row {row}; {expected}"
            )))
        }
    }
}

fn channels(connection: &Connection) -> Result<BTreeMap<ChannelId, Channel>, Problem> {
    let mut channels = BTreeMap::new();
    let mut query =
        connection.prepare("SELECT rowid, id, name, type, serialization_format FROM topics")?;
    let mut rows = query.query([])?;
    while let Some(row) = rows.next()? {
        let number = row.get(0)?;
        let text = |index: usize, column| match row.get_ref(index)? {
            ValueRef::Text(text) => Ok(String::from_utf8_lossy(text).into_owned()),
            value => Err(unexpected("topics", number, (column, value), "a text")),
        };
        let id = row.get_ref(1)?;
        let ValueRef::Integer(id) = id else {
            return Err(unexpected("topics", number, ("id", id), "an integer"));
        };
        let channel = Channel {
            topic: text(2, "name")?,
            type_name: text(3, "type")?,
            encoding: text(4, "serialization_format")?,
            ..Channel::default()
        };
        if channels.insert(id, channel).is_some() {
            let (value, expected) = (ValueRef::Integer(id), "another id for each topic");
            return Err(unexpected("topics", number, ("id", value), expected));
        }
    }
    Ok(channels)
}

/// Returns the description of the bag under the name that it has in MCAP, or nothing for bags
/// before ROS 2 Iron.
fn metadata(connection: &Connection) -> Result<Metadata, Problem> {
    let mut metadata = Metadata::new();
    if has_description(connection)? {
        let last = "SELECT metadata FROM metadata WHERE typeof(metadata) = 'text' \
                    ORDER BY rowid DESC LIMIT 1";
        let text: Option<String> = connection
            .query_row(last, [], |row| row.get(0))
            .optional()?;
        let record = text.map(|text| [("serialized_metadata".to_owned(), text)].into());
        metadata.extend(record.map(|record| ("rosbag2".to_owned(), record)));
    }
    Ok(metadata)
}
