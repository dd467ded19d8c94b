//! Texts as Python gives them.

use std::ops::Deref;

use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::errors::ArgumentError;

/// A text. PyO3's own conversion raises `UnicodeEncodeError` for characters that are no Unicode,
/// such as those that stand for bytes of the name of a file.
pub(crate) struct Text(pub(crate) String);

impl<'a, 'py> FromPyObject<'a, 'py> for Text {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let text = given.cast::<PyString>()?;
        let text = text.to_str().map_err(|_| {
            ArgumentError::new_err(format!(
                "expected text, but {} contains characters that are not valid Unicode",
                text.repr()
                    .map_or_else(|_| "it".to_owned(), |repr| repr.to_string())
            ))
        })?;
        Ok(Self(text.to_owned()))
    }
}

impl Deref for Text {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}
