//! What a calibration reports beside its data.

use nalgebra::{DMatrix, SVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_batch::Delay;
use tactid_dynamics::InertialParameters;
use tactid_identify::solve::Vector;

use super::arm::Arm;
use super::compare::compare;
use super::contradiction::Contradiction;
use super::fit::{Fitted, MOVES, problem};
use super::layout::Group;
use super::model::Calibration;
use super::noise::EffortNoise;
use super::payload::KnownPayload;
use super::recording::EffortRecording;
use super::settings::CalibrationSettings;
use super::solver::Problem;
use super::student::WIDENING;
use crate::CalibrateError;

/// The result of a calibration.
#[derive(Clone, Debug)]
pub struct CalibrationResult {
    /// The calibrated model, for a file and for identifications.
    pub calibration: Calibration,
    /// How well it explains the recordings, in readable numbers.
    pub report: CalibrationReport,
}

/// How well a calibration explains its recordings, and what it found.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationReport {
    /// Number of windows of all recordings.
    pub windows: usize,
    /// Length of a window, s.
    pub window_s: f64,
    /// Delay of the efforts relative to the motion.
    pub delay: Delay,
    /// The joints between base and tool.
    pub joints: Vec<JointCalibration>,
    /// The links that they move.
    pub links: Vec<LinkCalibration>,
    /// Identified payload of each recording with a known one, in the tool frame, in their order.
    pub payloads: Vec<InertialParameters>,
    /// What the motion does not determine.
    pub shortages: Vec<MotionShortage>,
    /// Assumptions that the recordings contradict: a gain that is improbable by what was known of
    /// it, and the one assumption of which the replacement explains the efforts best, such as the
    /// direction of gravity. Mostly there is none.
    pub contradictions: Vec<Contradiction>,
    /// The recordings.
    pub recordings: Vec<CalibratingRecording>,
}

/// A recording that calibrated an arm, to be recognised where it is given again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CalibratingRecording {
    /// [`EffortRecording::fingerprint`] of the recording.
    pub fingerprint: u64,
    /// Whether it has a payload.
    pub is_loaded: bool,
}

/// The calibrated model of one joint. Efforts are in N m, or in N for a prismatic joint; angles
/// become lengths there.
#[derive(Clone, Debug, PartialEq)]
pub struct JointCalibration {
    /// Name of the joint.
    pub name: String,
    /// Unit of its effort: `N m` or `N`.
    pub unit: &'static str,
    /// Factor from measured efforts to torques; 1 where efforts are torques.
    pub gain: f64,
    /// Standard deviation of the gain, widened as in
    /// [`CalibratedEstimate`](super::CalibratedEstimate); 0 where it is known.
    pub gain_std_dev: f64,
    /// Offset of the effort.
    pub offset: f64,
    /// Viscous friction, N m s/rad or N s/m.
    pub viscous: f64,
    /// Friction at each of the widths; the sum is the Coulomb friction far from standstill.
    pub friction: Vec<f64>,
    /// Load-dependent friction, a fraction of the torque of arm and payload.
    pub load_friction: f64,
    /// What load-dependent friction of a payload adds, a fraction of its torque; about zero where
    /// the friction does not distinguish the arm from what it holds.
    pub payload_friction: f64,
    /// Inertia of the rotor as the joint moves it, kg m² or kg.
    pub rotor_inertia: f64,
    /// Noise of window means.
    pub noise: EffortNoise,
    /// Largest velocity of a window mean in the positive and in the negative direction, rad/s or
    /// m/s, both positive numbers or zero.
    pub max_velocity: [f64; 2],
    /// Rms of measured less modelled efforts of all windows with the robot's description alone.
    pub residual_before: f64,
    /// Rms of measured less modelled efforts of all windows with the calibration.
    pub residual_after: f64,
    /// Rms of measured less modelled efforts of windows that a second fit did not see; NaN if few.
    pub residual_held_out: f64,
}

/// The calibrated parameters of one link, with all links fixed to it, about the link's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkCalibration {
    /// Name of the link.
    pub name: String,
    /// Parameters of the robot's description, with links beyond the tool.
    pub described: InertialParameters,
    /// Calibrated parameters. Motion determines combinations of links; others stay as described.
    pub calibrated: InertialParameters,
    /// Standard deviations of the ten calibrated parameters.
    pub std_devs: [f64; 10],
}

impl CalibrationReport {
    /// Returns what a recording was to the calibration; `None` where it is another one.
    #[must_use]
    pub fn used(&self, recording: &EffortRecording) -> Option<CalibratingRecording> {
        let fingerprint = recording.fingerprint();
        let mut recordings = self.recordings.iter().copied();
        recordings.find(|each| each.fingerprint == fingerprint)
    }

    /// Checks that an unloaded recording that updates the calibration is not one of its own.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Unloaded`] if it is: its noise would count twice.
    pub fn check_unloaded(&self, recording: &EffortRecording) -> Result<(), CalibrateError> {
        match self.used(recording) {
            Some(_) => Err(CalibrateError::Unloaded(
                "the unloaded recording has calibrated the arm, and its noise would count twice: give another one of the \
                 day, or none"
                    .to_owned(),
            )),
            None => Ok(()),
        }
    }
}

/// What the motion of the calibrating recordings does not determine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", deny_unknown_fields)]
pub enum MotionShortage {
    /// A joint does not move: its friction and, with that, its share of the payload stay uncertain.
    #[serde(rename = "joint_still")]
    Still {
        /// Name of the joint.
        joint: String,
        /// Largest velocity, rad/s or m/s.
        max_velocity: f64,
    },
    /// A joint moves in one direction only, which does not distinguish offset and Coulomb friction.
    #[serde(rename = "joint_one_direction")]
    OneDirection {
        /// Name of the joint.
        joint: String,
        /// Whether that direction is the positive one.
        is_positive: bool,
    },
    /// The recordings leave the gain of a joint more uncertain than half of what was known before.
    #[serde(rename = "gain_uncertain")]
    Gain {
        /// Name of the joint.
        joint: String,
        /// Standard deviation of its gain, as a fraction of the gain.
        std_dev: f64,
    },
}

/// Fraction of the prior standard deviation of a gain below which it counts as determined.
const GAIN_DETERMINED: f64 = 0.5;

/// Number of sections of each recording, of which one in so many is held out for validation.
const SECTIONS: usize = 25;
const HELD_OUT_EVERY: usize = 5;

/// Number of passes of the fit to the other sections, which starts at that to all of them.
const HELD_OUT_PASSES: usize = 2;

/// Returns the report on a fit to recordings.
pub(crate) fn report(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
    fitted: &Fitted,
    settings: &CalibrationSettings,
) -> Result<CalibrationReport, CalibrateError> {
    let arm = &recordings[0].0.arm;
    let factor = fitted.arm_precision()?.cholesky();
    let covariance = factor.ok_or_else(CalibrateError::unsolvable)?.inverse();
    let std_dev = |k: usize| covariance[(k, k)].max(0.0).sqrt() * fitted.prior.scales[k];
    let held_out = held_out_rms(recordings, fitted);
    let (before, after) = residual_rms(recordings, fitted);
    let of_joint = |joint: usize| {
        let layout = &fitted.model.layout;
        let index = |group| layout.index(group, joint);
        let value = |group| fitted.unknowns.arm[index(group)];
        let inverse_gain = value(Group::InverseGain);
        JointCalibration {
            name: arm.joints[joint].clone(),
            unit: arm.units[joint],
            gain: 1.0 / inverse_gain,
            gain_std_dev: WIDENING * std_dev(index(Group::InverseGain)) / inverse_gain.powi(2),
            offset: value(Group::Offset),
            viscous: value(Group::Viscous),
            friction: (0..layout.widths.len())
                .map(|width| value(Group::Friction(width)))
                .collect(),
            load_friction: value(Group::Load),
            payload_friction: value(Group::PayloadLoad),
            rotor_inertia: value(Group::Rotor),
            noise: fitted.noise[joint],
            max_velocity: max_velocity(recordings, joint),
            residual_before: before[joint],
            residual_after: after[joint],
            residual_held_out: held_out[joint],
        }
    };
    let delay = fitted.model.layout.index(Group::Delay, 0);
    let joints: Vec<JointCalibration> = (0..arm.joints.len()).map(of_joint).collect();
    let payloads = fitted.unknowns.payloads.iter();
    let windows = recordings.iter().map(|(recording, _)| recording.windows());
    Ok(CalibrationReport {
        windows: windows.sum(),
        window_s: recordings[0].0.window_s(),
        delay: Delay {
            delay_s: fitted.unknowns.arm[delay],
            std_dev_s: WIDENING * std_dev(delay),
        },
        shortages: joints
            .iter()
            .flat_map(|joint| shortages(joint, settings))
            .collect(),
        joints,
        contradictions: Vec::new(),
        recordings: recordings.iter().map(calibrating_recording).collect(),
        links: links(arm, &fitted.unknowns.arm, std_dev),
        payloads: payloads
            .map(|p| InertialParameters::from_vector(*p))
            .collect(),
    })
}

/// Returns what is stored of a recording.
fn calibrating_recording(
    (recording, payload): &(&EffortRecording, Option<KnownPayload>),
) -> CalibratingRecording {
    CalibratingRecording {
        fingerprint: recording.fingerprint(),
        is_loaded: payload.is_some(),
    }
}

/// Returns the parameters of the links, as described and as calibrated.
fn links(arm: &Arm, calibrated: &[f64], std_dev: impl Fn(usize) -> f64) -> Vec<LinkCalibration> {
    let parameters = |all: &[f64], link: usize| {
        InertialParameters::from_vector(SVector::from_column_slice(&all[10 * link..10 * link + 10]))
    };
    let of_link = |(link, name): (usize, &String)| LinkCalibration {
        name: name.clone(),
        described: parameters(&arm.described, link),
        calibrated: parameters(calibrated, link),
        std_devs: std::array::from_fn(|k| std_dev(10 * link + k)),
    };
    arm.links.iter().enumerate().map(of_link).collect()
}

/// Returns the largest velocity of a joint in both directions.
fn max_velocity(recordings: &[(&EffortRecording, Option<KnownPayload>)], joint: usize) -> [f64; 2] {
    let each = recordings
        .iter()
        .map(|(recording, _)| recording.max_velocities(joint));
    each.fold([0.0; 2], |[a, b]: [f64; 2], [c, d]| [a.max(c), b.max(d)])
}

/// Returns what the motion of a joint does not determine.
fn shortages(joint: &JointCalibration, settings: &CalibrationSettings) -> Vec<MotionShortage> {
    let mut shortages = Vec::new();
    let name = || joint.name.clone();
    let [positive, negative] = joint.max_velocity;
    if positive.max(negative) < MOVES {
        shortages.push(MotionShortage::Still {
            joint: name(),
            max_velocity: positive.max(negative),
        });
    } else if positive.min(negative) < MOVES {
        shortages.push(MotionShortage::OneDirection {
            joint: name(),
            is_positive: positive > negative,
        });
    }
    let std_dev = joint.gain_std_dev / joint.gain;
    if settings.gain_std_dev > 0.0 && std_dev > WIDENING * GAIN_DETERMINED * settings.gain_std_dev {
        shortages.push(MotionShortage::Gain {
            joint: name(),
            std_dev,
        });
    }
    shortages
}

/// The payload of each recording, zero where there is none.
fn payloads_of(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
    payloads: &[Vector],
) -> Vec<Vector> {
    let mut next = payloads.iter();
    let of_recording = |held: &Option<KnownPayload>| match held {
        Some(_) => next.next().copied().unwrap_or_default(),
        None => Vector::zeros(),
    };
    recordings
        .iter()
        .map(|(_, held)| held)
        .map(of_recording)
        .collect()
}

/// Returns the rms residual of each joint with the description alone and with the calibration.
fn residual_rms(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
    fitted: &Fitted,
) -> (Vec<f64>, Vec<f64>) {
    let joints = fitted.model.layout.joints;
    let (mut before, mut after) = (vec![0.0; joints], vec![0.0; joints]);
    let mut windows = 0.0;
    let payloads = payloads_of(recordings, &fitted.unknowns.payloads);
    for ((recording, _), payload) in recordings.iter().zip(&payloads) {
        let comparison = compare(&fitted.model, recording, &fitted.unknowns.arm, payload);
        let count = recording.windows() as f64;
        windows += count;
        let rms = [&comparison.described, &comparison.calibrated].map(|m| comparison.rms(m));
        for joint in 0..joints {
            before[joint] += count * rms[0][joint].powi(2);
            after[joint] += count * rms[1][joint].powi(2);
        }
    }
    let root = |sums: Vec<f64>| sums.into_iter().map(|sum| (sum / windows).sqrt()).collect();
    (root(before), root(after))
}

/// Returns the rms residual of each joint on sections that a second fit, with the same noise, does
/// not see; NaN where that fit fails.
fn held_out_rms(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
    fitted: &Fitted,
) -> Vec<f64> {
    let joints = fitted.model.layout.joints;
    let mut problem = problem(recordings, &fitted.model, fitted.prior.clone());
    let mut hidden = problem.blocks.clone();
    for (seen, hidden) in problem.blocks.iter_mut().zip(&mut hidden) {
        let section = seen.windows.len().div_ceil(SECTIONS).max(1);
        let is_held_out =
            |window: &usize| (window / section) % HELD_OUT_EVERY == HELD_OUT_EVERY / 2;
        seen.windows.retain(|window| !is_held_out(window));
        hidden.windows.retain(is_held_out);
    }
    let mut at = fitted.unknowns.clone();
    for _ in 0..HELD_OUT_PASSES {
        let normal = problem.normal_equations(&at, &fitted.noise);
        let Some(factor) = normal.matrix.cholesky() else {
            return vec![f64::NAN; joints];
        };
        problem.add(&mut at, &factor.solve(&normal.rhs));
    }
    let of_joint = |joint: usize| {
        let residuals = hidden
            .iter()
            .map(|block| last_column(&problem, block, joint, &at));
        let (count, squares) = residuals.fold((0, 0.0), |(count, squares), column| {
            (count + column.nrows(), squares + column.norm_squared())
        });
        (squares / count as f64).sqrt()
    };
    (0..joints).map(of_joint).collect()
}

/// Returns measured less modelled effort of a joint in the windows of a block.
fn last_column(
    problem: &Problem<'_>,
    block: &super::solver::Block<'_>,
    joint: usize,
    at: &super::rows::Unknowns,
) -> DMatrix<f64> {
    let rows = problem.rows(block, joint, at);
    rows.columns(rows.ncols() - 1, 1).into_owned()
}
