//! Conversion between NumPy arrays and series of samples. Anything that NumPy can convert is read;
//! results are arrays with one entry for each sample.

use std::ops::Range;

use nalgebra::Vector3;
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::ArgumentError;
use crate::shapes::{numbers, one_or_many, shape_error, transposition};

/// An array of numbers that belong to samples, of which some are copied at a time.
pub(crate) struct SeriesArray<'py> {
    name: &'static str,
    /// `None` for one item of zeros.
    array: Option<Bound<'py, PyArrayDyn<f64>>>,
    width: usize,
    /// `None` for one item that holds for every sample.
    samples: Option<usize>,
}

impl<'py> SeriesArray<'py> {
    /// Takes an array of the shape `(width,)` or `(N, width)`.
    pub(crate) fn read(
        value: &Bound<'py, PyAny>,
        name: &'static str,
        width: usize,
    ) -> PyResult<Self> {
        Self::read_one_of(value, name, &[&[width]], "")
    }

    /// Takes an array of the shape `(width,)` or `(N, width)`; zeros where nothing is given.
    pub(crate) fn read_or_zero(
        value: Option<&Bound<'py, PyAny>>,
        name: &'static str,
        width: usize,
    ) -> PyResult<Self> {
        let zero = Self {
            name,
            array: None,
            width,
            samples: None,
        };
        value.map_or(Ok(zero), |value| Self::read(value, name, width))
    }

    /// Takes an array whose items have one of some shapes; where none fits, the error also says
    /// `what` an item is.
    fn read_one_of(
        value: &Bound<'py, PyAny>,
        name: &'static str,
        items: &[&[usize]],
        what: &str,
    ) -> PyResult<Self> {
        let array = numbers(value, name)?;
        let shape = array.shape();
        let fitting = items.iter().find_map(|item| {
            let samples = match shape.len().checked_sub(item.len())? {
                0 if shape == *item => None,
                1 if shape[1..] == **item => Some(shape[0]),
                _ => return None,
            };
            Some((item.iter().product(), samples))
        });
        let Some((width, samples)) = fitting else {
            let advice = transposition(shape, items);
            return Err(shape_error(
                name,
                shape,
                one_or_many(items),
                &format!("{what}{advice}"),
            ));
        };
        Ok(Self {
            name,
            array: Some(array),
            width,
            samples,
        })
    }

    /// Copies all items.
    pub(crate) fn whole(&self) -> PyResult<Series> {
        let values = match &self.array {
            Some(array) => array.to_vec()?,
            None => vec![0.0; self.width],
        };
        Ok(Series {
            name: self.name,
            values,
            width: self.width,
            samples: self.samples,
        })
    }

    /// Copies the items of some samples, or the one that holds for all of them.
    ///
    /// # Errors
    /// Returns an `ArgumentError` if Python has changed the array's shape since it was taken.
    pub(crate) fn part(&self, samples: Range<usize>) -> PyResult<Series> {
        let (Some(array), Some(_)) = (&self.array, self.samples) else {
            return self.whole();
        };
        let array = array.try_readonly()?;
        let entries = samples.start * self.width..samples.end * self.width;
        let Some(values) = array.as_slice()?.get(entries) else {
            let message = format!("`{}` has changed its shape meanwhile", self.name);
            return Err(ArgumentError::new_err(message));
        };
        Ok(Series {
            name: self.name,
            values: values.to_vec(),
            width: self.width,
            samples: Some(samples.len()),
        })
    }
}

/// Numbers that belong to samples: one item for each sample, or one item for all samples.
///
/// The values are a copy, since nothing keeps Python from changing an array while the interpreter
/// is released.
pub(crate) struct Series {
    name: &'static str,
    values: Vec<f64>,
    width: usize,
    /// `None` for one item that holds for every sample.
    samples: Option<usize>,
}

impl Series {
    /// Reads an array of the shape `item` or `(N, *item)`; numbers of any type, lists and strided
    /// views included.
    pub(crate) fn read(
        value: &Bound<'_, PyAny>,
        name: &'static str,
        item: &[usize],
    ) -> PyResult<Self> {
        Self::read_one_of(value, name, &[item], "")
    }

    /// Reads an array whose items have one of some shapes; where none fits, the error also says
    /// `what` an item is.
    pub(crate) fn read_one_of(
        value: &Bound<'_, PyAny>,
        name: &'static str,
        items: &[&[usize]],
        what: &str,
    ) -> PyResult<Self> {
        SeriesArray::read_one_of(value, name, items, what)?.whole()
    }

    /// Reads an array of the shape `(width,)` or `(N, width)`; zeros where nothing is given.
    pub(crate) fn read_or_zero(
        value: Option<&Bound<'_, PyAny>>,
        name: &'static str,
        width: usize,
    ) -> PyResult<Self> {
        SeriesArray::read_or_zero(value, name, width)?.whole()
    }

    /// Reads an array of the shape `(width,)` or `(N, width)`; an item without entries where
    /// nothing is given.
    pub(crate) fn read_or_empty(
        value: Option<&Bound<'_, PyAny>>,
        name: &'static str,
        width: usize,
    ) -> PyResult<Self> {
        match value {
            Some(value) => Self::read(value, name, &[width]),
            None => Self::read_or_zero(None, name, 0),
        }
    }

    /// Returns the item of a sample. Panics where there is none: ask [`common_length`] first.
    pub(crate) fn at(&self, sample: usize) -> &[f64] {
        let start = self.samples.map_or(0, |_| sample * self.width);
        &self.values[start..start + self.width]
    }

    /// Returns all items one after the other, or the single one that holds for all samples.
    pub(crate) fn as_slice(&self) -> &[f64] {
        &self.values
    }

    /// Returns all items one after the other; a single item is repeated `count` times.
    pub(crate) fn repeated(self, count: usize) -> Vec<f64> {
        match self.samples {
            Some(_) => self.values,
            None => self.values.repeat(count),
        }
    }

    /// Returns the single item. A series is an error.
    pub(crate) fn single(&self) -> PyResult<&[f64]> {
        match self.samples {
            None => Ok(&self.values),
            Some(count) => Err(ArgumentError::new_err(format!(
                "`{}` is a series of {count} entries: expected one",
                self.name
            ))),
        }
    }

    /// Returns three consecutive numbers of a sample's item, beginning at the index `first`.
    pub(crate) fn vector(&self, sample: usize, first: usize) -> Vector3<f64> {
        let item = self.at(sample);
        Vector3::new(item[first], item[first + 1], item[first + 2])
    }
}

/// A quantity with one value for each sample, or one value for all samples.
pub(crate) trait Sampled {
    fn name(&self) -> &'static str;
    fn samples(&self) -> Option<usize>;
}

impl Sampled for SeriesArray<'_> {
    fn name(&self) -> &'static str {
        self.name
    }
    fn samples(&self) -> Option<usize> {
        self.samples
    }
}

impl Sampled for Series {
    fn name(&self) -> &'static str {
        self.name
    }
    fn samples(&self) -> Option<usize> {
        self.samples
    }
}

/// Returns the number of samples that the series have in common; `None` where each has one item for
/// all samples.
pub(crate) fn common_length(series: &[&dyn Sampled]) -> PyResult<Option<usize>> {
    let mut longest: Option<(&'static str, usize)> = None;
    for one in series {
        let Some(count) = one.samples() else { continue };
        match longest {
            Some((name, expected)) if expected != count => {
                return Err(ArgumentError::new_err(format!(
                    "`{}` has {count} samples, but `{name}` has {expected}",
                    one.name()
                )));
            }
            _ => longest = Some((one.name(), count)),
        }
    }
    Ok(longest.map(|(_, count)| count))
}

/// An array of Python.
pub(crate) type Array = Py<PyArrayDyn<f64>>;

/// Returns values as an array of a shape.
pub(crate) fn array(py: Python<'_>, values: Vec<f64>, shape: &[usize]) -> PyResult<Array> {
    Ok(output(py, values, None, shape)?.unbind())
}

/// Returns an array of the shape `(N, *item)`, or of the shape `item` for a single sample.
pub(crate) fn output<'py>(
    py: Python<'py>,
    values: Vec<f64>,
    samples: Option<usize>,
    item: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let flat = match samples {
        Some(_) => PyArray1::from_vec(py, values),
        // To copy a few numbers is quicker than to have Python own the vector.
        None => PyArray1::from_slice(py, &values),
    };
    if let (None, [_]) = (samples, item) {
        return Ok(flat.to_dyn().clone());
    }
    let shape: Vec<usize> = samples.into_iter().chain(item.iter().copied()).collect();
    flat.reshape(shape)
}

/// Appends two vectors, such as the linear and the angular part of a twist.
pub(crate) fn extend_with(values: &mut Vec<f64>, first: &Vector3<f64>, second: &Vector3<f64>) {
    values.extend(first.iter().chain(second.iter()));
}
