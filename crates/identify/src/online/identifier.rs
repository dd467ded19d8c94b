//! The online identifier: one sample at a time, an estimate at any time.

use std::sync::Arc;

use nalgebra::Vector3;
use tactid_dynamics::{InertialParameters, Manipulator};

use super::estimator::Recursive;
use super::readout::Latest;
use crate::equations::{EquationSettings, EquationStream, PushOutcome, Sample};
use crate::result::values;
use crate::solve::consistency::ProjectionTracker;
use crate::solve::subspace::Matrix;
use crate::solve::uncertainty::identifiable;
use crate::{IdentifyError, PayloadEstimate};

/// What is left to do of the last window, a stage a sample: no sample then takes much longer than others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Estimate,
    Aim,
    Step,
    Look,
    /// Nearer to the nearest possible body.
    Approach,
}

/// With fewer samples to a window, all is done with the one that ends it.
const DENSE: u32 = 16;

/// Identifies the payload of one robot from its samples, online.
///
/// Both sides of the equations pass the same low-pass, [`EquationSettings::cutoff_hz`], in its causal form:
/// wrench and acceleration belong to each other exactly, whatever the sample rate.
///
/// The estimator is weighted least squares. It reports standard deviations, a physically consistent body
/// wherever the mass is positive, and a change of payload; channels are weighted by their own noise, and
/// the errors-in-variables bias is corrected. It assumes that noise is white within a window, or as slow
/// as its residuals show, and that the payload is rigid. It estimates the noise from the first 32 windows,
/// 1 s at 10 Hz; before that the intervals are rough and no change is detected.
///
/// Nothing is allocated after construction. What a window says is computed with the eight samples that
/// follow its end, and is then told as a whole: no sample takes much longer than others, but for the three
/// of the first second that teach the noise. Cost: `cargo bench -p tactid-identify`.
///
/// ```
/// use tactid_dynamics::{BaseKind, Manipulator};
/// use tactid_identify::{EquationSettings, Identifier};
///
/// # let urdf = r#"<robot name="arm"><link name="base"><inertial><mass value="9"/>
/// #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
/// #   <link name="tool0"><inertial><mass value="1"/>
/// #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
/// #   <joint name="hinge" type="continuous"><parent link="base"/><child link="tool0"/></joint></robot>"#;
/// let robot = Manipulator::from_urdf(urdf, BaseKind::Floating)?;
/// let mut identifier = Identifier::new(&robot, "tool0", &["tool0"], &EquationSettings::default())?;
/// // for each sample: identifier.push(&sample)?;
/// let estimate = identifier.estimate();
/// assert_eq!(estimate.windows, 0);
/// assert_eq!(estimate.not_identifiable().count(), 10); // nothing is known yet
/// # Ok::<(), tactid_identify::IdentifyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Identifier {
    frame: Arc<str>,
    stream: EquationStream,
    estimator: Recursive,
    possible: ProjectionTracker,
    stage: Stage,
    /// Samples since a window ended.
    samples: u32,
    /// The links below the tool, where the estimator finds them with the payload; at the window's end.
    gripper: Option<InertialParameters>,
    /// As of the last window that is done.
    latest: Latest,
    windows: u64,
    payload_changes: u64,
    since_s: f64,
}

impl Identifier {
    /// Creates an identifier for a robot whose end-effector frame is the link `tool` and whose wrenches are
    /// measured in the links `sensors`.
    ///
    /// # Errors
    /// A link that the robot does not have, a setting out of range, or a method that this robot does
    /// not allow.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        let stream = EquationStream::new(robot, tool, sensors, settings)?;
        let mut identifier = Self {
            frame: tool.into(),
            estimator: Recursive::new(&stream.channels())?,
            gripper: stream.gripper_to_subtract(),
            stream,
            possible: ProjectionTracker::new(),
            stage: Stage::Estimate,
            samples: 0,
            latest: Latest::nothing(),
            windows: 0,
            payload_changes: 0,
            since_s: f64::NEG_INFINITY,
        };
        identifier.finish();
        Ok(identifier)
    }

    /// Gravitational acceleration that is assumed, in the inertial frame, m/s².
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        self.stream.gravity()
    }

    /// Takes one sample.
    ///
    /// Cost: one pass over the robot's bodies, and one of eight deferred update stages of the last window; no
    /// allocation.
    ///
    /// # Errors
    /// Where a slice does not fit the robot or the sensors. Bad data are no error: see [`PushOutcome`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        let (outcome, equation) = self.stream.push(sample)?;
        let ended = equation.map(|equation| (self.estimator.update(equation), equation.time_s));
        self.samples = self.samples.saturating_add(1);
        let Some((changed, time_s)) = ended else {
            self.proceed();
            return Ok(outcome);
        };
        self.windows += 1;
        if changed {
            self.payload_changes += 1;
            self.since_s = time_s;
        }
        self.stage = Stage::Estimate;
        self.gripper = self.stream.gripper_to_subtract();
        let is_dense = std::mem::take(&mut self.samples) >= DENSE;
        // A change is reported together with the estimate that starts again.
        if changed || !is_dense {
            self.finish();
        }
        Ok(if changed {
            PushOutcome::PayloadChanged
        } else {
            outcome
        })
    }

    /// Completes the deferred work of the last window at once, so that [`estimate`](Self::estimate) includes
    /// it: after the last sample of a recording. The samples that follow would do the same.
    pub fn finish(&mut self) {
        while self.stage != Stage::Approach {
            self.proceed();
        }
    }

    fn proceed(&mut self) {
        match self.stage {
            Stage::Estimate => {
                if !self.estimator.proceed() {
                    self.stage = Stage::Aim;
                }
            }
            Stage::Aim => {
                self.aim();
                self.stage = Stage::Step;
            }
            Stage::Step => {
                self.possible.step();
                self.stage = Stage::Look;
            }
            Stage::Look => {
                let possible = self.possible.parameters();
                let gripper = self.gripper.as_ref();
                self.latest = Latest::of_least_squares(&self.estimator, &possible, gripper);
                self.stage = Stage::Approach;
            }
            Stage::Approach if self.possible.is_settled() => {}
            Stage::Approach => {
                self.possible.step();
                self.latest.move_to(&self.possible.parameters());
            }
        }
    }

    /// Sets the possible body on its way to what the estimator has found.
    fn aim(&mut self) {
        let gripper = self.gripper.unwrap_or_else(InertialParameters::zero);
        let payload = self.estimator.parameters() - gripper.as_vector();
        self.possible
            .set_estimate(&payload, &self.estimator.information());
    }

    /// The payload as known now. A window counts from the eighth sample after its end on, or once
    /// [finished](Self::finish). No allocation.
    #[must_use]
    pub fn estimate(&self) -> PayloadEstimate {
        let body = self.latest.body;
        let std_devs = self.latest.certainty.std_devs;
        PayloadEstimate {
            frame: self.frame.clone(),
            body,
            composite: self.latest.composite,
            identifiable: identifiable(&values(&body), &std_devs),
            std_devs: Some(std_devs),
            is_physical: self.latest.is_physical,
            windows: self.windows,
            payload_changes: self.payload_changes,
            since_s: self.since_s,
            rejected: self.stream.rejected(),
            gaps: self.stream.gaps(),
        }
    }

    /// Covariance of the payload's linear parameters, 10x10, in the order and units of
    /// [`InertialParameters`], in the directions that the motion determined.
    #[must_use]
    pub fn covariance(&self) -> Matrix {
        self.latest.certainty.covariance
    }

    /// Offset of the sum of the wrenches, in the end-effector's frame and about its origin: force in N, then
    /// moment in N m. `None` unless [`EquationSettings::wrench_offset`] asks for it.
    #[must_use]
    pub fn wrench_offset(&self) -> Option<[f64; 6]> {
        self.estimator.offsets()
    }
}
