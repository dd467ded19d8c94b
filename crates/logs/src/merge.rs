//! Several logs as one, with the messages as they are.

use std::collections::HashMap;
use std::io::{Seek, Write};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use mcap::records::MessageHeader;

use crate::error::LogError;
use crate::messages::schema_of;
use crate::reader::{LogReader, Messages, RawMessage, Topic};
use crate::rosbag2::{Durability, TopicDescription};
use crate::writer::{LogWriter, Schema};

/// Name of the metadata of a channel that states the offered quality of service, as rosbag2 writes
/// it.
const PROFILES: &str = "offered_qos_profiles";
/// Name of the metadata record that describes a bag: each log has its own.
const DESCRIPTION: &str = "rosbag2";
/// Number of messages from one report of the progress to the next.
const REPORT_EVERY: u64 = 256;

/// What is known of a log that was merged from others.
#[derive(Clone, Debug)]
pub struct Merged {
    /// Content of `metadata.yaml` for a bag whose only file is the log.
    pub bag_metadata: String,
    /// Where logs could not be read further, in words.
    pub damage: Vec<String>,
}

/// Writes the messages of several logs as one MCAP log, in the order of their log times.
///
/// Each message keeps its bytes, its times and its sequence number, and each topic its type, the
/// definition of this type and the metadata of its channel. Metadata records are copied, but for
/// the description of the bag, which is that of the new log; attachments are not. A topic of an
/// SQLite bag, which has no definition, gets that of this crate where its type is known here.
/// Memory is that of reading the logs.
///
/// `file` is the name by which the description of the bag calls the log, and `progress` is called
/// with the fraction of the messages that are written.
///
/// # Errors
/// Returns [`LogError::Interrupted`] if `progress` breaks, and the errors of reading and writing.
pub fn merge_logs(
    logs: &[&LogReader],
    path: &Path,
    file: &str,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Merged, LogError> {
    let mut writer = LogWriter::create(path)?;
    let mut channels = HashMap::new();
    for (number, log) in logs.iter().enumerate() {
        for (name, metadata) in log.metadata() {
            if name != DESCRIPTION {
                writer.metadata(name, metadata.clone())?;
            }
        }
        for topic in log.topics() {
            let place = channels.len();
            let id = add_topic(&mut writer, log, topic)?;
            channels.insert((number, Arc::as_ptr(topic)), (place, id));
        }
    }
    let counts = logs.iter().flat_map(|log| log.topics());
    let total = counts.map(|topic| topic.count).sum::<u64>().max(1);
    let sources: Result<Vec<_>, _> = logs.iter().map(|log| Source::new(log)).collect();
    let mut sources = sources?;
    let mut written: u64 = 0;
    while let Some((number, message)) = next(&mut sources)? {
        let topic = Arc::as_ptr(&message.topic);
        let Some(&(place, id)) = channels.get(&(number, topic)) else {
            continue;
        };
        let header = MessageHeader {
            channel_id: id,
            sequence: message.sequence,
            log_time: message.log_time_ns,
            publish_time: message.publish_time_ns,
        };
        writer.write_encoded(place, &header, message.data())?;
        written += 1;
        let fraction = (written as f64 / total as f64).min(1.0);
        if written.is_multiple_of(REPORT_EVERY) && progress(fraction).is_break() {
            return Err(LogError::Interrupted);
        }
    }
    let damage = sources.iter().flat_map(|source| source.messages.damage());
    let merged = Merged {
        bag_metadata: writer.bag_metadata(file),
        damage: damage.map(ToString::to_string).collect(),
    };
    writer.finish()?;
    Ok(merged)
}

/// Adds a topic of a log as it is there, and returns the number of its channel.
fn add_topic<W: Write + Seek>(
    writer: &mut LogWriter<W>,
    log: &LogReader,
    topic: &Topic,
) -> Result<u16, LogError> {
    let mut definition = log.definition(topic);
    if definition.schema.is_empty() {
        let known = schema_of(&topic.type_name);
        let encoding = if known.is_empty() { "" } else { "ros2msg" };
        encoding.clone_into(&mut definition.schema_encoding);
        definition.schema = known.into_bytes().into();
    }
    let profiles = definition.metadata.get(PROFILES).map_or("", String::as_str);
    let durability = Durability::of_profiles(profiles);
    if definition.metadata.is_empty() {
        let profiles = durability.offered_qos_profiles();
        definition.metadata.insert(PROFILES.to_owned(), profiles);
    }
    let description = TopicDescription {
        name: topic.name.clone(),
        type_name: topic.type_name.clone(),
        encoding: topic.encoding.clone(),
        durability,
        count: 0,
    };
    let schema = Schema {
        encoding: &definition.schema_encoding,
        text: &definition.schema,
    };
    writer.add_channel(description, schema, &definition.metadata)
}

/// The messages of a log, of which the next one is known.
struct Source {
    messages: Messages,
    next: Option<RawMessage>,
}

impl Source {
    fn new(log: &LogReader) -> Result<Self, LogError> {
        let mut messages = log.messages();
        let next = messages.next().transpose()?;
        Ok(Self { messages, next })
    }

    /// Returns the next message, and reads the one after it.
    fn advance(&mut self) -> Result<Option<RawMessage>, LogError> {
        let after = self.messages.next().transpose()?;
        Ok(std::mem::replace(&mut self.next, after))
    }
}

/// Returns the earliest message that is left, with the number of its log: of the first log where
/// times are equal.
fn next(sources: &mut [Source]) -> Result<Option<(usize, RawMessage)>, LogError> {
    let due =
        |(number, source): (usize, &Source)| Some((source.next.as_ref()?.log_time_ns, number));
    let earliest = sources.iter().enumerate().filter_map(due).min();
    let Some((_, number)) = earliest else {
        return Ok(None);
    };
    let message = sources[number].advance()?;
    Ok(message.map(|message| (number, message)))
}
