//! Limits on position, velocity and acceleration as linear inequalities for the splines' variables.

use crate::joint_limits::JointLimits;
use crate::limits::Limit;
use crate::spline::HullPoint;
use crate::variables::{ControlPoint, Variables};

/// Fraction of a limit that counts as rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Fraction of a limit on velocity or acceleration that control points may use, so that rounding
/// exceeds none. A position may use all of its range, because a motion may start at its end.
const USABLE: f64 = 1.0 - ROUNDING;

/// An affine function of the variables that must stay between -1 and 1: a point of the hull of a
/// derivative, relative to its limit.
#[derive(Clone, Debug)]
pub(crate) struct JointRow {
    pub(crate) limit: Limit,
    pub(crate) terms: Vec<(usize, f64)>,
    constant: f64,
}

impl JointRow {
    /// Returns the fraction of the limit that is used, with the sign of the side.
    pub(crate) fn value(&self, values: &[f64]) -> f64 {
        let terms = self.terms.iter();
        self.constant
            + terms
                .map(|(variable, f)| f * values[*variable])
                .sum::<f64>()
    }
}

/// Moves variables that are control points of a position into the range of the joint.
pub(crate) fn clamp_positions(rows: &[JointRow], values: &mut [f64]) {
    for row in rows {
        if let (Limit::Position(_), [(variable, factor)]) = (&row.limit, row.terms.as_slice()) {
            let ends = [-1.0, 1.0].map(|end| (end - row.constant) / factor);
            values[*variable] = values[*variable].clamp(ends[0], ends[1]);
        }
    }
}

/// Returns the rows of all joints that move; `limits` and `names` are theirs.
pub(crate) fn joint_rows(
    variables: &Variables,
    limits: &[JointLimits],
    names: &[&str],
) -> Vec<JointRow> {
    let mut rows = Vec::new();
    for (joint, (limits, name)) in limits.iter().zip(names).enumerate() {
        let name = || (*name).to_owned();
        let (low, high) = limits.position;
        let middle = if low.is_finite() && high.is_finite() {
            0.5 * (low + high)
        } else {
            0.0
        };
        let of_orders = [
            (Limit::Position(name()), high - middle, middle),
            (Limit::Velocity(name()), limits.velocity, 0.0),
            (Limit::Acceleration(name()), limits.acceleration, 0.0),
        ];
        for (order, (limit, half, middle)) in of_orders.into_iter().enumerate() {
            if !half.is_finite() {
                continue;
            }
            let unit = 1.0 / if order == 0 { half } else { half * USABLE };
            for point in variables.basis.hull(order) {
                let row = row(variables, joint, &point, unit, limit.clone());
                if !row.terms.is_empty() {
                    rows.push(JointRow {
                        constant: row.constant - middle * unit,
                        ..row
                    });
                }
            }
        }
    }
    rows
}

/// Returns a point of the hull of a joint's spline or of its derivative, times `unit`.
fn row(
    variables: &Variables,
    joint: usize,
    point: &HullPoint,
    unit: f64,
    limit: Limit,
) -> JointRow {
    let mut row = JointRow {
        limit,
        terms: Vec::new(),
        constant: 0.0,
    };
    for (k, weight) in point.weights.iter().enumerate() {
        if *weight == 0.0 {
            continue;
        }
        let coefficient = weight * unit;
        match variables.control_point(joint, point.first + k) {
            ControlPoint::Fixed(fixed) => row.constant += coefficient * fixed,
            ControlPoint::Variable(variable) => {
                match row.terms.iter_mut().find(|(own, _)| *own == variable) {
                    Some((_, sum)) => *sum += coefficient,
                    None => row.terms.push((variable, coefficient)),
                }
            }
        }
    }
    row
}
