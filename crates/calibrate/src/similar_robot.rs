//! Torques of links that are far from those of the robot's description.
//!
//! Where efforts count as torques, links of any mass fit them, and the description of a similar
//! robot leaves no residual.

use tactid_identify::HALF_WIDTH_95;

use super::contradiction::{Assumption, Contradiction};
use super::fit::Fitted;
use super::recording::EffortRecording;
use super::report::LinkCalibration;
use super::rows::dot;
use super::student::WIDENING;
use crate::CalibrateError;

/// Ratio of fitted to described torques beyond which the description is doubtful: a judgement.
/// Published masses are off by tens of percent; a UR10 needs more than twice the torques of a UR5.
const DOUBTFUL_RATIO: f64 = 1.6;

/// Returns the joint that carries most by the robot's description, if the torque of the fitted
/// links is far from what the described ones need, beyond its uncertainty. Links without mass say
/// nothing. A part that is proportional to the joint's acceleration, or constant, does not count:
/// rotors and offsets may take it.
pub(crate) fn doubtful_links(
    recordings: &[&EffortRecording],
    fitted: &Fitted,
    links: &[LinkCalibration],
) -> Result<Option<Contradiction>, CalibrateError> {
    let arm = &recordings[0].arm;
    let joints = 0..arm.joints.len();
    let has_masses = |joint: &usize| {
        let moved = &links[arm.first_links[*joint]..];
        moved.iter().all(|link| link.described.mass() > 0.0)
    };
    let loads = joints
        .filter(has_masses)
        .map(|joint| Load::new(recordings, joint));
    let largest = loads.max_by(|a, b| a.squares.total_cmp(&b.squares));
    let Some(load) = largest.filter(|load| load.squares > 0.0) else {
        return Ok(None);
    };
    let first = 10 * arm.first_links[load.joint];
    let of_links = first..fitted.model.layout.link_range().end;
    let ratio = dot(&load.slopes, &fitted.unknowns.arm[of_links.clone()]);
    let mut scaled = nalgebra::DVector::zeros(fitted.prior.scales.len());
    for (k, slope) in of_links.zip(&load.slopes) {
        scaled[k] = fitted.prior.scales[k] * slope;
    }
    let factor = fitted.arm_precision()?.cholesky();
    let factor = factor.ok_or_else(CalibrateError::unsolvable)?;
    let std_dev = WIDENING * scaled.dot(&factor.solve(&scaled)).sqrt();
    let margin = HALF_WIDTH_95 * std_dev;
    let is_doubtful = ratio - margin > DOUBTFUL_RATIO || ratio + margin < 1.0 / DOUBTFUL_RATIO;
    Ok(is_doubtful.then(|| Contradiction {
        assumption: Assumption::Links,
        size: ratio - 1.0,
        std_dev,
        joint: arm.joints[load.joint].clone(),
        shown: None,
    }))
}

/// What a joint carries by the robot's description.
struct Load {
    joint: usize,
    /// Sum over all windows of the squares of the described torque, less its constant and its
    /// accelerating part.
    squares: f64,
    /// Derivatives of the ratio of torques with respect to the parameters of the links.
    slopes: Vec<f64>,
}

impl Load {
    fn new(recordings: &[&EffortRecording], joint: usize) -> Self {
        let arm = &recordings[0].arm;
        let described = &arm.described[10 * arm.first_links[joint]..];
        let windows = || {
            let each = recordings.iter();
            each.flat_map(|recording| (0..recording.windows()).map(|w| recording.columns(w, joint)))
        };
        let torques: Vec<f64> = windows()
            .map(|columns| dot(columns.links, described))
            .collect();
        let accelerations: Vec<f64> = windows().map(|columns| columns.acceleration).collect();
        let (torques, accelerations) = (centred(&torques), centred(&accelerations));
        let squares = dot(&accelerations, &accelerations).max(f64::MIN_POSITIVE);
        let inertia = dot(&torques, &accelerations) / squares;
        let pairs = torques.iter().zip(&accelerations);
        let loads: Vec<f64> = pairs
            .map(|(torque, rate)| torque - inertia * rate)
            .collect();
        let squares = dot(&loads, &loads);
        let mut slopes = vec![0.0; described.len()];
        for (columns, load) in windows().zip(&loads) {
            for (slope, entry) in slopes.iter_mut().zip(columns.links) {
                *slope += load * entry / squares;
            }
        }
        Self {
            joint,
            squares,
            slopes,
        }
    }
}

/// Returns numbers less their mean.
fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}
