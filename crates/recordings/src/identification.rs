//! The result of an identification.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use tactid_batch::diagnosis::LEAST_WINDOWS;
use tactid_batch::{
    BatchIdentifier, BatchResult, Delay, Finding as Data, FitReport, Forecast, HistoryPoint,
    Hypothesis, LinearEstimate, LoadEstimate, PrincipalMoments,
};
use tactid_calibrate::{ArmChange, MotionShortage};
use tactid_dynamics::words::HALF_WIDTH_95;
use tactid_dynamics::{InertialParameters, Notice, Severity, Subject};
use tactid_identify::{BoundingBox, KnownMass, PayloadEstimate, serial::TenValues};

use crate::ShapeFit;
use crate::plan::Plan;
use crate::run::Run;
use crate::shortage::{check_windows, explain};
use crate::sources::proposes_weight;
use crate::{ActsOn, ArmChanged, Finding, PaperIdentification, RecordingError, RecordingReport};

/// A joint is reported as noisy above this misfit: three times the standard deviation of the
/// calibration. A payload of 4 kg whose motion is noisy reaches a misfit of 7 at the wrist of a
/// small arm.
const NOISY_MISFIT: f64 = 9.0;

/// A change of friction or gains since the calibration is reported from this rms over the joints, a
/// fraction. Friction changes by some percent while a robot moves; on the simulated arms of the
/// tests an interval contains what smaller changes do.
const NOTABLE_CHANGE: f64 = 0.05;

/// Largest mass of a body whose weight seems to be subtracted, relative to that of the payload,
/// with which nothing is: it changes the payload by less than a usual error of a sensor's gain.
const LARGEST_EXCLUDED: f64 = 0.05;

/// What an estimator found in a recording.
#[derive(Clone, Debug)]
pub enum Identified {
    /// The result of least squares.
    LeastSquares(Box<Identification>),
    /// The result of the paper's filter.
    Paper(Box<PaperIdentification>),
}

impl Identified {
    /// Returns the result of least squares; `None` for that of the paper's filter.
    #[must_use]
    pub fn into_least_squares(self) -> Option<Identification> {
        match self {
            Self::LeastSquares(found) => Some(*found),
            Self::Paper(_) => None,
        }
    }

    /// What was assumed of the recording, and what was noticed about it.
    #[must_use]
    pub fn recording(&self) -> &RecordingReport {
        match self {
            Self::LeastSquares(found) => &found.recording,
            Self::Paper(found) => &found.recording,
        }
    }
}

/// The payload that least squares identified from a recording, with how it was found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[schemars(extend("x-base" = "RecordingReport"))]
pub struct Identification {
    /// Payload at the end of the recording, in the frame `estimate.frame`.
    pub estimate: PayloadEstimate,
    /// Principal moments of inertia of the payload; `None` where its mass is zero.
    pub principal_moments: Option<PrincipalMoments>,
    /// What the recording says about the linear parameters, which [`combine`](crate::combine) takes
    /// of each of several recordings.
    #[schemars(extend("kept" = "memory"))]
    pub linear: LinearEstimate,
    /// Estimate over time, from the measurements alone where a shape is used.
    #[serde(serialize_with = "History::of")]
    #[schemars(with = "History", extend("kept" = "file"))]
    pub history: Vec<HistoryPoint>,
    /// What the recording says about all that its wrench sensors measure, for the compensation of a
    /// recording; `None` where it says nothing of an offset and a load: without wrenches, with a
    /// calibration, or for poses at rest.
    pub load: Option<LoadEstimate>,
    /// How well the payload explains the measurements. Its offset, as that of a finding, has the
    /// sign in which the sensor reports wrenches, whichever body these act on.
    pub fit: FitReport,
    /// Forecast of the uncertainty for a motion that goes on; `None` where the mass is zero, with a
    /// calibration, and with a shape.
    #[schemars(extend("kept" = "memory"))]
    pub forecast: Option<Forecast>,
    /// Delay as it was estimated; `None` where the request gave it, or where it cannot be
    /// estimated.
    pub estimated_delay: Option<Delay>,
    /// Whether the efforts of an unloaded recording were subtracted.
    pub subtracts_unloaded: bool,
    /// What the calibration of the arm contributed; `None` where the request has none.
    pub calibrated: Option<CalibratedFit>,
    /// Mass of the payload as the request gave it.
    pub known_mass: Option<KnownMass>,
    /// Box around the payload as the request gave it.
    pub bounding_box: Option<BoundingBox>,
    /// What the shape of the payload contributed; `None` where the request has none.
    pub shape: Option<ShapeFit>,
    /// What was assumed of the recording, and what was noticed about it.
    #[serde(flatten)]
    pub recording: RecordingReport,
}

/// The estimate over time.
#[derive(Serialize, JsonSchema)]
struct History {
    /// Times on the clock of the samples, s, (H,).
    times_s: Vec<f64>,
    /// The ten values at each point, in the order and the units of the estimate's, (H, 10).
    values: Vec<[f64; 10]>,
    /// Standard deviations in the units of the values, (H, 10): infinite where a value was not
    /// determined yet.
    std_devs: Vec<[f64; 10]>,
}

impl History {
    /// Serialises the points of a history.
    fn of<S: Serializer>(points: &[HistoryPoint], serializer: S) -> Result<S::Ok, S::Error> {
        let history = Self {
            times_s: points.iter().map(|point| point.time_s).collect(),
            values: points.iter().map(|point| point.values).collect(),
            std_devs: points.iter().map(|point| point.std_devs).collect(),
        };
        history.serialize(serializer)
    }
}

/// What a calibration of the arm contributed to an identification.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CalibratedFit {
    /// Names of the joints between base and tool.
    pub joints: Vec<String>,
    /// Mean square of the whitened residual of each joint, without a unit: about one where the
    /// effort is as noisy as in the calibration. Where it is larger, the noise of the joint is
    /// enlarged by so much.
    pub misfit: Vec<f64>,
    /// Fraction of the variance of each of the [ten values](crate::VALUE_NAMES) that is noise of
    /// this recording. The rest is what the calibration does not know of the arm, which no longer
    /// recording of the payload reduces.
    #[schemars(with = "TenValues<f64>")]
    pub noise_fraction: [f64; 10],
    /// Whether an unloaded recording updated the calibration first.
    pub updated_by_unloaded: bool,
    /// How the friction of the joints has changed since the calibration; `None` where the
    /// recordings do not show that it has.
    pub friction_change: Option<ArmChange>,
    /// How the gains of the joints have changed since the calibration; `None` where the recordings
    /// do not show that they have.
    pub gain_change: Option<ArmChange>,
}

impl CalibratedFit {
    /// Reports joints whose efforts are far noisier than in the calibration. That of a joint that
    /// is `still` there, and has no known friction, is no noise.
    fn noisy_joints(&self, still: &[&str]) -> Vec<Finding> {
        let joints = self.joints.iter().zip(&self.misfit);
        let noisy = joints.filter(|(_, misfit)| **misfit > NOISY_MISFIT);
        let (still, noisy): (Vec<_>, Vec<_>) =
            noisy.partition(|(joint, _)| still.contains(&joint.as_str()));
        let of_noise = (!noisy.is_empty()).then(|| Finding::EffortNoisier {
            joints: noisy.iter().map(|(joint, _)| (*joint).clone()).collect(),
            noise_ratios: noisy.iter().map(|(_, misfit)| misfit.sqrt()).collect(),
        });
        let of_still = still
            .into_iter()
            .map(|(joint, _)| Finding::JointUncalibrated {
                joint: joint.clone(),
            });
        of_noise.into_iter().chain(of_still).collect()
    }

    /// Reports friction and gains that have changed notably since the calibration.
    fn changes(&self) -> impl Iterator<Item = Finding> + '_ {
        type OfChange = fn(ArmChanged) -> Finding;
        let changes: [(OfChange, _); 2] = [
            (Finding::FrictionChanged, &self.friction_change),
            (Finding::GainsChanged, &self.gain_change),
        ];
        changes.into_iter().filter_map(|(finding, change)| {
            let change = change.as_ref()?;
            let joints = self.joints.iter().zip(&change.by_joint);
            let (joint, joint_change) = joints.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            (change.rms() > NOTABLE_CHANGE).then(|| {
                finding(ArmChanged {
                    change: change.rms(),
                    joint: joint.clone(),
                    joint_change: *joint_change,
                    has_unloaded: self.updated_by_unloaded,
                })
            })
        })
    }
}

/// Returns the joint that did not move in the recordings of a calibration.
fn still_joint(shortage: &MotionShortage) -> Option<&str> {
    match shortage {
        MotionShortage::Still { joint, .. } => Some(joint),
        MotionShortage::OneDirection { .. } | MotionShortage::Gain { .. } => None,
    }
}

/// Keeps of the joints that the model does not explain, the worst first, only the worst one that
/// moved in the calibration. The friction of the `still` joints is unknown, which another finding
/// reports.
fn keep_worst_unexplained(findings: &mut Vec<Data>, still: &[&str]) {
    let mut is_first = true;
    findings.retain(|finding| match finding {
        Data::LoadUnexplained(load) => {
            let joint = load.joint.as_deref();
            let is_known = joint.is_none_or(|joint| !still.contains(&joint));
            is_known && std::mem::take(&mut is_first)
        }
        _ => true,
    });
}

/// Returns whether a finding of the data is that of a wrong assumption, or may follow from one, and
/// says nothing of how the values of the result were found.
fn follows_from_assumptions(finding: &Finding) -> bool {
    match finding {
        Finding::Data(Data::WrongAssumption(found)) => !found.is_applied,
        Finding::Data(
            Data::NothingHeld { .. } | Data::NegativeMass { .. } | Data::KnownBodiesTooHeavy { .. },
        ) => true,
        Finding::Data(data) => {
            matches!(data.subject(), Subject::Assumption | Subject::Consequence)
        }
        _ => false,
    }
}

/// States the offset of the wrenches with the sign of wrenches that act on the sensor.
pub(crate) fn negate_offsets(result: &mut BatchResult) {
    if let Some(offset) = &mut result.fit.wrench_offset {
        *offset = offset.clone().negated();
    }
    result.findings.iter_mut().for_each(Data::negate_wrenches);
}

impl Identification {
    /// Solves for the payload of a recording that was run through.
    ///
    /// # Errors
    /// Returns the errors of [`check_windows`] and, of too few windows, those of [`explain`].
    pub(crate) fn new(
        plan: Plan<'_>,
        run: Run,
        batch: &BatchIdentifier,
    ) -> Result<Self, RecordingError> {
        check_windows(batch.windows(), batch.stream(), &plan, &run)?;
        let solved = batch.solve();
        let mut result = solved.map_err(|error| explain(error.into(), &plan, &run))?;
        if plan.request.wrench_acts_on == Some(ActsOn::Sensor) {
            negate_offsets(&mut result);
        }
        let gripper = batch.stream().gripper_to_subtract();
        let mut found = Self::assemble(plan, run, gripper, result);
        found.leave_out_excluded_weight(batch);
        Ok(found)
    }

    /// Leaves out the proposal that a driver has subtracted a weight where the data, which
    /// contradict nothing, exclude that.
    fn leave_out_excluded_weight(&mut self, batch: &BatchIdentifier) {
        let findings = &mut self.recording.findings;
        let mut severities = findings.iter().map(Notice::severity);
        let is_sound = severities.all(|severity| severity == Severity::Notes);
        if !is_sound || !findings.iter().any(proposes_weight) {
            return;
        }
        let largest_kg = LARGEST_EXCLUDED * self.estimate.body.mass_kg;
        let subtracted = batch.subtracted_weight();
        let is_excluded = subtracted.is_some_and(|weight| {
            weight.values[0].abs() + HALF_WIDTH_95 * weight.std_devs[0] < largest_kg
        });
        findings.retain(|finding| !(is_excluded && proposes_weight(finding)));
    }

    /// Returns the result of a payload that was identified with a calibration of the arm.
    pub(crate) fn of_calibrated(
        plan: Plan<'_>,
        run: Run,
        mut result: BatchResult,
        fit: CalibratedFit,
        shortages: &[MotionShortage],
    ) -> Self {
        let still: Vec<&str> = shortages.iter().filter_map(still_joint).collect();
        keep_worst_unexplained(&mut result.findings, &still);
        let mut found = Self::assemble(plan, run, None, result);
        found.recording.findings.extend(fit.noisy_joints(&still));
        found.recording.findings.extend(fit.changes());
        found.calibrated = Some(fit);
        found
    }

    /// Returns whether a measured twist is not the derivative of the pose, which explains whatever is
    /// wrong with the motion.
    pub(crate) fn motion_is_contradicted(&self) -> bool {
        let mut findings = self.recording.findings.iter();
        findings.any(|finding| matches!(finding, Finding::Data(Data::TwistContradicted { .. })))
    }

    /// Removes the wrong assumptions that were found as causes of an unexplained load, except those
    /// that the result already takes into account.
    pub(crate) fn remove_causes(&mut self) {
        let is_cause = |finding: &Finding| match finding {
            Finding::Data(Data::WrongAssumption(found)) => !found.is_applied,
            _ => false,
        };
        let findings = &mut self.recording.findings;
        findings.retain(|finding| !is_cause(finding));
    }

    /// Returns whether a finding can follow from measurements that are read wrongly, and the
    /// windows are enough to show it.
    pub(crate) fn follows_from_reading(&self) -> bool {
        self.fit.weights.len() >= LEAST_WINDOWS
            && self.recording.findings.iter().any(follows_from_assumptions)
    }

    /// Returns the fraction of the residuals that the first cause leaves which is not an offset.
    pub(crate) fn left_by_cause(&self) -> f64 {
        let mut causes = self.recording.findings.iter();
        let first = causes.find_map(|finding| match finding {
            Finding::Data(Data::WrongAssumption(found)) => {
                (found.cause != Hypothesis::Offset).then_some(found.residual_ratio)
            }
            _ => None,
        });
        first.unwrap_or(1.0)
    }

    /// Puts the finding of a wrong reading, if there is one, in the place of what follows from it.
    pub(crate) fn replace_consequences(&mut self, reading: Option<Finding>) {
        if let Some(reading) = reading {
            let findings = &mut self.recording.findings;
            findings.retain(|finding| !follows_from_assumptions(finding));
            findings.push(reading);
        }
    }

    fn assemble(
        plan: Plan<'_>,
        run: Run,
        gripper: Option<InertialParameters>,
        mut result: BatchResult,
    ) -> Self {
        let remaining_delay = result.delay.map(|rest| Delay {
            delay_s: plan.delay_s + rest.delay_s,
            std_dev_s: rest.std_dev_s,
        });
        let estimated_delay = remaining_delay.or(plan.estimated_delay);
        let corrected = estimated_delay.filter(|_| plan.delay_s != 0.0);
        let corrected = corrected.map(|estimated| Finding::DelayCorrected {
            applied_s: plan.delay_s,
            estimated_s: estimated.delay_s,
            std_dev_s: estimated.std_dev_s,
        });
        for finding in &mut result.findings {
            if let Data::LoadUnexplained(load) = finding {
                load.has_unloaded = plan.streams.unloaded;
            }
        }
        let of_data = result.findings.into_iter().map(Finding::Data);
        let mut found = Self {
            estimate: result.estimate,
            principal_moments: result.principal_moments,
            linear: result.linear,
            history: result.history,
            load: result.load,
            fit: result.fit,
            forecast: result.forecast,
            estimated_delay,
            subtracts_unloaded: plan.streams.unloaded,
            calibrated: None,
            known_mass: plan.request.known_mass(),
            bounding_box: plan.request.bounding_box,
            shape: None,
            recording: RecordingReport::new(
                plan,
                run,
                gripper,
                corrected.into_iter().chain(of_data),
            ),
        };
        if let Some(gravity) = &found.fit.gravity {
            found.recording.gravity_m_s2 = gravity.values.into();
        }
        found
    }
}
