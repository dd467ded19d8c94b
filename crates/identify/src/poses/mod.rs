//! Poses at rest: the payload from wrenches in a few attitudes, without times.
//!
//! At rest the wrench of a payload depends on its mass, on its centre of mass and on the direction of
//! gravity in the sensor, and never on its inertia. Samples of one attitude are averaged into one
//! equation for each channel, because what repeats in them (hysteresis, a posture that is not the
//! commanded one, a drift) is no smaller in a hundred samples than in one. The noise is what is left
//! between attitudes, and the intervals are those of Student's t.
//!
//! With an unknown offset of the sensor, two attitudes determine the mass and three the centre of
//! mass; with a sensor whose zero was set, one and two do.

mod advice;
mod assumptions;
mod fit;

use nalgebra::Vector3;
use tactid_dynamics::{FrameMotion, Manipulator};

use self::advice::next_attitude;
use self::assumptions::{causes, equation_at_rest, mean};
use self::fit::RestFit;
use crate::IdentifyError;
use crate::batch::{BatchResult, FitReport};
use crate::diagnosis::{CONTRADICTION, nearest_consistent, nothing_held};
use crate::equations::{
    Equation, EquationSettings, EquationStream, Geometry, Instant, Model, OffsetFrame, Row, Sample,
    WRENCH,
};
use crate::finding::{Finding, RestingPoses};
use crate::fit::GainErrors;
use crate::known_bodies::{KnownBodies, KnownTool};
use crate::linear_estimate::{LinearEstimate, SharedErrors};
use crate::result::PayloadEstimate;
use crate::serial::Table;
use crate::solve::report::{Posterior, Report};

/// Samples belong to one attitude as long as the direction of gravity in the tool is within this angle of
/// the first of them, rad: half a degree, more than the noise of encoders and of orientations, and
/// less than two attitudes of a calibration differ by.
const SAME_ATTITUDE_RAD: f64 = 0.009;

/// The rows of the six channels of a wrench at rest.
type Rows = [Row; WRENCH];

/// Identifies a payload from wrenches at rest.
///
/// Only the attitudes of the samples count: their times, velocities and accelerations are not used.
/// Consecutive samples of one attitude are averaged.
#[derive(Clone, Debug)]
pub struct RestIdentifier {
    frame: std::sync::Arc<str>,
    model: Model,
    /// Equations of samples with times, whose assumptions are those of the poses.
    stream: EquationStream,
    offset_frame: OffsetFrame,
    has_offset: bool,
    known: KnownBodies,
    instant: Instant,
    poses: Vec<Pose>,
    rejected: u64,
}

/// The samples of one attitude.
#[derive(Clone, Debug)]
struct Pose {
    /// Gravity at the first sample, in the tool frame, m/s².
    gravity: Vector3<f64>,
    /// Mean rows, in the frame of the offset.
    rows: Rows,
    /// Sum of the equations of the samples, in the tool frame.
    sum: Equation,
    samples: usize,
}

impl RestIdentifier {
    /// Creates an identifier for a robot whose end-effector frame is the link `tool` and whose wrenches
    /// are measured in the links `sensors`. `known_tool` is a body in the tool frame that the load
    /// contains besides the payload: it is subtracted.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`](crate::EquationStream::new), and
    /// [`IdentifyError::Option`] if there is no gravity.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        equations: &EquationSettings,
        known_tool: Option<KnownTool>,
    ) -> Result<Self, IdentifyError> {
        let mut model = Model::new(robot, tool, sensors, equations)?;
        model.keep_geometry();
        if model.gravity().norm() == 0.0 {
            return Err(IdentifyError::Option {
                option: "gravity",
                what: "`gravity` is zero: at rest, nothing but the weight shows the payload"
                    .to_owned(),
            });
        }
        Ok(Self {
            frame: tool.into(),
            stream: EquationStream::with_geometry(robot, tool, sensors, equations)?,
            offset_frame: OffsetFrame::new(robot, tool, sensors, &equations.unmeasured)?,
            has_offset: equations.wrench_offset,
            known: KnownBodies::new(None, known_tool),
            instant: Instant::new(robot.dof(), sensors.len()),
            model,
            poses: Vec::new(),
            rejected: 0,
        })
    }

    /// Adds one sample at rest. A sample with a number that is not finite, or has a magnitude of 1e30 or
    /// more, is counted and left out.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice does not fit the robot, and
    /// [`IdentifyError::Wrenches`] if the wrenches do not fit the sensors.
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<(), IdentifyError> {
        self.model.check_lengths(sample)?;
        if !sample.is_measurable() {
            self.rejected += 1;
            return Ok(());
        }
        self.instant.base = FrameMotion::at_rest(sample.base.pose);
        self.instant
            .joint_position
            .copy_from_slice(sample.joint_position);
        self.instant.wrenches.copy_from_slice(sample.wrenches);
        self.model.entries(&self.instant)?;
        let equation = equation_at_rest(&self.model);
        let in_tool = std::array::from_fn(|channel| equation.rows[channel]);
        let rows = self.offset_frame.mapped_rows(&in_tool);
        let geometry = Geometry::new(&equation.geometry);
        let gravity = geometry.map_or_else(Vector3::zeros, |geometry| {
            geometry.tool_from_world() * self.model.gravity()
        });
        match self.poses.last_mut() {
            Some(pose) if pose.gravity.angle(&gravity) < SAME_ATTITUDE_RAD => {
                pose.add(&rows, &equation);
            }
            _ => self.poses.push(Pose {
                gravity,
                rows,
                sum: equation,
                samples: 1,
            }),
        }
        Ok(())
    }

    /// Solves for the payload.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Wrenches`] without a sample, and [`IdentifyError::Option`] for one
    /// attitude alone where the sensor has an unknown offset.
    pub fn solve(&self) -> Result<BatchResult, IdentifyError> {
        self.check()?;
        let rows: Vec<Rows> = self.poses.iter().map(|pose| pose.rows).collect();
        let fit = RestFit::new(&rows, self.has_offset, self.offset_frame.measured());
        let (found, covariance) = self.known.payload(&fit.parameters, &fit.covariance, None);
        let consistent = nearest_consistent(found, &covariance, fit.null_space.scales(), None);
        let parameters = consistent.parameters;
        let posterior = Posterior {
            parameters,
            covariance,
            null_space: &fit.null_space,
            factors: fit.t_factors(&parameters),
        };
        let Report {
            estimate,
            principal_moments,
        } = posterior.report(&self.frame, &Default::default());
        let mut findings = self.data_findings(found[0], estimate.std_devs[0]);
        findings.push(Finding::PosesAtRest(self.resting(&fit, &rows)));
        findings.extend(self.model.findings().map(Finding::Model));
        Ok(BatchResult {
            estimate: PayloadEstimate {
                windows: rows.len() as u64,
                rejected: self.rejected,
                ..estimate
            },
            principal_moments,
            history: Vec::new(),
            linear: LinearEstimate {
                parameters: found,
                information: fit.information,
                covariance: fit.covariance,
                shared: SharedErrors::new(&GainErrors::zeros(0), self.known.errors()),
                degrees_of_freedom: fit.freedom.iter().copied().fold(f64::INFINITY, f64::min),
            },
            fit: self.fit_report(&fit, &rows),
            delay: None,
            findings,
            forecast: None,
        })
    }

    fn check(&self) -> Result<(), IdentifyError> {
        match self.poses.len() {
            0 => Err(IdentifyError::Wrenches(
                "no pose has a wrench and an attitude that can be used".to_owned(),
            )),
            1 if self.has_offset => Err(IdentifyError::Option {
                option: "wrench_offset",
                what: "all poses have one attitude to gravity, in which a weight and an offset of the \
                       sensor look alike: measure in two attitudes or more for the mass and in three or \
                       more for the centre of mass, or, if the zero of the sensor was set without the \
                       payload, set `wrench_offset` to \"no\""
                    .to_owned(),
            }),
            _ => Ok(()),
        }
    }

    /// Reports wrong assumptions, or a mass that is none where there are none.
    fn data_findings(&self, mass_kg: f64, std_dev_kg: f64) -> Vec<Finding> {
        let poses = self.poses.iter();
        let equations: Vec<Equation> = poses.map(|pose| mean(&pose.sum, pose.samples)).collect();
        let causes = causes(&equations, &self.stream);
        if causes.is_empty() {
            return self.mass_findings(mass_kg, std_dev_kg);
        }
        causes.into_iter().map(Finding::WrongAssumption).collect()
    }

    /// Reports a mass that is none.
    fn mass_findings(&self, mass_kg: f64, std_dev_kg: f64) -> Vec<Finding> {
        let (known_bodies_kg, _) = self.known.mass_kg();
        let negative = || {
            let is_negative = mass_kg < -CONTRADICTION * std_dev_kg;
            is_negative.then_some(if mass_kg + known_bodies_kg > 0.0 {
                Finding::KnownBodiesTooHeavy {
                    known_bodies_kg,
                    load_kg: mass_kg + known_bodies_kg,
                }
            } else {
                Finding::NegativeMass {
                    method: self.model.method(),
                    or_gravity: true,
                }
            })
        };
        let found = nothing_held(mass_kg, std_dev_kg).or_else(negative);
        found.into_iter().collect()
    }

    fn resting(&self, fit: &RestFit, rows: &[Rows]) -> RestingPoses {
        let gravity_m_s2 = self.model.gravity().norm();
        let next = next_attitude(fit, gravity_m_s2, self.offset_frame.map());
        let [force_noise, moment_noise] = fit.measured_noise();
        RestingPoses {
            attitudes: rows.len(),
            samples: self.poses.iter().map(|pose| pose.samples).sum(),
            frame: self.offset_frame.name().to_string(),
            has_offset: self.has_offset,
            force_noise,
            moment_noise,
            next_gravity: next.gravity,
            next_value: next.value.into(),
            next_fraction: next.fraction,
        }
    }

    fn fit_report(&self, fit: &RestFit, rows: &[Rows]) -> FitReport {
        let table = |of: &dyn Fn(usize, usize) -> f64| Table {
            columns: WRENCH,
            values: (0..rows.len())
                .flat_map(|pose| (0..WRENCH).map(move |channel| (pose, channel)))
                .map(|(pose, channel)| of(pose, channel))
                .collect(),
        };
        let residual = |pose: usize, channel: usize| fit.residual(&rows[pose][channel], channel);
        let rms = |channel: usize| {
            let squares = (0..rows.len()).map(|pose| residual(pose, channel).powi(2));
            (squares.sum::<f64>() / rows.len() as f64).sqrt()
        };
        let excitation = fit.excitation();
        FitReport {
            channels: self.model.channels().channels,
            times_s: (0..rows.len()).map(|pose| pose as f64).collect(),
            measured: table(&|pose, channel| rows[pose][channel].target),
            predicted: table(&|pose, channel| rows[pose][channel].target - residual(pose, channel)),
            weights: vec![1.0; rows.len()],
            held_out: vec![false; rows.len()],
            residual_rms: (0..WRENCH).map(rms).collect(),
            held_out_rms: vec![f64::NAN; WRENCH],
            held_out_plain_rms: vec![f64::NAN; WRENCH],
            noise_fraction: [1.0; 10],
            excitation: excitation.strengths,
            excitation_directions: excitation.directions.iter().map(|v| (*v).into()).collect(),
            wrench_offset: self.has_offset.then(|| {
                self.offset_frame
                    .offset(&fit.offsets, Some(fit.offset_std_devs()))
            }),
            gravity: None,
            subtracted_weight: None,
            stride_s: f64::NAN,
            cutoff_hz: f64::NAN,
        }
    }
}

impl Pose {
    /// Adds a sample to the mean.
    fn add(&mut self, rows: &Rows, equation: &Equation) {
        self.samples += 1;
        self.sum.add_mean(equation, 1.0);
        for (mean, row) in self.rows.iter_mut().zip(rows) {
            let mut difference = *row;
            difference.add(mean, -1.0);
            mean.add(&difference, 1.0 / self.samples as f64);
        }
    }
}
