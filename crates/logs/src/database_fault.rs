//! What can be wrong with an SQLite bag.

use std::path::PathBuf;

/// Reason why a file cannot be read as an SQLite bag.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DatabaseFault {
    /// Another process writes to the database and lets nobody read meanwhile.
    #[error(
        "another process has locked it for longer than {waited_s} s; try again when that process has ended, \
         or read a copy of the file"
    )]
    Locked {
        /// Time for which the lock was awaited, s.
        waited_s: u64,
    },
    /// The file is cut off, or its content is inconsistent.
    #[error(
        "the database is damaged or cut off ({what}); `sqlite3 damaged.db3 .recover | sqlite3 recovered.db3` saves \
         what is readable"
    )]
    Damaged {
        /// Description of the fault by SQLite.
        what: String,
    },
    /// A writer was killed within a transaction, and its journal must be rolled back before the file can be read.
    #[error(
        "a killed recorder left {} beside it, which must be rolled back first: \
         `sqlite3 bag.db3 \"PRAGMA quick_check\"` does that, with the path of the bag and write access to its folder",
        journal.display()
    )]
    Journal {
        /// Path of the journal.
        journal: PathBuf,
    },
    /// The last messages are in a write-ahead log that cannot be opened.
    #[error(
        "the last messages are in {}, which SQLite can only read in a folder with write access; copy all files of the \
         bag into such a folder",
        log.display()
    )]
    WriteAheadLog {
        /// Path of the write-ahead log.
        log: PathBuf,
    },
    /// A table of a bag is missing. Its name is the field of the variant.
    #[error("it has no table `{0}`; a bag of rosbag2 has the tables `topics` and `messages`")]
    NoTable(&'static str),
    /// A column of a bag's table is missing.
    #[error("its table `{table}` has no stored column `{column}`, which every bag of rosbag2 has")]
    NoColumn {
        /// Name of the table.
        table: &'static str,
        /// Name of the column.
        column: &'static str,
    },
    /// A table has a column `rowid`, which may hide its key. The field is the name of the table.
    #[error(
        "its table `{0}` has a column `rowid`, which may hide its key; rosbag2 names the key `id`"
    )]
    HiddenKey(&'static str),
    /// A table of a bag has no numbers of rows. The field is its name.
    #[error(
        "its table `{0}` is WITHOUT ROWID, but messages are read by the numbers of their rows, which every table of rosbag2 has"
    )]
    NoRowNumbers(&'static str),
    /// A value has the wrong type or is out of range.
    #[error("its table `{table}` has {found} as `{column}` in row {row}; expected {expected}")]
    Value {
        /// Name of the table.
        table: &'static str,
        /// Name of the column.
        column: &'static str,
        /// Number of the row.
        row: i64,
        /// Description of the value.
        found: String,
        /// Description of a valid value.
        expected: &'static str,
    },
    /// A name or a description is longer than any of a robot.
    #[error(
        "its table `{table}` has {bytes} bytes as `{column}` in row {row}; expected at most {most_bytes}"
    )]
    TooLong {
        /// Name of the table.
        table: &'static str,
        /// Name of the column.
        column: &'static str,
        /// Number of the row.
        row: i64,
        /// Length of the value, bytes.
        bytes: i64,
        /// Most bytes of a value in this column.
        most_bytes: usize,
    },
    /// A message belongs to a topic that does not exist.
    #[error("message {row} belongs to topic {topic}, which is missing in its table `topics`")]
    UnknownTopic {
        /// Number of the message's row.
        row: i64,
        /// Number of the topic.
        topic: i64,
    },
    /// Any other fault. Its description by SQLite is the field of the variant.
    #[error("SQLite reports: {0}")]
    Other(String),
}
