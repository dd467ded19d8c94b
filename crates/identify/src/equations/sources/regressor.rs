//! The regressor of the wrench on the payload, which every source has in common.

use nalgebra::{Isometry3, SMatrix, Vector3};
use tactid_dynamics::{FrameMotion, ToolMotion, Wrench, wrench_regressor};

use crate::equations::equation::Row;

/// Regressor of the wrench on the payload in the tool frame and about its origin: the standard linear form
/// of (29) and (42), `[f_U; n_U] = Y(p̈_U - g, ω_U, ω̇_U) π`.
#[derive(Clone, Debug)]
pub(crate) struct WrenchRegressor {
    /// `Y`, 6x10.
    pub(crate) parameters: SMatrix<f64, 6, 10>,
    /// What an acceleration equal to gravity would add to the columns of mass and first moments, 6x4.
    pub(crate) gravity: SMatrix<f64, 6, 4>,
}

impl WrenchRegressor {
    /// Computes the regressor of a motion of the tool frame. `gravity` is the gravitational acceleration in
    /// the inertial frame, m/s².
    pub(crate) fn new(motion: &FrameMotion, gravity: &Vector3<f64>) -> Self {
        let gravity_motion = ToolMotion {
            acceleration: motion.pose.rotation.inverse_transform_vector(gravity),
            angular_velocity: Vector3::zeros(),
            angular_acceleration: Vector3::zeros(),
        };
        Self {
            parameters: wrench_regressor(&motion.in_frame(gravity)),
            gravity: wrench_regressor(&gravity_motion)
                .fixed_columns::<4>(0)
                .into_owned(),
        }
    }

    /// Returns the regressor of the wrench in another frame and about that frame's origin.
    pub(crate) fn expressed_in(&self, other_from_tool: &Isometry3<f64>) -> Self {
        Self {
            parameters: columns_expressed_in(&self.parameters, other_from_tool),
            gravity: columns_expressed_in(&self.gravity, other_from_tool),
        }
    }

    /// Writes the six rows whose targets are the entries of a measured wrench.
    pub(crate) fn fill_rows(&self, wrench: &Wrench, rows: &mut [Row]) {
        let targets = wrench.force.iter().chain(wrench.moment.iter());
        for (k, (row, &target)) in rows.iter_mut().zip(targets).enumerate() {
            row.regressor = self.parameters.row(k).transpose();
            row.target = target;
            row.gravity = self.gravity.row(k).transpose();
        }
    }
}

/// Returns the wrenches that are the columns, in another frame and about that frame's origin.
pub(crate) fn columns_expressed_in<const N: usize>(
    wrenches: &SMatrix<f64, 6, N>,
    other_from_this: &Isometry3<f64>,
) -> SMatrix<f64, 6, N> {
    let mut expressed = *wrenches;
    for mut column in expressed.column_iter_mut() {
        let wrench = Wrench {
            force: column.fixed_rows::<3>(0).into_owned(),
            moment: column.fixed_rows::<3>(3).into_owned(),
        }
        .expressed_in(other_from_this);
        column.fixed_rows_mut::<3>(0).copy_from(&wrench.force);
        column.fixed_rows_mut::<3>(3).copy_from(&wrench.moment);
    }
    expressed
}
