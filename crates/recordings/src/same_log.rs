//! Logs that are given twice.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Returns the indices of two paths that are the same log. A path that does not exist is left for
/// its own error.
pub(crate) fn same_log<P: AsRef<Path>>(paths: &[P]) -> Option<(usize, usize)> {
    let mut seen: HashMap<PathBuf, usize> = HashMap::new();
    for (index, path) in paths.iter().enumerate() {
        let Ok(same) = path.as_ref().canonicalize() else {
            continue;
        };
        if let Some(first) = seen.insert(same, index) {
            return Some((first, index));
        }
    }
    None
}
