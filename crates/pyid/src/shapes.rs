//! Arrays of numbers from what Python gives, and errors for shapes that do not fit.

use numpy::{PyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::errors::ArgumentError;

/// Converts what Python gives to an array of numbers. NumPy would take dates, text and complex
/// numbers, too, and None for one number that is missing.
pub(crate) fn numbers<'py>(
    value: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let py = value.py();
    // Most arguments need no conversion. An instance of a subclass may: a masked array is one.
    if value.is_exact_instance_of::<PyUntypedArray>()
        && let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
    {
        return Ok(array.clone());
    }
    let refuse =
        |why: &str| ArgumentError::new_err(format!("`{name}` is not an array of numbers: {why}"));
    if value.is_none() {
        return Err(refuse("it is None"));
    }
    let numpy = py.import("numpy")?;
    let convert = || {
        let masked = numpy.getattr("ma")?;
        let array = if masked
            .call_method1("isMaskedArray", (value,))?
            .is_truthy()?
        {
            let numbers = value.call_method1("astype", ("float64",))?;
            numbers.call_method1("filled", (f64::NAN,))?
        } else {
            numpy.call_method1("asarray", (value,))?
        };
        let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
        let reason = match kind.as_str() {
            "M" | "m" => {
                "it holds dates; give seconds, such as (t - t[0]) / numpy.timedelta64(1, \"s\")"
            }
            "U" | "S" | "T" => "it holds text",
            "c" => "it holds complex numbers",
            _ => return numpy.call_method1("ascontiguousarray", (array, "float64")),
        };
        Err(refuse(reason))
    };
    let array = convert().map_err(|error| {
        // Ctrl-C is no `Exception`.
        if error.is_instance_of::<ArgumentError>(py) || !error.is_instance_of::<PyException>(py) {
            return error;
        }
        let reason = error.value(py).to_string();
        if reason.contains("inhomogeneous") {
            refuse("its rows have different lengths")
        } else {
            refuse(&reason)
        }
    })?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

/// Returns the shapes of one item and of N, as Python writes them.
pub(crate) fn one_or_many(items: &[&[usize]]) -> Vec<String> {
    let many = |item: &[usize]| {
        let dimensions = item.iter().map(usize::to_string);
        tuple(std::iter::once("N".to_owned()).chain(dimensions))
    };
    let shapes = items.iter().flat_map(|item| [shape_of(item), many(item)]);
    shapes.collect()
}

/// Returns the advice to transpose an array, if that would fit.
pub(crate) fn transposition(given: &[usize], items: &[&[usize]]) -> &'static str {
    match *given {
        [rows, _] if items.iter().any(|item| **item == [rows]) => "; it is transposed: give its .T",
        _ => "",
    }
}

pub(crate) fn shape_error(name: &str, given: &[usize], expected: Vec<String>, what: &str) -> PyErr {
    let colon = if what.is_empty() || what.starts_with(';') {
        ""
    } else {
        ": "
    };
    ArgumentError::new_err(format!(
        "`{name}` has the shape {}: expected {}{colon}{what}",
        shape_of(given),
        expected.join(" or ")
    ))
}

/// Formats a shape as Python writes a tuple.
pub(crate) fn shape_of(shape: &[usize]) -> String {
    tuple(shape.iter().map(usize::to_string))
}

fn tuple(entries: impl Iterator<Item = String>) -> String {
    match &entries.collect::<Vec<_>>()[..] {
        [one] => format!("({one},)"),
        entries => format!("({})", entries.join(", ")),
    }
}
