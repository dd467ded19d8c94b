//! A log cannot exhaust the memory, and a bag cannot name files outside its folder.

use std::fs;

use crate::common::{joint_state_log, log};
use mcap::{Compression, WriteOptions};
use tactid_logs::{LogError, LogReader};

const MEGABYTE: usize = 1 << 20;

/// Returns what reading a log of messages of some size gives with a budget: their number, or an
/// error. Each chunk has two.
fn read(steps: &[u64], size: usize, budget: usize, compressed: bool) -> Result<usize, LogError> {
    let options = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .chunk_size(Some(size as u64 + 100))
        .compression_threads(0);
    let content = vec![0; size];
    let bytes = joint_state_log(options, steps.iter().copied(), |_| {
        if compressed {
            zstd::encode_all(content.as_slice(), 1).unwrap()
        } else {
            content.clone()
        }
    });
    assert!(bytes.len() < MEGABYTE, "{} bytes", bytes.len());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.mcap");
    fs::write(&path, bytes).unwrap();
    let mut messages = LogReader::open_within(&path, budget as u64)?.messages();
    let mut count = 0;
    for message in &mut messages {
        assert_eq!(message?.data().len(), size);
        count += 1;
    }
    assert!(messages.damage().is_empty());
    Ok(count)
}

/// Twenty chunks of two messages, each of which overlaps all others.
fn overlapping() -> Vec<u64> {
    (0..20).flat_map(|k| [k, 100 + k]).collect()
}

/// Asserts that a budget is refused, which the message gives in MiB.
fn assert_refused(result: Result<usize, LogError>, shown: &str) {
    let error = result.unwrap_err();
    assert!(matches!(&error, LogError::Memory { .. }), "{error}");
    let text = error.to_string();
    let limit = format!("more than {shown} MiB of memory");
    assert!(
        text.contains("bomb.mcap") && text.contains(&limit),
        "{text}"
    );
}

#[test]
fn chunks_that_overlap_need_a_budget() {
    let steps = overlapping();
    assert_eq!(read(&steps, MEGABYTE, 50 * MEGABYTE, false).unwrap(), 40);
    for (budget, shown) in [
        (MEGABYTE / 2, "0.5"),
        (4 * MEGABYTE, "4.0"),
        (38 * MEGABYTE, "38.0"),
    ] {
        assert_refused(read(&steps, MEGABYTE, budget, false), shown);
    }
}

/// The memory of a chunk is free once its messages have been read.
#[test]
fn chunks_in_order_need_the_budget_of_one() {
    let steps: Vec<u64> = (0..40).collect();
    assert_eq!(read(&steps, MEGABYTE, 3 * MEGABYTE, false).unwrap(), 40);
}

#[test]
fn messages_that_are_compressed_one_by_one_need_a_budget() {
    let one = [0];
    assert_eq!(read(&one, 8 * MEGABYTE, 9 * MEGABYTE, true).unwrap(), 1);
    assert_refused(read(&one, 8 * MEGABYTE, 7 * MEGABYTE, true), "7.0");
}

/// The headers of empty messages need more memory than the chunk.
#[test]
fn the_headers_of_messages_need_a_budget() {
    let options = WriteOptions::new().chunk_size(None).compression_threads(0);
    let bytes = joint_state_log(options, 0..100_000, |_| Vec::new());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.mcap");
    fs::write(&path, bytes).unwrap();
    for (budget, is_enough) in [(4, false), (6, false), (16, true)] {
        let reader = LogReader::open_within(&path, budget << 20).unwrap();
        let mut messages = reader.messages();
        assert_eq!(
            messages.all(|message| message.is_ok()),
            is_enough,
            "{budget} MB"
        );
    }
}

#[test]
fn a_large_metadata_file_is_not_read() {
    let bag = tempfile::tempdir().unwrap();
    let metadata = fs::File::create(bag.path().join("metadata.yaml")).unwrap();
    metadata.set_len(1 << 40).unwrap();
    let error = LogReader::open(bag.path()).unwrap_err().to_string();
    let says = error.contains("metadata.yaml") && error.contains("more than 16 MiB");
    assert!(says, "{error}");
}

/// Messages of a file that is listed twice would count twice.
#[test]
fn a_bag_lists_no_file_twice() {
    let bag = tempfile::tempdir().unwrap();
    fs::write(bag.path().join("bag_0.mcap"), log(3)).unwrap();
    for listed in ["'bag_0.mcap', 'bag_0.mcap'", "bag_0.mcap, ./bag_0.mcap"] {
        let yaml = format!(
            "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths: [{listed}]\n"
        );
        fs::write(bag.path().join("metadata.yaml"), yaml).unwrap();
        let error = LogReader::open(bag.path()).unwrap_err().to_string();
        let says = error.contains("metadata.yaml") && error.contains("twice");
        assert!(says && error.contains("bag_0.mcap"), "{error}");
    }
}

#[test]
fn a_bag_lists_no_file_outside_of_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    fs::create_dir_all(bag.join("sub")).unwrap();
    for path in ["other.mcap", "bag/bag_0.mcap", "bag/sub/part.mcap"] {
        fs::write(folder.path().join(path), log(3)).unwrap();
    }
    let opened = |listed: &str| {
        let yaml = format!(
            "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths: ['{listed}']\n"
        );
        fs::write(bag.join("metadata.yaml"), yaml).unwrap();
        LogReader::open(&bag)
    };
    let absolute = folder.path().join("other.mcap");
    for outside in [
        "../other.mcap",
        "sub/../../other.mcap",
        absolute.to_str().unwrap(),
    ] {
        let error = opened(outside).unwrap_err().to_string();
        let says = error.contains("metadata.yaml") && error.contains("not in its folder");
        assert!(says && error.contains(outside), "{error}");
    }
    // Old versions of rosbag2 list a file from the parent folder.
    for inside in [
        "bag_0.mcap",
        "./bag_0.mcap",
        "sub/part.mcap",
        "bag/bag_0.mcap",
    ] {
        assert!(opened(inside).is_ok(), "{inside}");
    }
}

#[test]
fn an_unknown_topic_lists_a_few_of_many() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut log = tactid_logs::LogWriter::create(&path).unwrap();
    for k in 1000..2000 {
        let topic = format!("/sensor_{k}");
        log.channel::<tactid_logs::messages::Imu>(&topic, tactid_logs::Durability::Volatile)
            .unwrap();
    }
    log.finish().unwrap();
    let reader = LogReader::open(&path).unwrap();
    let error = reader
        .messages_on(["/sensor_15000"])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("/sensor_1500, ") && error.ends_with(" and 984 more"),
        "{error}"
    );
    assert!(error.len() < 400, "{error}");
}

/// Opening a pipe would wait for its writer.
#[cfg(unix)]
#[test]
fn a_pipe_is_no_log() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.mcap");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let error = LogReader::open(&pipe).unwrap_err().to_string();
    assert!(
        error.contains("pipe.mcap") && error.contains("no regular file"),
        "{error}"
    );
}

/// A link that leads in a circle is no mistyped name of a file.
#[cfg(unix)]
#[test]
fn a_link_to_itself_is_named_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("loop");
    std::os::unix::fs::symlink("loop", &link).unwrap();
    let error = LogReader::open(&link).unwrap_err().to_string();
    assert!(error.contains("loop: Too many levels"), "{error}");
    assert!(!error.contains("did you mean"), "{error}");
}
