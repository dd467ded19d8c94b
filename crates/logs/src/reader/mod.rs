//! Reading of logs of any length, also damaged or unfinished ones.

mod bag;
mod compression;
#[cfg(test)]
mod io_faults;
mod mcap;
mod memory;
mod missing;
mod opening;
mod source;
mod sqlite;
mod storage;
mod stream;
mod zstd_context;

use std::{
    collections::{BTreeMap, HashMap},
    ops::ControlFlow,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use missing::no_such_log;
use opening::Opening;
pub use source::Ranges;
use source::{Elsewhere, Format, Source};
use storage::{Channel, FileIndex, MemoryBudget, Metadata};
pub use storage::{Damage, Definition};
pub use stream::{Messages, RawMessage};

use crate::{error::LogError, messages::Message};

/// Memory that messages of a log may occupy at once by default, bytes: hundreds of chunks.
pub const DEFAULT_MEMORY_LIMIT: u64 = 256 << 20;

static MEMORY: AtomicU64 = AtomicU64::new(DEFAULT_MEMORY_LIMIT);

/// Sets the memory that the messages of each log may occupy at once, bytes, for the logs that this
/// process opens with [`LogReader::open`] from now on: [`DEFAULT_MEMORY_LIMIT`] until then. It
/// counts chunks of overlapping times, as they are in the file and decompressed; the index of a log
/// may occupy half as many bytes. A log that needs more is an error, [`LogError::Memory`], whatever
/// its files claim.
pub fn set_memory_limit(bytes: u64) {
    MEMORY.store(bytes, Ordering::Relaxed);
}

/// Largest number of topics that an error lists.
const MAX_LISTED: usize = 16;

/// A topic of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name, for instance `/joint_states`.
    pub name: String,
    /// Type of its messages, such as `sensor_msgs/msg/JointState`; empty if the log has none.
    pub type_name: String,
    /// Encoding of its messages, `cdr` in ROS 2.
    pub encoding: String,
    /// Number of messages.
    pub count: u64,
    /// First and last log time, ns; `None` without messages.
    pub times_ns: Option<(u64, u64)>,
}

impl Topic {
    /// Returns name, type and encoding: one topic has one of each.
    fn key(&self) -> [&str; 3] {
        [&self.name, &self.type_name, &self.encoding]
    }

    /// Returns its name with the type of its messages, and with an encoding that is not read.
    #[must_use]
    pub fn described(&self) -> String {
        match self.encoding.as_str() {
            "cdr" => format!("{} ({})", self.name, self.type_name),
            other => format!("{} ({}; {other} is not read)", self.name, self.type_name),
        }
    }

    /// Returns whether its messages have the type `M`. Some writers omit `/msg` from the name.
    #[must_use]
    pub fn is<M: Message>(&self) -> bool {
        // The length tells most others before anything is copied: each message is asked.
        let is_short = self.type_name.len() + "/msg".len() == M::TYPE.len();
        self.type_name == M::TYPE || (is_short && self.type_name == M::TYPE.replace("/msg/", "/"))
    }

    /// Returns the mean number of messages per second, or `None` if all times are equal.
    #[must_use]
    pub fn frequency_hz(&self) -> Option<f64> {
        let (first, last) = self.times_ns?;
        let duration_s = last.checked_sub(first).filter(|ns| *ns > 0)? as f64 * 1e-9;
        Some((self.count.saturating_sub(1)) as f64 / duration_s)
    }
}

/// An open log: the folder of a rosbag2 bag, or one of its files, in MCAP (`.mcap`) or SQLite
/// (`.db3`), compressed by file, by message or not at all. The content of a file shows its storage.
///
/// A finished MCAP log is opened with its index, in a time that does not depend on its length. A
/// log that a killed writer left without index is scanned once, and so are the headers of the
/// messages of an SQLite bag. Of a bag that another process writes, the messages that are complete
/// when it is opened are read. A file that is compressed as a whole is decompressed to a temporary
/// file, which is deleted with the reader.
#[derive(Debug)]
pub struct LogReader {
    path: PathBuf,
    files: Arc<[FileIndex]>,
    topics: Vec<Arc<Topic>>,
    metadata: Metadata,
    damage: Vec<Damage>,
    memory: MemoryBudget,
}

impl LogReader {
    /// Opens a log. Its messages may occupy the memory that [`set_memory_limit`] has set.
    ///
    /// # Errors
    /// Returns the errors of [`open_within`](Self::open_within).
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        Self::open_within(path, MEMORY.load(Ordering::Relaxed))
    }

    /// Opens a log. Its messages may occupy at most `memory_bytes` bytes of memory at once, and its
    /// index half as many. The limit counts what [`set_memory_limit`] names.
    ///
    /// # Errors
    /// Returns [`LogError::Io`], [`LogError::NotALog`], [`LogError::Locked`] or
    /// [`LogError::Oversized`] if there is no readable log at this path, and [`LogError::Memory`]
    /// if the index, or a chunk of a file without index, needs more memory. A damaged MCAP log is
    /// not an error; see [`damage`](Self::damage).
    pub fn open_within(path: impl AsRef<Path>, memory_bytes: u64) -> Result<Self, LogError> {
        Self::open_files(path.as_ref(), memory_bytes, &mut || {
            ControlFlow::Continue(())
        })
    }

    /// Opens a log as [`open`](Self::open) does, under the eyes of a watch that is asked many times
    /// a second: a log without index is read to its end, which may take minutes.
    ///
    /// # Errors
    /// Returns [`LogError::Interrupted`] if the watch breaks, and the errors of
    /// [`open_within`](Self::open_within).
    pub fn open_watched(
        path: impl AsRef<Path>,
        watch: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Self, LogError> {
        Self::open_files(path.as_ref(), MEMORY.load(Ordering::Relaxed), watch)
    }

    /// Opens an MCAP log whose bytes are read by ranges, such as an object in a store, with the
    /// memory and under the watch of [`open_watched`](Self::open_watched). Errors name it by `path`.
    /// Of a finished log, its index and the chunks with the messages that are asked for are read.
    ///
    /// # Errors
    /// Returns the errors of [`open_watched`](Self::open_watched).
    pub fn of_ranges(
        path: impl AsRef<Path>,
        ranges: impl Ranges + Clone + Sync + 'static,
        watch: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Self, LogError> {
        let path = path.as_ref().to_owned();
        let mut opening = Opening::new(MEMORY.load(Ordering::Relaxed), watch);
        let content = Elsewhere {
            path: path.clone(),
            ranges,
        };
        let index = mcap::index(content, &mut opening)?;
        Ok(Self::of_files(&path, [index].into(), opening.memory))
    }

    /// Returns messages in memory as a log, which errors name by `path`. The number and the times
    /// of their topics are counted here, whatever the topics of the messages have.
    #[must_use]
    pub fn of_messages(path: impl AsRef<Path>, messages: &[RawMessage]) -> Self {
        let path = path.as_ref();
        let memory = MemoryBudget::whole(MEMORY.load(Ordering::Relaxed));
        Self::of_files(path, [memory::index(path, messages)].into(), memory)
    }

    fn open_files(
        path: &Path,
        memory_bytes: u64,
        watch: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Self, LogError> {
        let paths = match path.metadata() {
            Ok(metadata) if metadata.is_dir() => bag::files(path)?,
            Ok(_) => vec![path.to_owned()],
            Err(_) if path.symlink_metadata().is_err() => return Err(no_such_log(path)),
            // A link that leads nowhere.
            Err(error) => return Err(LogError::io("open", path, error)),
        };
        let mut opening = Opening::new(memory_bytes, watch);
        let files: Arc<[FileIndex]> = paths
            .iter()
            .map(|path| open_file(path, &mut opening))
            .collect::<Result<_, _>>()?;
        Ok(Self::of_files(path, files, opening.memory))
    }

    /// Returns the log at a path with these open files.
    fn of_files(path: &Path, files: Arc<[FileIndex]>, memory: MemoryBudget) -> Self {
        Self {
            path: path.to_owned(),
            topics: topics_of(&files),
            metadata: files
                .iter()
                .flat_map(|file| file.metadata.clone())
                .collect(),
            damage: files
                .iter()
                .filter_map(|file| file.damage.clone())
                .collect(),
            files,
            memory,
        }
    }

    /// Returns the path by which errors name the log.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the topics in the order of their names.
    #[must_use]
    pub fn topics(&self) -> &[Arc<Topic>] {
        &self.topics
    }

    /// Returns the topic with a name.
    #[must_use]
    pub fn topic(&self, name: &str) -> Option<&Topic> {
        self.topics
            .iter()
            .find(|topic| topic.name == name)
            .map(AsRef::as_ref)
    }

    /// Returns what the log states of the messages of one of its topics: the definition of a
    /// channel that has one. SQLite bags have none.
    #[must_use]
    pub fn definition(&self, topic: &Topic) -> Definition {
        let channels = self.files.iter().flat_map(|file| file.channels.values());
        let own = channels.filter(|channel| channel.key() == topic.key());
        let found = own.max_by_key(|channel| !channel.definition.schema.is_empty());
        found.map_or_else(Definition::default, |channel| channel.definition.clone())
    }

    /// Returns the topics of a type in the order of their names.
    pub fn topics_of<M: Message>(&self) -> impl Iterator<Item = &Topic> {
        self.topics
            .iter()
            .map(AsRef::as_ref)
            .filter(|topic: &&Topic| topic.is::<M>())
    }

    /// Returns first and last log time, ns, or `None` if the log is empty.
    #[must_use]
    pub fn times_ns(&self) -> Option<(u64, u64)> {
        let times = || self.topics.iter().filter_map(|topic| topic.times_ns);
        times().map(|t| t.0).min().zip(times().map(|t| t.1).max())
    }

    /// Returns the metadata records by name.
    #[must_use]
    pub fn metadata(&self) -> &BTreeMap<String, BTreeMap<String, String>> {
        &self.metadata
    }

    /// Returns the damage that was found when the log was opened. Damage within the data of a
    /// finished log is found when the data is read; see [`Messages::damage`].
    #[must_use]
    pub fn damage(&self) -> &[Damage] {
        &self.damage
    }

    /// Returns all messages in the order of their log times.
    #[must_use]
    pub fn messages(&self) -> Messages {
        self.select(|_| true)
    }

    /// Returns the messages of some topics in the order of their log times. Parts of the log
    /// without such messages are not read.
    ///
    /// # Errors
    /// Returns [`LogError::NoSuchTopic`] if the log lacks one of the topics.
    pub fn messages_on<S: AsRef<str>>(
        &self,
        topics: impl IntoIterator<Item = S>,
    ) -> Result<Messages, LogError> {
        let names: Vec<S> = topics.into_iter().collect();
        if let Some(unknown) = names
            .iter()
            .find(|name| self.topic(name.as_ref()).is_none())
        {
            return Err(LogError::NoSuchTopic {
                path: self.path.clone(),
                topic: unknown.as_ref().to_owned(),
                available: self.topics_beside(unknown.as_ref()),
            });
        }
        Ok(self.select(|topic| names.iter().any(|name| name.as_ref() == topic.name)))
    }

    /// Lists topics for an error message: of more than [`MAX_LISTED`] the neighbours of a name.
    fn topics_beside(&self, name: &str) -> String {
        if self.topics.is_empty() {
            return "no topics".to_owned();
        }
        let place = self
            .topics
            .partition_point(|topic| topic.name.as_str() < name);
        let first = place.saturating_sub(MAX_LISTED / 2);
        let beside = self.topics.iter().skip(first).take(MAX_LISTED);
        let listed: Vec<&str> = beside.map(|topic| topic.name.as_str()).collect();
        match self.topics.len() - listed.len() {
            0 => listed.join(", "),
            more => format!("{} and {more} more", listed.join(", ")),
        }
    }

    fn select(&self, is_selected: impl Fn(&Topic) -> bool) -> Messages {
        let selected = self.topics.iter().filter(|topic| is_selected(topic));
        let of_key: HashMap<_, _> = selected.map(|topic| (topic.key(), topic)).collect();
        let by_channel = |file: &FileIndex| {
            let channels = file.channels.iter();
            channels
                .filter_map(|(id, channel)| Some((*id, (*of_key.get(&channel.key())?).clone())))
                .collect()
        };
        let selected = self.files.iter().map(by_channel).collect();
        let damage = self.damage.clone();
        Messages::new(self.files.clone(), selected, damage, self.memory.total)
    }
}

/// Opens the index of a file in any storage.
fn open_file(path: &Path, opening: &mut Opening<'_>) -> Result<FileIndex, LogError> {
    let source = Source::open(path, opening)?;
    match source.format()? {
        Format::Mcap => mcap::index(source, opening),
        Format::Sqlite => sqlite::index(source, opening),
    }
}

/// Merges the channels of all files by topic.
fn topics_of(files: &[FileIndex]) -> Vec<Arc<Topic>> {
    let mut topics = BTreeMap::new();
    for channel in files.iter().flat_map(|file| file.channels.values()) {
        let whole = topics.entry(channel.key()).or_insert_with(Channel::default);
        whole.count = whole.count.saturating_add(channel.count);
        if let Some(times_ns) = channel.times_ns {
            whole.extend_times(times_ns);
        }
    }
    let topic = |([name, type_name, encoding], whole): ([&str; 3], Channel)| {
        Arc::new(Topic {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            encoding: encoding.to_owned(),
            count: whole.count,
            times_ns: whole.times_ns,
        })
    };
    topics.into_iter().map(topic).collect()
}
