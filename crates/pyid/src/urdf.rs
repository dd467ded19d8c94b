//! URDFs and kinds of base as Python gives them.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyString;
use tactid_dynamics::{BaseKind, Urdf};

use crate::errors::{ArgumentError, ModelError};

/// A URDF that has been read.
pub(crate) struct ReadUrdf {
    pub(crate) urdf: Urdf,
    /// Folder of its file, from which its meshes are found; `None` for a text.
    pub(crate) folder: Option<PathBuf>,
}

/// Returns the folder of the file of a URDF, given as [`urdf_text`] takes it; `None` for a text.
pub(crate) fn urdf_folder(given: &Bound<'_, PyAny>) -> Option<PathBuf> {
    let path: PathBuf = given.extract().ok()?;
    let file = std::path::absolute(path).ok()?;
    file.is_file().then(|| file.parent().map(PathBuf::from))?
}

/// Returns the text of a URDF. A `str` that begins with `<` after white space is the text itself;
/// any other `str`, and an `os.PathLike`, is the path of a file.
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
    tactid_dynamics::read_text(&path).map_err(|error| {
        let path = path.display();
        ModelError::new_err(format!("cannot read the URDF `{path}`: {error}"))
    })
}

/// Returns the kind of base that has a name.
pub(crate) fn base_kind(name: &str) -> PyResult<BaseKind> {
    match name {
        "floating" => Ok(BaseKind::Floating),
        "fixed" => Ok(BaseKind::Fixed),
        _ => Err(ArgumentError::new_err(format!(
            "`base` is {name:?}: expected \"fixed\" or \"floating\""
        ))),
    }
}
