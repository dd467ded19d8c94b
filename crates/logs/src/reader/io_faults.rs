//! Reading of a log from a stream that fails at some byte, or that returns few bytes at once.

use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::ops::{ControlFlow, Range};
use std::path::Path;
use std::sync::Arc;

use super::mcap;
use super::opening::Opening;
use super::source::{Content, Ranges};
use super::storage::Damage;
use super::{DEFAULT_MEMORY_LIMIT, LogReader};
use crate::messages::{Header, JointState, Time};
use crate::{Durability, LogError, LogWriter};

/// How a stream misbehaves.
#[derive(Clone, Debug)]
enum Fault {
    /// A read that needs a byte in this range fails with this error, as on a bad sector.
    At(Range<u64>, io::ErrorKind),
    /// A read returns at most this number of bytes.
    Short(usize),
    /// Reads are interrupted by a signal: every second one fails before it reads anything.
    Interrupted,
    /// The file has become shorter since it was opened.
    Cut(u64),
}

/// A log in memory with streams that misbehave.
#[derive(Clone, Debug)]
struct Faulty {
    bytes: Arc<[u8]>,
    fault: Fault,
}

impl Content for Faulty {
    fn path(&self) -> &Path {
        Path::new("faulty.mcap")
    }

    fn open_ranges(&self) -> io::Result<Box<dyn Ranges>> {
        Ok(Box::new(FaultyStream {
            bytes: Cursor::new(self.bytes.clone()),
            fault: self.fault.clone(),
            reads: 0,
        }))
    }

    fn damage(&self) -> Option<&Damage> {
        None
    }
}

#[derive(Debug)]
struct FaultyStream {
    bytes: Cursor<Arc<[u8]>>,
    fault: Fault,
    reads: usize,
}

impl Read for FaultyStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reads += 1;
        let at = self.bytes.position();
        let length = match &self.fault {
            Fault::At(bad, kind) if at >= bad.start && at < bad.end => return Err((*kind).into()),
            // A system reads up to the bad sector.
            Fault::At(bad, _) if at < bad.start => buffer.len().min((bad.start - at) as usize),
            Fault::At(..) => buffer.len(),
            Fault::Short(most) => buffer.len().min(*most),
            Fault::Interrupted if self.reads % 2 == 1 => {
                return Err(io::ErrorKind::Interrupted.into());
            }
            Fault::Interrupted => buffer.len(),
            Fault::Cut(end) => buffer.len().min(end.saturating_sub(at) as usize),
        };
        self.bytes.read(&mut buffer[..length])
    }
}

impl Seek for FaultyStream {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

/// Returns a log of `count` messages of 10 Hz with its index, in chunks of a second, with the
/// positions of a number of joints.
fn log(count: u64, joints: usize) -> Vec<u8> {
    let mut log = LogWriter::new(Cursor::new(Vec::new())).unwrap();
    let states = log.channel("/joint_states", Durability::Volatile).unwrap();
    for k in 0..count {
        let state = state(k, joints);
        log.write(&states, k * 100_000_000, &state).unwrap();
    }
    log.finish().unwrap().into_inner()
}

fn state(k: u64, joints: usize) -> JointState {
    JointState {
        header: Header {
            stamp: Time::from_ns(k * 100_000_000),
            ..Header::default()
        },
        position: (0..joints)
            .map(|joint| (1000.0 * k as f64 + joint as f64).sin())
            .collect(),
        ..JointState::default()
    }
}

/// Result of reading: messages up to the first error, the error, and whether damage is reported.
struct Reading {
    messages: Vec<JointState>,
    error: Option<LogError>,
    is_damaged: bool,
}

fn read(bytes: &[u8], fault: Fault) -> Reading {
    let bytes = bytes.into();
    let mut watch = || ControlFlow::Continue(());
    let mut opening = Opening::new(DEFAULT_MEMORY_LIMIT, &mut watch);
    let mut reading = Reading {
        messages: Vec::new(),
        error: None,
        is_damaged: false,
    };
    let index = match mcap::index(Faulty { bytes, fault }, &mut opening) {
        Ok(index) => index,
        Err(error) => {
            reading.error = Some(error);
            return reading;
        }
    };
    let log = LogReader::of_files(Path::new("faulty.mcap"), [index].into(), opening.memory);
    let mut messages = log.messages();
    for message in &mut messages {
        match message.and_then(|message| message.decode()) {
            Ok(message) => reading.messages.push(message),
            Err(error) => {
                reading.error = Some(error);
                break;
            }
        }
    }
    assert!(reading.error.is_none() || messages.next().is_none());
    reading.is_damaged = !messages.damage().is_empty();
    reading
}

/// Asserts that messages are the first ones of the log.
fn assert_beginning(messages: &[JointState]) {
    for (k, message) in messages.iter().enumerate() {
        assert_eq!(*message, state(k as u64, message.position.len()));
    }
}

/// Asserts that a read that fails at any byte is an error that names the file and the reason, after
/// which nothing more is read, or that it is a byte which is never read.
fn assert_error_at_each_byte(bytes: &[u8], count: usize) {
    let mut failed = 0;
    for at in 0..bytes.len() as u64 {
        let reading = read(bytes, Fault::At(at..at + 1, io::ErrorKind::Other));
        assert_beginning(&reading.messages);
        match reading.error {
            Some(LogError::Io { action, path, .. }) => {
                assert_eq!((action, path.as_path()), ("read", Path::new("faulty.mcap")));
                failed += 1;
            }
            Some(error) => panic!("byte {at}: {error}"),
            None => assert_eq!(reading.messages.len(), count, "byte {at}"),
        }
    }
    // A buffer reads ahead, which costs errors at bytes that are not needed; none of the chunks is
    // without errors.
    assert!(failed * 2 > bytes.len(), "{failed} of {}", bytes.len());
}

#[test]
fn a_failing_read_is_one_error_at_every_byte() {
    assert_error_at_each_byte(&log(30, 1), 30);
}

/// A log without its index, as of a killed writer, is scanned from its beginning.
#[test]
fn a_failing_read_is_one_error_at_every_byte_of_a_scan() {
    let bytes = log(30, 1);
    let cut = &bytes[..bytes.len() - 8];
    assert_error_at_each_byte(cut, 30);
}

/// The same for 200 kB: `cargo test --release -p tactid-logs long_log -- --ignored` takes some
/// minutes.
#[test]
#[ignore = "takes some minutes"]
fn a_failing_read_is_one_error_at_every_byte_of_a_long_log() {
    let count = 120;
    let bytes = log(count as u64, 220);
    assert!(bytes.len() > 200_000, "{} bytes", bytes.len());
    assert_error_at_each_byte(&bytes, count);
    assert_error_at_each_byte(&bytes[..bytes.len() - 8], count);
}

#[test]
fn short_and_interrupted_reads_change_nothing() {
    let bytes = log(50, 1);
    for fault in [
        Fault::Short(1),
        Fault::Short(7),
        Fault::Short(4095),
        Fault::Interrupted,
    ] {
        let reading = read(&bytes, fault);
        assert!(reading.error.is_none() && !reading.is_damaged);
        assert_eq!(reading.messages.len(), 50);
        assert_beginning(&reading.messages);
    }
}

/// A file that another program cuts while it is read is an error or damage, never a whole log.
#[test]
fn a_file_that_shrinks_is_an_error_or_damage() {
    let bytes = log(30, 1);
    for end in 0..bytes.len() as u64 {
        let reading = read(&bytes, Fault::Cut(end));
        assert_beginning(&reading.messages);
        assert!(reading.error.is_some() || reading.is_damaged, "{end} bytes");
    }
}
