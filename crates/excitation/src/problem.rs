//! What is to be designed: the robot, what it measures, what it holds, what is to be known, and
//! what limits the motion.

use std::f64::consts::PI;

use serde::Deserialize;
use tactid_dynamics::{BaseKind, InertialParameters, Manipulator};
use tactid_identify::equations::window;
use tactid_identify::{EquationSettings, Range, largest_of_kind, values_of_body};
use tactid_options::{Kind, Value, read_as};

use crate::ExcitationError;
use crate::checks::{positive, value};
use crate::grip::Grip;
use crate::joint_limits::JointLimits;
use crate::shapes::CollisionModel;
use crate::variables::End;
use crate::workspace_bounds::{OrientedBox, WorkspaceBounds};

/// What the robot measures, and how the payload is identified from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensing {
    /// Links in which wrenches are measured.
    pub sensors: Vec<String>,
    /// Method, filter and noise of the sensors. The noise of each source that the method uses must
    /// be known: of the wrenches, of the efforts, and [`base_noise`](Self::base_noise). Uncertain
    /// gains are not part of a prediction.
    pub equations: EquationSettings,
    /// Samples per second, Hz.
    pub rate_hz: f64,
    /// Standard deviations of the white noise of one sample of the wrench that follows from the
    /// motion of a floating base: three forces, N, and three moments, N m, in the frame of the
    /// base. The combined method on a floating base and joint sensing use it.
    pub base_noise: Option<[f64; 6]>,
}

/// What a design minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// The largest ratio of a predicted 95 % interval to its target.
    #[default]
    LargestInterval,
    /// The volume of the confidence ellipsoid of the ten parameters (D-optimality).
    Volume,
}

impl Value for Criterion {
    read_as!(Kind::Choice(&["largest-interval", "volume"]), Self);
}

/// Bounds on the motion of a free-floating base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BaseBounds {
    /// Largest angle by which the base may turn from where it starts, rad: at most pi.
    pub attitude_rad: Option<f64>,
    /// Largest distance by which the origin of the base may move from where it starts, m.
    pub position_m: Option<f64>,
}

/// Default duration of a motion, s.
pub(crate) const DURATION_S: f64 = 10.0;

/// Largest number of joints of a robot, far more than a humanoid with hands has. A design takes
/// time for each of them.
const MOST_JOINTS: usize = 256;

/// Longest motion, s: memory and time of a design grow with it; seconds determine all parameters.
const LONGEST_S: f64 = 3600.0;

/// Default least distance of bodies, m.
const LEAST_DISTANCE_M: f64 = 0.01;

/// Range of the least distance of bodies, m: pairs that are beyond
/// [`REACH_M`](crate::limits::REACH_M), and count as at its end, keep it with a margin.
pub(crate) const LEAST_DISTANCE: Range = Range {
    contains: |distance_m| distance_m > 0.0 && distance_m <= 0.06,
    expected: "more than 0, and at most 0.06 m, because distances beyond 0.08 m are not computed",
};

/// A motion to be designed: [`Problem::new`] makes one, and its fields can then be changed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Problem {
    /// The robot. A floating base starts at rest and nothing acts on it from outside.
    pub robot: Manipulator,
    /// Link with the frame in which the payload is described.
    pub tool: String,
    /// Positions of all joints at the beginning, rad or m.
    pub start: Vec<f64>,
    /// Where the motion ends. Default: where it starts.
    pub end: End,
    /// Indices of the joints that may move, each once; empty for those that move the tool. Torques
    /// are limited for all joints.
    pub joints: Vec<usize>,
    /// Duration, s.
    pub duration_s: f64,
    /// Limits of all joints.
    pub limits: Vec<JointLimits>,
    /// What is measured.
    pub sensing: Sensing,
    /// Payloads in the tool frame for which all limits must hold. The first is the one that the
    /// information is predicted for. Another one may be [`InertialParameters::zero`], the hand
    /// without a payload.
    pub payloads: Vec<InertialParameters>,
    /// Targets for the half widths of the 95 % intervals, in the order and the units of
    /// [`VALUE_NAMES`](tactid_identify::VALUE_NAMES).
    pub targets: [f64; 10],
    /// What is minimised.
    pub criterion: Criterion,
    /// Bounds on the motion of a floating base.
    pub base: BaseBounds,
    /// Largest magnitudes of the wrench on the payload in the tool frame: three forces, N, and
    /// three moments, N m.
    pub wrench: Option<[f64; 6]>,
    /// The grip that must hold the payload by friction.
    pub grip: Option<Grip>,
    /// Bounding box of the payload in the tool frame. Default: none, so that only the origin of the
    /// tool's frame is kept in and out of the boxes of [`workspace`](Self::workspace), and
    /// collisions of the payload are not tested.
    pub payload_box: Option<OrientedBox>,
    /// Boxes that tool and payload must stay in or out of.
    pub workspace: WorkspaceBounds,
    /// Shapes of the links, which must not touch one another, the payload's bounding box or a
    /// keep-out box. Default: none, so that collisions of the robot are not tested.
    pub collisions: Option<CollisionModel>,
    /// Least distance of links, payload and keep-out boxes, m: at most 0.06. Default: 0.01. A pair
    /// without a keep-out box that is closer than twice that and than 0.08 m at the start must keep
    /// half of its distance at the start, which
    /// [`CollisionFinding::LeastDistanceReduced`](crate::CollisionFinding) reports.
    pub least_distance_m: f64,
}

/// Returns targets for the half widths of the 95 % intervals of the ten values: a fraction, such as
/// 0.01, of the largest value of its kind (mass, centre of mass, inertia). `None` for a payload
/// without mass.
///
/// A centre of mass that is closer to the origin of the tool frame than a tenth of the radius of
/// gyration, the root mean square distance of the mass from its centre, counts as that far away: a
/// fraction of nothing could not be reached.
#[must_use]
pub fn targets_within(payload: &InertialParameters, fraction: f64) -> Option<[f64; 10]> {
    targets_from(payload, fraction, NEAREST_CENTER)
}

/// Returns [`targets_within`] with another least distance of the centre of mass, in gyration radii.
pub(crate) fn targets_from(
    payload: &InertialParameters,
    fraction: f64,
    nearest_center: f64,
) -> Option<[f64; 10]> {
    let body = payload.mass_properties()?;
    let mut largest = largest_of_kind(&values_of_body(&body));
    let gyration_m = (0.5 * body.inertia.trace().max(0.0) / body.mass_kg).sqrt();
    for center in &mut largest[1..4] {
        *center = center.max(nearest_center * gyration_m);
    }
    Some(largest.map(|largest| fraction * largest))
}

/// Least distance of the centre of mass from the origin of which a precision is a fraction, in
/// radii of gyration.
const NEAREST_CENTER: f64 = 0.1;

impl Sensing {
    /// Returns why a motion has no averaging window: it is too short, or a window lacks samples.
    pub(crate) fn no_window(&self, duration_s: f64) -> ExcitationError {
        let cutoff_hz = self.equations.cutoff_hz;
        let window_s = window::length_s(cutoff_hz);
        if duration_s <= window_s {
            return ExcitationError::TooShort {
                duration_s,
                window_s,
            };
        }
        ExcitationError::TooFewSamples {
            window_s,
            cutoff_hz,
            rate_hz: self.rate_hz,
        }
    }
}

impl Problem {
    /// Returns the problem of a motion of 10 s that ends where it starts, of all joints that move
    /// the tool, for the smallest largest interval relative to its target. Only the limits of the
    /// joints bound it.
    ///
    /// `tool` is the link with the frame in which `payload` is described, `start` has the positions
    /// of all joints in rad or m, `limits` has one entry for each joint, and `targets` are half
    /// widths of 95 % intervals, such as [`targets_within`] returns. A design checks all of them.
    #[must_use]
    pub fn new(
        robot: Manipulator,
        tool: &str,
        start: &[f64],
        limits: Vec<JointLimits>,
        sensing: Sensing,
        payload: InertialParameters,
        targets: [f64; 10],
    ) -> Self {
        Self {
            robot,
            tool: tool.to_owned(),
            start: start.to_vec(),
            end: End::Start,
            joints: Vec::new(),
            duration_s: DURATION_S,
            limits,
            sensing,
            payloads: vec![payload],
            targets,
            criterion: Criterion::LargestInterval,
            base: BaseBounds::default(),
            wrench: None,
            grip: None,
            payload_box: None,
            workspace: WorkspaceBounds::default(),
            collisions: None,
            least_distance_m: LEAST_DISTANCE_M,
        }
    }

    /// Returns the indices of the joints that move.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Identify`] if the robot does not have the tool's link.
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
    /// Returns [`ExcitationError::Identify`] for a wrong number of joints,
    /// [`ExcitationError::Value`] for a number that is out of range, [`ExcitationError::Option`]
    /// for a tool that is fixed to the base, and the errors of [`Problem::moving_joints`].
    pub(crate) fn check(&self) -> Result<(), ExcitationError> {
        let (limits, dof) = (self.limits.len(), self.robot.dof());
        value("limits", limits as f64, limits == dof, "one for each joint")?;
        let is_small = dof <= MOST_JOINTS;
        value(
            "number of joints of the robot",
            dof as f64,
            is_small,
            "at most 256",
        )?;
        self.check_posture("start", &self.start)?;
        self.check_joints()?;
        if self.moving_joints()?.is_empty() {
            return Err(ExcitationError::unmoved(&self.tool));
        }
        if let End::At(end) = &self.end {
            self.check_end(end)?;
        }
        positive("duration_s", self.duration_s)?;
        let is_short = self.duration_s <= LONGEST_S;
        value("duration_s", self.duration_s, is_short, "at most 3600")?;
        positive("rate_hz", self.sensing.rate_hz)?;
        for &noise in self.sensing.base_noise.iter().flatten() {
            positive("base_noise", noise)?;
        }
        for (k, &target) in self.targets.iter().enumerate() {
            positive(&format!("targets[{k}]"), target)?;
        }
        self.check_payloads()?;
        self.check_limits()?;
        for (entry, limit) in self.wrench.iter().flatten().enumerate() {
            let name = format!("wrench[{entry}]");
            value(&name, *limit, *limit > 0.0, "more than zero")?;
        }
        if let Some(grip) = &self.grip {
            grip.check()?;
        }
        if let Some(bounds) = &self.payload_box {
            bounds.check("payload_box")?;
        }
        self.workspace.check()?;
        LEAST_DISTANCE.check("least_distance_m", &[self.least_distance_m])?;
        self.check_base()
    }

    /// Checks that there is a finite position for each joint.
    fn check_posture(&self, name: &'static str, posture: &[f64]) -> Result<(), ExcitationError> {
        self.robot.check_length(name, posture)?;
        for (joint, &position) in posture.iter().enumerate() {
            let name = format!("{name}[{joint}]{}", self.named(joint));
            value(&name, position, position.is_finite(), "a finite number")?;
        }
        Ok(())
    }

    /// Checks that the joints that may move exist and are given once.
    fn check_joints(&self) -> Result<(), ExcitationError> {
        for (place, &joint) in self.joints.iter().enumerate() {
            let name = format!("joints[{place}]");
            let exists = joint < self.robot.dof();
            value(&name, joint as f64, exists, "an index of a joint")?;
            let is_new = !self.joints[..place].contains(&joint);
            value(&name, joint as f64, is_new, "each joint once")?;
        }
        Ok(())
    }

    /// Checks the posture at the end: joints that do not move are where they start.
    fn check_end(&self, end: &[f64]) -> Result<(), ExcitationError> {
        self.check_posture("end", end)?;
        let moving = self.moving_joints()?;
        for (joint, (&end, start)) in end.iter().zip(&self.start).enumerate() {
            let name = format!("end[{joint}]{}", self.named(joint));
            let expected = format!("{start} as at the start, because this joint does not move");
            value(
                &name,
                end,
                moving.contains(&joint) || end == *start,
                &expected,
            )?;
        }
        Ok(())
    }

    /// Checks that all payloads are finite and have mass.
    fn check_payloads(&self) -> Result<(), ExcitationError> {
        let count = self.payloads.len();
        value("payloads", count as f64, count > 0, "at least one")?;
        for (k, payload) in self.payloads.iter().enumerate() {
            let name = format!("payloads[{k}]");
            for &entry in payload.as_vector().iter() {
                value(&name, entry, entry.is_finite(), "finite parameters")?;
            }
            let mass = payload.mass();
            let is_without = k > 0 && *payload == InertialParameters::zero();
            value(&name, mass, mass > 0.0 || is_without, "a mass above zero")?;
        }
        Ok(())
    }

    /// Checks the limits of the joints.
    fn check_limits(&self) -> Result<(), ExcitationError> {
        for (joint, limits) in self.limits.iter().enumerate() {
            let name = |field| format!("limits[{joint}].{field}{}", self.named(joint));
            let (low, high) = limits.position;
            let below = format!("less than its upper end {high}");
            value(&name("position"), low, low < high, &below)?;
            let is_range = low.is_finite() == high.is_finite();
            let expected = "a range whose ends are both finite or both infinite";
            value(&name("position"), low, is_range, expected)?;
            positive(&name("velocity"), limits.velocity)?;
            positive(&name("acceleration"), limits.acceleration)?;
            let is_positive = limits.effort > 0.0;
            value(
                &name("effort"),
                limits.effort,
                is_positive,
                "more than zero",
            )?;
        }
        Ok(())
    }

    /// Returns the name of a joint in parentheses after a space.
    fn named(&self, joint: usize) -> String {
        format!(" ({})", self.robot.joint_names()[joint])
    }

    /// Checks the bounds of the base, that a base that floats does so without gravity, and that
    /// only such a base has bounds.
    fn check_base(&self) -> Result<(), ExcitationError> {
        if let Some(attitude) = self.base.attitude_rad {
            positive("base.attitude_rad", attitude)?;
            // The angle of a rotation is never larger.
            let expected = "at most pi, the largest angle of a rotation";
            value("base.attitude_rad", attitude, attitude <= PI, expected)?;
        }
        if let Some(position) = self.base.position_m {
            positive("base.position_m", position)?;
        }
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
        Err(ExcitationError::Option {
            option: "base_attitude",
            what: "`base_attitude` bounds the motion of the base, but the base is fixed".to_owned(),
        })
    }

    /// Returns the gravitational acceleration in the inertial frame, m/s².
    pub(crate) fn gravity(&self) -> nalgebra::Vector3<f64> {
        self.sensing.equations.gravity_for(self.robot.base_kind())
    }
}
