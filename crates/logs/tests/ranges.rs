//! Reading of logs by ranges, as from an object store.

use std::io::{self, Cursor};
use std::ops::{ControlFlow, Range};
use std::sync::{Arc, Mutex};

use mcap::{WriteOptions, records::MessageHeader};
use tactid_logs::{
    LogError, LogReader, Message, Messages, Ranges, cdr,
    messages::{JointState, WrenchStamped},
};

use crate::common::{Read, STEP_NS, joint_state, read, wrench};

/// An object of which each read is noted, and that fails where `is_lost`.
#[derive(Clone, Debug, Default)]
struct Object {
    bytes: Arc<[u8]>,
    is_lost: bool,
    reads: Arc<Mutex<Vec<Range<u64>>>>,
    announced: Arc<Mutex<Vec<Range<u64>>>>,
}

impl Ranges for Object {
    fn length(&mut self) -> io::Result<u64> {
        Ok(self.bytes.len() as u64)
    }

    fn read_range(&mut self, at_byte: u64, length: u64) -> io::Result<Vec<u8>> {
        if self.is_lost {
            return Err(io::Error::other("the object has changed"));
        }
        let end = (at_byte + length).min(self.bytes.len() as u64);
        self.reads.lock().unwrap().push(at_byte..end);
        Ok(self.bytes[at_byte as usize..end as usize].to_vec())
    }

    fn announce(&mut self, ranges: &[Range<u64>]) {
        self.announced.lock().unwrap().extend_from_slice(ranges);
    }

    fn costs_requests(&self) -> bool {
        true
    }
}

const IMAGE: &str = "sensor_msgs/msg/Image";

/// A log with an image of 20 kB after every tenth pair of measurements, each in chunks of its own.
fn log_with_images(pairs: u64) -> Vec<u8> {
    let options = WriteOptions::new().compression(None).chunk_size(None);
    let mut log = options.create(Cursor::new(Vec::new())).unwrap();
    let mut channel = |topic: &str, type_name: &str| {
        let schema = log.add_schema(type_name, "ros2msg", b"").unwrap();
        log.add_channel(schema, topic, "cdr", &[].into()).unwrap()
    };
    let ids = [
        channel("/joint_states", JointState::TYPE),
        channel("/wrench", WrenchStamped::TYPE),
        channel("/camera", IMAGE),
    ];
    let (mut joints, mut wrenches) = (Vec::new(), Vec::new());
    for k in 0..pairs {
        cdr::encode(&joint_state(k), &mut joints).unwrap();
        cdr::encode(&wrench(k), &mut wrenches).unwrap();
        let image = vec![7; 20_000];
        let has_image = k % 10 == 9;
        let data: [&[u8]; 3] = [&joints, &wrenches, &image];
        for (channel_id, data) in ids.into_iter().zip(data).take(2 + usize::from(has_image)) {
            if channel_id == ids[2] {
                log.flush().unwrap();
            }
            let header = MessageHeader {
                channel_id,
                sequence: 0,
                log_time: k * STEP_NS,
                publish_time: k * STEP_NS,
            };
            log.write_to_known_channel(&header, data).unwrap();
        }
        if has_image {
            log.flush().unwrap();
        }
    }
    log.finish().unwrap();
    log.into_inner().into_inner()
}

fn open(object: &Object) -> Result<LogReader, LogError> {
    LogReader::of_ranges("s3://bucket/run.mcap", object.clone(), &mut || {
        ControlFlow::Continue(())
    })
}

/// By ranges a log has the messages of its file. Of the images nothing is read but what stands
/// beside measurements, and all that is read after the opening was announced.
#[test]
fn only_the_chunks_that_are_asked_for_are_read() {
    let bytes = log_with_images(100);
    let object = Object {
        bytes: bytes.clone().into(),
        ..Object::default()
    };
    let log = open(&object).unwrap();
    let topics = ["/joint_states", "/wrench"];
    object.reads.lock().unwrap().clear();
    let messages: Vec<Read> = log
        .messages_on(topics)
        .unwrap()
        .map(|message| message.unwrap())
        .map(|m| (m.topic.name.clone(), m.log_time_ns, m.data().to_vec()))
        .collect();
    let mut expected = read(&bytes).unwrap().0;
    expected.retain(|(topic, ..)| topic != "/camera");
    assert_eq!(messages, expected);
    let announced = object.announced.lock().unwrap();
    assert_eq!(announced.len(), 10);
    for read in &*object.reads.lock().unwrap() {
        let is_announced = |range: &&Range<u64>| range.contains(&read.start);
        assert!(
            announced.iter().any(|range| is_announced(&range)),
            "{read:?}"
        );
    }
    let needed: u64 = announced.iter().map(|range| range.end - range.start).sum();
    assert!(
        needed < bytes.len() as u64 / 5,
        "{needed} of {}",
        bytes.len()
    );
}

/// Messages since a time are the later ones of the whole log, and chunks with earlier ones alone are
/// not read.
#[test]
fn chunks_before_the_time_are_not_read() {
    let object = Object {
        bytes: log_with_images(100).into(),
        ..Object::default()
    };
    let log = open(&object).unwrap();
    let topics = ["/joint_states", "/wrench"];
    let all = log.messages_on(topics).unwrap();
    let times = |messages: Messages| -> Vec<u64> {
        messages
            .map(|message| message.unwrap().log_time_ns)
            .collect()
    };
    let mut expected = times(all);
    expected.retain(|time_ns| *time_ns >= 75 * STEP_NS);
    object.announced.lock().unwrap().clear();
    let later = log.messages_on(topics).unwrap().since(75 * STEP_NS);
    assert_eq!(times(later), expected);
    // Ten pairs are in a chunk.
    assert_eq!(object.announced.lock().unwrap().len(), 3);
}

/// Topics that are decoded have the times of their messages, and images those of their chunks.
#[test]
fn the_topics_are_those_of_the_file() {
    let object = Object {
        bytes: log_with_images(30).into(),
        ..Object::default()
    };
    let log = open(&object).unwrap();
    let times = |name: &str| log.topic(name).unwrap().times_ns;
    assert_eq!(times("/joint_states"), Some((0, 29 * STEP_NS)));
    assert_eq!(times("/camera"), Some((9 * STEP_NS, 29 * STEP_NS)));
    assert_eq!(log.path().to_str(), Some("s3://bucket/run.mcap"));
    let of_images = 20_000;
    let reads = object.reads.lock().unwrap();
    assert!(reads.iter().all(|read| read.end - read.start < of_images));
}

#[test]
fn a_failing_read_names_the_object() {
    let object = Object {
        bytes: log_with_images(10).into(),
        is_lost: true,
        ..Object::default()
    };
    let error = open(&object).unwrap_err().to_string();
    assert!(error.contains("s3://bucket/run.mcap"), "{error}");
    assert!(error.contains("the object has changed"), "{error}");
}
