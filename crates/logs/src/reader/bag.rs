//! Bags: folders with the MCAP files of one recording.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::LogError;

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

/// Returns the paths of the log files of a bag in the order of the recording.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let metadata = folder.join("metadata.yaml");
    if !metadata.is_file() {
        return files_without_metadata(folder);
    }
    let not_a_bag = |what| LogError::NotABag {
        path: metadata.clone(),
        what,
    };
    let text = std::fs::read_to_string(&metadata).map_err(|source| LogError::Io {
        action: "read",
        path: metadata.clone(),
        source,
    })?;
    let MetadataFile {
        rosbag2_bagfile_information: bag,
    } = serde_saphyr::from_str(&text).map_err(|error| {
        let first_line = error
            .to_string()
            .lines()
            .next()
            .unwrap_or_default()
            .to_owned();
        not_a_bag(first_line)
    })?;
    if bag.storage_identifier != "mcap" {
        return Err(not_a_bag(format!(
            "it is stored as {}; `ros2 bag convert` makes an MCAP bag of it",
            bag.storage_identifier
        )));
    }
    // Chunks within a file may be compressed. Compression of messages or whole files is not
    // supported.
    if let Some(mode) = bag
        .compression_mode
        .filter(|mode| !mode.is_empty() && mode != "storage")
    {
        let format = bag.compression_format.unwrap_or_default();
        return Err(not_a_bag(format!(
            "each {} is compressed ({format}); `ros2 bag convert` makes a bag that is not",
            mode.to_lowercase()
        )));
    }
    if bag.relative_file_paths.is_empty() {
        return Err(not_a_bag("it lists no files".to_owned()));
    }
    Ok(bag
        .relative_file_paths
        .iter()
        .map(|path| locate(folder, path))
        .collect())
}

/// Returns the path of a listed file. Old versions of rosbag2 list it relative to the bag's parent
/// folder.
fn locate(folder: &Path, listed: &str) -> PathBuf {
    let listed = Path::new(listed);
    let in_bag = listed.file_name().map(|name| folder.join(name));
    match in_bag {
        Some(in_bag) if !folder.join(listed).exists() && in_bag.exists() => in_bag,
        _ => folder.join(listed),
    }
}

/// Finds the files of a bag without `metadata.yaml`, which a killed recorder leaves. They are named
/// `<bag>_<number>.mcap`.
fn files_without_metadata(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let error = |source| LogError::Io {
        action: "read",
        path: folder.to_owned(),
        source,
    };
    let mut logs = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(error)? {
        let path = entry.map_err(error)?.path();
        if path
            .extension()
            .is_some_and(|extension| extension == "mcap")
        {
            logs.push((split_name(&path), path));
        }
    }
    logs.sort();
    let not_a_bag = |what: &str| LogError::NotABag {
        path: folder.to_owned(),
        what: what.to_owned(),
    };
    match logs.as_slice() {
        [] => Err(not_a_bag(
            "it holds neither metadata.yaml nor an .mcap file",
        )),
        [((first, _), _), rest @ ..] if rest.iter().any(|((name, _), _)| name != first) => {
            Err(not_a_bag(
                "it has no metadata.yaml, and its .mcap files have different names; name one of them",
            ))
        }
        _ => Ok(logs.into_iter().map(|(_, path)| path).collect()),
    }
}

/// Returns the name of the bag and the number of the file from a file's name.
fn split_name(path: &Path) -> (String, u64) {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let split = stem
        .rsplit_once('_')
        .and_then(|(name, number)| number.parse().ok().map(|number| (name.to_owned(), number)));
    split.unwrap_or_else(|| (stem.into_owned(), 0))
}
