//! Reading of small text files.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// Largest text file that is read, bytes, far above any robot, calibration or experiment.
const MAX_BYTES: u64 = 16 << 20;

/// Reads a text file of at most 16 MiB: a URDF, a calibration, an experiment. A larger one is not read further, so that no
/// file exhausts the memory.
///
/// # Errors
/// Returns the error of the operating system if the file cannot be read, [`io::ErrorKind::InvalidData`] if it is not UTF-8,
/// and [`io::ErrorKind::FileTooLarge`] if it is larger.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    File::open(path)?
        .take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES {
        let message = format!("it has more than {} MiB", MAX_BYTES >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    String::from_utf8(bytes)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_file_is_not_read() {
        let path = std::env::temp_dir().join(format!("tactid-text-{}", std::process::id()));
        let file = File::create(&path).unwrap();
        for (length, is_read) in [(MAX_BYTES, true), (MAX_BYTES + 1, false), (1 << 40, false)] {
            file.set_len(length).unwrap();
            let read = read_text(&path);
            assert_eq!(read.is_ok(), is_read, "{length} bytes");
            let kind = read.err().map(|error| error.kind());
            assert!(kind.is_none_or(|kind| kind == io::ErrorKind::FileTooLarge));
        }
        std::fs::remove_file(&path).unwrap();
    }
}
