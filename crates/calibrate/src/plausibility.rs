//! Gains that contradict what was known of them before a calibration.

use super::contradiction::{Assumption, Contradiction};
use super::report::JointCalibration;
use crate::CalibrateError;

/// Distance from the given gain that contradicts it, in its standard deviations, and the least that
/// does, a fraction.
const CONTRADICTED: f64 = 5.0;
const LEAST: f64 = 0.1;

/// Distance from the given gain that is improbable, in its standard deviations: of 1000 normal
/// gains, three are farther away.
const IMPROBABLE: f64 = 3.0;

/// Standard deviation below which a gain is found, a fraction of the gain.
const FOUND: f64 = 0.2;

/// Largest ratio of gains that count as off by one factor: motors differ by tens of percent.
const SAME: f64 = 2.0;

/// Checks that the gains are not far from those that were given, with a standard deviation, a
/// fraction; 0 where they are not estimated.
pub(crate) fn check_gains(joints: &[JointCalibration], std_dev: f64) -> Result<(), CalibrateError> {
    if std_dev == 0.0 {
        return Ok(());
    }
    let is_far = |joint: &JointCalibration| distance(joint) > (CONTRADICTED * std_dev).max(LEAST);
    let found: Vec<_> = joints.iter().filter(|joint| is_found(joint)).collect();
    let Some(first) = found.iter().find(|joint| is_far(joint)) else {
        return Ok(());
    };
    let found_gains = || found.iter().map(|joint| joint.gain);
    let (low, high) = (
        found_gains().fold(f64::INFINITY, f64::min),
        found_gains().fold(0.0, f64::max),
    );
    // All are off by one factor where their mean is farther from one than they are from it.
    let mean = found_gains().map(f64::ln).sum::<f64>() / found.len() as f64;
    let half_range = 0.5 * (high / low).ln();
    let factor = mean.exp();
    let gain = |joint| if is_found(joint) { joint.gain } else { factor };
    let gains = joints.iter().map(gain).collect();
    if found.len() > 1 && high < SAME * low && mean.abs() > half_range {
        return Err(CalibrateError::GainsUnexpected {
            joint: None,
            gain: factor,
            std_dev,
            gains,
        });
    }
    Err(CalibrateError::GainsUnexpected {
        joint: Some(first.name.clone()),
        gain: first.gain,
        std_dev,
        gains,
    })
}

/// Returns the joint with the gain farthest from the given one, if it is improbably far: of another
/// robot, for instance, with other masses of the links. `std_dev` refers to the given gains, a
/// fraction; 0 where they are not estimated.
pub(crate) fn improbable_gain(joints: &[JointCalibration], std_dev: f64) -> Option<Contradiction> {
    let found = joints.iter().filter(|joint| is_found(joint));
    let farthest = found.max_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let is_improbable = distance(farthest) > (IMPROBABLE * std_dev).max(LEAST);
    (std_dev > 0.0 && is_improbable).then(|| Contradiction {
        assumption: Assumption::GainPrior {
            prior_std_dev: std_dev,
        },
        size: farthest.gain - 1.0,
        std_dev: farthest.gain_std_dev,
        joint: farthest.name.clone(),
        shown: None,
    })
}

/// Whether the recordings determine the gain of a joint.
fn is_found(joint: &JointCalibration) -> bool {
    joint.gain_std_dev < FOUND * joint.gain
}

/// Returns the distance of a gain from the given one, a fraction of the smaller of both.
fn distance(joint: &JointCalibration) -> f64 {
    (joint.gain - 1.0).abs().max((1.0 / joint.gain - 1.0).abs())
}
