//! Parsing of a record's body, whose lengths are checked first.

use mcap::records::{Record, op};

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

/// Returns the parts of a record up to the last text.
fn parts(opcode: u8) -> &'static [Part] {
    use Part::{Bytes, Entries, Numbers, TextPairs};
    match opcode {
        op::HEADER => &[Bytes, Bytes],
        op::SCHEMA => &[Numbers(2), Bytes, Bytes, Bytes],
        op::CHANNEL => &[Numbers(4), Bytes, Bytes, TextPairs],
        op::CHUNK => &[Numbers(28), Bytes],
        op::CHUNK_INDEX => &[Numbers(32), Entries(10), Numbers(8), Bytes],
        op::ATTACHMENT => &[Numbers(16), Bytes, Bytes],
        op::ATTACHMENT_INDEX => &[Numbers(40), Bytes, Bytes],
        op::METADATA => &[Bytes, TextPairs],
        op::METADATA_INDEX => &[Numbers(16), Bytes],
        _ => &[],
    }
}

/// Parses the body of a record.
///
/// The parser allocates as much memory as a text claims to need before it reads it, and reads the last entry of a map to its
/// end even where the map ends before: a damaged length would take up to 4 GiB.
///
/// # Errors
/// Returns the reason why the body is not that of such a record.
pub(super) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, String> {
    let mut rest = body;
    for part in parts(opcode) {
        rest = skip(*part, rest)
            .ok_or("a text or map that is longer than its record, or ends within an entry")?;
    }
    mcap::parse_record(opcode, body).map_err(|error| error.to_string())
}

/// Returns the bytes after a part, or `None` where the part is longer than they are.
fn skip(part: Part, bytes: &[u8]) -> Option<&[u8]> {
    let Part::Numbers(length) = part else {
        let (length, rest) = bytes.split_first_chunk()?;
        let (mut inner, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        match part {
            Part::TextPairs => {
                while !inner.is_empty() {
                    inner = skip(Part::Bytes, skip(Part::Bytes, inner)?)?;
                }
            }
            Part::Entries(each) if inner.len() % each != 0 => return None,
            _ => {}
        }
        return Some(rest);
    };
    bytes.get(length..)
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// A map whose length ends within a text, or between a text and its pair, is refused: the parser would read on after it.
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

    /// Each record with a text is refused where the text claims more bytes than there are. The others have numbers alone.
    #[test]
    fn no_record_claims_more_than_its_body() {
        let body = [0xff; 300];
        let refused = |opcode: &u8| {
            let error = parse(*opcode, &body).err();
            error.is_some_and(|error| error.contains("longer than its record"))
        };
        let without_text = [
            op::FOOTER,
            op::MESSAGE,
            op::MESSAGE_INDEX,
            op::STATISTICS,
            op::SUMMARY_OFFSET,
            op::DATA_END,
        ];
        for opcode in op::HEADER..=op::DATA_END {
            assert_eq!(
                refused(&opcode),
                !without_text.contains(&opcode),
                "{opcode}"
            );
        }
    }
}
