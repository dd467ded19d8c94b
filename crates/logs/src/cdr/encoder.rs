//! Writer of the fields behind a message's header.

use super::{CdrError, HEADER_BYTES};

/// Appends fields to the bytes of a message, one after the other, in little endian.
#[derive(Debug)]
pub struct Encoder<'a> {
    /// The message, which begins with its header.
    message: &'a mut Vec<u8>,
}

impl<'a> Encoder<'a> {
    /// Creates a writer that appends to a message that has its header and nothing else.
    pub(super) fn new(message: &'a mut Vec<u8>) -> Self {
        Self { message }
    }

    /// Appends bytes.
    #[inline]
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.message.extend_from_slice(bytes);
    }

    /// Appends zeros up to a multiple of `size` bytes behind the header.
    #[inline]
    pub(super) fn align(&mut self, size: usize) {
        let fields = self.message.len() - HEADER_BYTES;
        let padding = fields.next_multiple_of(size) - fields;
        self.message.resize(self.message.len() + padding, 0);
    }

    /// Appends the length of a text or a sequence.
    ///
    /// # Errors
    /// Returns [`CdrError::Value`] for a length of 2³² or more.
    #[inline]
    pub(super) fn length(&mut self, length: usize) -> Result<(), CdrError> {
        let Ok(length) = u32::try_from(length) else {
            return Err(CdrError::Value(format!(
                "has a text or a sequence of {length} elements; CDR counts up to {}",
                u32::MAX
            )));
        };
        self.align(size_of::<u32>());
        self.bytes(&length.to_le_bytes());
        Ok(())
    }
}
