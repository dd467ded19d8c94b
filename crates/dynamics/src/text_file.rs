//! Reading of text files, and of pipes to which another program writes a text.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
    thread,
    time::{Duration, Instant},
};

/// Largest text file that is read, bytes, far above any robot, calibration or experiment.
pub(crate) const MAX_BYTES: u64 = 16 << 20;

/// Longest time for which a pipe may have nothing to read. Making a URDF takes some seconds.
const LONGEST_PAUSE: Duration = Duration::from_secs(30);

/// Time between two attempts to read an empty pipe.
const PAUSE: Duration = Duration::from_millis(5);

/// Reads a text file of at most 16 MiB: a URDF, a calibration, an experiment.
///
/// # Errors
/// Returns the errors of [`read_text_within`].
pub fn read_text(path: &Path) -> io::Result<String> {
    read_text_within(path, MAX_BYTES)
}

/// Reads a text file of at most `most_bytes` bytes. A larger one is not read further, so that no
/// file exhausts the memory. A pipe is read until its writer closes it.
///
/// # Errors
/// Returns the error of the operating system if the file cannot be read,
/// [`io::ErrorKind::InvalidData`] if it is not UTF-8, [`io::ErrorKind::FileTooLarge`] if it is
/// larger, and, so that no call waits for ever, [`io::ErrorKind::UnexpectedEof`] for a pipe without
/// a writer and [`io::ErrorKind::TimedOut`] for one that has nothing to read for 30 s.
pub fn read_text_within(path: &Path, most_bytes: u64) -> io::Result<String> {
    let file = open(path).map_err(in_plain_words)?;
    let kind = file.metadata()?.file_type();
    if kind.is_dir() {
        return Err(in_plain_words(io::ErrorKind::IsADirectory.into()));
    }
    let mut bytes = Vec::new();
    WaitingReader(file)
        .take(most_bytes + 1)
        .read_to_end(&mut bytes)?;
    if bytes.is_empty() && !kind.is_file() {
        let message = "it is no file, and no program writes into it";
        return Err(io::Error::new(io::ErrorKind::UnexpectedEof, message));
    }
    if bytes.len() as u64 > most_bytes {
        let message = format!("it has more than {} MiB", most_bytes >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    String::from_utf8(bytes)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

/// Opens a file, and a pipe without waiting for its writer.
fn open(path: &Path) -> io::Result<File> {
    #[allow(unused_mut, reason = "mutable on Unix alone")]
    let mut options = File::options();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    options.read(true).open(path)
}

/// Returns the error of a path that is no file, without the number of the operating system's error.
fn in_plain_words(error: io::Error) -> io::Error {
    let message = match error.kind() {
        io::ErrorKind::NotFound => "there is no such file",
        io::ErrorKind::IsADirectory => "it is a folder, not a file",
        _ => return error,
    };
    io::Error::new(error.kind(), message)
}

/// A reader that waits for bytes where the one in it would have to, up to [`LONGEST_PAUSE`].
struct WaitingReader<R>(R);

impl<R: Read> Read for WaitingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let start = Instant::now();
        loop {
            match self.0.read(buffer) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                result => return result,
            }
            if start.elapsed() > LONGEST_PAUSE {
                let message = format!("nothing came for {} s", LONGEST_PAUSE.as_secs());
                return Err(io::Error::new(io::ErrorKind::TimedOut, message));
            }
            thread::sleep(PAUSE);
        }
    }
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

    /// The text of a program that pauses while it writes into a pipe is whole; a pipe without a
    /// writer is an error at once.
    #[cfg(unix)]
    #[test]
    fn a_pipe_is_read_until_its_writer_closes_it() {
        use std::{io::Write, os::fd::AsRawFd};

        let (reader, mut writer) = io::pipe().unwrap();
        let path = format!("/dev/fd/{}", reader.as_raw_fd());
        let writing = thread::spawn(move || {
            for part in ["<robot", " name='arm'/>"] {
                thread::sleep(10 * PAUSE);
                writer.write_all(part.as_bytes()).unwrap();
            }
        });
        let text = read_text(Path::new(&path)).unwrap();
        assert_eq!(text, "<robot name='arm'/>");
        writing.join().unwrap();

        let error = read_text(Path::new(&path)).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
    }
}
