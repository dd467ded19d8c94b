//! Bags of both storages that rosbag2 compresses by file or by message.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::common::{
    joint_state, joint_state_log, log, read, read_file,
    sqlite::{bag, create, fill},
};
use mcap::WriteOptions;
use tactid_logs::{LogReader, messages::JointState};

const STEPS: u64 = 50;

fn pack(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 1).unwrap()
}

/// Writes a whole file, compressed.
fn pack_file(path: &Path) -> PathBuf {
    let packed = PathBuf::from(format!("{}.zstd", path.display()));
    fs::write(&packed, pack(&fs::read(path).unwrap())).unwrap();
    fs::remove_file(path).unwrap();
    packed
}

/// Describes a bag of these files.
fn describe(folder: &Path, storage: &str, mode: &str, files: &str) {
    let text = format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: {storage}\n  \
         relative_file_paths: [{files}]\n  compression_format: zstd\n  compression_mode: {mode}\n"
    );
    fs::write(folder.join("metadata.yaml"), text).unwrap();
}

#[test]
fn files_that_are_compressed_as_a_whole_are_read() {
    let (expected, _) = read(&log(STEPS)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let plain = folder.path().join("run_0.mcap");
    fs::write(&plain, log(STEPS)).unwrap();
    assert_eq!(read_file(&pack_file(&plain)).unwrap().0, expected);
    describe(folder.path(), "mcap", "FILE", "run_0.mcap.zstd");
    assert_eq!(read_file(folder.path()).unwrap().0, expected);

    let folder = tempfile::tempdir().unwrap();
    let plain = folder.path().join("run_0.db3");
    bag(&plain, STEPS);
    assert_eq!(read_file(&pack_file(&plain)).unwrap().0, expected);
    describe(folder.path(), "sqlite3", "FILE", "run_0.db3.zstd");
    assert_eq!(read_file(folder.path()).unwrap().0, expected);
}

#[test]
fn messages_that_are_compressed_one_by_one_are_read() {
    let (expected, _) = read(&log(STEPS)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run_0.db3");
    fill(&create(&path, 3, true), 0..STEPS, pack);
    assert_eq!(read_file(&path).unwrap().0, expected);
    describe(folder.path(), "sqlite3", "MESSAGE", "run_0.db3");
    assert_eq!(read_file(folder.path()).unwrap().0, expected);

    let path = folder.path().join("run_0.mcap");
    fs::write(&path, joint_state_log(WriteOptions::new(), 0..STEPS, pack)).unwrap();
    describe(folder.path(), "mcap", "message", "run_0.mcap");
    let joints: Vec<_> = expected
        .into_iter()
        .filter(|(topic, ..)| topic == "/joint_states")
        .collect();
    assert_eq!(read_file(folder.path()).unwrap().0, joints);
}

/// Parts in several files are one recording, with `metadata.yaml` and without it. A part that a
/// killed recorder was compressing counts once.
#[test]
fn a_split_bag_is_one_recording() {
    let (expected, _) = read(&log(STEPS)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    // Without leading zeros, the order of the names differs from the order of recording.
    for part in 0..11 {
        let path = folder.path().join(format!("run_{part}.db3"));
        let steps = part * STEPS / 11..(part + 1) * STEPS / 11;
        fill(&create(&path, 3, part % 2 == 0), steps, <[u8]>::to_vec);
        if part < 5 {
            pack_file(&path);
        }
    }
    fs::write(folder.path().join("run_5.db3.zstd"), b"\x28\xb5").unwrap();
    assert_eq!(read_file(folder.path()).unwrap().0, expected);

    // Old versions of rosbag2 list files with the folder of the bag.
    let listed = |part| {
        let suffix = if part < 5 { ".zstd" } else { "" };
        format!("bag/run_{part}.db3{suffix}")
    };
    let listed: Vec<String> = (0..11).rev().map(listed).collect();
    describe(folder.path(), "sqlite3", "FILE", &listed.join(", "));
    assert_eq!(read_file(folder.path()).unwrap().0, expected);
}

/// A compressed MCAP log that is cut off gives its beginning; a compressed database is refused.
#[test]
fn a_cut_file_is_reported() {
    let (whole, _) = read(&log(5000)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let plain = folder.path().join("run.mcap");
    fs::write(&plain, log(5000)).unwrap();
    let packed = pack_file(&plain);
    let cut = |path: &Path| {
        let file = fs::File::options().write(true).open(path).unwrap();
        let half = file.metadata().unwrap().len() / 2;
        file.set_len(half).unwrap();
        half
    };
    let half = cut(&packed);
    let (messages, damage) = read_file(&packed).unwrap();
    assert!(!messages.is_empty() && messages.len() < whole.len());
    assert!(whole.starts_with(&messages));
    assert_eq!(damage.len(), 1);
    assert_eq!((&damage[0].path, damage[0].at_byte), (&packed, half));
    assert!(
        damage[0].what.contains("cannot be decompressed further"),
        "{}",
        damage[0]
    );

    let plain = folder.path().join("run.db3");
    bag(&plain, 5000);
    let packed = pack_file(&plain);
    cut(&packed);
    let error = read_file(&packed).unwrap_err().to_string();
    assert!(
        error.contains("run.db3.zstd") && error.contains("cannot be decompressed further"),
        "{error}"
    );
}

/// A compressed message that is damaged is an error of this message alone.
#[test]
fn a_damaged_message_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    let cut = |bytes: &[u8]| pack(bytes)[..20].to_vec();
    let writer = create(&path, 3, true);
    fill(&writer, 0..1, cut);
    fill(&writer, 1..2, pack);
    let log = LogReader::open(&path).unwrap();
    let messages = log.messages_on(["/joint_states"]).unwrap();
    let decoded: Vec<_> = messages
        .map(|message| message.unwrap().decode::<JointState>())
        .collect();
    let error = decoded[0].as_ref().unwrap_err().to_string();
    assert!(
        error.contains("/joint_states at 0 ns") && error.contains("compressed with zstd"),
        "{error}"
    );
    assert_eq!(decoded[1].as_ref().unwrap(), &joint_state(1));
}
