//! Interpolation of measurements: weighted sums whose weights sum to one.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3, Vector4};
use tactid_dynamics::{BaseAcceleration, Wrench};
use tactid_identify::BaseState;

use super::event::{JointValues, SpecificForce};

/// Quantities that can be interpolated.
pub(crate) trait Interpolate: Clone {
    /// Returns the weighted sum of values whose weights sum to one. There is at least one value.
    fn weighted_sum(values: &[(f64, &Self)]) -> Self;
}

fn sum<T>(values: &[(f64, &T)], of: fn(&T) -> Vector3<f64>) -> Vector3<f64> {
    let terms = values.iter().map(|(weight, value)| of(value) * *weight);
    terms.sum()
}

impl Interpolate for Wrench {
    fn weighted_sum(values: &[(f64, &Self)]) -> Self {
        Self {
            force: sum(values, |wrench| wrench.force),
            moment: sum(values, |wrench| wrench.moment),
        }
    }
}

impl Interpolate for BaseAcceleration {
    fn weighted_sum(values: &[(f64, &Self)]) -> Self {
        Self {
            linear: sum(values, |acceleration| acceleration.linear),
            angular: sum(values, |acceleration| acceleration.angular),
        }
    }
}

impl Interpolate for SpecificForce {
    fn weighted_sum(values: &[(f64, &Self)]) -> Self {
        Self {
            linear: sum(values, |imu| imu.linear),
            angular_velocity: sum(values, |imu| imu.angular_velocity),
        }
    }
}

impl Interpolate for BaseState {
    fn weighted_sum(values: &[(f64, &Self)]) -> Self {
        let first = values[0].1.pose.rotation.coords;
        let terms = values.iter().map(|(weight, base)| {
            let coords = base.pose.rotation.coords;
            // Both signs of a quaternion are the same rotation: all are taken on the side of the
            // first.
            coords * weight.copysign(*weight * coords.dot(&first))
        });
        let rotation: Vector4<f64> = terms.sum();
        let measured = |of: fn(&Self) -> Option<Vector3<f64>>| -> Option<Vector3<f64>> {
            let terms = values
                .iter()
                .map(|(weight, base)| Some(of(base)? * *weight));
            terms.sum()
        };
        Self {
            pose: Isometry3::from_parts(
                sum(values, |base| base.pose.translation.vector).into(),
                UnitQuaternion::new_normalize(Quaternion::from(rotation)),
            ),
            velocity: sum(values, |base| base.velocity),
            angular_velocity: sum(values, |base| base.angular_velocity),
            acceleration: measured(|base| base.acceleration),
            angular_acceleration: measured(|base| base.angular_acceleration),
        }
    }
}

impl Interpolate for JointValues {
    fn weighted_sum(values: &[(f64, &Self)]) -> Self {
        let sum = |of: fn(&Self) -> &Vec<f64>| -> Vec<f64> {
            // What one of the samples does not have is not known of the sum.
            let length = values.iter().map(|(_, v)| of(v).len()).min().unwrap_or(0);
            let at = |k| values.iter().map(|(weight, v)| weight * of(v)[k]).sum();
            (0..length).map(at).collect()
        };
        Self {
            position: sum(|v| &v.position),
            velocity: sum(|v| &v.velocity),
            effort: sum(|v| &v.effort),
        }
    }
}
