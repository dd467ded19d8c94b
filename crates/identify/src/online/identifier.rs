//! The online identifier: one sample at a time, an estimate at any time.

use std::sync::Arc;

use nalgebra::Vector3;
use tactid_dynamics::Manipulator;

use super::contact_observer::ContactObserver;
use super::inputs::Inputs;
use super::least_squares::Assessment;
use super::payload_times::PayloadTimes;
use super::readout::Readout;
use super::recent_equations::RecentEquations;
use super::settings::OnlineSettings;
use super::stage::Stage;
use super::staged_update::StagedUpdate;
use crate::checks::SampleChecks;
use crate::equations::{EquationSettings, EquationStream, PushOutcome, Sample, clock_watch::Order};
use crate::solve::subspace::Matrix;
use crate::{IdentifyError, KnownBodies, PayloadEstimate, Range};

/// Identifies the payload of one robot from its samples, online.
///
/// The payload is a rigid body that is fixed in the end-effector frame. Its estimate, the
/// [`PayloadEstimate`], is expressed in that frame, in SI units: mass in kg, centre of mass in m,
/// inertia about the centre of mass in kg m², each with its standard deviation. The samples measure
/// motion and load, see [`Sample`] for frames and signs.
///
/// # Method
/// Motion and load enter linear equations of the ten inertial parameters, averaged over overlapping
/// windows. The average is a low-pass with the cutoff [`EquationSettings::cutoff_hz`] on both sides
/// of the equations, which adds no bias. Weighted least squares over all windows estimates the
/// parameters: the residuals determine the weights of the channels, the bias from noise in the
/// motion is corrected, and the result is projected onto physically consistent parameters wherever
/// the mass is positive.
///
/// # Assumptions
/// - The wrenches act on the payload and have no constant offset, unless
///   [`EquationSettings::wrench_offset`] makes the offset an unknown. A constant error biases the
///   estimate of the payload, and no interval shows it.
/// - Gravity and the kinematics of the robot are known.
/// - Noise is white within a window, or as slow as the residuals show.
///
/// # Uncertainty
/// The noise is estimated from the first 32 windows, 1 s at a cutoff of 10 Hz; until then the
/// intervals are rough. A value that the motion does not determine has an infinite standard
/// deviation, and so has everything but the mass while the mass is not known to a quarter. In
/// simulations with white noise, 1 of 40 000 values in the first seconds was off by more than six
/// standard deviations, and after a payload change less than 1 of a million
/// (`tests/payload_change.rs`).
///
/// # Payload changes
/// [`PushOutcome::PayloadChanged`] means that several windows in a row contradict the estimate by
/// more than noise, the uncertainty of the estimate and a model error of 3 % of the load explain.
/// All earlier windows are discarded, the noise is kept, and the values are unknown until a payload
/// explains at least eight windows: the sensor's zero is the one before, and a contact with the
/// payload before (a constant wrench in the tool and a weight without inertia) explains them worse.
/// Where the payload before explains them again, its estimate continues:
/// [`PushOutcome::PayloadReturned`]. At rest, and after 100 windows of a slow motion, a payload
/// that may be a contact is reported, but not [settled](Self::is_settled). A change well above the
/// noise is detected within 0.2 s at a cutoff of 10 Hz, a change below the noise of a window after
/// seconds, where the motion determines all ten parameters, or the change is the same in many
/// windows. A model that is wrong by far more than 3 %, or noise that grows suddenly, causes
/// alarms, too. A change by less than some 7 % of the load can pass unnoticed, because such an
/// error of the model could explain it: create a new identifier where the payload is known to
/// change. None is detected in the first 32 windows.
///
/// # Cost
/// Nothing is allocated after construction. A sample costs one pass over the bodies of the robot
/// and, at sample rates above 52 times the cutoff (520 Hz at a cutoff of 10 Hz), one of
/// [`DEFERRED_STAGES`](Self::DEFERRED_STAGES) stages of the update by the most recent window, so
/// that no sample takes much longer than others. Exceptions are three windows of the first second,
/// at which the noise is estimated. At lower rates fewer than 16 samples lie between the ends of
/// two windows, and the sample that ends a window costs all stages.
/// `cargo bench -p tactid-identify --bench update` measures the times.
///
/// # Example
/// A sensor that is swung by hand identifies the 2 kg that are mounted on it.
///
/// ```
/// use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
/// use rand::{RngExt, SeedableRng, rngs::SmallRng};
/// use rand_distr::StandardNormal;
/// use tactid_dynamics::{
///     FrameMotion, InertialParameters, Manipulator, MassProperties, Wrench, wrench_regressor,
/// };
/// use tactid_identify::{BaseState, EquationSettings, HALF_WIDTH_95, Identifier, Sample};
///
/// let robot = Manipulator::lone_body("flange"); // no arm: the base has the pose of the sensor
/// let gravity = Vector3::new(0.0, 0.0, -9.81); // m/s²
/// let settings = EquationSettings { gravity: Some(gravity), ..EquationSettings::default() };
/// let mut identifier = Identifier::new(&robot, "flange", &["flange"], &settings)?;
///
/// let payload = InertialParameters::from(MassProperties {
///     mass_kg: 2.0,
///     center_of_mass: Vector3::new(0.02, 0.0, 0.1), // m
///     inertia: Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, 0.005)), // kg m²
/// });
/// let mut random = SmallRng::seed_from_u64(0);
/// for k in 0..1500 {
///     let time_s = 0.002 * f64::from(k);
///     // The flange turns about the vertical by `a`, then about its own x axis by `b`.
///     let (sin, cos) = (|w: f64| (w * time_s).sin(), |w: f64| (w * time_s).cos());
///     let sine = |w: f64| [sin(w), w * cos(w), -w * w * sin(w)];
///     let ([a, da, dda], [b, db, ddb], [c, dc, ddc]) = (sine(4.0), sine(5.0), sine(6.0));
///     let (up, along) = (Vector3::z(), Vector3::new(0.1, 0.05, 0.02));
///     let turn = UnitQuaternion::from_scaled_axis(up * a);
///     let axis = turn * Vector3::x();
///     let rotation = turn * UnitQuaternion::from_scaled_axis(Vector3::x() * b);
///     let motion = FrameMotion {
///         pose: Isometry3::from_parts((along * c).into(), rotation),
///         velocity: along * dc,
///         angular_velocity: up * da + axis * db,
///         acceleration: along * ddc,
///         angular_acceleration: up * dda + axis * ddb + up.cross(&axis) * (da * db),
///     };
///     // The sensor measures the wrench on the payload, with noise of 0.1 N and 0.01 N m.
///     let exact = wrench_regressor(&motion.in_frame(&gravity)) * payload.as_vector();
///     let mut draw = || random.sample::<f64, _>(StandardNormal);
///     let mut noise = |std_dev: f64| Vector3::from_fn(|_, _| std_dev * draw());
///     let wrench = Wrench {
///         force: exact.fixed_rows::<3>(0) + noise(0.1),
///         moment: exact.fixed_rows::<3>(3) + noise(0.01),
///     };
///     let base = BaseState {
///         pose: motion.pose,
///         velocity: motion.velocity,
///         angular_velocity: motion.angular_velocity,
///         acceleration: None, // differentiated from the velocities
///         angular_acceleration: None,
///     };
///     identifier.push(&Sample {
///         time_s,
///         base,
///         joint_position: &[],
///         joint_velocity: &[],
///         joint_effort: &[],
///         wrenches: &[wrench],
///     })?;
/// }
/// identifier.finish();
/// let estimate = identifier.estimate();
/// assert_eq!(estimate.not_identifiable().count(), 0);
/// let half_width_kg = HALF_WIDTH_95 * estimate.std_devs[0];
/// assert!((estimate.body.mass_kg - 2.0).abs() < half_width_kg);
/// assert!(half_width_kg < 0.005);
/// # Ok::<(), tactid_identify::IdentifyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Identifier {
    /// `None` where samples are used as they are.
    inputs: Option<Box<Inputs>>,
    /// Sign of the measured wrenches, relative to that of those on the payload.
    pub(super) sign: f64,
    pub(super) frame: Arc<str>,
    pub(super) stream: EquationStream,
    pub(super) update: StagedUpdate,
    pub(super) recent: RecentEquations,
    pub(super) checks: SampleChecks,
    pub(super) contact: ContactObserver,
    /// Whether the caller says that the payload stays what it is.
    pub(super) is_held: bool,
    pub(super) times: PayloadTimes,
    /// Number of samples since the end of the most recent window.
    samples: u32,
    pub(super) windows: u64,
    /// Number of samples that were rejected before they were aligned.
    refused: u64,
}

impl Identifier {
    /// Number of stages of the update by one window. One stage runs with each sample after the end
    /// of the window, and the estimate changes with the last one, as a whole. Where it is not
    /// physically consistent, each sample after them takes one more step of the projection onto
    /// consistent parameters, until it has settled, and updates the report.
    ///
    /// All stages run with the sample that ends the window after a payload change, and where fewer
    /// than twice as many samples lie between the ends of two windows: at sample rates below 52
    /// times the cutoff, as 500 Hz at a cutoff of 10 Hz.
    pub const DEFERRED_STAGES: usize = Stage::COUNT;

    /// Creates an identifier for a robot whose end-effector frame is the link `tool` and whose
    /// wrenches are measured in the links `sensors`.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`](crate::EquationStream::new), and
    /// [`IdentifyError::Option`] for [`EquationSettings::unknowns`].
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        Self::with_settings(robot, tool, sensors, settings, &OnlineSettings::default())
    }

    /// Creates an identifier as [`new`](Self::new) does, with what is known beside the settings of
    /// the equations.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new), and [`IdentifyError::Option`] for a delay of more
    /// than a second.
    pub fn with_settings(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
        online: &OnlineSettings,
    ) -> Result<Self, IdentifyError> {
        settings.check_known()?;
        Range::ONLINE_DELAY_S.check("delay_s", &[online.delay_s])?;
        let counts = [robot.dof(), sensors.len()];
        let OnlineSettings {
            delay_s,
            wrench_acts_on,
            ..
        } = *online;
        let inputs = Inputs::new(counts, wrench_acts_on, delay_s, settings.max_gap_s);
        let stream = EquationStream::new(robot, tool, sensors, settings)?;
        let channels = stream.channels();
        Ok(Self {
            frame: tool.into(),
            sign: wrench_acts_on.sign(),
            inputs: (!inputs.are_direct()).then(|| Box::new(inputs)),
            update: StagedUpdate::new(&channels, stream.gripper_to_subtract(), online.known_tool)?,
            recent: RecentEquations::new(channels.count()),
            checks: SampleChecks::new(robot, robot.frame(tool)?, sensors, settings),
            is_held: false,
            times: PayloadTimes::new(),
            contact: ContactObserver::new(settings.cutoff_hz, stream.offset_frame().projection()),
            stream,
            samples: 0,
            windows: 0,
            refused: 0,
        })
    }

    /// Returns the gravitational acceleration that is assumed, in the inertial frame, m/s².
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        self.stream.gravity()
    }

    /// Adds one sample, and reports a payload change that the window which it ends shows.
    ///
    /// Cost: one pass over the bodies of the robot, and one of
    /// [`DEFERRED_STAGES`](Self::DEFERRED_STAGES) stages of the update by the most recent window;
    /// all stages at sample rates below 52 times the cutoff, where the sample ends a window. No
    /// allocation.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice does not fit the robot, and
    /// [`IdentifyError::Wrenches`] if the wrenches do not fit the sensors. Bad data are no error:
    /// see [`PushOutcome`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        self.push_with(sample, |_, _, _| {})
    }

    /// Adds one sample as [`push`](Self::push) does, and calls `then` after each sample that is
    /// complete with it, where there is a delay, or after this one: with this identifier, the
    /// sample, whose wrenches act on the payload at the time of its motion, and what it was.
    ///
    /// # Errors
    /// Returns the errors of [`push`](Self::push).
    pub fn push_with(
        &mut self,
        sample: &Sample<'_>,
        mut then: impl FnMut(&Self, &Sample<'_>, PushOutcome),
    ) -> Result<PushOutcome, IdentifyError> {
        let Some(mut inputs) = self.inputs.take() else {
            let outcome = self.push_aligned(sample)?;
            then(self, sample, outcome);
            return Ok(outcome);
        };
        let outcome = self.push_to(&mut inputs, sample, then);
        self.inputs = Some(inputs);
        outcome
    }

    /// Pushes the samples that are complete with this one.
    fn push_to(
        &mut self,
        inputs: &mut Inputs,
        sample: &Sample<'_>,
        mut then: impl FnMut(&Self, &Sample<'_>, PushOutcome),
    ) -> Result<PushOutcome, IdentifyError> {
        self.stream.model().check_lengths(sample)?;
        match inputs.push(sample) {
            Order::Rejected => {
                self.refused += 1;
                return Ok(PushOutcome::Rejected);
            }
            Order::Interrupted => self.stream.interrupt(),
            Order::Follows => {}
        }
        let mut outcome = PushOutcome::Used;
        while let Some(sample) = inputs.pop() {
            let of_sample = self.push_aligned(&sample)?;
            then(self, &sample, of_sample);
            if of_sample != PushOutcome::Used {
                outcome = of_sample;
            }
        }
        Ok(outcome)
    }

    /// Adds one sample whose wrenches act on the payload at the time of the motion.
    fn push_aligned(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        let (outcome, equation) = self.stream.push(sample)?;
        if outcome != PushOutcome::Rejected {
            self.samples = self.samples.saturating_add(1);
            self.checks.push(sample);
        }
        let ends_window = equation.is_some();
        if outcome == PushOutcome::Started {
            self.contact.start_stretch();
        } else if let Some(time_s) = self.stream.instant_s() {
            self.contact.push(time_s, self.stream.model());
        }
        Ok(if ends_window && !self.is_held {
            self.update_by_window(outcome)
        } else {
            self.update.proceed();
            outcome
        })
    }

    /// Begins the update by the window that the last sample ended.
    fn update_by_window(&mut self, outcome: PushOutcome) -> PushOutcome {
        let equation = self.stream.equation();
        let time_s = equation.time_s;
        let assessment = self.update.begin(equation);
        self.recent.push(equation);
        self.contact
            .observe_noise(equation, self.update.estimator());
        self.update.set_gripper(self.stream.gripper_to_subtract());
        self.windows += 1;
        // With fewer samples from window to window, all stages run with the one that ends it.
        let is_dense = std::mem::take(&mut self.samples) >= 2 * Self::DEFERRED_STAGES as u32;
        let outcome = match assessment {
            Assessment::Accepted(_) => outcome,
            Assessment::PayloadChanged => {
                self.times
                    .change(time_s, self.update.estimator().is_first_alarm());
                PushOutcome::PayloadChanged
            }
            Assessment::Contradicted => {
                self.times.since_s = time_s;
                outcome
            }
            Assessment::PayloadReturned => {
                self.times.return_to_before();
                PushOutcome::PayloadReturned
            }
        };
        // A payload change is reported together with the estimate that starts again.
        if outcome != PushOutcome::Used {
            self.recent.clear();
        }
        let starts_again = outcome != PushOutcome::Used || assessment == Assessment::Contradicted;
        if starts_again || !is_dense {
            self.finish();
        }
        outcome
    }

    /// Completes the update by the most recent window at once, so that [`estimate`](Self::estimate)
    /// includes it: after the last sample of a recording. The samples that follow would do the
    /// same.
    ///
    /// It does not refine the projection onto physically consistent parameters any further, as
    /// samples do after the last stage: where the projection has not settled, the reported body is
    /// that of its latest step.
    pub fn finish(&mut self) {
        self.update.finish();
    }

    /// Returns the estimate of the payload in the end-effector frame, without allocation.
    ///
    /// It includes a window [`DEFERRED_STAGES`](Self::DEFERRED_STAGES) samples after the window's
    /// end at the latest, or once [`finish`](Self::finish) has been called. The number of windows
    /// includes one from its end on, and those before a payload change.
    #[must_use]
    pub fn estimate(&self) -> PayloadEstimate {
        self.estimate_of(self.update.readout(), self.times.since_s)
    }

    /// Returns the estimate of the payload before the last [payload change](Self#payload-changes),
    /// as of the last window before the evidence of the change began, without allocation; `None`
    /// before a change, and where the payload had not been known long enough.
    #[must_use]
    pub fn estimate_before_change(&self) -> Option<PayloadEstimate> {
        let readout = self.update.before_change()?;
        Some(self.estimate_of(readout, self.times.since_before_s))
    }

    /// Returns the known bodies that the measured load contains besides the payload: the gripper of
    /// the robot's description where the method measures it, and the known tool.
    #[must_use]
    pub fn known_bodies(&self) -> KnownBodies {
        self.update.known()
    }

    /// Returns whether the estimate is one of the payload that is held now: at least 32 windows
    /// contribute to it, so that payload changes are detected, the most recent ones show no
    /// evidence of a change, and since the last change they show a payload that no contact could
    /// be.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.update.estimator().is_settled()
    }

    /// Returns the time from the last payload change to the last sample, s; infinite before a
    /// change, and zero where the clock has gone back behind it.
    #[must_use]
    pub fn time_since_change_s(&self) -> f64 {
        (self.newest_s() - self.times.changed_s).max(0.0)
    }

    /// Time of the last sample, s.
    pub(super) fn newest_s(&self) -> f64 {
        let inputs = self.inputs.as_ref();
        inputs.map_or(self.stream.time_s(), |inputs| inputs.newest_s())
    }

    fn estimate_of(&self, readout: &Readout, since_s: f64) -> PayloadEstimate {
        let (frame, described) = (self.frame.clone(), &readout.described);
        PayloadEstimate {
            composite: readout.composite,
            windows: self.windows,
            payload_changes: self.times.changes,
            since_s,
            rejected: self.stream.rejected() + self.refused,
            gaps: self.stream.gaps(),
            ..described.estimate(frame, readout.body, readout.is_physical)
        }
    }

    /// Returns the covariance of the payload's linear parameters, 10x10, in the order and units of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters).
    ///
    /// A direction that the motion does not determine has the variance of a parameter of plausible
    /// size: one whose load alone would be all that is measured, or that is as large as the
    /// estimate before the last payload change. `None` during the first seven windows, in which the
    /// noise is not known, and while nothing explains the windows since a payload change.
    #[must_use]
    pub fn covariance(&self) -> Option<Matrix> {
        self.update.readout().uncertainty.covariance
    }
}
