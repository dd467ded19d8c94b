//! What a path that does not exist may have been meant to be.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use strsim::levenshtein;

use crate::error::LogError;

/// Largest number of characters that are inserted, removed or replaced between similar names.
const MOST_EDITS: usize = 2;

/// Returns the error of a log that does not exist, with the path that was perhaps meant.
pub(super) fn no_such_log(path: &Path) -> LogError {
    let meant = similar(path).map(|meant| format!("; did you mean {}?", meant.display()));
    let what = format!(
        "there is no such file or folder{}",
        meant.unwrap_or_default()
    );
    LogError::io("open", path, io::Error::new(io::ErrorKind::NotFound, what))
}

/// Returns the path in the same folder with the most similar name, if one is similar: it has the
/// same stem, or few other characters.
fn similar(path: &Path) -> Option<PathBuf> {
    let given_name = path.file_name()?.to_str()?;
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let entries = fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
    let distance = |name: &str| {
        let has_stem = stem(name) == stem(given_name) && !stem(name).is_empty();
        let edits = levenshtein(&name.to_lowercase(), &given_name.to_lowercase());
        let is_similar = edits <= MOST_EDITS && 2 * edits < given_name.chars().count();
        (has_stem || is_similar).then_some(edits)
    };
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let closest = names
        .filter_map(|name| Some((distance(&name)?, name)))
        .min()?;
    Some(path.with_file_name(closest.1))
}

/// Returns a name up to its first dot.
fn stem(name: &str) -> &str {
    name.split('.').next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::no_such_log;

    /// A name with a slip, another case or another extension is suggested, an unrelated one not.
    #[test]
    fn a_similar_name_is_suggested() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["recording_12", "pick.mcap", "notes.txt"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let cases = [
            ("recordng_12", Some("recording_12")),
            ("Recording_12", Some("recording_12")),
            ("pick.db3", Some("pick.mcap")),
            ("ab", None),
            ("place.mcap", None),
        ];
        for (given, meant) in cases {
            let error = no_such_log(&folder.path().join(given)).to_string();
            assert!(error.contains("there is no such file or folder"), "{error}");
            match meant {
                Some(name) => assert!(error.ends_with(&format!("{name}?")), "{error}"),
                None => assert!(!error.contains("did you mean"), "{error}"),
            }
        }
        let nowhere = folder.path().join("none").join("run.mcap");
        assert!(!no_such_log(&nowhere).to_string().contains("did you mean"));
    }
}
