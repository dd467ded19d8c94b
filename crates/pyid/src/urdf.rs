//! URDFs as Python gives them: text, or the path of a file.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::errors::{ArgumentError, ModelError};

/// Returns the text of a URDF. A `str` that begins with `<` after white space is the text itself; any other `str`,
/// and an `os.PathLike`, is the path of a file.
pub(crate) fn urdf_text(given: &Bound<'_, PyAny>) -> PyResult<String> {
    // The name of a file may have bytes that are no text.
    if given.is_instance_of::<PyString>()
        && let Ok(text) = given.extract::<String>()
    {
        // A file may begin with a byte order mark.
        if text
            .trim_start_matches('\u{feff}')
            .trim_start()
            .starts_with('<')
        {
            return Ok(text);
        }
    }
    let Ok(path) = given.extract::<PathBuf>() else {
        let kind = given.get_type().name()?;
        return Err(ArgumentError::new_err(format!(
            "a URDF is given as its text, which begins with `<`, or as the path of its file, but not as {kind}"
        )));
    };
    std::fs::read_to_string(&path).map_err(|error| {
        let path = path.display();
        ModelError::new_err(format!("cannot read the URDF `{path}`: {error}"))
    })
}
