//! What a message consists of: numbers, truth values, texts, arrays and sequences.

use super::CdrError;
use super::decoder::{ByteOrder, Decoder};
use super::encoder::Encoder;

/// A value that CDR encodes: a number, a text, an array, a sequence or a message.
///
/// A message encodes its fields in the order of its definition.
pub trait Field: Sized {
    /// Appends the value.
    ///
    /// # Errors
    /// Returns [`CdrError::Value`] for a text or a sequence of 2³² or more elements.
    fn write(&self, encoder: &mut Encoder<'_>) -> Result<(), CdrError>;

    /// Reads the next value into this one, which keeps the allocations of its texts and sequences.
    ///
    /// # Errors
    /// Returns [`CdrError::Truncated`] if the bytes end first, and [`CdrError::Value`] for an
    /// impossible value.
    fn read(&mut self, decoder: &mut Decoder<'_>) -> Result<(), CdrError>;

    /// Appends consecutive values.
    ///
    /// # Errors
    /// Returns the errors of [`write`](Self::write).
    fn write_all(values: &[Self], encoder: &mut Encoder<'_>) -> Result<(), CdrError> {
        values.iter().try_for_each(|value| value.write(encoder))
    }

    /// Reads consecutive values.
    ///
    /// # Errors
    /// Returns the errors of [`read`](Self::read).
    fn read_all(values: &mut [Self], decoder: &mut Decoder<'_>) -> Result<(), CdrError> {
        values.iter_mut().try_for_each(|value| value.read(decoder))
    }

    /// Reads so many values into a sequence, which becomes as long. A length that the bytes do not
    /// reach allocates no more than values for these bytes.
    ///
    /// # Errors
    /// Returns the errors of [`read`](Self::read).
    fn read_sequence(
        values: &mut Vec<Self>,
        count: usize,
        decoder: &mut Decoder<'_>,
    ) -> Result<(), CdrError>
    where
        Self: Default,
    {
        values.truncate(count);
        Self::read_all(values, decoder)?;
        while values.len() < count {
            let mut value = Self::default();
            value.read(decoder)?;
            values.push(value);
        }
        Ok(())
    }
}

/// Implements [`Field`] for a type of number. Arrays and sequences are read and written as a whole.
macro_rules! number {
    ($type:ty) => {
        impl Field for $type {
            #[inline]
            fn write(&self, encoder: &mut Encoder<'_>) -> Result<(), CdrError> {
                encoder.align(size_of::<Self>());
                encoder.bytes(&self.to_le_bytes());
                Ok(())
            }

            #[inline]
            fn read(&mut self, decoder: &mut Decoder<'_>) -> Result<(), CdrError> {
                let bytes = decoder.number()?;
                *self = match decoder.order() {
                    ByteOrder::Little => Self::from_le_bytes(bytes),
                    ByteOrder::Big => Self::from_be_bytes(bytes),
                };
                Ok(())
            }

            fn write_all(values: &[Self], encoder: &mut Encoder<'_>) -> Result<(), CdrError> {
                if !values.is_empty() {
                    encoder.align(size_of::<Self>());
                }
                for value in values {
                    encoder.bytes(&value.to_le_bytes());
                }
                Ok(())
            }

            #[inline]
            fn read_all(values: &mut [Self], decoder: &mut Decoder<'_>) -> Result<(), CdrError> {
                let numbers = decoder.numbers(values.len())?;
                let pairs = values.iter_mut().zip(numbers);
                match decoder.order() {
                    ByteOrder::Little => {
                        pairs.for_each(|(v, bytes)| *v = Self::from_le_bytes(*bytes))
                    }
                    ByteOrder::Big => pairs.for_each(|(v, bytes)| *v = Self::from_be_bytes(*bytes)),
                }
                Ok(())
            }

            #[inline]
            fn read_sequence(
                values: &mut Vec<Self>,
                count: usize,
                decoder: &mut Decoder<'_>,
            ) -> Result<(), CdrError> {
                let numbers = decoder.numbers(count)?.iter().copied();
                values.clear();
                match decoder.order() {
                    ByteOrder::Little => values.extend(numbers.map(Self::from_le_bytes)),
                    ByteOrder::Big => values.extend(numbers.map(Self::from_be_bytes)),
                }
                Ok(())
            }
        }
    };
}

number!(u8);
number!(i32);
number!(u32);
number!(f64);

impl Field for bool {
    fn write(&self, encoder: &mut Encoder<'_>) -> Result<(), CdrError> {
        u8::from(*self).write(encoder)
    }

    fn read(&mut self, decoder: &mut Decoder<'_>) -> Result<(), CdrError> {
        let mut byte = 0u8;
        byte.read(decoder)?;
        *self = match byte {
            0 => false,
            1 => true,
            other => {
                return Err(CdrError::Value(format!(
                    "has a truth value that is {other} instead of 0 or 1"
                )));
            }
        };
        Ok(())
    }
}

/// A text ends with a zero, which its length counts. Some writers leave it out of an empty text.
impl Field for String {
    fn write(&self, encoder: &mut Encoder<'_>) -> Result<(), CdrError> {
        encoder.length(self.len() + 1)?;
        encoder.bytes(self.as_bytes());
        encoder.bytes(&[0]);
        Ok(())
    }

    #[inline]
    fn read(&mut self, decoder: &mut Decoder<'_>) -> Result<(), CdrError> {
        let length = decoder.length()?;
        let bytes = decoder.bytes(length)?;
        let text = bytes.split_last().map_or(bytes, |(_, text)| text);
        // Messages of a topic repeat their names.
        if text == self.as_bytes() {
            return Ok(());
        }
        let text = std::str::from_utf8(text)
            .map_err(|error| CdrError::Value(format!("has a text that is not UTF-8: {error}")))?;
        self.clear();
        self.push_str(text);
        Ok(())
    }
}

/// An array has no length.
impl<const N: usize> Field for [f64; N] {
    fn write(&self, encoder: &mut Encoder<'_>) -> Result<(), CdrError> {
        f64::write_all(self, encoder)
    }

    #[inline]
    fn read(&mut self, decoder: &mut Decoder<'_>) -> Result<(), CdrError> {
        f64::read_all(self, decoder)
    }
}

impl<T: Field + Default> Field for Vec<T> {
    fn write(&self, encoder: &mut Encoder<'_>) -> Result<(), CdrError> {
        encoder.length(self.len())?;
        T::write_all(self, encoder)
    }

    #[inline]
    fn read(&mut self, decoder: &mut Decoder<'_>) -> Result<(), CdrError> {
        let count = decoder.length()?;
        T::read_sequence(self, count, decoder)
    }
}

/// Implements [`Field`] for a message from the names of its fields, in the order of its definition.
macro_rules! fields {
    ($type:ident: $($field:ident),+) => {
        impl $crate::cdr::Field for $type {
            #[inline]
            fn write(
                &self,
                encoder: &mut $crate::cdr::Encoder<'_>,
            ) -> Result<(), $crate::cdr::CdrError> {
                let Self { $($field),+ } = self;
                $($field.write(encoder)?;)+
                Ok(())
            }

            #[inline]
            fn read(
                &mut self,
                decoder: &mut $crate::cdr::Decoder<'_>,
            ) -> Result<(), $crate::cdr::CdrError> {
                let Self { $($field),+ } = self;
                $($field.read(decoder)?;)+
                Ok(())
            }
        }
    };
}
pub(crate) use fields;
