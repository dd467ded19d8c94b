//! Reader of the fields behind a message's header.

use super::{CdrError, HEADER_BYTES};

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

/// Reads fields from the bytes of a message, one after the other.
#[derive(Debug)]
pub struct Decoder<'a> {
    /// Bytes behind the header.
    bytes: &'a [u8],
    /// Number of bytes that have been read, with the padding between fields: at most as many as
    /// there are, but for padding before a field that is missing.
    read: usize,
    order: ByteOrder,
}

impl<'a> Decoder<'a> {
    /// Creates a reader of the bytes behind a header, relative to which fields are aligned.
    pub(super) fn new(bytes: &'a [u8], order: ByteOrder) -> Self {
        Self {
            bytes,
            read: 0,
            order,
        }
    }

    /// Number of bytes that have been read.
    pub(super) fn read(&self) -> usize {
        self.read
    }

    /// Returns the order of the bytes of numbers.
    pub(super) fn order(&self) -> ByteOrder {
        self.order
    }

    /// Skips the padding before a number of `SIZE` bytes.
    #[inline]
    fn align<const SIZE: usize>(&mut self) {
        const { assert!(SIZE.is_power_of_two()) };
        self.read = (self.read + SIZE - 1) & !(SIZE - 1);
    }

    /// Reads so many bytes.
    #[inline]
    pub(super) fn bytes(&mut self, count: usize) -> Result<&'a [u8], CdrError> {
        let rest = self.bytes.get(self.read..).unwrap_or_default();
        let Some(bytes) = rest.get(..count) else {
            return Err(self.truncated());
        };
        self.read += count;
        Ok(bytes)
    }

    /// Reads so many numbers of `SIZE` bytes, aligned to their size. None have no alignment.
    #[inline]
    pub(super) fn numbers<const SIZE: usize>(
        &mut self,
        count: usize,
    ) -> Result<&'a [[u8; SIZE]], CdrError> {
        if count > 0 {
            self.align::<SIZE>();
        }
        let Some(length) = count.checked_mul(SIZE) else {
            return Err(self.truncated());
        };
        Ok(self.bytes(length)?.as_chunks().0)
    }

    /// Reads one number of `SIZE` bytes, aligned to its size.
    #[inline]
    pub(super) fn number<const SIZE: usize>(&mut self) -> Result<[u8; SIZE], CdrError> {
        self.align::<SIZE>();
        let rest = self.bytes.get(self.read..).unwrap_or_default();
        let Some(number) = rest.first_chunk() else {
            return Err(self.truncated());
        };
        self.read += SIZE;
        Ok(*number)
    }

    /// Reads the length of a text or a sequence.
    #[inline]
    pub(super) fn length(&mut self) -> Result<usize, CdrError> {
        let bytes = self.number()?;
        let length = match self.order {
            ByteOrder::Little => u32::from_le_bytes(bytes),
            ByteOrder::Big => u32::from_be_bytes(bytes),
        };
        Ok(length as usize)
    }

    /// Returns the error of bytes that end inside a field.
    #[cold]
    fn truncated(&self) -> CdrError {
        CdrError::Truncated {
            length: HEADER_BYTES + self.bytes.len(),
        }
    }
}
