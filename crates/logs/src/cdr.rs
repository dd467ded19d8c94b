//! CDR, the encoding of ROS 2 messages: a header of four bytes with the byte order, then the fields, each number aligned
//! to its size relative to the end of the header.

use std::marker::PhantomData;

use byteorder::{BigEndian, ByteOrder, LittleEndian};
use cdr_encoding::CdrDeserializer;
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{DeserializeOwned, DeserializeSeed},
};

/// Header of plain CDR in little endian without options.
const LITTLE_ENDIAN_HEADER: [u8; 4] = [0, 1, 0, 0];

/// First bytes of a frame of zstd, which a compressed message has instead of a header.
pub(crate) const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Largest number of padding bytes: a writer may pad a message to a multiple of four bytes.
const MAX_PADDING: usize = 3;

/// Reason why bytes cannot be decoded or a message cannot be encoded.
#[derive(Debug, thiserror::Error)]
pub enum CdrError {
    /// The header is missing or is not that of plain CDR. The field contains the first bytes.
    #[error("does not start as CDR (00 01 00 00 or 00 00 00 00) but with {0:02x?}")]
    Header(Vec<u8>),
    /// The message is compressed, and could not be decompressed.
    #[error("is compressed with zstd, and its compressed bytes are damaged")]
    Compressed,
    /// The bytes end inside a field.
    #[error("ends within its fields: {length} bytes do not hold a whole message")]
    Truncated {
        /// Number of bytes given.
        length: usize,
    },
    /// Bytes follow the last field. Their number is the field of the variant.
    #[error("{0} bytes follow its last field")]
    Trailing(usize),
    /// A field has an impossible value.
    #[error("{0}")]
    Value(String),
}

/// Encodes a message in little endian. The content of `buffer` is replaced and its allocation is reused.
///
/// # Errors
/// Returns [`CdrError::Value`] for a sequence of unknown length, which the message types of this crate do not have.
pub fn encode<M: Serialize>(message: &M, buffer: &mut Vec<u8>) -> Result<(), CdrError> {
    buffer.clear();
    buffer.extend_from_slice(&LITTLE_ENDIAN_HEADER);
    cdr_encoding::to_writer::<_, LittleEndian, _>(buffer, message)
        .map_err(|error| CdrError::Value(error.to_string()))
}

/// Decodes a message of either byte order. Lengths are checked against the number of bytes, so that a damaged length
/// costs no memory.
///
/// # Errors
/// Returns the fault if the bytes are not exactly one message with at most three bytes of padding.
pub fn decode<M: DeserializeOwned>(bytes: &[u8]) -> Result<M, CdrError> {
    decode_by(bytes, PhantomData::<M>)
}

/// Decodes a message of either byte order into an existing one, whose strings and sequences keep their allocations.
/// After an error the fields of `message` are unspecified.
///
/// # Errors
/// Returns the errors of [`decode`].
pub fn decode_into<M: DeserializeOwned>(bytes: &[u8], message: &mut M) -> Result<(), CdrError> {
    decode_by(bytes, InPlace(message))
}

struct InPlace<'a, M>(&'a mut M);

impl<'de, M: Deserialize<'de>> DeserializeSeed<'de> for InPlace<'_, M> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        M::deserialize_in_place(deserializer, self.0)
    }
}

fn decode_by<'de, S: DeserializeSeed<'de>>(
    bytes: &'de [u8],
    seed: S,
) -> Result<S::Value, CdrError> {
    let header = || CdrError::Header(bytes.iter().take(4).copied().collect());
    let (head, fields) = bytes.split_at_checked(4).ok_or_else(header)?;
    // The last two bytes are options. Plain CDR has none, but some writers set them.
    let decoded = match head {
        [0, 1, ..] => fields_by::<S, LittleEndian>(fields, seed),
        [0, 0, ..] => fields_by::<S, BigEndian>(fields, seed),
        _ if bytes.starts_with(&ZSTD_MAGIC) => return Err(CdrError::Compressed),
        _ => return Err(header()),
    };
    let (value, consumed) = decoded.map_err(|error| match error {
        cdr_encoding::Error::Eof => CdrError::Truncated {
            length: bytes.len(),
        },
        error => CdrError::Value(error.to_string()),
    })?;
    match fields.len() - consumed {
        0..=MAX_PADDING => Ok(value),
        trailing => Err(CdrError::Trailing(trailing)),
    }
}

/// Decodes the fields and returns the message with the number of bytes it takes.
fn fields_by<'de, S: DeserializeSeed<'de>, BO: ByteOrder>(
    fields: &'de [u8],
    seed: S,
) -> cdr_encoding::Result<(S::Value, usize)> {
    let mut deserializer = CdrDeserializer::<BO>::new(fields);
    let value = seed.deserialize(&mut deserializer)?;
    Ok((value, deserializer.bytes_consumed()))
}
