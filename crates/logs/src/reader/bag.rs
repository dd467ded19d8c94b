//! Bags: folders with the files of one recording.

use std::collections::BTreeSet;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use crate::error::LogError;
use crate::system_file::{self, FileMark};

/// Most bytes of `metadata.yaml` that are read, far more than any bag has.
const MAX_METADATA: u64 = 16 << 20;

#[derive(Deserialize)]
struct MetadataFile {
    rosbag2_bagfile_information: BagInformation,
}

/// The fields of `metadata.yaml` that name the files and their storage format. The files contain
/// everything else.
#[derive(Deserialize)]
struct BagInformation {
    storage_identifier: String,
    relative_file_paths: Vec<String>,
    #[serde(default)]
    compression_format: Option<String>,
    #[serde(default)]
    compression_mode: Option<String>,
}

impl BagInformation {
    /// Returns the reason why the bag cannot be read although it is one. The files show their
    /// storage and their compression themselves.
    fn unsupported(&self) -> Option<String> {
        let storage = &self.storage_identifier;
        if !["mcap", "sqlite3"].contains(&storage.as_str()) {
            return Some(format!(
                "it is stored as {storage}, not as mcap or sqlite3; `ros2 bag convert` makes an MCAP bag of it"
            ));
        }
        let mode = self.compression_mode.as_deref().unwrap_or_default();
        let format = self.compression_format.as_deref().unwrap_or_default();
        let is_compressed = ["file", "message"].contains(&mode.to_lowercase().as_str());
        (is_compressed && format != "zstd").then(|| {
            format!(
                "each {} is compressed as {format:?}, not as \"zstd\"; `ros2 bag convert` makes a bag that is not \
                 compressed",
                mode.to_lowercase()
            )
        })
    }
}

/// Returns the error of a folder, or of the `metadata.yaml` in it.
fn not_a_bag(path: &Path, why: &str) -> LogError {
    LogError::NotALog {
        path: path.to_owned(),
        what: format!("is not a rosbag2 bag that can be read: {why}"),
    }
}

/// Returns the paths of the log files of a bag in the order of the recording.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let metadata = folder.join("metadata.yaml");
    if !metadata.is_file() {
        return files_without_metadata(folder);
    }
    let not_a_bag = |what: String| not_a_bag(&metadata, &what);
    let text = read_metadata(&metadata)?;
    if text.len() as u64 > MAX_METADATA {
        return Err(not_a_bag(format!(
            "it has more than {} MiB",
            MAX_METADATA >> 20
        )));
    }
    let MetadataFile {
        rosbag2_bagfile_information: bag,
    } = serde_saphyr::from_str(&text).map_err(|error| {
        let text = error.to_string();
        let first_line = text.lines().next().unwrap_or_default();
        // What follows is advice for the author of a program.
        let fault = first_line.split("; use ").next().unwrap_or_default();
        not_a_bag(format!("it is not as rosbag2 writes it ({fault})"))
    })?;
    if let Some(what) = bag.unsupported() {
        return Err(not_a_bag(what));
    }
    if bag.relative_file_paths.is_empty() {
        return Err(not_a_bag("it lists no files".to_owned()));
    }
    let (mut found, mut inodes) = (BTreeSet::new(), BTreeSet::new());
    let files = bag.relative_file_paths.iter();
    files
        .map(|listed| {
            let path = locate(folder, listed).ok_or_else(|| {
                not_a_bag(format!(
                    "it lists {listed:?}, which is not in its folder; name the log files themselves"
                ))
            })?;
            // A file that is absent is reported when it is opened.
            let whole = path.canonicalize().unwrap_or_else(|_| path.clone());
            let metadata = whole.metadata().ok();
            let inode = metadata.and_then(|metadata| FileMark::of(&metadata).inode());
            if !found.insert(whole) || inode.is_some_and(|inode| !inodes.insert(inode)) {
                return Err(not_a_bag(format!(
                    "it lists {listed:?} twice: its messages would count twice"
                )));
            }
            Ok(path)
        })
        .collect()
}

/// Reads `metadata.yaml`, at most one byte more than [`MAX_METADATA`].
fn read_metadata(path: &Path) -> Result<String, LogError> {
    let text = system_file::open(path)
        .and_then(|(file, _)| io::read_to_string(file.take(MAX_METADATA + 1)));
    text.map_err(|source| LogError::io("read", path, source))
}

/// Returns the path of a listed file, or `None` if that is not below the bag's folder: whoever
/// opens a bag does not expect that it names other files. Old versions of rosbag2 list a file
/// relative to the bag's parent folder.
fn locate(folder: &Path, listed: &str) -> Option<PathBuf> {
    let listed = Path::new(listed);
    let is_below = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    let below = listed
        .components()
        .all(is_below)
        .then(|| folder.join(listed));
    let in_bag = listed.file_name().map(|name| folder.join(name));
    match in_bag {
        Some(in_bag) if !below.as_ref().is_some_and(|path| path.exists()) && in_bag.exists() => {
            Some(in_bag)
        }
        _ => below,
    }
}

/// Finds the files of a bag without `metadata.yaml`, which a killed recorder leaves. They are named
/// `<bag>_<number>` with the extension of the storage, and `.zstd` after it if they are compressed.
fn files_without_metadata(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let error = |source| LogError::io("read", folder, source);
    let mut logs = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(error)? {
        let path = entry.map_err(error)?.path();
        logs.extend(split_name(&path).map(|name| (name, path)));
    }
    // A file comes before its compressed copy, which the recorder has not finished.
    logs.sort();
    logs.dedup_by(|copy, file| file.0 == copy.0 && is_compressed(&copy.1));
    match logs.as_slice() {
        [] => {
            let meant = bag_within(folder);
            let what = "it holds neither metadata.yaml nor an .mcap or .db3 file, as a bag does";
            Err(not_a_bag(folder, &format!("{what}{meant}")))
        }
        [((first, _), _), rest @ ..] if rest.iter().any(|((name, _), _)| name != first) => {
            Err(not_a_bag(
                folder,
                "it has no metadata.yaml, and its .mcap or .db3 files have different names; name one of them",
            ))
        }
        _ => Ok(logs.into_iter().map(|(_, path)| path).collect()),
    }
}

/// Names the first folder that is a bag in one that is none.
fn bag_within(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let folders = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let bags = folders.filter(|path| path.join("metadata.yaml").is_file());
    let first = bags
        .min()
        .map(|bag| format!("; did you mean {}?", bag.display()));
    first.unwrap_or_default()
}

fn is_compressed(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension == "zstd")
}

/// Returns the name of the bag and the number of the file from its name; `None` if it is no log.
fn split_name(path: &Path) -> Option<(String, u64)> {
    let stem = path.file_stem()?;
    let name = if is_compressed(path) {
        Path::new(stem)
    } else {
        path
    };
    if !["mcap", "db3"].contains(&name.extension()?.to_str()?) {
        return None;
    }
    let stem = name.file_stem()?.to_string_lossy();
    let split = stem
        .rsplit_once('_')
        .and_then(|(name, number)| number.parse().ok().map(|number| (name.to_owned(), number)));
    Some(split.unwrap_or_else(|| (stem.into_owned(), 0)))
}
