//! Poses at rest: the payload from wrenches in a few attitudes, without times.
//!
//! At rest the wrench of a payload depends on its mass, on its centre of mass and on the direction
//! of gravity in the sensor, and never on its inertia. Samples of one attitude are averaged into
//! one equation for each channel, because what repeats in them (hysteresis, a posture that is not
//! the commanded one, a drift) is no smaller in a hundred samples than in one. The noise is what is
//! left between poses, and the intervals are those of Student's t.
//!
//! With an unknown offset of the sensor, two attitudes determine the mass and three the centre of
//! mass; with a sensor whose zero was set, one and two do. Without a given direction of gravity,
//! one attitude more is needed. A pose that the others contradict is left out and reported.

mod advice;
mod assumptions;
mod far_center;
mod fit;
mod outliers;
mod pose_fit;
mod visits;

use std::collections::BTreeSet;

use nalgebra::Vector3;
use tactid_dynamics::{FrameMotion, Manipulator, Notice, Severity};
use tactid_identify::checks::PositionMonitor;
use tactid_identify::equations::{
    Equation, EquationSettings, EquationStream, Geometry, Instant, Model, Row, Sample, Unknowns,
    WRENCH,
};
use tactid_identify::solve::Matrix;
use tactid_identify::{IdentifyError, KnownBodies, KnownTool, Method, PayloadEstimate};

use self::advice::next_attitude;
use self::assumptions::{causes, equation_at_rest, is_far_better, mean};
use self::far_center::far_center;
use self::outliers::{WithoutOutliers, without_outliers};
use self::pose_fit::Poses;
use crate::attitudes::{Attitudes, are_same_attitude};
use crate::diagnosis::{mass_findings, nearest_consistent};
use crate::finding::{Finding, RestingPoses};
use crate::fit::GainErrors;
use crate::linear_estimate::{LinearEstimate, SharedErrors};
use crate::serial::Table;
use crate::solve::{Posterior, Report};
use crate::trajectory::MotionEstimate;
use crate::{BatchResult, FitReport};

/// The rows of the six channels of a wrench at rest.
type Rows = [Row; WRENCH];

/// Identifies a payload from wrenches at rest.
///
/// Only the attitudes of the samples count: their times, velocities and accelerations are not used.
/// Consecutive samples of one attitude are averaged to a pose. An attitude that is visited again is
/// another pose, which shows the noise, but not another attitude.
#[derive(Clone, Debug)]
pub struct RestIdentifier {
    frame: std::sync::Arc<str>,
    model: Model,
    /// Equations of samples with times, whose assumptions are those of the poses.
    stream: EquationStream,
    has_offset: bool,
    unknowns: Unknowns,
    known: KnownBodies,
    instant: Instant,
    positions: PositionMonitor,
    poses: Vec<Pose>,
    /// Number of samples that were pushed or skipped.
    rows: usize,
    rejected: u64,
}

/// Samples of one attitude that follow each other.
#[derive(Clone, Debug)]
struct Pose {
    /// Sum of the equations of the samples, in the tool frame.
    sum: Equation,
    samples: usize,
    /// Numbers of the first and the last of them among all samples, counted from one.
    rows: (usize, usize),
}

impl RestIdentifier {
    /// Creates an identifier for a robot whose end-effector frame is the link `tool` and whose
    /// wrenches are measured in the links `sensors`. `known_tool` is a body in the tool frame that
    /// the load contains besides the payload: it is subtracted.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`](tactid_identify::EquationStream::new),
    /// [`IdentifyError::Method`] for another method than the tactile one, and
    /// [`IdentifyError::Option`] if there is no gravity, or an unknown weight was subtracted, which
    /// at rest nothing shows.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        equations: &EquationSettings,
        known_tool: Option<KnownTool>,
    ) -> Result<Self, IdentifyError> {
        check_settings(equations)?;
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
            has_offset: equations.wrench_offset,
            unknowns: equations.unknowns,
            known: KnownBodies::new(None, known_tool),
            instant: Instant::new(robot.dof(), sensors.len()),
            model,
            positions: PositionMonitor::new(robot),
            poses: Vec::new(),
            rows: 0,
            rejected: 0,
        })
    }

    /// Counts a sample that cannot be used, so that findings name the others by their place among
    /// all.
    pub fn skip(&mut self) {
        self.rows += 1;
    }

    /// Adds one sample at rest. A sample with a number that is not finite, or has a magnitude of
    /// 1e30 or more, is counted and left out.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice does not fit the robot, and
    /// [`IdentifyError::Wrenches`] if the wrenches do not fit the sensors.
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<(), IdentifyError> {
        self.model.check_lengths(sample)?;
        self.rows += 1;
        if !sample.is_measurable() {
            self.rejected += 1;
            return Ok(());
        }
        self.instant.base = FrameMotion::at_rest(sample.base.pose);
        self.instant
            .joint_position
            .copy_from_slice(sample.joint_position);
        self.instant.wrenches.copy_from_slice(sample.wrenches);
        for (joint, position) in sample.joint_position.iter().enumerate() {
            self.positions.push(joint, 0.0, *position);
        }
        self.model.entries(&self.instant)?;
        let equation = equation_at_rest(&self.model);
        let down = self.down(&equation);
        let last = self.poses.last().map(|pose| self.down(&pose.sum));
        let is_same = last.is_some_and(|last| are_same_attitude(&last, &down));
        match self.poses.last_mut().filter(|_| is_same) {
            Some(pose) => {
                pose.sum.add_mean(&equation, 1.0);
                pose.samples += 1;
                pose.rows.1 = self.rows;
            }
            None => self.poses.push(Pose {
                sum: equation,
                samples: 1,
                rows: (self.rows, self.rows),
            }),
        }
        Ok(())
    }

    /// Solves for the payload.
    ///
    /// # Errors
    /// Returns [`IdentifyError::NoPose`] without a sample, and [`IdentifyError::Option`] for one
    /// attitude alone where the sensor has an unknown offset.
    pub fn solve(&self) -> Result<BatchResult, IdentifyError> {
        let poses = self.means();
        self.check(&poses.attitudes)?;
        let solution = without_outliers(&poses);
        let fit = &solution.found.fit;
        let (found, covariance) = self.known.payload(&fit.parameters, &fit.covariance, None);
        let metric = fit.null_space.across(&covariance);
        let consistent = nearest_consistent(found, &metric, fit.null_space.scales(), None);
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
        let findings = self.findings(&poses, &solution);
        Ok(BatchResult {
            estimate: PayloadEstimate {
                windows: self.poses.len() as u64,
                rejected: self.rejected,
                ..estimate
            },
            principal_moments,
            history: Vec::new(),
            load: None,
            linear: LinearEstimate {
                parameters: found,
                information: fit.information,
                covariance: fit.covariance,
                shared: SharedErrors::new(&GainErrors::zeros(0), self.known.errors()),
                degrees_of_freedom: fit.freedom.iter().copied().fold(f64::INFINITY, f64::min),
            },
            fit: self.fit_report(&solution),
            delay: None,
            findings,
            forecast: None,
        })
    }

    /// Returns the size of the residuals of the same wrenches in the attitudes of another
    /// identifier, relative to that in the own ones, where the other attitudes explain them far
    /// better; `None` where they do not, or the poses are too few to tell. The other attitudes
    /// count for so many `unknowns` that follow from the poses. With `is_exchanged`, the forces of
    /// the other one are the moments of this one, and its moments the forces.
    #[must_use]
    pub fn residual_ratio_of(
        &self,
        other: &Self,
        unknowns: usize,
        is_exchanged: bool,
    ) -> Option<f64> {
        let [own, other] = [self, other].map(|identifier| {
            let poses = identifier.means();
            identifier.check(&poses.attitudes).ok()?;
            Some(without_outliers(&poses).found.fit)
        });
        let (own, mut other) = (own?, other?);
        if is_exchanged {
            other.exchange_kinds();
        }
        (own.can_contradict() && other.can_contradict() && is_far_better(&other, &own, unknowns))
            .then(|| (other.squares(&other) / own.squares(&other)).sqrt())
    }

    /// Returns the direction of gravity in the tool frame, given a sum of equations.
    fn down(&self, sum: &Equation) -> Vector3<f64> {
        let geometry = Geometry::new(&sum.geometry);
        geometry.map_or(Vector3::zeros(), |geometry| {
            geometry.tool_from_world() * self.model.gravity()
        })
    }

    /// Returns the mean equations of the poses, with the attitude of each.
    fn means(&self) -> Poses<'_> {
        let mut attitudes = Attitudes::default();
        let number = |pose: &Pose| attitudes.number(&self.down(&pose.sum));
        let attitudes = self.poses.iter().map(number).collect();
        let mean = |pose: &Pose| mean(&pose.sum, pose.samples);
        Poses {
            equations: self.poses.iter().map(mean).collect(),
            attitudes,
            frame: self.model.offset_frame(),
            has_offset: self.has_offset,
            gravity: self.model.gravity(),
            unknowns: self.unknowns,
        }
    }

    fn check(&self, attitudes: &[usize]) -> Result<(), IdentifyError> {
        match attitudes.iter().max() {
            None => Err(IdentifyError::NoPose),
            Some(1) if self.has_offset && self.unknowns.gravity => Err(IdentifyError::Option {
                option: "gravity",
                what: "two attitudes do not determine the direction of gravity beside an offset of the sensor: \
                       measure in three or more"
                    .to_owned(),
            }),
            Some(0) if self.has_offset => Err(IdentifyError::Option {
                option: "wrench_offset",
                what: "all poses have one attitude to gravity, in which a weight and an offset of the \
                       sensor look alike: measure in two attitudes or more for the mass and in three or \
                       more for the centre of mass, or, if the zero of the sensor was set without the \
                       payload, set `wrench_offset` to \"no\""
                    .to_owned(),
            }),
            Some(_) => Ok(()),
        }
    }

    /// Returns what was noticed: wrong assumptions, or a mass that is none where there are none,
    /// then poses that do not fit.
    fn findings(&self, poses: &Poses<'_>, solution: &WithoutOutliers) -> Vec<Finding> {
        let fit = &solution.found.fit;
        let causes = causes(poses, solution, &self.stream);
        let mass = (
            fit.parameters[0],
            fit.std_dev(&Matrix::identity().row(0).into()),
        );
        let of_mass = || mass_findings(mass, self.known.mass_kg(), self.model.method(), true);
        let of_mass = causes.is_empty().then(of_mass).flatten();
        let is_empty = matches!(of_mass, Some(Finding::NothingHeld { .. }));
        let too_few = (is_empty && !fit.can_contradict()).then_some(Finding::TooFewPoses {
            poses: self.poses.len(),
        });
        let rows: Vec<_> = self.poses.iter().map(|pose| pose.rows).collect();
        let outliers = solution.outliers(&rows).into_iter();
        let beyond = self.positions.beyond_limits(f64::INFINITY);
        let of_units = beyond.map(Finding::PositionsBeyondLimits);
        let causes = causes.into_iter().map(Finding::WrongAssumption);
        let mut findings: Vec<Finding> = of_units
            .into_iter()
            .chain(far_center(fit, &self.frame).map(Finding::CenterFarAway))
            .chain(causes)
            .chain(too_few)
            .chain(of_mass)
            .chain(outliers.map(Finding::OutlyingPose))
            .collect();
        let mut severities = findings.iter().map(Notice::severity);
        let is_sound = severities.all(|severity| severity != Severity::Contradicts);
        let resting = self.resting(poses, solution, is_sound);
        findings.push(Finding::PosesAtRest(resting));
        findings.extend(self.model.findings().map(Finding::Model));
        findings
    }

    /// Returns what is known of the poses that are kept, with advice where their result is sound.
    fn resting(
        &self,
        poses: &Poses<'_>,
        solution: &WithoutOutliers,
        is_sound: bool,
    ) -> RestingPoses {
        let fit = &solution.found.fit;
        let kept: Vec<usize> = (0..self.poses.len())
            .filter(|pose| solution.kept[*pose])
            .collect();
        let attitudes: BTreeSet<usize> = kept.iter().map(|pose| poses.attitudes[*pose]).collect();
        let gravity_m_s2 = self.model.gravity().norm();
        let next = || next_attitude(fit, gravity_m_s2, self.model.offset_frame().map());
        let [force_noise, moment_noise] = fit.measured_noise();
        RestingPoses {
            attitudes: attitudes.len(),
            poses: kept.len(),
            samples: kept.iter().map(|pose| self.poses[*pose].samples).sum(),
            frame: self.model.offset_frame().name().to_string(),
            force_noise,
            moment_noise,
            next: is_sound.then(next),
        }
    }

    fn fit_report(&self, solution: &WithoutOutliers) -> FitReport {
        let WithoutOutliers { found, kept, .. } = solution;
        let (fit, rows) = (&found.fit, &found.rows);
        let table = |of: &dyn Fn(usize, usize) -> f64| Table {
            columns: WRENCH,
            values: (0..rows.len())
                .flat_map(|pose| (0..WRENCH).map(move |channel| (pose, channel)))
                .map(|(pose, channel)| of(pose, channel))
                .collect(),
        };
        let residual = |pose: usize, channel: usize| fit.residual(&rows[pose][channel], channel);
        let rms = |channel: usize| {
            let poses = (0..rows.len()).filter(|pose| kept[*pose]);
            let squares: Vec<f64> = poses.map(|pose| residual(pose, channel).powi(2)).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let excitation = fit.excitation();
        FitReport {
            channels: self.model.channels().channels,
            times_s: (0..rows.len()).map(|pose| pose as f64).collect(),
            measured: table(&|pose, channel| rows[pose][channel].target),
            predicted: table(&|pose, channel| rows[pose][channel].target - residual(pose, channel)),
            weights: kept.iter().map(|kept| f64::from(u8::from(*kept))).collect(),
            held_out: vec![false; rows.len()],
            residual_rms: (0..WRENCH).map(rms).collect(),
            held_out_rms: vec![f64::NAN; WRENCH],
            held_out_plain_rms: vec![f64::NAN; WRENCH],
            noise_fraction: [1.0; 10],
            excitation: excitation.strengths,
            excitation_directions: excitation.directions.iter().map(|v| (*v).into()).collect(),
            wrench_offset: self.has_offset.then(|| {
                let frame = self.model.offset_frame();
                frame.offset(&fit.offsets, Some(fit.offset_std_devs()))
            }),
            gravity: found.gravity_estimate(),
            subtracted_weight: None,
            motion: MotionEstimate::Smoothed,
            motion_until_s: None,
            stride_s: f64::NAN,
            cutoff_hz: f64::NAN,
        }
    }
}

/// Checks that nothing is used or unknown that poses at rest do not show.
fn check_settings(equations: &EquationSettings) -> Result<(), IdentifyError> {
    if equations.method != Method::Tactile {
        return Err(IdentifyError::Method(format!(
            "poses at rest are for the tactile method and not for the {} method",
            equations.method.name()
        )));
    }
    if equations.unknowns.weight {
        return Err(IdentifyError::Option {
            option: "configured_payload",
            what: "`configured_payload` is missing: at rest, a weight that was subtracted from the wrenches and that of \
                   the payload are one"
                .to_owned(),
        });
    }
    Ok(())
}
