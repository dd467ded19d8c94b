//! CDR, the encoding of ROS 2 messages: a header of four bytes with the byte order, then the
//! fields, each number aligned to its size relative to the end of the header.

mod decoder;
mod encoder;
mod field;

pub use self::decoder::Decoder;
pub use self::encoder::Encoder;
pub use self::field::Field;
pub(crate) use self::field::fields;

use self::decoder::ByteOrder;

/// Number of bytes of a header.
const HEADER_BYTES: usize = 4;

/// Header of plain CDR in little endian without options.
const LITTLE_ENDIAN_HEADER: [u8; HEADER_BYTES] = [0, 1, 0, 0];

/// First bytes of a frame of zstd, which a compressed message has instead of a header.
pub(crate) const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Largest number of padding bytes: a writer may pad a message to a multiple of four bytes.
const MAX_PADDING: usize = 3;

/// Reason why bytes cannot be decoded or a message cannot be encoded.
#[derive(Debug, thiserror::Error)]
pub enum CdrError {
    /// The header is missing or does not belong to plain CDR. The field contains the first bytes.
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

/// Encodes a message in little endian over the content of `buffer`, with its allocation.
///
/// # Errors
/// Returns [`CdrError::Value`] for a text or a sequence of 2³² or more elements.
pub fn encode<M: Field>(message: &M, buffer: &mut Vec<u8>) -> Result<(), CdrError> {
    buffer.clear();
    buffer.extend_from_slice(&LITTLE_ENDIAN_HEADER);
    message.write(&mut Encoder::new(buffer))
}

/// Decodes a message of either byte order. Lengths are checked against the number of bytes, so that
/// a damaged length costs no memory.
///
/// # Errors
/// Returns the fault if the bytes are not exactly one message with at most three bytes of padding.
pub fn decode<M: Field + Default>(bytes: &[u8]) -> Result<M, CdrError> {
    let mut message = M::default();
    decode_into(bytes, &mut message)?;
    Ok(message)
}

/// Decodes a message of either byte order into an existing one. Its texts and sequences keep their
/// allocations. After an error the fields of `message` are unspecified.
///
/// # Errors
/// Returns the errors of [`decode`].
pub fn decode_into<M: Field>(bytes: &[u8], message: &mut M) -> Result<(), CdrError> {
    let header = || CdrError::Header(bytes.iter().take(HEADER_BYTES).copied().collect());
    let (head, fields) = bytes.split_at_checked(HEADER_BYTES).ok_or_else(header)?;
    // The last two bytes are options. Plain CDR has none, but some writers set them.
    let order = match head {
        [0, 1, ..] => ByteOrder::Little,
        [0, 0, ..] => ByteOrder::Big,
        _ if bytes.starts_with(&ZSTD_MAGIC) => return Err(CdrError::Compressed),
        _ => return Err(header()),
    };
    let mut decoder = Decoder::new(fields, order);
    message.read(&mut decoder)?;
    match fields.len() - decoder.read() {
        0..=MAX_PADDING => Ok(()),
        trailing => Err(CdrError::Trailing(trailing)),
    }
}
