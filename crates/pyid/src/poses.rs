//! Poses between Python and nalgebra: 4x4 matrices, or positions with quaternions.

use std::ops::Range;

use nalgebra::{
    Isometry3, Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3, Vector4,
};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tactid_recordings::unit_quaternion;

use crate::arrays::Sampled;
use crate::errors::ArgumentError;
use crate::shapes::{numbers, one_or_many, shape_error};

/// Largest entry of `R R^T - 1` for a rotation matrix `R`, above the rounding of float32.
const ROTATION_TOLERANCE: f64 = 1e-5;

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
    /// A matrix with NaN, and a quaternion that is not about normalised, become poses of NaN, which
    /// the identification counts as faults of single samples. Any other matrix that is no pose is
    /// an error.
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

    /// Returns the poses of some samples, or the one that holds for all of them.
    pub(crate) fn part(&self, samples: Range<usize>) -> Self {
        Self {
            name: self.name,
            poses: match self.samples {
                Some(_) => self.poses[samples.clone()].to_vec(),
                None => self.poses.clone(),
            },
            samples: self.samples.map(|_| samples.len()),
        }
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

impl Sampled for Poses {
    fn name(&self) -> &'static str {
        self.name
    }
    fn samples(&self) -> Option<usize> {
        self.samples
    }
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
