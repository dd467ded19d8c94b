//! The regressor of a rigid body on whole arrays.

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use tactid_dynamics::ToolMotion;

use crate::arrays::{Series, common_length, output};
use crate::errors::detached;

/// The 6x10 matrix that takes a body's ten parameters to the wrench that moves it.
///
/// ``[force, moment] = wrench_regressor(...) @ body.parameters``: the wrench on the body, in the
/// axes of a frame fixed to it and about its origin, in the order of
/// :attr:`MassProperties.parameters`.
///
/// Args: acceleration: Classical acceleration of the frame's origin less gravity, in the frame's
/// axes, (3,) or (N, 3), m/s². angular_velocity: In the frame's axes, (3,) or (N, 3), rad/s.
/// angular_acceleration: In the frame's axes, (3,) or (N, 3), rad/s².
///
/// Returns:
///     (6, 10) or (N, 6, 10).
///
/// Raises:
///     ArgumentError: A shape does not fit.
#[pyfunction]
pub(crate) fn wrench_regressor<'py>(
    py: Python<'py>,
    acceleration: &Bound<'py, PyAny>,
    angular_velocity: &Bound<'py, PyAny>,
    angular_acceleration: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let acceleration = Series::read(acceleration, "acceleration", &[3])?;
    let angular_velocity = Series::read(angular_velocity, "angular_velocity", &[3])?;
    let angular_acceleration = Series::read(angular_acceleration, "angular_acceleration", &[3])?;
    let samples = common_length(&[&acceleration, &angular_velocity, &angular_acceleration])?;
    let count = samples.unwrap_or(1);
    let mut values = Vec::with_capacity(60 * count);
    detached(py, || {
        for sample in 0..count {
            let motion = ToolMotion {
                acceleration: acceleration.vector(sample, 0),
                angular_velocity: angular_velocity.vector(sample, 0),
                angular_acceleration: angular_acceleration.vector(sample, 0),
            };
            // Transposed, since nalgebra goes column by column.
            values.extend(
                tactid_dynamics::wrench_regressor(&motion)
                    .transpose()
                    .iter(),
            );
        }
    })?;
    output(py, values, samples, &[6, 10])
}
