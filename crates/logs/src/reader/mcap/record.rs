//! Parsing of a record's body after a check of its lengths.

use std::{borrow::Cow, path::Path};

use mcap::records::{Record, op};

use super::file::{LogFile, RecordHead};
use crate::{
    error::LogError,
    reader::{opening::Opening, storage::Stop},
};

/// What is wrong with a record of lengths that contradict each other.
const TOO_LONG: &str = "a text or map that is longer than its record, or ends within an entry";

/// Longest definition of a schema or metadata of a channel that is kept, bytes. Definitions of ROS
/// have a few thousand.
const MAX_DEFINITION: usize = 1 << 16;

/// A part of a record's body.
#[derive(Clone, Copy)]
enum Part {
    /// Numbers of this many bytes.
    Numbers(usize),
    /// A length of four bytes, and as many bytes.
    Bytes,
    /// As [`Part::Bytes`], which are whole pairs of texts.
    TextPairs,
    /// As [`Part::Bytes`], which are whole entries of this many bytes.
    Entries(usize),
}

/// Returns the parts of a record up to the last text that reading needs, or `None` for a record
/// that is not parsed.
fn parts(opcode: u8) -> Option<&'static [Part]> {
    use Part::{Bytes, Entries, Numbers, TextPairs};
    Some(match opcode {
        op::SCHEMA => &[Numbers(2), Bytes, Bytes],
        op::CHANNEL => &[Numbers(4), Bytes, Bytes],
        op::MESSAGE_INDEX | op::STATISTICS => &[],
        op::CHUNK_INDEX => &[Numbers(32), Entries(10), Numbers(8), Bytes],
        op::METADATA => &[Bytes, TextPairs],
        op::METADATA_INDEX => &[Numbers(16), Bytes],
        _ => return None,
    })
}

/// Returns the body of a record that the library may parse, or `None` if its lengths contradict
/// each other. What an index keeps of it is counted, but for the names of schemas and channels,
/// which are often repeated.
///
/// The library allocates as much memory as a text claims to need before it reads it, and reads the
/// last entry of a map to its end even where the map ends before: a damaged length would take up
/// to 4 GiB. A map takes ten times the memory of its record. The definition of a schema and the
/// metadata of a channel are left out where they are damaged or unusually long: only a copy of the
/// log needs them.
pub(super) fn checked<'a>(
    (opcode, body): (u8, &'a [u8]),
    path: &Path,
    opening: &mut Opening<'_>,
) -> Result<Option<Cow<'a, [u8]>>, LogError> {
    let (mut rest, mut entries) = (body, 0);
    for part in parts(opcode).unwrap_or_default() {
        match skip(*part, rest, &mut entries) {
            Some(after) => rest = after,
            None => return Ok(None),
        }
    }
    let bytes = body.len() as u64;
    match opcode {
        op::SCHEMA | op::CHANNEL => {
            let last = if opcode == op::SCHEMA {
                Part::Bytes
            } else {
                Part::TextPairs
            };
            if rest.len() <= MAX_DEFINITION && skip(last, rest, &mut 0).is_some() {
                return Ok(Some(body.into()));
            }
            let needed = body.get(..body.len() - rest.len()).unwrap_or_default();
            return Ok(Some([needed, &[0; 4]].concat().into()));
        }
        op::CHUNK_INDEX => opening.keep_segment(path, entries)?,
        op::METADATA => opening.keep_texts(path, (2 * entries as u64 + 1, bytes))?,
        op::METADATA_INDEX => opening.keep_texts(path, (1, bytes))?,
        _ => {}
    }
    Ok(Some(body.into()))
}

/// Parses the body of a record, as far as it is [`checked`].
///
/// # Errors
/// Returns the damage of the file if the body does not fit such a record.
pub(super) fn parse(
    head: RecordHead,
    body: &[u8],
    file: &LogFile,
    opening: &mut Opening<'_>,
) -> Result<Record<'static>, Stop> {
    let body = checked((head.opcode, body), &file.path, opening)?;
    let body = body.ok_or_else(|| file.damage(head.at_byte, TOO_LONG))?;
    let parsed = mcap::parse_record(head.opcode, &body).map(Record::into_owned);
    parsed.map_err(|error| file.damage(head.at_byte, error.to_string()))
}

/// Returns the bytes after a part, or `None` where the part is longer than they are. Counts the
/// pairs and entries of maps.
fn skip<'a>(part: Part, bytes: &'a [u8], entries: &mut usize) -> Option<&'a [u8]> {
    let Part::Numbers(length) = part else {
        let (length, rest) = bytes.split_first_chunk()?;
        let (mut inner, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        match part {
            Part::TextPairs => {
                while !inner.is_empty() {
                    *entries += 1;
                    inner = skip(Part::Bytes, skip(Part::Bytes, inner, entries)?, entries)?;
                }
            }
            Part::Entries(each) if inner.len() % each != 0 => return None,
            Part::Entries(each) => *entries += inner.len() / each,
            _ => {}
        }
        return Some(rest);
    };
    bytes.get(length..)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::reader::DEFAULT_MEMORY_LIMIT;

    fn parse(opcode: u8, body: &[u8]) -> Result<Record<'static>, String> {
        let mut watch = || ControlFlow::Continue(());
        let mut opening = Opening::new(DEFAULT_MEMORY_LIMIT, &mut watch);
        let body = checked((opcode, body), Path::new("log.mcap"), &mut opening).unwrap();
        let parsed = mcap::parse_record(opcode, &body.ok_or(TOO_LONG)?).map(Record::into_owned);
        parsed.map_err(|error| error.to_string())
    }

    /// A metadata record with one pair of texts of this claimed length.
    fn metadata(length: u32) -> Vec<u8> {
        let mut body = vec![1, 0, 0, 0, b'n', 10, 0, 0, 0, 1, 0, 0, 0, b'k'];
        body.extend(length.to_le_bytes());
        body.push(b'v');
        body
    }

    #[test]
    fn a_text_is_no_longer_than_its_record() {
        let whole = metadata(1);
        let Ok(Record::Metadata(record)) = parse(op::METADATA, &whole) else {
            panic!("no metadata");
        };
        assert_eq!(record.metadata["k"], "v");
        for length in [2, 1 << 20, u32::MAX] {
            let error = parse(op::METADATA, &metadata(length)).err();
            let error = error.expect("a text that is too long");
            assert!(error.contains("longer than its record"), "{error}");
        }
    }

    /// A map that ends within a text, or between a text and its pair, is refused: the parser would
    /// read on after it.
    #[test]
    fn a_map_ends_with_an_entry() {
        let mut of_one_text = metadata(1);
        of_one_text[5] = 5; // the key alone
        let mut chunk_index = vec![0; 32];
        chunk_index.extend(22u32.to_le_bytes());
        chunk_index.extend([0; 22 + 8 + 4 + 16]);
        for (opcode, body) in [(op::METADATA, of_one_text), (op::CHUNK_INDEX, chunk_index)] {
            let error = parse(opcode, &body).err();
            let error = error.unwrap_or_default();
            assert!(error.contains("ends within an entry"), "{error}");
        }
    }

    /// Each record with a text is refused where the text claims more bytes than there are. The
    /// others have numbers alone, or are not parsed.
    #[test]
    fn no_record_claims_more_than_its_body() {
        let body = [0xff; 300];
        let is_refused = |opcode: u8| {
            let error = parse(opcode, &body).err();
            error.is_some_and(|error| error.contains("longer than its record"))
        };
        let refused: Vec<u8> = (op::HEADER..=op::DATA_END)
            .filter(|opcode| is_refused(*opcode))
            .collect();
        let with_text = [
            op::SCHEMA,
            op::CHANNEL,
            op::CHUNK_INDEX,
            op::METADATA,
            op::METADATA_INDEX,
        ];
        assert_eq!(refused, with_text);
    }

    /// The metadata of a channel are kept, unless they are damaged or long: a map of short texts
    /// takes ten times the memory of its record.
    #[test]
    fn what_is_not_needed_may_be_left_out() {
        let head = [7, 0, 1, 0, 1, 0, 0, 0, b't', 1, 0, 0, 0, b'e'];
        let pair = [1, 0, 0, 0, b'k', 1, 0, 0, 0, b'v'];
        let many = pair.repeat(MAX_DEFINITION / pair.len() + 1);
        for (pairs, kept) in [
            (metadata(1)[5..].to_vec(), 1),
            (metadata(9)[5..].to_vec(), 0),
            ([&(many.len() as u32).to_le_bytes(), &*many].concat(), 0),
        ] {
            let Ok(Record::Channel(record)) = parse(op::CHANNEL, &[&head, &*pairs].concat()) else {
                panic!("no channel");
            };
            assert_eq!((record.id, record.schema_id), (7, 1));
            assert_eq!(
                (record.topic.as_str(), record.message_encoding.as_str()),
                ("t", "e")
            );
            assert_eq!(record.metadata.len(), kept);
        }
    }

    /// The texts of a map count before they are parsed.
    #[test]
    fn a_map_needs_the_memory_of_its_texts() {
        let mut watch = || ControlFlow::Continue(());
        let mut opening = Opening::new(4 * 96, &mut watch);
        let body = metadata(1);
        let path = Path::new("log.mcap");
        let error = checked((op::METADATA, &body), path, &mut opening).unwrap_err();
        assert!(matches!(error, LogError::Memory { .. }), "{error}");
    }
}
