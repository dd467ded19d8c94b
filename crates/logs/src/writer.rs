use std::{
    collections::BTreeMap,
    fmt,
    fs::{self, File, TryLockError},
    io::{self, BufWriter, Seek, Write},
    marker::PhantomData,
    path::{Path, PathBuf},
};

use mcap::{Compression, McapError, WriteOptions, records::MessageHeader};

use crate::{
    cdr,
    error::LogError,
    messages::Message,
    rosbag2::{ANY_NAME, BagDescription, Durability, TopicDescription, invalid_topic},
    system_file,
};

/// A chunk ends after this duration of log time, ns, or after [`CHUNK_BYTES`], whichever comes
/// first. This is the most that a killed writer loses.
const CHUNK_DURATION_NS: u64 = 1_000_000_000;
const CHUNK_BYTES: usize = 4 << 20;

/// Writes a log that rosbag2 can play: MCAP with the profile `ros2` in compressed and indexed
/// chunks.
///
/// Each second of log time is a chunk of its own. A complete chunk is handed to the operating
/// system, so that the log of a killed writer is readable up to there. The bytes of the log depend
/// only on what is written. A writer that is dropped still leaves an indexed log;
/// [`finish`](Self::finish) also writes the description for rosbag2 and reports errors.
pub struct LogWriter<W: Write + Seek> {
    mcap: mcap::Writer<W>,
    path: PathBuf,
    topics: Vec<TopicDescription>,
    /// First and last log time, ns.
    times_ns: Option<(u64, u64)>,
    /// Log time at which the open chunk starts, ns.
    chunk_start_ns: Option<u64>,
    chunk_bytes: usize,
    /// One encoded message, kept for its allocation.
    buffer: Vec<u8>,
}

/// A topic of a [`LogWriter`], which accepts messages of one type.
pub struct Channel<M> {
    id: u16,
    index: usize,
    message: PhantomData<fn(&M)>,
}

/// Definition of a type of messages.
#[derive(Clone, Copy)]
pub(crate) struct Schema<'a> {
    pub(crate) encoding: &'a str,
    pub(crate) text: &'a [u8],
}

impl LogWriter<BufWriter<File>> {
    /// Creates a log file. It replaces an existing one, unless another writer still has it open.
    ///
    /// # Errors
    /// Returns [`LogError::Io`] if the file cannot be created or written, if another writer is
    /// writing it, or if the path leads to a pipe or a socket, which have no positions.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref();
        let file = create_locked(path).map_err(|source| LogError::Io {
            action: "create",
            path: path.to_owned(),
            source,
        })?;
        Self::with_path(BufWriter::new(file), path.to_owned())
    }
}

/// Creates an empty file that no other writer has open. The lock ends with file or process.
fn create_locked(path: &Path) -> io::Result<File> {
    // What another writer has written must stay until the lock is there.
    let mut options = system_file::options();
    let opened = options.write(true).create(true).truncate(false).open(path);
    let file = opened.map_err(|error| match has_no_reader(&error) {
        true => without_positions(),
        false => error,
    })?;
    let kind = file.metadata()?.file_type();
    if has_no_positions(kind) {
        return Err(without_positions());
    }
    if !kind.is_file() {
        return Ok(file);
    }
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let what = "another program is writing this log";
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, what));
        }
        // File systems without locks are usable, too.
        Err(TryLockError::Error(_)) | Ok(()) => {}
    }
    file.set_len(0)?;
    Ok(file)
}

/// Returns the error of a file that cannot be a log.
fn without_positions() -> io::Error {
    let what = "a log needs a file, and this is a pipe or a socket";
    io::Error::new(io::ErrorKind::NotSeekable, what)
}

/// Returns whether an error comes from a pipe without a reader, or from a socket.
fn has_no_reader(error: &io::Error) -> bool {
    cfg!(unix) && error.raw_os_error() == Some(libc::ENXIO)
}

#[cfg(unix)]
fn has_no_positions(kind: fs::FileType) -> bool {
    use std::os::unix::fs::FileTypeExt;
    kind.is_fifo() || kind.is_socket()
}

#[cfg(not(unix))]
fn has_no_positions(_: fs::FileType) -> bool {
    false
}

impl<W: Write + Seek> LogWriter<W> {
    /// Creates a log on an empty stream.
    ///
    /// # Errors
    /// Returns [`LogError::Io`] or [`LogError::Write`] if the stream cannot be written.
    pub fn new(stream: W) -> Result<Self, LogError> {
        Self::with_path(stream, PathBuf::from("log.mcap"))
    }

    fn with_path(stream: W, path: PathBuf) -> Result<Self, LogError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("tactid ", env!("CARGO_PKG_VERSION")))
            // Measured on doubles at 1 kHz: smaller than lz4, and faster to write and to read.
            .compression(Some(Compression::Zstd))
            .compression_level(1)
            // The writer needs no other threads.
            .compression_threads(0)
            // A complete chunk is written at once, so that no header has to be corrected later.
            .disable_seeking(true)
            // This writer decides where chunks end.
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

    /// Adds a topic. rosbag2 plays it with the given durability.
    ///
    /// # Errors
    /// Returns [`LogError::BadTopic`] if the log already has the topic or ROS 2 does not allow its
    /// name, and [`LogError::Io`] or [`LogError::Write`] if the log cannot be written.
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
        let schema = Schema {
            encoding: "ros2msg",
            text: M::schema().as_bytes(),
        };
        let description = TopicDescription {
            name: topic.to_owned(),
            type_name: M::TYPE.to_owned(),
            encoding: "cdr".to_owned(),
            durability,
            count: 0,
        };
        let id = self.add_channel(description, schema, &metadata)?;
        Ok(Channel {
            id,
            index: self.topics.len() - 1,
            message: PhantomData,
        })
    }

    /// Adds a topic as it is described, and returns the number of its channel.
    pub(crate) fn add_channel(
        &mut self,
        topic: TopicDescription,
        schema: Schema<'_>,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16, LogError> {
        let (name, encoding) = (&topic.name, &topic.encoding);
        let id = self
            .mcap
            .add_schema(&topic.type_name, schema.encoding, schema.text)
            .and_then(|schema| self.mcap.add_channel(schema, name, encoding, metadata))
            .map_err(|error| write_error(&self.path, error))?;
        self.topics.push(topic);
        Ok(id)
    }

    /// Appends a message. `time_ns` is its log time, ns, on the clock of the stamps. Messages may
    /// come in any order.
    ///
    /// # Errors
    /// Returns [`LogError::Encode`] if the message cannot be encoded, [`LogError::Io`] or
    /// [`LogError::Write`] if the log cannot be written, and [`LogError::Write`] for the channel of
    /// another log.
    pub fn write<M: Message>(
        &mut self,
        channel: &Channel<M>,
        time_ns: u64,
        message: &M,
    ) -> Result<(), LogError> {
        let Some(topic) = self.topics.get(channel.index) else {
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
        let buffer = std::mem::take(&mut self.buffer);
        let written = self.write_encoded(channel.index, &header, &buffer);
        self.buffer = buffer;
        written
    }

    /// Appends an encoded message to the topic with this place among all.
    pub(crate) fn write_encoded(
        &mut self,
        topic: usize,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<(), LogError> {
        self.make_room(header.log_time, data.len())?;
        self.mcap
            .write_to_known_channel(header, data)
            .map_err(|error| write_error(&self.path, error))?;
        if let Some(topic) = self.topics.get_mut(topic) {
            topic.count += 1;
        }
        Ok(())
    }

    /// Ends the open chunk if a message of so many bytes, with this log time, belongs to the next
    /// one.
    fn make_room(&mut self, time_ns: u64, bytes: usize) -> Result<(), LogError> {
        let (first, last) = self.times_ns.unwrap_or((time_ns, time_ns));
        self.times_ns = Some((first.min(time_ns), last.max(time_ns)));

        let start = *self.chunk_start_ns.get_or_insert(time_ns);
        if time_ns.saturating_sub(start) >= CHUNK_DURATION_NS || self.chunk_bytes >= CHUNK_BYTES {
            self.flush()?;
            self.chunk_start_ns = Some(time_ns);
        }
        self.chunk_bytes += bytes;
        Ok(())
    }

    /// Adds a metadata record, which ends the open chunk.
    ///
    /// # Errors
    /// Returns [`LogError::Io`] or [`LogError::Write`] if the log cannot be written.
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

    /// Ends the open chunk and hands it to the operating system. Everything written so far is then
    /// readable, even if the process is killed.
    ///
    /// # Errors
    /// Returns [`LogError::Io`] or [`LogError::Write`] if the log cannot be written.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.chunk_start_ns = None;
        self.chunk_bytes = 0;
        self.mcap
            .flush()
            .map_err(|error| write_error(&self.path, error))
    }

    /// Returns the `metadata.yaml` of a bag whose only file has this name and what was written so
    /// far.
    #[must_use]
    pub fn bag_metadata(&self, file: &str) -> String {
        self.description().file(file)
    }

    fn description(&self) -> BagDescription<'_> {
        BagDescription {
            times_ns: self.times_ns.unwrap_or_default(),
            topics: &self.topics,
        }
    }

    /// Writes the description for rosbag2, the index and the statistics, and returns the stream.
    ///
    /// # Errors
    /// Returns [`LogError::Io`] or [`LogError::Write`] if the log cannot be written.
    pub fn finish(mut self) -> Result<W, LogError> {
        let description = self.description().serialized(ANY_NAME);
        let record = BTreeMap::from([("serialized_metadata".to_owned(), description)]);
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
