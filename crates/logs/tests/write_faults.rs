//! Writing of a log to a stream that fails at some byte, as a disk that becomes full, or that takes
//! few bytes at once.

use std::cell::RefCell;
use std::fs;
use std::io::{self, Cursor, ErrorKind, Seek, SeekFrom, Write};
use std::path::Path;
use std::rc::Rc;
use std::thread;

use crate::common::{STEP_NS, header};
use tactid_logs::messages::JointState;
use tactid_logs::{Durability, LogError, LogReader, LogWriter};

/// Messages between two calls of `flush`.
const FLUSH_EVERY: usize = 5;

/// A file on a disk that becomes full. The test keeps the bytes of the disk after the writer.
struct Disk {
    bytes: Rc<RefCell<Cursor<Vec<u8>>>>,
    /// Size of the disk, bytes.
    size: u64,
    /// Most bytes that one call writes.
    most: usize,
}

impl Write for Disk {
    fn write(&mut self, given: &[u8]) -> io::Result<usize> {
        let mut bytes = self.bytes.borrow_mut();
        let room = self.size.saturating_sub(bytes.position()) as usize;
        if room == 0 && !given.is_empty() {
            return Err(ErrorKind::StorageFull.into());
        }
        bytes.write(&given[..given.len().min(room).min(self.most)])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.borrow_mut().seek(to)
    }
}

/// Returns messages with positions of a number of joints.
fn states(count: u64, joints: usize) -> Vec<JointState> {
    let state = |k: u64| JointState {
        header: header(k * STEP_NS),
        position: (0..joints)
            .map(|joint| (1000.0 * k as f64 + joint as f64).sin())
            .collect(),
        ..JointState::default()
    };
    (0..count).map(state).collect()
}

/// Writes messages and finishes the log. Counts the messages that a successful flush acknowledged.
fn write(disk: Disk, states: &[JointState], acknowledged: &mut usize) -> Result<(), LogError> {
    let mut log = LogWriter::new(disk)?;
    let joints = log.channel::<JointState>("/joint_states", Durability::Volatile)?;
    for (k, state) in states.iter().enumerate() {
        log.write(&joints, k as u64 * STEP_NS, state)?;
        if (k + 1) % FLUSH_EVERY == 0 {
            log.flush()?;
            *acknowledged = k + 1;
        }
    }
    log.finish()?;
    *acknowledged = states.len();
    Ok(())
}

/// Returns the messages of a log in a file of these bytes, up to the damage.
fn read(path: &Path, bytes: &[u8]) -> Vec<JointState> {
    fs::write(path, bytes).unwrap();
    let Ok(log) = LogReader::open(path) else {
        return Vec::new();
    };
    let messages = log.messages();
    messages
        .map(|message| message.unwrap().decode().unwrap())
        .collect()
}

/// Returns the bytes of a log on a disk of this size, whether it is whole, and how many messages
/// were acknowledged.
fn written(states: &[JointState], size: u64) -> (Vec<u8>, Result<(), LogError>, usize) {
    let bytes = Rc::new(RefCell::new(Cursor::new(Vec::new())));
    let disk = Disk {
        bytes: bytes.clone(),
        size,
        most: usize::MAX,
    };
    let mut acknowledged = 0;
    let result = write(disk, states, &mut acknowledged);
    (bytes.take().into_inner(), result, acknowledged)
}

/// Asserts that a log on a disk of this size, which is too small for it, keeps what was
/// acknowledged.
fn assert_acknowledged_is_kept(states: &[JointState], size: u64, path: &Path) {
    let (bytes, result, acknowledged) = written(states, size);
    match result {
        Err(LogError::Io { action, source, .. }) => {
            assert_eq!((action, source.kind()), ("write", ErrorKind::StorageFull));
        }
        other => panic!("{size} bytes: {other:?}"),
    }
    let messages = read(path, &bytes);
    assert!(messages.len() >= acknowledged, "{size} bytes");
    assert!(states.starts_with(&messages), "{size} bytes");
}

/// Asserts that a log on a disk of any size keeps what was acknowledged. Returns the size that is
/// enough for it.
fn assert_acknowledged_is_kept_at_any_size(states: &[JointState]) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    let (bytes, result, _) = written(states, u64::MAX);
    result.unwrap();
    let enough = bytes.len() as u64;
    let whole = folder.path().join("whole.mcap");
    assert_eq!(read(&whole, &bytes).len(), states.len());
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for first in 0..threads {
            let path = folder.path().join(format!("{first}.mcap"));
            scope.spawn(move || {
                for size in (first as u64..enough).step_by(threads) {
                    assert_acknowledged_is_kept(states, size, &path);
                }
            });
        }
    });
    enough
}

#[test]
fn a_disk_that_is_full_at_any_byte_keeps_what_was_acknowledged() {
    let size = assert_acknowledged_is_kept_at_any_size(&states(11, 1));
    assert!(size > 1000, "{size} bytes");
}

/// The same for 200 kB: `cargo test --release -p tactid-logs long_log -- --ignored` takes some
/// minutes.
#[test]
#[ignore = "takes some minutes"]
fn a_disk_that_is_full_at_any_byte_of_a_long_log_keeps_what_was_acknowledged() {
    let size = assert_acknowledged_is_kept_at_any_size(&states(120, 220));
    assert!(size > 200_000, "{size} bytes");
}

#[test]
fn short_writes_write_the_same_bytes() {
    let whole = |most| {
        let bytes = Rc::new(RefCell::new(Cursor::new(Vec::new())));
        let disk = Disk {
            bytes: bytes.clone(),
            size: u64::MAX,
            most,
        };
        write(disk, &states(11, 1), &mut 0).unwrap();
        bytes.take().into_inner()
    };
    let expected = whole(usize::MAX);
    for most in [1, 7, 100] {
        assert_eq!(whole(most), expected);
    }
}
