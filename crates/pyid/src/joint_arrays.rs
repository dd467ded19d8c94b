//! Positions, velocities and efforts of joints in arrays on one clock.

use pyo3::prelude::*;
use tactid_dynamics::Manipulator;
use tactid_recordings::Arrays;

use crate::arrays::{Series, common_length};

/// Times, positions, velocities and efforts of the joints, N samples each; matrices are stored row
/// by row.
pub(crate) struct JointArrays {
    pub(crate) time: Vec<f64>,
    pub(crate) q: Vec<f64>,
    /// Empty where the velocities are derived from the positions.
    qd: Vec<f64>,
    pub(crate) effort: Vec<f64>,
}

impl JointArrays {
    /// Reads times, positions and efforts of `dof` joints, which errors name by `names`, and their
    /// velocities, if there are any.
    pub(crate) fn read(
        names: [&'static str; 3],
        [time, q, effort]: [&Bound<'_, PyAny>; 3],
        qd: Option<&Bound<'_, PyAny>>,
        dof: usize,
    ) -> PyResult<Self> {
        let time = Series::read(time, names[0], &[])?;
        let q = Series::read(q, names[1], &[dof])?;
        let effort = Series::read(effort, names[2], &[dof])?;
        let qd = Series::read_or_empty(qd, "qd", dof)?;
        let count = common_length(&[&time, &q, &qd, &effort])?.unwrap_or(1);
        let [time, q, qd, effort] = [time, q, qd, effort].map(|series| series.repeated(count));
        Ok(Self {
            time,
            q,
            qd,
            effort,
        })
    }

    /// Returns the arrays as those of a robot, where it is given as such.
    pub(crate) fn of_robot<'a>(&'a self, robot: Option<&'a Manipulator>) -> Arrays<'a> {
        Arrays {
            robot,
            time: &self.time,
            q: &self.q,
            qd: &self.qd,
            effort: &self.effort,
            ..Arrays::default()
        }
    }
}
