//! Messages in memory as a log, for what reads logs.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::storage::{
    Block, Channel, ChannelId, Entry, FileIndex, MemoryBudget, Segment, SegmentReader, Selected,
    Stop, Storage,
};
use super::stream::RawMessage;
use crate::LogError;

/// Number of messages of a segment.
const SEGMENT: usize = 4096;

/// Messages with the channel of each.
#[derive(Clone, Debug)]
struct MemoryStorage(Arc<[(ChannelId, RawMessage)]>);

/// Returns the index of messages in memory, which errors name by a path. Each topic is a channel.
pub(super) fn index(path: &Path, messages: &[RawMessage]) -> FileIndex {
    let mut ids: BTreeMap<[&str; 3], ChannelId> = BTreeMap::new();
    let mut channels: BTreeMap<ChannelId, Channel> = BTreeMap::new();
    let mut segments: Vec<Segment> = Vec::new();
    let mut stored = Vec::with_capacity(messages.len());
    for (place, message) in messages.iter().enumerate() {
        let next = ids.len() as ChannelId;
        let id = *ids.entry(message.topic.key()).or_insert(next);
        let channel = channels.entry(id).or_insert_with(|| Channel {
            topic: message.topic.name.clone(),
            type_name: message.topic.type_name.clone(),
            encoding: message.topic.encoding.clone(),
            ..Channel::default()
        });
        channel.count_message(message.log_time_ns);
        if place % SEGMENT == 0 {
            segments.push(Segment::default());
        }
        if let Some(segment) = segments.last_mut() {
            segment.add(id, message.log_time_ns);
        }
        stored.push((id, message.clone()));
    }
    FileIndex {
        segments,
        channels,
        metadata: BTreeMap::new(),
        damage: None,
        storage: Box::new(MemoryStorage(stored.into())),
        path: path.to_owned(),
    }
}

impl Storage for MemoryStorage {
    fn open(&self) -> Result<Box<dyn SegmentReader>, LogError> {
        Ok(Box::new(self.clone()))
    }
}

impl SegmentReader for MemoryStorage {
    fn read(
        &mut self,
        segment: usize,
        selected: &Selected,
        _budget: MemoryBudget,
    ) -> Result<Block, Stop> {
        let messages = self.0.iter().skip(segment * SEGMENT).take(SEGMENT);
        let mut block = Block::default();
        for (channel, message) in messages.filter(|(channel, _)| selected.contains_key(channel)) {
            let begin = block.bytes.len();
            block.bytes.extend_from_slice(message.data());
            block.entries.push(Entry {
                channel: *channel,
                sequence: message.sequence,
                log_time_ns: message.log_time_ns,
                publish_time_ns: message.publish_time_ns,
                data: begin..block.bytes.len(),
            });
        }
        Ok(block)
    }
}
