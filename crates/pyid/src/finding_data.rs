//! What Python's `tactid.findings.Finding` is made from.

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The kind of a finding, and its data.
pub(crate) type FindingData = (&'static str, Py<PyDict>);

/// A dictionary of the listed entries.
macro_rules! data {
    ($py:expr $(, $name:literal: $value:expr)*) => {{
        let data = pyo3::types::PyDict::new($py);
        $(data.set_item($name, $value)?;)*
        data.unbind()
    }};
}

/// A dictionary of variables by their names.
macro_rules! fields {
    ($py:expr $(, $name:ident)*) => {{
        let data = pyo3::types::PyDict::new($py);
        $(data.set_item(stringify!($name), $name)?;)*
        data.unbind()
    }};
}

pub(crate) use {data, fields};
