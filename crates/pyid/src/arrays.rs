//! Conversion between NumPy arrays and series of samples. Anything that NumPy can convert is read; results are
//! arrays with one entry for each sample.

use nalgebra::{
    Isometry3, Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3, Vector4,
};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tactid_recordings::unit_quaternion;

use crate::errors::ArgumentError;
use crate::shapes::{numbers, one_or_many, shape_error, shape_of, transposition};

/// Largest entry of `R R^T - 1` for a rotation matrix `R`, above the rounding of float32.
const ROTATION_TOLERANCE: f64 = 1e-5;

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

    /// Reads an array of the shape `item`.
    pub(crate) fn read_item(
        value: &Bound<'_, PyAny>,
        name: &'static str,
        item: &[usize],
    ) -> PyResult<Self> {
        let array = numbers(value, name)?;
        if array.shape() != item {
            let expected = vec![shape_of(item)];
            return Err(shape_error(name, array.shape(), expected, ""));
        }
        Ok(Self {
            name,
            values: array.to_vec()?,
            width: item.iter().product(),
            samples: None,
        })
    }

    /// Reads an array whose items have one of some shapes; where none fits, the error also says `what` an item is.
    pub(crate) fn read_one_of(
        value: &Bound<'_, PyAny>,
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
            values: array.to_vec()?,
            width,
            samples,
        })
    }

    /// Reads an array of the shape `(width,)` or `(N, width)`; zeros where nothing is given.
    pub(crate) fn read_or_zero(
        value: Option<&Bound<'_, PyAny>>,
        name: &'static str,
        width: usize,
    ) -> PyResult<Self> {
        value.map_or_else(
            || {
                Ok(Self {
                    name,
                    values: vec![0.0; width],
                    width,
                    samples: None,
                })
            },
            |value| Self::read(value, name, &[width]),
        )
    }

    /// Reads an array of the shape `(width,)` or `(N, width)`; an item without entries where nothing is given.
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

/// Poses, given as 4x4 matrices or as position and quaternion `[x, y, z, qx, qy, qz, qw]`.
pub(crate) struct Poses {
    name: &'static str,
    poses: Vec<Isometry3<f64>>,
    samples: Option<usize>,
}

impl Poses {
    /// Reads poses; the identity where nothing is given. Any entry that is no pose is an error.
    pub(crate) fn read_or_identity(
        value: Option<&Bound<'_, PyAny>>,
        name: &'static str,
    ) -> PyResult<Self> {
        Self::read(value, name, pose_from_quaternion, pose_from_matrix)
    }

    /// Reads measured poses; the identity where nothing is given.
    ///
    /// A matrix with NaN, and a quaternion that is not about normalised, become poses of NaN,
    /// which the identification counts as faults of single samples. Any other matrix that is no pose is an error.
    pub(crate) fn read_measured_or_identity(
        value: Option<&Bound<'_, PyAny>>,
        name: &'static str,
    ) -> PyResult<Self> {
        let read = Self::read(
            value,
            name,
            |item| Ok(measured_pose_from_quaternion(item)),
            |item| {
                if item.iter().any(|entry| entry.is_nan()) {
                    Ok(missing_pose())
                } else {
                    pose_from_matrix(item)
                }
            },
        )?;
        let is_missing = |pose: &Isometry3<f64>| pose.rotation.coords.iter().any(|x| x.is_nan());
        if read.poses.len() > 1 && read.poses.iter().all(is_missing) {
            return Err(ArgumentError::new_err(format!(
                "`{name}` has no pose that can be used: expected [x, y, z, qx, qy, qz, qw] with a quaternion of \
                 norm one, or 4x4 matrices without NaN"
            )));
        }
        Ok(read)
    }

    fn read(
        value: Option<&Bound<'_, PyAny>>,
        name: &'static str,
        from_quaternion: impl Fn(&[f64]) -> Result<Isometry3<f64>, &'static str>,
        from_matrix: impl Fn(&[f64]) -> Result<Isometry3<f64>, &'static str>,
    ) -> PyResult<Self> {
        let Some(value) = value else {
            return Ok(Self {
                name,
                poses: vec![Isometry3::identity()],
                samples: None,
            });
        };
        let array = numbers(value, name)?;
        let shape = array.shape();
        let (samples, width) = match *shape {
            [4, 4] => (None, 16),
            [count, 4, 4] => (Some(count), 16),
            [7] => (None, 7),
            [count, 7] => (Some(count), 7),
            _ => return Err(shape_error(name, shape, one_or_many(&[&[4, 4], &[7]]), "")),
        };
        let values = array.to_vec()?;
        let poses = values.chunks_exact(width).enumerate().map(|(row, item)| {
            let pose = if width == 16 {
                from_matrix(item)
            } else {
                from_quaternion(item)
            };
            pose.map_err(|why| ArgumentError::new_err(format!("`{name}`, entry {row}: {why}")))
        });
        Ok(Self {
            name,
            poses: poses.collect::<PyResult<_>>()?,
            samples,
        })
    }

    /// Returns the pose of a sample. Panics where there is none: ask [`common_length`] first.
    pub(crate) fn at(&self, sample: usize) -> &Isometry3<f64> {
        &self.poses[self.samples.map_or(0, |_| sample)]
    }

    /// Returns all poses, or the single one that holds for all samples.
    pub(crate) fn as_slice(&self) -> &[Isometry3<f64>] {
        &self.poses
    }

    /// Returns the single pose. A series is an error.
    pub(crate) fn single(&self) -> PyResult<&Isometry3<f64>> {
        match (self.samples, &self.poses[..]) {
            (None, [pose]) => Ok(pose),
            _ => Err(ArgumentError::new_err(format!(
                "`{}` is a series of poses: expected one pose, (4, 4) or (7,)",
                self.name
            ))),
        }
    }
}

/// A quantity with one value for each sample, or one value for all samples.
pub(crate) trait Sampled {
    fn name(&self) -> &'static str;
    fn samples(&self) -> Option<usize>;
}

impl Sampled for Series {
    fn name(&self) -> &'static str {
        self.name
    }
    fn samples(&self) -> Option<usize> {
        self.samples
    }
}

impl Sampled for Poses {
    fn name(&self) -> &'static str {
        self.name
    }
    fn samples(&self) -> Option<usize> {
        self.samples
    }
}

/// Returns the number of samples that the series have in common; `None` where each has one item for all samples.
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

/// Returns the 16 entries of a pose as a 4x4 matrix, row by row.
pub(crate) fn homogeneous(pose: &Isometry3<f64>) -> impl Iterator<Item = f64> {
    let transposed = pose.to_homogeneous().transpose(); // nalgebra goes column by column
    (0..16).map(move |index| transposed[index])
}

fn pose_from_matrix(entries: &[f64]) -> Result<Isometry3<f64>, &'static str> {
    let matrix = Matrix4::from_row_slice(entries);
    let rotation: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
    let off = (rotation * rotation.transpose() - Matrix3::identity()).amax();
    // Written so that NaN is rejected, too.
    if !(off < ROTATION_TOLERANCE && rotation.determinant() > 0.0) {
        return Err("the upper left 3x3 block is not a rotation");
    }
    if matrix.row(3) != Matrix4::identity().row(3) {
        return Err("the last row of a pose is [0, 0, 0, 1]");
    }
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    Ok(Isometry3::from_parts(
        matrix.fixed_view::<3, 1>(0, 3).into_owned().into(),
        UnitQuaternion::from_rotation_matrix(&rotation),
    ))
}

fn pose_from_quaternion(entries: &[f64]) -> Result<Isometry3<f64>, &'static str> {
    let quaternion = Quaternion::new(entries[6], entries[3], entries[4], entries[5]);
    let rotation =
        UnitQuaternion::try_new(quaternion, 1e-9).ok_or("the quaternion has no length")?;
    Ok(Isometry3::from_parts(
        Vector3::new(entries[0], entries[1], entries[2]).into(),
        rotation,
    ))
}

/// Returns the pose of a quaternion that is about normalised, else a pose of NaN.
fn measured_pose_from_quaternion(entries: &[f64]) -> Isometry3<f64> {
    let quaternion = Quaternion::new(entries[6], entries[3], entries[4], entries[5]);
    unit_quaternion(quaternion).map_or_else(missing_pose, |rotation| {
        let position = Vector3::new(entries[0], entries[1], entries[2]);
        Isometry3::from_parts(position.into(), rotation)
    })
}

fn missing_pose() -> Isometry3<f64> {
    let rotation = Quaternion::from(Vector4::repeat(f64::NAN));
    Isometry3::from_parts(
        Vector3::repeat(f64::NAN).into(),
        UnitQuaternion::new_unchecked(rotation),
    )
}
