//! Options as Python gives them: the table of their declarations out, and those that are given in.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use pythonize::{Depythonizer, pythonize};
use serde::de::DeserializeOwned;
use tactid_dynamics::Urdf;
use tactid_excitation::MotionRequest;
use tactid_recordings::{ArmCalibration, CalibrationRequest, Declaration, Kind, Request};

use crate::arm_model::ArmModel;
use crate::errors::{ArgumentError, IntoPyErr, option_error, with_option};
use crate::urdf::urdf_text;

/// Most characters of a wrong value that an error shows.
const LONGEST_VALUE: usize = 200;

/// Returns the declarations of all options of an identification, then those that only a design has,
/// and those that only a calibration has, in the order in which they are documented.
#[pyfunction]
pub(crate) fn options(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let all = [
        Request::OPTIONS,
        MotionRequest::OPTIONS,
        CalibrationRequest::OPTIONS,
    ];
    Ok(pythonize(py, &all)?)
}

/// Reads a structure from the values of its options, with the declarations of these.
pub(crate) fn read<T: DeserializeOwned>(
    given: &Bound<'_, PyDict>,
    declared: &[Declaration],
) -> PyResult<T> {
    let mut values = Depythonizer::from_object(given.as_any());
    serde_path_to_error::deserialize(&mut values)
        .map_err(|error| wrong_value(given, declared, &error))
}

/// Reads a request from the options that are given, but for an unloaded reference: see
/// [`log_request`] and [`unloaded_arrays`].
pub(crate) fn request(given: &Bound<'_, PyDict>) -> PyResult<Request> {
    let plain = given.copy()?;
    // The path of a file may have bytes that are no text.
    take(&plain, "unloaded")?;
    let urdf = take(&plain, "urdf")?.map(|given| with_option(urdf(&given), "urdf"));
    let calibration = take(&plain, "calibration")?.map(|given| calibration(&given));
    let shape = take(&plain, "shape")?;
    let shape = shape.map(|given| path("shape", "the path of a file", &given));
    Ok(Request {
        shape: shape.transpose()?,
        urdf: urdf.transpose()?,
        calibration: calibration.transpose()?,
        ..read(&plain, Request::OPTIONS)?
    })
}

fn urdf(given: &Bound<'_, PyAny>) -> PyResult<Urdf> {
    Urdf::from_xml(&urdf_text(given)?).map_err(IntoPyErr::into_py_err)
}

/// Reads a request for a log, whose unloaded reference is a log, too.
pub(crate) fn log_request(given: &Bound<'_, PyDict>) -> PyResult<Request> {
    let unloaded = given.get_item("unloaded")?.map(|unloaded| {
        if unloaded.cast::<PyMapping>().is_ok() {
            let message =
                "the unloaded reference of a log is the path of a log, but arrays are given";
            return Err(option_error(message.to_owned(), "unloaded"));
        }
        path("unloaded", "the path of a log", &unloaded)
    });
    Ok(Request {
        unloaded: unloaded.transpose()?,
        ..request(given)?
    })
}

/// Reads the unloaded reference of arrays: its arrays by their names.
pub(crate) fn unloaded_arrays<'py>(
    given: &Bound<'py, PyDict>,
) -> PyResult<Option<Bound<'py, PyMapping>>> {
    let Some(unloaded) = given.get_item("unloaded")? else {
        return Ok(None);
    };
    unloaded.cast_into::<PyMapping>().map(Some).map_err(|_| {
        let message =
            "the unloaded reference of arrays is a dict with the arrays `time`, `q` and `effort`";
        option_error(message.to_owned(), "unloaded")
    })
}

/// Removes an option from those that are given, and returns it.
pub(crate) fn take<'py>(
    options: &Bound<'py, PyDict>,
    name: &str,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let given = options.get_item(name)?;
    if given.is_some() {
        options.del_item(name)?;
    }
    Ok(given)
}

/// Reads a calibration: a `tactid.Calibration`, or the path of its file.
fn calibration(given: &Bound<'_, PyAny>) -> PyResult<ArmCalibration> {
    if let Ok(model) = given.getattr("model")
        && let Ok(model) = model.cast::<ArmModel>()
    {
        return Ok(model.get().0.as_ref().clone());
    }
    let expected = "a tactid.Calibration, or the path of its file";
    let path = path("calibration", expected, given)?;
    ArmCalibration::read(&path).map_err(IntoPyErr::into_py_err)
}

fn path(name: &'static str, expected: &str, given: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    let path = given.extract();
    path.map_err(|_| unexpected(name, given, expected))
}

/// Returns the error of a value that is none of its option.
fn wrong_value(
    given: &Bound<'_, PyDict>,
    declared: &[Declaration],
    error: &serde_path_to_error::Error<pythonize::PythonizeError>,
) -> PyErr {
    let place = error.path().to_string();
    let name = place.split(['.', '[']).next().unwrap_or_default();
    let option = declared.iter().find(|option| option.name == name);
    match (option, given.get_item(name)) {
        (Some(option), Ok(Some(value))) => unexpected(option.name, &value, &expected(option.kind)),
        _ => ArgumentError::new_err(format!("the options cannot be read: {}", error.inner())),
    }
}

pub(crate) fn unexpected(name: &'static str, value: &Bound<'_, PyAny>, expected: &str) -> PyErr {
    let text = value.repr().map(|text| text.to_string());
    let mut text = text.unwrap_or_else(|_| "of another type".to_owned());
    if let Some((end, _)) = text.char_indices().nth(LONGEST_VALUE) {
        text.truncate(end);
        text.push('…');
    }
    option_error(format!("`{name}` is {text}: expected {expected}"), name)
}

/// Returns what Python gives for an option of a kind, in words.
pub(crate) fn expected(kind: Kind) -> String {
    let words = match kind {
        Kind::Flag | Kind::Switch => "True or False",
        Kind::Number | Kind::Degrees | Kind::Percentage | Kind::GainPercentage => "a number",
        Kind::Count => "a whole number from 0",
        Kind::Text => "text",
        Kind::Texts => "a name, or a list of names",
        Kind::Path => "the path of a file",
        Kind::Names => "a dict of names in the log and names in the URDF",
        Kind::Vector => "three numbers, of the shape (3,)",
        Kind::Gravity => "three numbers, or 'auto' or 'unknown'",
        Kind::Recordings => "the path of a log, arrays by their names, or a list of these",
        Kind::Posture => "a position for each joint, or positions by the names of joints",
        Kind::EachNumber => "a number for each recording",
        Kind::EachPoint => "three numbers for all recordings, (3,), or for each, (L, 3)",
        Kind::EachInertia => "an inertia for all recordings, (3, 3), or for each, (L, 3, 3)",
        Kind::Numbers | Kind::Fractions => "a number for all, or one for each",
        Kind::Wrench => "six numbers, of the shape (6,)",
        Kind::Wrenches => "six numbers for all sensors, (6,), or for each, (S, 6)",
        Kind::Box => "the least and the largest corner, of the shape (2, 3)",
        Kind::Boxes => {
            "boxes by their names, such as {'table': [[-1, -1, -0.5], [1, 1, 0]]}, each with its least and its largest corner"
        }
        Kind::Grip => "a tactid.Grip, whose center and normal have three numbers",
        Kind::Body => "a tactid.MassProperties",
        Kind::Payload => {
            "its mass and its centre of mass, four numbers, or these and its inertia, ten numbers"
        }
        Kind::Tool => {
            "a tactid.MassProperties, a result or its estimate, or the path of its JSON file"
        }
        Kind::Frame => "a link, then x, y, z, qx, qy, qz, qw",
        Kind::Pose => "seven numbers, x, y, z, qx, qy, qz, qw",
        Kind::Calibration => "a tactid.Calibration, or the path of its file",
        Kind::Choice(names) => {
            let names = names.iter().map(|name| format!("'{name}'"));
            return names.collect::<Vec<_>>().join(" or ");
        }
    };
    words.to_owned()
}
