//! Opening of a database without changing it.
//!
//! Nothing is created beside it either, but for one case: a killed recorder leaves a write-ahead
//! log (`-wal`), and SQLite creates its index (`-shm`) again where only the log was copied.

use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    time::Duration,
};

use rusqlite::{Connection, Error, ErrorCode, OpenFlags, limits::Limit};

use crate::{
    error::LogError,
    reader::{source::Source, storage::MAX_RECORD},
};

/// Time for which a lock of another process is awaited. A recorder locks only while it commits.
const LOCK_WAIT: Duration = Duration::from_secs(5);

/// An open database that is only read.
#[derive(Debug)]
pub(super) struct Database {
    source: Source,
    pub(super) connection: Connection,
}

impl Database {
    pub(super) fn open(source: &Source) -> Result<Self, LogError> {
        let path = source.content();
        let header = source.open_content().and_then(Header::read);
        let header = header.map_err(|e| LogError::io("read", &source.path, e))?;
        if header.is_cut() {
            let fault = damaged("it ends within a page");
            return Err(LogError::not_a_bag(&source.path, &fault));
        }
        // A database that uses a write-ahead log and has none is not open in any process. SQLite
        // would create the log and its index beside the file, or fail where it must not, unless the
        // file is declared immutable.
        let log = beside(path, "-wal");
        let is_closed = header.uses_log && !log.exists();
        let mut connected = connect(path, is_closed);
        if is_closed && log.exists() {
            // A recorder has opened it meanwhile. An immutable database would not see the log.
            connected = connect(path, false);
        }
        let connection = connected.map_err(|error| failure(source, &error))?;
        // SQLite has opened the path by itself: it still leads to the same file.
        let same = source.open_content();
        same.map_err(|e| LogError::io("read", &source.path, e))?;
        Ok(Self {
            source: source.clone(),
            connection,
        })
    }

    /// Returns the path by which errors name the file.
    pub(super) fn path(&self) -> &Path {
        &self.source.path
    }

    /// Returns the error for a problem with this database.
    pub(super) fn error(&self, problem: Problem) -> LogError {
        match problem {
            Problem::Query(error) => failure(&self.source, &error),
            Problem::Fault(fault) => LogError::not_a_bag(&self.source.path, &fault),
        }
    }
}

/// Connects to a database, which SQLite takes for immutable where this is so.
fn connect(path: &Path, immutable: bool) -> Result<Connection, Error> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = if immutable {
        let flags = flags | OpenFlags::SQLITE_OPEN_URI;
        Connection::open_with_flags(immutable_uri(path), flags)?
    } else {
        Connection::open_with_flags(path, flags)?
    };
    connection.busy_timeout(LOCK_WAIT)?;
    // Any file may claim to be a bag: no function or view of it runs, and no value exhausts memory.
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_RECORD as i32)?;
    connection.execute_batch("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON")?;
    Ok(connection)
}

/// Reason why a query has no result.
pub(super) enum Problem {
    /// SQLite reports an error.
    Query(Error),
    /// The content is no bag's, for the reason in the field.
    Fault(String),
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        Self::Query(error)
    }
}

/// Beginning of a database file (<https://www.sqlite.org/fileformat2.html#the_database_header>).
struct Header {
    /// Size of a page, bytes; zero if the header is damaged, which SQLite reports.
    page_size: u64,
    /// Whether the database uses a write-ahead log.
    uses_log: bool,
    /// Length of the file, bytes.
    length: u64,
}

impl Header {
    fn read(file: File) -> io::Result<Self> {
        let length = file.metadata()?.len();
        let mut start = Vec::new();
        file.take(20).read_to_end(&mut start)?;
        let (page_size, versions) = match start.get(16..20) {
            Some(&[high, low, write, read]) => (u16::from_be_bytes([high, low]), [write, read]),
            _ => (0, [0, 0]),
        };
        Ok(Self {
            // The largest size does not fit in its field.
            page_size: if page_size == 1 {
                1 << 16
            } else {
                page_size.into()
            },
            uses_log: versions == [2, 2],
            length,
        })
    }

    /// Returns whether the file is cut off within a page. SQLite would take the rest for zeros.
    fn is_cut(&self) -> bool {
        self.length
            .checked_rem(self.page_size)
            .is_some_and(|rest| rest != 0)
    }
}

/// Returns the URI of a file that SQLite takes for immutable.
fn immutable_uri(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut uri = "file://".to_owned();
    for &byte in path.as_os_str().as_encoded_bytes() {
        if byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte) {
            uri.push(byte.into());
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri.push_str("?immutable=1");
    uri.into()
}

/// Returns the path of a file that SQLite keeps beside a database.
fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

fn failure(source: &Source, error: &Error) -> LogError {
    let what = match error {
        Error::SqliteFailure(_, Some(message)) | Error::SqlInputError { msg: message, .. } => {
            message.clone()
        }
        error => error.to_string(),
    };
    let fault = match error.sqlite_error_code() {
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            return LogError::Locked {
                path: source.path.clone(),
                waited_s: LOCK_WAIT.as_secs(),
            };
        }
        Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => damaged(&what),
        Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen) => not_opened(source.content(), &what),
        _ => reported(&what),
    };
    LogError::not_a_bag(&source.path, &fault)
}

/// Returns the fault of a file that is cut off, or has inconsistent content.
pub(super) fn damaged(what: &str) -> String {
    format!(
        "the database is damaged or cut off ({what}); `sqlite3 damaged.db3 .recover | sqlite3 recovered.db3` saves \
         what is readable"
    )
}

fn reported(what: &str) -> String {
    format!("SQLite reports: {what}")
}

/// Returns the reason why SQLite cannot open a file that exists: what a writer has left beside it.
fn not_opened(path: &Path, what: &str) -> String {
    let (log, journal) = (beside(path, "-wal"), beside(path, "-journal"));
    if log.exists() {
        return format!(
            "the last messages are in {}, which SQLite can only read in a folder with write access; copy all files of \
             the bag into such a folder",
            log.display()
        );
    }
    if journal.exists() {
        return format!(
            "a killed recorder left {} beside it, which must be rolled back first: \
             `sqlite3 bag.db3 \"PRAGMA quick_check\"` does that, with the path of the bag and write access to its folder",
            journal.display()
        );
    }
    reported(what)
}
