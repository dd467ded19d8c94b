//! The further attitude that helps most.

use nalgebra::{Matrix4, Matrix6, SMatrix, Vector3};
use tactid_identify::equations::{WRENCH, acceleration_columns};
use tactid_identify::solve::{EIGENVALUE_RATIO, Matrix, Vector};
use tactid_identify::solve::{std_dev, value_jacobian};
use tactid_identify::{KINDS, VALUE_NAMES};

use super::fit::RestFit;
use super::pose_fit::set_angles;
use crate::finding::NextAttitude;
use crate::fit::elimination::tangents;
use crate::solve::pseudo_inverse;

/// Returns which of 26 directions of gravity adds most information on mass and centre of mass: the
/// largest determinant of the information of both (D-optimality). `map` maps wrenches in the tool
/// frame to the frame of the offset.
pub(super) fn next_attitude(fit: &RestFit, gravity_m_s2: f64, map: &Matrix6<f64>) -> NextAttitude {
    let directions = (0..27).map(|k| [k % 3, k / 3 % 3, k / 9].map(|axis| f64::from(axis) - 1.0));
    let directions = directions.filter(|direction| direction.iter().any(|axis| *axis != 0.0));
    let after = |gravity: &[f64; 3]| {
        let up = Vector3::from(*gravity).normalize() * -gravity_m_s2;
        fit.information_with(&rows_at_rest(&up, map, fit))
    };
    let volume = |information: Matrix| {
        let block: Matrix4<f64> = information.fixed_view::<4, 4>(0, 0).into();
        let units = fit
            .information
            .diagonal()
            .fixed_rows::<4>(0)
            .map(|entry| entry.max(f64::MIN_POSITIVE));
        let ridge = Matrix4::from_diagonal(&(units * EIGENVALUE_RATIO));
        (block + ridge).determinant()
    };
    let best = directions
        .map(|gravity| (volume(after(&gravity)), gravity))
        .reduce(|best, next| {
            if next.0 > best.0 * (1.0 + 1e-6) {
                next
            } else {
                best
            }
        });
    let gravity = best.map_or([0.0, 0.0, -1.0], |(_, gravity)| gravity);
    let (value, fraction) = improvement(fit, &after(&gravity));
    NextAttitude {
        gravity,
        value: VALUE_NAMES[value].into(),
        fraction,
    }
}

/// Returns the value that another information improves most, with its standard deviation relative
/// to the present one.
fn improvement(fit: &RestFit, after: &Matrix) -> (usize, f64) {
    let Some(jacobian) = value_jacobian(&fit.parameters) else {
        return (0, 1.0);
    };
    let then = pseudo_inverse(after);
    let fraction = |k: usize| {
        let gradient = jacobian.row(k).into();
        let now = std_dev(&gradient, &fit.covariance, &fit.null_space);
        let then = std_dev(&gradient, &then.covariance, &then.null_space);
        if then.is_finite() { then / now } else { 1.0 }
    };
    let fractions = (0..KINDS[1].end).map(|k| (k, fraction(k)));
    fractions
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, 1.0))
}

/// Returns the regressor of each channel of a wrench in the frame of the offset, for a payload that
/// is held against gravity with the specific force `up` in this frame, m/s²: the force is the mass
/// times it, and the moment the first moments times it. The angles of gravity have columns where
/// the fit has them.
fn rows_at_rest(up: &Vector3<f64>, map: &Matrix6<f64>, fit: &RestFit) -> [Vector; WRENCH] {
    let frame_from_tool = map.fixed_view::<3, 3>(0, 0);
    let up: Vector3<f64> = frame_from_tool.tr_mul(up);
    let mut in_tool = SMatrix::<f64, WRENCH, 10>::zeros();
    in_tool
        .fixed_columns_mut::<4>(0)
        .copy_from(&acceleration_columns(&up));
    if fit.has_angles() {
        set_angles(&mut in_tool, &-tangents(&-up), &fit.parameters);
    }
    let rows = map * in_tool;
    std::array::from_fn(|channel| rows.row(channel).transpose())
}
