//! CDR, the encoding of ROS 2 messages: four bytes that say the byte order, then the fields, each
//! number aligned to its size counted from after those four bytes.

use std::marker::PhantomData;

use byteorder::{BigEndian, ByteOrder, LittleEndian};
use cdr_encoding::CdrDeserializer;
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{DeserializeOwned, DeserializeSeed},
};

/// Plain CDR, little endian, no options.
const LITTLE_ENDIAN_HEADER: [u8; 4] = [0, 1, 0, 0];

/// A writer may pad a message to a multiple of four bytes.
const MAX_PADDING: usize = 3;

/// Why bytes are not a message, or a message has no bytes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CdrError {
    /// The four bytes are not there, or do not name plain CDR.
    #[error("does not start as CDR (00 01 00 00 or 00 00 00 00) but with {0:02x?}")]
    Header(Vec<u8>),
    /// The bytes end inside a field.
    #[error("ends within its fields: {length} bytes do not hold a whole message")]
    Truncated {
        /// The bytes that there are.
        length: usize,
    },
    /// The fields end before the bytes.
    #[error("{0} bytes follow its last field")]
    Trailing(usize),
    /// A field has no such value.
    #[error("{0}")]
    Value(String),
}

/// Encodes a message in little endian. `buffer` is cleared first; its allocation is reused.
///
/// # Errors
/// If a sequence has no length.
pub fn encode<M: Serialize>(message: &M, buffer: &mut Vec<u8>) -> Result<(), CdrError> {
    buffer.clear();
    buffer.extend_from_slice(&LITTLE_ENDIAN_HEADER);
    cdr_encoding::to_writer::<_, LittleEndian, _>(buffer, message)
        .map_err(|error| CdrError::Value(error.to_string()))
}

/// Decodes a message of either byte order. Lengths are checked against the bytes that are there,
/// so damaged ones cost no memory.
///
/// # Errors
/// If the bytes are not exactly one message, up to three bytes of padding.
pub fn decode<M: DeserializeOwned>(bytes: &[u8]) -> Result<M, CdrError> {
    decode_by(bytes, PhantomData::<M>)
}

/// The same into a message that is there already, whose strings and sequences keep their
/// allocations. After an error its fields mean nothing.
///
/// # Errors
/// As [`decode`].
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
    // The last two bytes are options, which plain CDR does not have but some writers set.
    let decoded = match head {
        [0, 1, ..] => fields_by::<S, LittleEndian>(fields, seed),
        [0, 0, ..] => fields_by::<S, BigEndian>(fields, seed),
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

/// What the fields hold, and how many bytes they are.
fn fields_by<'de, S: DeserializeSeed<'de>, BO: ByteOrder>(
    fields: &'de [u8],
    seed: S,
) -> cdr_encoding::Result<(S::Value, usize)> {
    let mut deserializer = CdrDeserializer::<BO>::new(fields);
    let value = seed.deserialize(&mut deserializer)?;
    Ok((value, deserializer.bytes_consumed()))
}
