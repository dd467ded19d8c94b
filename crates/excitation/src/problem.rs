//! What is to be designed: the robot, what it measures, what it holds, what is to be known, and what limits the motion.

use tactid_dynamics::{BaseKind, InertialParameters, Manipulator};
use tactid_identify::{EquationSettings, largest_of_kind, values_of_body};

use crate::ExcitationError;
use crate::grip::Grip;
use crate::joint_limits::JointLimits;
use crate::spline::End;

/// What the robot measures, and how the payload is identified from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensing {
    /// Links in which wrenches are measured.
    pub sensors: Vec<String>,
    /// Method, filter and noise of the sensors. The noise of each source that the method uses must be known: that of the
    /// wrenches, of the efforts, and [`base_noise`](Self::base_noise). Uncertain gains are not part of a prediction.
    pub equations: EquationSettings,
    /// Samples per second, Hz.
    pub rate_hz: f64,
    /// Standard deviations of the white noise of one sample of the wrench that follows from the motion of a floating base:
    /// three forces, N, and three moments, N m. The combined method on a floating base and joint sensing use it.
    pub base_noise: Option<[f64; 6]>,
}

/// What a design minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// The largest ratio of a predicted 95 % interval to its target.
    #[default]
    LargestInterval,
    /// The volume of the confidence ellipsoid of the ten parameters (D-optimality).
    Volume,
}

/// Bounds on the motion of a free-floating base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BaseBounds {
    /// Largest angle by which the base may turn from where it starts, rad.
    pub attitude_rad: Option<f64>,
    /// Largest distance by which the origin of the base may move from where it starts, m.
    pub position_m: Option<f64>,
}

/// A motion to be designed.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The robot. A floating base starts at rest and nothing acts on it from outside.
    pub robot: Manipulator,
    /// Link in whose frame the payload is described.
    pub tool: String,
    /// Positions of all joints at the beginning, rad or m.
    pub start: Vec<f64>,
    /// Where the motion ends. Default: where it starts.
    pub end: End,
    /// Indices of the joints that may move; empty for those that move the tool.
    pub joints: Vec<usize>,
    /// Duration, s.
    pub duration_s: f64,
    /// Limits of all joints.
    pub limits: Vec<JointLimits>,
    /// What is measured.
    pub sensing: Sensing,
    /// Payloads in the tool frame for which all limits must hold. The first is the one that the information is predicted
    /// for.
    pub payloads: Vec<InertialParameters>,
    /// Targets for the half widths of the 95 % intervals, in the order and the units of
    /// [`VALUE_NAMES`](tactid_identify::VALUE_NAMES).
    pub targets: [f64; 10],
    /// What is minimised.
    pub criterion: Criterion,
    /// Bounds on the motion of a floating base.
    pub base: BaseBounds,
    /// Largest magnitudes of the wrench on the payload in the tool frame: three forces, N, and three moments, N m.
    pub wrench: Option<[f64; 6]>,
    /// The grip whose friction must hold the payload.
    pub grip: Option<Grip>,
}

/// Returns targets for the half widths of the 95 % intervals of the ten values: a fraction, such as 0.01, of the largest
/// value of its kind (mass, centre of mass, inertia). `None` for a payload without mass.
#[must_use]
pub fn targets_within(payload: &InertialParameters, fraction: f64) -> Option<[f64; 10]> {
    let values = values_of_body(&payload.mass_properties()?);
    Some(largest_of_kind(&values).map(|largest| fraction * largest))
}

impl Problem {
    /// Returns the indices of the joints that move.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Model`] if the robot does not have the tool's link.
    pub fn moving_joints(&self) -> Result<Vec<usize>, ExcitationError> {
        if !self.joints.is_empty() {
            return Ok(self.joints.clone());
        }
        let tool = self.robot.frame(&self.tool)?;
        let all = 0..self.robot.dof();
        Ok(all.filter(|&joint| self.robot.moves(joint, tool)).collect())
    }

    /// Checks that all numbers are in their ranges and that slices fit the robot.
    ///
    /// # Errors
    /// Returns [`ExcitationError::State`] for a wrong number of joints, [`ExcitationError::Value`] for a number that is out of
    /// range, and [`ExcitationError::Impossible`] for a posture outside of its limits.
    pub(crate) fn check(&self) -> Result<(), ExcitationError> {
        self.check_posture("start", &self.start)?;
        if let End::At(end) = &self.end {
            self.check_posture("end", end)?;
        }
        let (limits, dof) = (self.limits.len(), self.robot.dof());
        value("limits", limits as f64, limits == dof, "one for each joint")?;
        let payloads = self.payloads.len();
        value("payloads", payloads as f64, payloads > 0, "at least one")?;
        for &joint in &self.joints {
            value("joints", joint as f64, joint < dof, "an index of a joint")?;
        }
        let positive = |name, x: f64| value(name, x, x > 0.0 && x.is_finite(), "more than zero");
        positive("duration_s", self.duration_s)?;
        positive("rate_hz", self.sensing.rate_hz)?;
        for target in self.targets {
            positive("targets", target)?;
        }
        for payload in &self.payloads {
            positive("payloads", payload.mass())?;
        }
        for limits in &self.limits {
            let (low, high) = limits.position;
            let is_range = low < high && low.is_finite() == high.is_finite();
            let expected = "a range whose ends are both finite or both infinite";
            value("position", low, is_range, expected)?;
            positive("velocity", limits.velocity)?;
            positive("acceleration", limits.acceleration)?;
            value(
                "effort",
                limits.effort,
                limits.effort > 0.0,
                "more than zero",
            )?;
        }
        let bounds = [self.base.attitude_rad, self.base.position_m];
        for bound in bounds.into_iter().flatten() {
            positive("base", bound)?;
        }
        for limit in self.wrench.iter().flatten() {
            value("wrench", *limit, *limit > 0.0, "more than zero")?;
        }
        if let Some(grip) = &self.grip {
            let expected = "of positive size, with a used fraction of at most 1";
            value("grip", grip.grip_force_n, grip.is_valid(), expected)?;
        }
        self.check_base()
    }

    /// Checks that there is a finite position for each joint.
    fn check_posture(&self, name: &'static str, posture: &[f64]) -> Result<(), ExcitationError> {
        self.robot.check_length(name, posture)?;
        for &position in posture {
            value(name, position, position.is_finite(), "finite")?;
        }
        Ok(())
    }

    /// Checks that a base that floats does so without gravity, and that only such a base has bounds.
    fn check_base(&self) -> Result<(), ExcitationError> {
        let floats = self.robot.base_kind() == BaseKind::Floating;
        let gravity = self.gravity().norm();
        if floats {
            self.robot.check_base_mass()?;
            return value(
                "gravity",
                gravity,
                gravity == 0.0,
                "zero for a floating base",
            );
        }
        if self.base == BaseBounds::default() {
            return Ok(());
        }
        Err(ExcitationError::FixedBase)
    }

    /// Returns the gravitational acceleration in the inertial frame, m/s².
    pub(crate) fn gravity(&self) -> nalgebra::Vector3<f64> {
        self.sensing.equations.gravity_for(self.robot.base_kind())
    }
}

/// Returns an error for a value that is out of range.
fn value(
    name: &'static str,
    given: f64,
    is_valid: bool,
    expected: &'static str,
) -> Result<(), ExcitationError> {
    if is_valid {
        return Ok(());
    }
    Err(ExcitationError::Value {
        name,
        given,
        expected,
    })
}
