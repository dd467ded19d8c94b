//! Logs that are cut off or damaged are readable up to the damage, which is reported.

use std::fs;

use crate::common::{foreign_log, log, random, read, read_file};
use mcap::Compression;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Returns a record of an MCAP file.
fn record(opcode: u8, body: &[&[u8]]) -> Vec<u8> {
    let body = body.concat();
    [&[opcode], &(body.len() as u64).to_le_bytes()[..], &body].concat()
}

/// Returns a small log of each kind.
fn kinds() -> Vec<(&'static str, Vec<u8>)> {
    let steps: Vec<u64> = (0..12).collect();
    vec![
        ("ours", log(25)),
        ("plain chunks", foreign_log(None, true, &steps)),
        ("zstd", foreign_log(Some(Compression::Zstd), true, &steps)),
        ("lz4", foreign_log(Some(Compression::Lz4), true, &steps)),
        ("no chunks", foreign_log(None, false, &steps)),
    ]
}

/// A log that is cut off at any byte gives the first messages of the whole log and reports the cut.
#[test]
fn a_cut_log_gives_a_prefix() {
    for (kind, bytes) in kinds() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        fs::write(&path, &bytes).unwrap();
        let (whole, damage) = read_file(&path).unwrap();
        assert!(damage.is_empty(), "{kind}: {damage:?}");

        let file = fs::File::options().write(true).open(&path).unwrap();
        let mut shortest = whole.len();
        for length in (0..bytes.len() as u64).rev() {
            file.set_len(length).unwrap();
            match read_file(&path) {
                Ok((messages, damage)) => {
                    assert!(whole.starts_with(&messages), "{kind} cut at {length}");
                    assert!(
                        messages.len() <= shortest,
                        "{kind} cut at {length}: more than after"
                    );
                    assert_eq!(damage.len(), 1, "{kind} cut at {length}: {damage:?}");
                    assert!(damage[0].at_byte <= length);
                    assert!(
                        damage[0].what.starts_with("the file ends"),
                        "{kind} cut at {length}: {damage:?}"
                    );
                    // The cut is within the index.
                    let lost = length + 1 == bytes.len() as u64 && messages.len() < whole.len();
                    assert!(!lost, "{kind}: messages are lost with the index");
                    shortest = messages.len();
                }
                Err(error) => {
                    assert!(length < 8, "{kind} cut at {length}: {error}");
                    assert!(
                        error
                            .to_string()
                            .contains("is neither an MCAP log nor an SQLite bag"),
                        "{error}"
                    );
                }
            }
        }
    }
}

/// Changed bytes cause no panic. If chunks have checksums, every message is one of the log.
#[test]
fn changed_bytes_never_panic() {
    let mut seed = 0x9e37_79b9_7f4a_7c15;
    for (kind, bytes) in kinds() {
        let (whole, _) = read(&bytes).unwrap();
        for _ in 0..1000 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random(&mut seed) % 3 {
                let at = random(&mut seed) % bytes.len();
                damaged[at] ^= 1 << (random(&mut seed) % 8);
            }
            let Ok((messages, _)) = read(&damaged) else {
                continue;
            };
            if kind != "no chunks" {
                let data = |(_, _, data)| data;
                let known: Vec<_> = whole.iter().cloned().map(data).collect();
                assert!(
                    messages.into_iter().map(data).all(|m| known.contains(&m)),
                    "{kind}"
                );
            }
        }
    }
}

/// A damaged chunk in the middle of a finished log ends the messages, and the damage is reported
/// once with its position.
#[test]
fn a_bad_checksum_ends_the_log() {
    let bytes = log(50);
    let (whole, _) = read(&bytes).unwrap();
    // A chunk's header ends with the name of its compression.
    let name = b"\x04\0\0\0zstd";
    let mut names = bytes
        .windows(name.len())
        .enumerate()
        .filter(|(_, window)| window == name);
    let (third, _) = names.nth(2).unwrap();
    let mut damaged = bytes.clone();
    damaged[third + 100] ^= 0x40;

    let (messages, damage) = read(&damaged).unwrap();
    assert!(whole.starts_with(&messages));
    assert!(
        (1..whole.len()).contains(&messages.len()),
        "{}",
        messages.len()
    );
    assert_eq!(damage.len(), 1);
    assert!(
        (third as u64 - 60..third as u64).contains(&damage[0].at_byte),
        "{damage:?}"
    );
    let place = format!("byte {} of {}: ", damage[0].at_byte, bytes.len());
    assert!(
        damage[0]
            .to_string()
            .contains(&format!("log.mcap is damaged at {place}")),
        "{}",
        damage[0]
    );
}

/// A damaged index is not used, and every message is found without it.
#[test]
fn a_bad_index_loses_nothing() {
    let bytes = log(25);
    let (whole, _) = read(&bytes).unwrap();
    let mut damaged = bytes.clone();
    let in_summary = bytes.len() - 200;
    damaged[in_summary] ^= 1;
    let (messages, damage) = read(&damaged).unwrap();
    assert_eq!(messages, whole);
    assert_eq!(damage.len(), 1);
    assert!(damage[0].what.contains("index"), "{}", damage[0]);
}

/// A channel or schema that is defined again as another one would change the topic or type of
/// messages: the log ends there.
#[test]
fn a_channel_that_is_defined_again_ends_the_log() {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let schema = |name: &str| record(3, &[&[1, 0], &text(name), &text(""), &text("")]);
    let channel = |topic: &str| record(4, &[&[1, 0, 1, 0], &text(topic), &text("cdr"), &text("")]);
    let message = record(5, &[&[1, 0], &[0; 4], &[7; 16], &[0; 12]]);
    let header = record(1, &[&text("ros2"), &text("")]);
    let parts = [
        schema("T"),
        channel("/a"),
        message.clone(),
        channel("/a"),
        message.clone(),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    for (again, expected) in [
        (channel("/a"), "the file ends"),
        (channel("/b"), "a channel with the id of another one"),
        (schema("U"), "a schema with the id of another one"),
    ] {
        let bytes = [
            &[MAGIC.to_vec(), header.clone()][..],
            &parts,
            &[again, message.clone()],
        ]
        .concat();
        fs::write(&path, bytes.concat()).unwrap();
        let (messages, damage) = read_file(&path).unwrap();
        assert!(
            messages.iter().all(|message| message.0 == "/a"),
            "{messages:?}"
        );
        assert_eq!(
            messages.len(),
            if expected == "the file ends" { 3 } else { 2 }
        );
        assert!(damage[0].what.contains(expected), "{damage:?}");
    }
}

/// A record that ends early, within the summary, where no reader needs it.
#[test]
fn an_attachment_in_the_index_is_ignored() {
    let header = record(1, &[&[0; 8]]);
    let attachment = record(9, &[&[0; 32]]);
    let start = (MAGIC.len() + header.len()) as u64;
    let footer = record(2, &[&start.to_le_bytes(), &[0; 12]]);
    let bytes = [MAGIC, &header, &attachment, &footer, MAGIC].concat();
    let (messages, damage) = read(&bytes).unwrap();
    assert!(messages.is_empty());
    assert_eq!(damage.len(), 1, "{damage:?}");
}
