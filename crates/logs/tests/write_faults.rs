//! Writing of a log to a stream that fails at some byte, as a disk that becomes full, or that takes few bytes at once.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::cell::RefCell;
use std::fs;
use std::io::{self, Cursor, ErrorKind, Seek, SeekFrom, Write};
use std::path::Path;
use std::rc::Rc;

use common::{STEP_NS, joint_state};
use tactid_logs::messages::JointState;
use tactid_logs::{Durability, LogError, LogReader, LogWriter};

/// Messages between two calls of `flush`.
const FLUSH_EVERY: u64 = 5;

/// A file on a disk that becomes full. The test keeps the bytes that the disk has when the writer is gone.
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

/// Writes `count` messages and finishes the log. Returns the number of messages that a successful flush acknowledged.
fn write(disk: Disk, count: u64, acknowledged: &mut u64) -> Result<(), LogError> {
    let mut log = LogWriter::new(disk)?;
    let joints = log.channel::<JointState>("/joint_states", Durability::Volatile)?;
    for k in 0..count {
        log.write(&joints, k * STEP_NS, &joint_state(k))?;
        if (k + 1) % FLUSH_EVERY == 0 {
            log.flush()?;
            *acknowledged = k + 1;
        }
    }
    log.finish()?;
    *acknowledged = count;
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

/// Asserts that a log of `count` messages on a disk of any size, in steps, keeps what was acknowledged. Returns the size
/// that is enough for it.
fn assert_acknowledged_is_kept(count: u64, step: u64) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("full.mcap");
    let mut size = 0;
    loop {
        let bytes = Rc::new(RefCell::new(Cursor::new(Vec::new())));
        let disk = Disk {
            bytes: bytes.clone(),
            size,
            most: usize::MAX,
        };
        let mut acknowledged = 0;
        let result = write(disk, count, &mut acknowledged);
        let messages = read(&path, bytes.borrow().get_ref());
        assert!(messages.len() as u64 >= acknowledged, "{size} bytes");
        for (k, message) in messages.iter().enumerate() {
            assert_eq!(*message, joint_state(k as u64), "{size} bytes");
        }
        match result {
            Ok(()) => {
                assert_eq!(messages.len() as u64, count);
                return size;
            }
            Err(LogError::Io { action, source, .. }) => {
                assert_eq!((action, source.kind()), ("write", ErrorKind::StorageFull));
            }
            Err(error) => panic!("{size} bytes: {error}"),
        }
        size += step;
    }
}

#[test]
fn a_disk_that_is_full_at_any_byte_keeps_what_was_acknowledged() {
    let size = assert_acknowledged_is_kept(11, 1);
    assert!(size > 1000, "{size} bytes");
}

/// The same for 200 kB: `cargo test --release -p tactid-logs long_log -- --ignored` takes some minutes.
#[test]
#[ignore = "takes some minutes"]
fn a_disk_that_is_full_in_a_long_log_keeps_what_was_acknowledged() {
    let size = assert_acknowledged_is_kept(11_000, 7);
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
        write(disk, 11, &mut 0).unwrap();
        bytes.take().into_inner()
    };
    let expected = whole(usize::MAX);
    for most in [1, 7, 100] {
        assert_eq!(whole(most), expected);
    }
}
