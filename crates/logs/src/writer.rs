use std::{
    collections::BTreeMap,
    fmt,
    fs::File,
    io::{self, BufWriter, Seek, Write},
    marker::PhantomData,
    path::{Path, PathBuf},
};

use mcap::{Compression, McapError, WriteOptions, records::MessageHeader};

use crate::{
    cdr,
    error::LogError,
    messages::Message,
    rosbag2::{BagDescription, Durability, TopicDescription, invalid_topic},
};

/// A chunk ends after this much of the log's time or after so many bytes, whichever is first:
/// what a killed writer can lose.
const CHUNK_DURATION_NS: u64 = 1_000_000_000;
const CHUNK_BYTES: usize = 4 << 20;

/// Writes a log that rosbag2 can play: MCAP of profile `ros2`, in compressed and indexed chunks.
///
/// Each second of log time is a chunk of its own, which is handed to the operating system when it
/// is complete, so that a log whose writer was killed is readable up to there. The bytes depend on
/// nothing but what is written. A writer that is dropped still leaves an indexed log;
/// [`finish`](Self::finish) adds rosbag2's description and reports what went wrong.
pub struct LogWriter<W: Write + Seek> {
    mcap: mcap::Writer<W>,
    path: PathBuf,
    topics: Vec<TopicDescription>,
    /// First and last log time.
    times_ns: Option<(u64, u64)>,
    /// The log time at which the open chunk began, and its bytes so far.
    chunk_start_ns: Option<u64>,
    chunk_bytes: usize,
    /// One encoded message; kept for its allocation.
    buffer: Vec<u8>,
}

/// A topic of a [`LogWriter`], which takes messages of one type.
pub struct Channel<M> {
    id: u16,
    index: usize,
    message: PhantomData<fn(&M)>,
}

impl LogWriter<BufWriter<File>> {
    /// Creates a log under its final name; a file that is there is replaced.
    ///
    /// # Errors
    /// If the file cannot be created or written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref();
        let file = File::create(path).map_err(|source| LogError::Io {
            action: "create",
            path: path.to_owned(),
            source,
        })?;
        Self::with_path(BufWriter::new(file), path.to_owned())
    }
}

impl<W: Write + Seek> LogWriter<W> {
    /// Writes a log to any stream that starts empty.
    ///
    /// # Errors
    /// If the stream cannot be written.
    pub fn new(stream: W) -> Result<Self, LogError> {
        Self::with_path(stream, PathBuf::from("log.mcap"))
    }

    fn with_path(stream: W, path: PathBuf) -> Result<Self, LogError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("tactid ", env!("CARGO_PKG_VERSION")))
            // Measured on 1 kHz of doubles: smaller than lz4, and faster both ways.
            .compression(Some(Compression::Zstd))
            .compression_level(1)
            // None beside this one.
            .compression_threads(0)
            // A chunk is written when it is whole, so that nothing half-written has to be mended.
            .disable_seeking(true)
            // Chunks end where this writer says.
            .chunk_size(None);
        let mcap = options
            .create(stream)
            .map_err(|error| write_error(&path, error))?;
        let mut writer = Self {
            mcap,
            path,
            topics: Vec::new(),
            times_ns: None,
            chunk_start_ns: None,
            chunk_bytes: 0,
            buffer: Vec::new(),
        };
        writer.flush()?;
        Ok(writer)
    }

    /// Adds a topic. rosbag2 plays it with the durability that is given here.
    ///
    /// # Errors
    /// If the log has the topic already, if ROS 2 would refuse its name, or if the log cannot be
    /// written.
    pub fn channel<M: Message>(
        &mut self,
        topic: &str,
        durability: Durability,
    ) -> Result<Channel<M>, LogError> {
        let bad = |why| LogError::BadTopic {
            topic: topic.to_owned(),
            why,
        };
        if let Some(why) = invalid_topic(topic) {
            return Err(bad(why));
        }
        if self.topics.iter().any(|known| known.name == topic) {
            return Err(bad("the log has this topic already"));
        }
        let metadata = BTreeMap::from([(
            "offered_qos_profiles".to_owned(),
            durability.offered_qos_profiles(),
        )]);
        let id = self
            .mcap
            .add_schema(M::TYPE, "ros2msg", M::schema().as_bytes())
            .and_then(|schema| self.mcap.add_channel(schema, topic, "cdr", &metadata))
            .map_err(|error| write_error(&self.path, error))?;
        self.topics.push(TopicDescription {
            name: topic.to_owned(),
            type_name: M::TYPE,
            durability,
            count: 0,
        });
        Ok(Channel {
            id,
            index: self.topics.len() - 1,
            message: PhantomData,
        })
    }

    /// Appends a message. `time_ns` is its log time, on the clock that the stamps are on; messages
    /// may come in any order.
    ///
    /// # Errors
    /// If the log cannot be written, or the channel belongs to another one.
    pub fn write<M: Message>(
        &mut self,
        channel: &Channel<M>,
        time_ns: u64,
        message: &M,
    ) -> Result<(), LogError> {
        let Some(topic) = self.topics.get_mut(channel.index) else {
            return Err(write_error(
                &self.path,
                McapError::UnknownChannel(0, channel.id),
            ));
        };
        cdr::encode(message, &mut self.buffer).map_err(|source| LogError::Encode {
            topic: topic.name.clone(),
            log_time_ns: time_ns,
            source,
        })?;
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: topic.count,
            log_time: time_ns,
            publish_time: time_ns,
        };
        topic.count += 1;
        self.make_room(time_ns)?;
        self.mcap
            .write_to_known_channel(&header, &self.buffer)
            .map_err(|error| write_error(&self.path, error))
    }

    /// Ends the open chunk if the message in the buffer, of this time, belongs into the next one.
    fn make_room(&mut self, time_ns: u64) -> Result<(), LogError> {
        let (first, last) = self.times_ns.unwrap_or((time_ns, time_ns));
        self.times_ns = Some((first.min(time_ns), last.max(time_ns)));

        let start = *self.chunk_start_ns.get_or_insert(time_ns);
        if time_ns.saturating_sub(start) >= CHUNK_DURATION_NS || self.chunk_bytes >= CHUNK_BYTES {
            self.flush()?;
            self.chunk_start_ns = Some(time_ns);
        }
        self.chunk_bytes += self.buffer.len();
        Ok(())
    }

    /// Adds a metadata record, which ends the open chunk.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn metadata(
        &mut self,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> Result<(), LogError> {
        let record = mcap::records::Metadata {
            name: name.to_owned(),
            metadata,
        };
        self.mcap
            .write_metadata(&record)
            .map_err(|error| write_error(&self.path, error))
    }

    /// Ends the open chunk and hands it to the operating system: everything so far is readable,
    /// whatever happens to this process.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.chunk_start_ns = None;
        self.chunk_bytes = 0;
        self.mcap
            .flush()
            .map_err(|error| write_error(&self.path, error))
    }

    /// Writes rosbag2's description, the index and the statistics, and gives the stream back.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn finish(mut self) -> Result<W, LogError> {
        let description = BagDescription {
            times_ns: self.times_ns.unwrap_or_default(),
            topics: &self.topics,
        };
        let record = BTreeMap::from([("serialized_metadata".to_owned(), description.serialized())]);
        self.metadata("rosbag2", record)?;
        self.mcap
            .finish()
            .map_err(|error| write_error(&self.path, error))?;
        let mut stream = self.mcap.into_inner();
        stream
            .flush()
            .map_err(|error| write_error(&self.path, McapError::Io(error)))?;
        Ok(stream)
    }
}

impl<W: Write + Seek> fmt::Debug for LogWriter<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LogWriter")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

impl<M: Message> fmt::Debug for Channel<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Channel {} of {}", self.id, M::TYPE)
    }
}

fn write_error(path: &Path, error: McapError) -> LogError {
    match error {
        McapError::Io(source) => io_error(path, source),
        error => LogError::Write {
            path: path.to_owned(),
            what: error.to_string(),
        },
    }
}

fn io_error(path: &Path, source: io::Error) -> LogError {
    LogError::Io {
        action: "write",
        path: path.to_owned(),
        source,
    }
}
