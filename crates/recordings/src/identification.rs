//! The result of an identification.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use tactid_calibrate::{ArmChange, MotionShortage};
use tactid_identify::{
    BatchIdentifier, BatchResult, BoundingBox, Delay, Finding as Data, FitReport, Forecast,
    HistoryPoint, IdentifyError, KnownMass, LinearEstimate, Method, PayloadEstimate,
    PrincipalMoments,
    serial::{self, TenValues},
};

use crate::paper::{PaperSettings, SingularValues};
use crate::plan::Plan;
use crate::run::{PaperRun, Run, Solver};
use crate::shortage::{explain, is_too_little};
use crate::{ActsOn, ArmChanged, Clock, DataFault, Estimator, Finding, RecordingError};

/// A joint is reported as noisy above this misfit: three times the standard deviation of the calibration. A payload of 4 kg
/// whose motion is noisy reaches a misfit of 7 at the wrist of a small arm.
const NOISY_MISFIT: f64 = 9.0;

/// A change of friction or gains since the calibration is reported from this rms over the joints, a fraction. Friction changes by
/// some percent while a robot moves; on the simulated arms of the tests an interval contains what smaller changes do.
const NOTABLE_CHANGE: f64 = 0.05;

/// The payload that was identified from a recording, with how it was found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Identification {
    /// Payload at the end of the recording, in the frame `estimate.frame`.
    pub estimate: PayloadEstimate,
    /// Principal moments of inertia of the payload; `None` where its mass is zero.
    pub principal_moments: Option<PrincipalMoments>,
    /// What the recording says about the linear parameters, which [`combine`](crate::combine) takes of each of several
    /// recordings; `None` for the paper's filter, and where the reading was interrupted before there was an estimate.
    #[schemars(extend("kept" = "memory"))]
    pub linear: Option<LinearEstimate>,
    /// Estimate over time. The paper's filter has a point at least every 0.1 s of each presentation.
    #[serde(serialize_with = "History::of")]
    #[schemars(with = "History", extend("kept" = "file"))]
    pub history: Vec<HistoryPoint>,
    /// How well the payload explains the measurements; `None` for the paper's filter. Its offset, as that of a finding,
    /// has the sign in which the sensor reports wrenches, whichever body these act on.
    pub fit: Option<FitReport>,
    /// Strength with which the motion excited mass and inertia; for the paper's filter only.
    pub singular_values: Option<SingularValues>,
    /// Forecast of the uncertainty for a motion that goes on; `None` for the paper's filter.
    #[schemars(extend("kept" = "memory"))]
    pub forecast: Option<Forecast>,
    /// Measurements that were used.
    pub method: Method,
    /// Estimator that was used.
    #[serde(serialize_with = "name_of")]
    #[schemars(with = "EstimatorName")]
    pub estimator: Estimator,
    /// Settings of the paper's filter; `None` for least squares.
    pub paper_settings: Option<PaperSettings>,
    /// Cutoff of the low-pass on both sides of the equations, Hz.
    pub cutoff_hz: f64,
    /// Longest time between two samples that was bridged, s.
    pub max_gap_s: f64,
    /// Gravitational acceleration that was assumed, in the inertial frame, m/s².
    #[serde(with = "serial::vector")]
    #[schemars(with = "[f64; 3]")]
    pub gravity_m_s2: Vector3<f64>,
    /// Delay of the wrenches' stamps that was corrected, s; positive where they are later than the motion.
    pub delay_s: f64,
    /// Delay as it was estimated; `None` where the request gave it, or where it cannot be estimated.
    pub estimated_delay: Option<Delay>,
    /// Whether the efforts of an unloaded recording were subtracted.
    pub subtracts_unloaded: bool,
    /// What the calibration of the arm contributed; `None` where the request has none.
    pub calibrated: Option<CalibratedFit>,
    /// Mass of the payload as the request gave it.
    pub known_mass: Option<KnownMass>,
    /// Box around the payload as the request gave it.
    pub bounding_box: Option<BoundingBox>,
    /// Where the times came from.
    pub clock: Clock,
    /// Time zero of the recording, ns since the epoch of its clock; 0 for arrays.
    pub start_ns: i64,
    /// Time from the first aligned sample to the last, s.
    pub duration_s: f64,
    /// Messages and samples that could not be used, counted by topic and kind.
    #[serde(serialize_with = "added_later")]
    #[schemars(with = "Vec<OpaqueFault>")]
    pub faults: Vec<DataFault>,
    /// What a reader of the result should know.
    #[serde(serialize_with = "added_later")]
    #[schemars(with = "Vec<OpaqueFinding>")]
    pub findings: Vec<Finding>,
    /// Whether the observer stopped the reading before the end.
    pub interrupted: bool,
    /// Where the log could not be read further, and why: an entry for each file that ends early.
    pub damage: Vec<String>,
}

/// The estimate over time.
#[derive(Serialize, JsonSchema)]
struct History {
    /// Index of the presentation of the recording to the paper's filter that each point belongs to, (H,); 0 for least squares.
    epoch: Vec<u32>,
    /// Times on the clock of the samples, s, (H,). They begin again with each epoch.
    times_s: Vec<f64>,
    /// The ten values at each point, in the order and the units of the estimate's, (H, 10); not averaged.
    values: Vec<[f64; 10]>,
    /// Standard deviations of the values, (H, 10): infinite where a value was not determined yet, and unknown for the paper's
    /// filter.
    std_devs: Vec<[f64; 10]>,
}

impl History {
    /// Serialises the points of a history.
    fn of<S: Serializer>(points: &[HistoryPoint], serializer: S) -> Result<S::Ok, S::Error> {
        let std_devs = |point: &HistoryPoint| point.std_devs.unwrap_or([f64::NAN; 10]);
        let history = Self {
            epoch: points.iter().map(|point| point.epoch).collect(),
            times_s: points.iter().map(|point| point.time_s).collect(),
            values: points.iter().map(|point| point.values).collect(),
            std_devs: points.iter().map(std_devs).collect(),
        };
        history.serialize(serializer)
    }
}

/// A finding, in a schema.
#[derive(JsonSchema)]
#[schemars(rename = "Finding")]
struct OpaqueFinding {}

/// A fault, in a schema.
#[derive(JsonSchema)]
#[schemars(rename = "DataFault")]
struct OpaqueFault {}

/// Serialises nothing.
fn added_later<T, S: Serializer>(_: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(std::iter::empty::<()>())
}

/// Name of an estimator.
#[derive(Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum EstimatorName {
    LeastSquares,
    Nlms,
}

fn name_of<S: Serializer>(estimator: &Estimator, serializer: S) -> Result<S::Ok, S::Error> {
    let name = match estimator {
        Estimator::LeastSquares => EstimatorName::LeastSquares,
        Estimator::Paper(_) => EstimatorName::Nlms,
    };
    name.serialize(serializer)
}

/// What a calibration of the arm contributed to an identification.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CalibratedFit {
    /// Names of the joints between base and tool.
    pub joints: Vec<String>,
    /// Mean square of the whitened residual of each joint, without a unit: about one where the effort is as noisy as in the calibration.
    /// Where it is larger, the noise of the joint is enlarged by so much.
    pub misfit: Vec<f64>,
    /// Fraction of the variance of each of the [ten values](crate::VALUE_NAMES) that is noise of this recording. The rest
    /// is what the calibration does not know of the arm, which no longer recording of the payload reduces.
    #[schemars(with = "TenValues<f64>")]
    pub noise_fraction: [f64; 10],
    /// Whether an unloaded recording updated the calibration first.
    pub updated_by_unloaded: bool,
    /// How the friction of the joints has changed since the calibration; `None` where the recordings do not show that it has.
    pub friction_change: Option<ArmChange>,
    /// How the gains of the joints have changed since the calibration; `None` where the recordings do not show that they have.
    pub gain_change: Option<ArmChange>,
}

impl CalibratedFit {
    /// Reports joints whose efforts are far noisier than in the calibration. That of a joint that is `still` there, and
    /// has no known friction, is no noise.
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

/// Keeps of the joints that the model does not explain, the worst first, only the worst one that moved in the calibration. The
/// friction of the `still` joints is unknown, which another finding reports.
fn keep_worst_unexplained(findings: &mut Vec<Finding>, still: &[&str]) {
    let mut is_first = true;
    findings.retain(|finding| match finding {
        Finding::Data(Data::LoadUnexplained(load)) => {
            let joint = load.joint.as_deref();
            let is_known = joint.is_none_or(|joint| !still.contains(&joint));
            is_known && std::mem::take(&mut is_first)
        }
        _ => true,
    });
}

/// What an estimator found.
struct Solution {
    estimate: PayloadEstimate,
    principal_moments: Option<PrincipalMoments>,
    linear: Option<LinearEstimate>,
    history: Vec<HistoryPoint>,
    fit: Option<FitReport>,
    singular_values: Option<SingularValues>,
    forecast: Option<Forecast>,
    gravity: Vector3<f64>,
    /// Delay that is left in the aligned samples.
    remaining_delay: Option<Delay>,
    findings: Vec<Finding>,
}

impl Solution {
    fn of_batch(result: BatchResult, gravity: Vector3<f64>) -> Self {
        Self {
            estimate: result.estimate,
            principal_moments: result.principal_moments,
            linear: Some(result.linear),
            history: result.history,
            fit: Some(result.fit),
            singular_values: None,
            forecast: result.forecast,
            gravity,
            remaining_delay: result.delay,
            findings: result.findings.into_iter().map(Finding::Data).collect(),
        }
    }

    /// Solves for the payload; of too few windows nothing is known where the reading was interrupted.
    fn of_least_squares(batch: &BatchIdentifier, interrupted: bool) -> Result<Self, IdentifyError> {
        let gravity = batch.stream().gravity();
        match batch.solve() {
            Ok(result) => Ok(Self::of_batch(result, gravity)),
            Err(error) if interrupted && is_too_little(&error) => Ok(Self {
                estimate: batch.unknown(),
                principal_moments: None,
                linear: None,
                history: Vec::new(),
                fit: None,
                singular_values: None,
                forecast: None,
                gravity,
                remaining_delay: None,
                findings: Vec::new(),
            }),
            Err(error) => Err(error),
        }
    }

    /// States the offset of the wrenches with the sign of wrenches that act on the sensor.
    fn negate_offsets(&mut self) {
        let of_fit = self.fit.iter_mut();
        for offset in of_fit.filter_map(|fit| fit.wrench_offset.as_mut()) {
            *offset = offset.clone().negated();
        }
        for finding in &mut self.findings {
            if let Finding::Data(Data::OffsetSuspected { values, .. }) = finding {
                *values = values.map(|value| -value);
            }
        }
    }

    fn of_paper(run: &PaperRun) -> Self {
        let estimate = run.estimate();
        Self {
            principal_moments: PrincipalMoments::of(&estimate.body.into()),
            estimate,
            linear: None,
            history: run.history.clone(),
            fit: None,
            singular_values: Some(run.filter.singular_values()),
            forecast: None,
            gravity: run.filter.stream().gravity(),
            remaining_delay: None,
            findings: run.findings(),
        }
    }
}

impl Identification {
    /// Solves for the payload of a recording that was run through.
    ///
    /// # Errors
    /// Returns [`RecordingError::NoOverlap`] if the streams share no time and, if the windows are too few and the reading
    /// was not interrupted, the variant that says why: [`RecordingError::TimesNotIncreasing`],
    /// [`RecordingError::TooManyGaps`], [`RecordingError::RareSamples`] or [`IdentifyError::TooFewWindows`].
    pub(crate) fn new(plan: Plan<'_>, run: Run, solver: &Solver) -> Result<Self, RecordingError> {
        if solver.windows() == 0 && !run.interrupted {
            let nothing = no_overlap(&plan, &run)
                .unwrap_or_else(|| RecordingError::Identify(solver.stream().too_few_windows(0)));
            return Err(explain(nothing, &plan, &run));
        }
        let mut solution = match solver {
            Solver::LeastSquares(batch) => Solution::of_least_squares(batch, run.interrupted)
                .map_err(|error| explain(error.into(), &plan, &run))?,
            Solver::Paper(paper) => Solution::of_paper(paper),
        };
        if plan.request.wrench_acts_on == Some(ActsOn::Sensor) {
            solution.negate_offsets();
        }
        Ok(Self::assemble(plan, run, solution))
    }

    /// Returns the result of a payload that was identified with a calibration of the arm.
    pub(crate) fn of_calibrated(
        plan: Plan<'_>,
        run: Run,
        result: BatchResult,
        fit: CalibratedFit,
        shortages: &[MotionShortage],
    ) -> Self {
        let still: Vec<&str> = shortages.iter().filter_map(still_joint).collect();
        let gravity = plan.equations.gravity_for(plan.sources.robot.base_kind());
        let mut solution = Solution::of_batch(result, gravity);
        keep_worst_unexplained(&mut solution.findings, &still);
        solution.findings.extend(fit.noisy_joints(&still));
        solution.findings.extend(fit.changes());
        Self {
            calibrated: Some(fit),
            ..Self::assemble(plan, run, solution)
        }
    }

    fn assemble(plan: Plan<'_>, run: Run, solution: Solution) -> Self {
        let sources = plan.sources;
        let remaining_delay = solution.remaining_delay.map(|rest| Delay {
            delay_s: plan.delay_s + rest.delay_s,
            std_dev_s: rest.std_dev_s,
        });
        let estimated_delay = remaining_delay.or(plan.estimated_delay);
        let mut findings = sources.findings.clone();
        findings.extend(plan.findings);
        findings.extend(run.findings);
        if let Some(estimated) = estimated_delay.filter(|_| plan.delay_s != 0.0) {
            findings.push(Finding::DelayCorrected {
                applied_s: plan.delay_s,
                estimated_s: estimated.delay_s,
                std_dev_s: estimated.std_dev_s,
            });
        }
        findings.extend(solution.findings);
        for finding in &mut findings {
            if let Finding::Data(Data::LoadUnexplained(load)) = finding {
                load.has_unloaded = plan.streams.unloaded;
            }
        }
        Self {
            estimate: solution.estimate,
            principal_moments: solution.principal_moments,
            linear: solution.linear,
            history: solution.history,
            fit: solution.fit,
            singular_values: solution.singular_values,
            forecast: solution.forecast,
            method: plan.equations.method,
            estimator: plan.estimator,
            paper_settings: match plan.estimator {
                Estimator::LeastSquares => None,
                Estimator::Paper(settings) => Some(settings),
            },
            cutoff_hz: plan.equations.cutoff_hz,
            max_gap_s: plan.equations.max_gap_s,
            gravity_m_s2: solution.gravity,
            delay_s: plan.delay_s,
            estimated_delay,
            subtracts_unloaded: plan.streams.unloaded,
            calibrated: None,
            known_mass: plan.request.known_mass(),
            bounding_box: plan.request.bounding_box,
            clock: sources.clock,
            start_ns: sources.start_ns,
            duration_s: run.duration_s,
            faults: run.faults.to_vec(),
            findings,
            interrupted: run.interrupted,
            damage: run.damage,
        }
    }
}

/// Returns the error that the streams of a recording share no time; `None` where they do.
pub(crate) fn no_overlap(plan: &Plan<'_>, run: &Run) -> Option<RecordingError> {
    let unused = plan.sources.optional_acceleration.as_ref();
    let unused = unused.filter(|_| !plan.streams.acceleration);
    let names = plan.sources.names.iter();
    let used = names.filter(|name| Some(*name) != unused);
    (run.samples == 0).then(|| RecordingError::NoOverlap {
        topics: used.cloned().collect(),
        delay_s: plan.request.delay_s.unwrap_or(0.0),
        faults: run.faults.to_vec(),
    })
}
