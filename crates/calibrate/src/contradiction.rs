//! Wrong assumptions that the residuals of a calibration show.
//!
//! A wrong zero of a joint or a tilted gravity is partly absorbed by links and gains; the rest
//! looks like noise. So each assumption is tested by the unknown that would replace it, such as a
//! tilt of gravity: one more step of the fit with this unknown gives its size and by how much it
//! lowers the sum of squares (a score test). The noise comes from the calibration and contains the
//! misfit: a test is rather too cautious than too bold. Its threshold is Fisher's distribution with
//! the degrees of freedom of the noise.

use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use tactid_batch::distributions::f_p;

use super::arm::TILTS;
use super::fit::{Fitted, problem};
use super::layout::Group;
use super::noise::EffortNoise;
use super::payload::KnownPayload;
use super::recording::EffortRecording;
use super::rows::{EffortModel, Unknowns};
use super::solver::{Block, Problem};
use super::student::{DEGREES_OF_FREEDOM, WIDENING};
use crate::CalibrateError;

/// Probability of the sum of squares by chance below which an assumption is contradicted: with some
/// ten tests, one calibration in a hundred.
const PROBABILITY: f64 = 1e-3;

/// Least tilt of gravity and least error of a joint's zero that count, rad: 1.5 degrees. The
/// measured arms of the tests stay below it.
const MIN_ANGLE_RAD: f64 = 0.026;

/// Least error of a gain that was taken for exact, a fraction: less is usual for torques.
const MIN_GAIN: f64 = 0.05;

/// Least error of a known centre of mass, m: what a ruler shows.
const MIN_CENTER_M: f64 = 0.005;

/// Fraction of the information on an unknown below which others of the fit stand for it.
const MIN_INFORMATION_FRACTION: f64 = 1e-9;

/// An assumption of a calibration that its recordings contradict, with what they show instead.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contradiction {
    /// The assumption.
    #[serde(flatten)]
    pub assumption: Assumption,
    /// Size of its error by one linear step, rough where it is large: the angle between the given
    /// and the true gravity, rad; the true position less the measured one, rad; the true gain over
    /// the given one, less 1; the distance of the true centre of mass from the given one, m; or the
    /// torque of the true links over that of the described ones, less 1. The errors of
    /// [`Assumption::GainPrior`] and [`Assumption::Links`] are what the whole calibration found.
    pub size: f64,
    /// Standard deviation of the size, in the unit of the size, widened as in
    /// [`CalibratedEstimate`](super::CalibratedEstimate).
    pub std_dev: f64,
    /// The joint with the wrong zero or gain; for gravity and a centre of mass, the joint with the
    /// efforts that show it most.
    pub joint: String,
    /// What the recordings show in place of an assumption that is a vector, as it would be given,
    /// and as rough as the size: gravity in the axes of the base, m/s^2, or the centre of mass in
    /// the tool frame, m. `None` for a number of one joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shown: Option<[f64; 3]>,
}

/// What a calibration takes for true.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "assumption")]
pub enum Assumption {
    /// The direction of gravity in the axes of the base.
    #[serde(rename = "gravity_tilted")]
    Gravity,
    /// The zero of the position of [`Contradiction::joint`].
    #[serde(rename = "joint_zero_off")]
    JointZero,
    /// The gain of [`Contradiction::joint`], where gains are taken for exact.
    #[serde(rename = "gain_contradicted")]
    Gains,
    /// The centre of mass of a known payload.
    #[serde(rename = "payload_com_contradicted")]
    PayloadCenter {
        /// Number of its recording among the loaded ones, from zero.
        payload: usize,
    },
    /// The gain of [`Contradiction::joint`] as it was known before the calibration.
    #[serde(rename = "gain_improbable")]
    GainPrior {
        /// Its standard deviation, as a fraction of the gain, without a unit.
        prior_std_dev: f64,
    },
    /// The masses and centres of mass of the links that [`Contradiction::joint`] moves, as the
    /// robot's description has them.
    #[serde(rename = "links_improbable")]
    Links,
}

/// The columns of the unknowns that replace an assumption.
#[derive(Clone, Debug)]
struct Test {
    assumption: Assumption,
    columns: std::ops::Range<usize>,
    /// The joint that the assumption is about.
    joint: Option<usize>,
    least: f64,
}

/// What the residuals show in place of one assumption.
struct Evidence {
    /// Probability that noise lowers the sum of squares by as much.
    probability: f64,
    /// By how much the sum of squares is lower.
    squares: f64,
    contradiction: Contradiction,
    /// Whether the error is large enough to count.
    is_relevant: bool,
}

impl Evidence {
    /// Whether it is stronger than another one. Small probabilities are zero.
    fn is_stronger(&self, other: &Self) -> bool {
        (self.probability, -self.squares) < (other.probability, -other.squares)
    }
}

/// Returns the assumption with the replacement that explains the residuals best, if they contradict
/// it. The others are not looked at: one wrong assumption makes others look wrong, too.
pub(crate) fn contradiction(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
    fitted: &Fitted,
) -> Result<Option<Contradiction>, CalibrateError> {
    if recordings
        .iter()
        .any(|(recording, _)| recording.arm.slopes == 0)
    {
        return Ok(None);
    }
    let problem = problem(recordings, &fitted.model, fitted.prior.clone());
    let tests = tests(recordings, fitted);
    // Gravity, zeros, gains, and centres of mass.
    let factor = fitted.precision().clone().cholesky();
    let factor = factor.ok_or_else(CalibrateError::unsolvable)?;
    let sums = sums(&problem, &fitted.unknowns, &fitted.noise);
    let information = &sums.information - &sums.coupling * factor.solve(&sums.coupling.transpose());
    let mut strongest: Option<Evidence> = None;
    for test in &tests {
        let found = test.evidence(&sums, &information, recordings);
        strongest = match (strongest, found) {
            (Some(strongest), Some(found)) if !found.is_stronger(&strongest) => Some(strongest),
            (strongest, found) => found.or(strongest),
        };
    }
    Ok(strongest
        .filter(|found| found.probability < PROBABILITY && found.is_relevant)
        .map(|found| found.contradiction))
}

/// Returns all tests: gravity, zeros of revolute joints, exact gains, and known centres of mass.
fn tests(recordings: &[(&EffortRecording, Option<KnownPayload>)], fitted: &Fitted) -> Vec<Test> {
    let arm = &recordings[0].0.arm;
    let joints = arm.joints.len();
    let mut tests = vec![Test {
        assumption: Assumption::Gravity,
        columns: 0..TILTS,
        joint: None,
        least: MIN_ANGLE_RAD,
    }];
    let revolute = (0..joints).filter(|&joint| arm.units[joint] == "N m");
    tests.extend(revolute.map(|joint| Test {
        assumption: Assumption::JointZero,
        columns: column_of_zero(joint)..column_of_zero(joint) + 1,
        joint: Some(joint),
        least: MIN_ANGLE_RAD,
    }));
    let gains = fitted.model.layout.range(Group::InverseGain);
    let first = TILTS + joints;
    if fitted.prior.scales[gains].contains(&0.0) {
        tests.push(Test {
            assumption: Assumption::Gains,
            columns: first..first + joints,
            joint: None,
            least: MIN_GAIN,
        });
    }
    let held = recordings.iter().filter_map(|(_, held)| *held);
    let known = held
        .enumerate()
        .filter(|(_, held)| held.center_of_mass.is_some());
    tests.extend(known.map(|(payload, _)| Test {
        assumption: Assumption::PayloadCenter { payload },
        columns: first + joints + 3 * payload..first + joints + 3 * (payload + 1),
        joint: None,
        least: MIN_CENTER_M,
    }));
    tests
}

/// Sums over all whitened rows, with the columns of the unknowns of all tests: tilts of gravity,
/// zeros, gains, and centres of mass.
pub(crate) struct Sums {
    /// Products of the columns of the tests with each other.
    pub(crate) information: DMatrix<f64>,
    /// Products of the columns of the tests with the columns of the fit.
    pub(crate) coupling: DMatrix<f64>,
    /// Products of the columns of the tests with the residuals of each joint.
    pub(crate) scores: DMatrix<f64>,
}

/// Returns the column of the zero of a joint among the columns of [`Sums`].
pub(crate) fn column_of_zero(joint: usize) -> usize {
    TILTS + joint
}

/// Returns the sums at some unknowns, with the noise of each joint.
pub(crate) fn sums(problem: &Problem<'_>, at: &Unknowns, noise: &[EffortNoise]) -> Sums {
    let joints = problem.model.layout.joints;
    let count = TILTS + 2 * joints + 3 * problem.payload_scales.len();
    let mut sums = Sums {
        information: DMatrix::zeros(count, count),
        coupling: DMatrix::zeros(count, problem.len()),
        scores: DMatrix::zeros(count, joints),
    };
    for block in &problem.blocks {
        for (joint, noise) in noise.iter().enumerate() {
            let mut rows = problem.rows(block, joint, at);
            let mut columns = columns(block, joint, (problem.model, at), count);
            let whitening = block.whitening(joint, noise);
            whitening.apply(&mut rows);
            whitening.apply(&mut columns);
            sums.information += columns.tr_mul(&columns);
            let products = columns.tr_mul(&rows);
            let indices = problem.indices(block, joint);
            for (column, &index) in indices.iter().enumerate() {
                let mut sum = sums.coupling.column_mut(index);
                sum += products.column(column);
            }
            let mut sum = sums.scores.column_mut(joint);
            sum += products.column(indices.len());
        }
    }
    sums
}

/// Returns the derivatives of the modelled effort of a joint with respect to the unknowns of all
/// tests. The derivatives for gravity and the zeros are of the links as described and of the
/// payload as estimated.
fn columns(
    block: &Block<'_>,
    joint: usize,
    (model, at): (&EffortModel, &Unknowns),
    count: usize,
) -> DMatrix<f64> {
    let joints = model.layout.joints;
    let payload = block.payload.map(|payload| &at.payloads[payload]);
    let rows = model.rows(block.recording, joint, &block.windows, &at.arm, payload);
    let inverse_gain = model.layout.index(Group::InverseGain, joint);
    let indices = model.indices(block.recording, joint);
    let place = indices.iter().position(|index| *index == inverse_gain);
    let first = TILTS + joints;
    let mut columns = DMatrix::zeros(block.windows.len(), count);
    for (row, &window) in block.windows.iter().enumerate() {
        let of_joint = block.recording.columns(window, joint);
        for k in 0..first {
            columns[(row, k)] = at.arm[inverse_gain] * of_joint.slope(k, payload);
        }
        if let Some(place) = place {
            // The gain changes opposite to its inverse.
            columns[(row, first + joint)] = -at.arm[inverse_gain] * rows[(row, place)];
        }
        let (Some(payload), Some(held)) = (block.payload, payload) else {
            continue;
        };
        let of_center = first + joints + 3 * payload;
        for axis in 0..3 {
            columns[(row, of_center + axis)] = held[0] * rows[(row, indices.len() + 1 + axis)];
        }
    }
    columns
}

impl Test {
    /// Returns what the residuals show in place of the assumption; `None` where they show nothing.
    fn evidence(
        &self,
        sums: &Sums,
        information: &DMatrix<f64>,
        recordings: &[(&EffortRecording, Option<KnownPayload>)],
    ) -> Option<Evidence> {
        let (first, count) = (self.columns.start, self.columns.len());
        let all: DVector<f64> = sums.scores.column_sum();
        let score = all.rows(first, count).into_owned();
        let of_test = information
            .view((first, first), (count, count))
            .into_owned();
        let is_determined = |k: usize| {
            of_test[(k, k)] > MIN_INFORMATION_FRACTION * sums.information[(first + k, first + k)]
        };
        if !(0..count).all(is_determined) {
            return None;
        }
        let factor = of_test.cholesky()?;
        let found = factor.solve(&score);
        let squares = score.dot(&found);
        let covariance = factor.inverse();
        let (size, variance, largest) = match self.assumption {
            Assumption::Gains => {
                let significance = |k: usize| found[k].powi(2) / covariance[(k, k)];
                let largest =
                    (0..count).max_by(|&a, &b| significance(a).total_cmp(&significance(b)))?;
                (
                    found[largest],
                    covariance[(largest, largest)],
                    Some(largest),
                )
            }
            _ => {
                let size = found.norm();
                let direction = &found / size;
                (size, direction.dot(&(&covariance * &direction)), self.joint)
            }
        };
        // The joint with the residuals that gain most by the step.
        let of_joints = sums.scores.rows(first, count).tr_mul(&found);
        let joint = largest.unwrap_or_else(|| of_joints.imax());
        let of_noise = DEGREES_OF_FREEDOM;
        Some(Evidence {
            probability: f_p(squares, count as f64, of_noise),
            squares,
            is_relevant: size.abs() >= self.least,
            contradiction: Contradiction {
                assumption: self.assumption,
                size: if count == 1 { found[0] } else { size },
                std_dev: WIDENING * variance.sqrt(),
                joint: recordings[0].0.arm.joints[joint].clone(),
                shown: self.shown(&found, recordings).map(Into::into),
            },
        })
    }

    /// Returns the vector by which the step `found` replaces the assumption; `None` for a number.
    fn shown(
        &self,
        found: &DVector<f64>,
        recordings: &[(&EffortRecording, Option<KnownPayload>)],
    ) -> Option<Vector3<f64>> {
        match self.assumption {
            Assumption::Gravity => {
                let tilt = Vector2::new(found[0], found[1]);
                Some(recordings[0].0.arm.tilted_gravity(tilt))
            }
            Assumption::PayloadCenter { payload } => {
                let mut held = recordings.iter().filter_map(|(_, held)| *held);
                let given = held.nth(payload)?.center_of_mass?;
                Some(given + Vector3::new(found[0], found[1], found[2]))
            }
            Assumption::JointZero
            | Assumption::Gains
            | Assumption::GainPrior { .. }
            | Assumption::Links => None,
        }
    }
}
