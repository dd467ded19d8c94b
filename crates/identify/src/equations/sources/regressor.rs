//! The regressor of the wrench on the payload, which every source has in common.

use nalgebra::{Isometry3, SMatrix, SVector, Vector3, Vector6};
use tactid_dynamics::{ToolMotion, Wrench, cross, mean_wrench_regressor};

use crate::equations::equation::Row;
use crate::equations::settings::SubtractedLoad;

/// Number of the [`MotionTerms`].
pub(crate) const MOTION_TERMS: usize = 15;

/// Functions of the tool's motion in which the regressor of the wrench in the tool frame is linear,
/// so that their means over a window give the mean regressor: `p̈_U - g`, `g` and `ω̇_U` in the
/// tool frame, then the products `ωxωx, ωxωy, ωxωz, ωyωy, ωyωz, ωzωz` of the angular velocity.
pub(crate) type MotionTerms = SVector<f64, MOTION_TERMS>;

/// Returns the terms of a motion of the tool frame. `g` is the gravitational acceleration in the
/// tool frame, m/s².
pub(crate) fn motion_terms(motion: &ToolMotion, g: &Vector3<f64>) -> MotionTerms {
    let (a, dw, w) = (
        &motion.acceleration,
        &motion.angular_acceleration,
        &motion.angular_velocity,
    );
    let [xx, xy, xz] = [w.x * w.x, w.x * w.y, w.x * w.z];
    let [yy, yz, zz] = [w.y * w.y, w.y * w.z, w.z * w.z];
    MotionTerms::from([
        a.x, a.y, a.z, g.x, g.y, g.z, dw.x, dw.y, dw.z, xx, xy, xz, yy, yz, zz,
    ])
}

/// Regressor of the wrench on the payload in the tool frame and about its origin: the standard
/// linear form of (29) and (42), `[f_U; n_U] = Y(p̈_U - g, ω_U, ω̇_U) π`.
#[derive(Clone, Debug)]
pub(crate) struct WrenchRegressor {
    /// `Y`, 6x10.
    pub(crate) parameters: SMatrix<f64, 6, 10>,
    /// What an acceleration equal to gravity would add to the columns of mass and first moments,
    /// 6x4.
    pub(crate) gravity: SMatrix<f64, 6, 4>,
}

impl WrenchRegressor {
    /// Computes the regressor from the terms of one motion, or from mean terms.
    pub(crate) fn new(terms: &MotionTerms) -> Self {
        let vector = |first: usize| terms.fixed_rows::<3>(first).into_owned();
        let (acceleration, gravity, angular_acceleration) = (vector(0), vector(3), vector(6));
        let products = std::array::from_fn(|k| terms[9 + k]);
        Self {
            parameters: mean_wrench_regressor(&acceleration, &angular_acceleration, &products),
            gravity: acceleration_columns(&gravity),
        }
    }

    /// Returns the wrench that supports the weight of a body and, where these were subtracted as
    /// well, accelerates it.
    pub(crate) fn load(&self, of: &SubtractedLoad) -> Vector6<f64> {
        let parameters = of.body.as_vector();
        if of.with_inertia {
            self.parameters * parameters
        } else {
            -(self.gravity * parameters.fixed_rows::<4>(0))
        }
    }

    /// Returns the regressor of the wrench in another frame and about that frame's origin.
    pub(crate) fn expressed_in(&self, other_from_tool: &Isometry3<f64>) -> Self {
        Self {
            parameters: columns_expressed_in(&self.parameters, other_from_tool),
            gravity: columns_expressed_in(&self.gravity, other_from_tool),
        }
    }

    /// Writes the regressors of the six rows whose targets are the entries of a measured wrench.
    pub(crate) fn set_rows(&self, rows: &mut [Row]) {
        for (k, row) in rows.iter_mut().enumerate() {
            row.regressor = self.parameters.row(k).transpose();
            row.gravity = self.gravity.row(k).transpose();
        }
    }
}

/// Returns the wrench that an acceleration of a body, in the tool frame, needs for each kg of its
/// mass and each kg m of its first moments.
pub fn acceleration_columns(acceleration: &Vector3<f64>) -> SMatrix<f64, 6, 4> {
    let mut columns = SMatrix::<f64, 6, 4>::zeros();
    columns.fixed_view_mut::<3, 1>(0, 0).copy_from(acceleration);
    columns
        .fixed_view_mut::<3, 3>(3, 1)
        .copy_from(&-cross(acceleration));
    columns
}

/// Writes the six entries of a wrench.
pub(crate) fn set_wrench(entries: &mut [f64], wrench: &Wrench) {
    let values = wrench.force.iter().chain(&wrench.moment);
    for (entry, value) in entries.iter_mut().zip(values) {
        *entry = *value;
    }
}

/// Returns the wrenches that are the columns, in another frame and about that frame's origin.
pub(crate) fn columns_expressed_in<const N: usize>(
    wrenches: &SMatrix<f64, 6, N>,
    other_from_this: &Isometry3<f64>,
) -> SMatrix<f64, 6, N> {
    let rotation = other_from_this.rotation.to_rotation_matrix().into_inner();
    let forces = rotation * wrenches.fixed_rows::<3>(0);
    let arm = cross(&other_from_this.translation.vector);
    let moments = rotation * wrenches.fixed_rows::<3>(3) + arm * forces;
    let mut expressed = SMatrix::<f64, 6, N>::zeros();
    expressed.fixed_rows_mut::<3>(0).copy_from(&forces);
    expressed.fixed_rows_mut::<3>(3).copy_from(&moments);
    expressed
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use tactid_dynamics::wrench_regressor;

    use super::*;

    /// The mean of the terms of two motions gives the mean of their regressors as the dynamics have
    /// them, and the columns of gravity are the regressor of an acceleration equal to gravity.
    #[test]
    fn mean_terms_give_the_mean_regressor_of_the_dynamics() {
        let mut random = SmallRng::seed_from_u64(2);
        let mut vector = || Vector3::from_fn(|_, _| random.random_range(-2.0..2.0));
        let mut motion = || {
            let motion = ToolMotion {
                acceleration: vector(),
                angular_velocity: vector(),
                angular_acceleration: vector(),
            };
            (motion, vector())
        };
        let motions = [motion(), motion()];
        let terms = motions.map(|(motion, gravity)| motion_terms(&motion, &gravity));
        let found = WrenchRegressor::new(&((terms[0] + terms[1]) / 2.0));
        let regressors = motions.map(|(motion, _)| wrench_regressor(&motion));
        let expected = (regressors[0] + regressors[1]) / 2.0;
        assert!((found.parameters - expected).amax() < 1e-14);
        let of_gravity = motions.map(|(_, gravity)| {
            wrench_regressor(&ToolMotion {
                acceleration: gravity,
                angular_velocity: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
            })
        });
        let expected = (of_gravity[0] + of_gravity[1]) / 2.0;
        assert!((found.gravity - expected.fixed_columns::<4>(0)).amax() < 1e-14);
    }
}
