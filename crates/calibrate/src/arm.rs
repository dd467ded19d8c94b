//! The joints and links between base and tool, and the columns of their efforts at one instant.

use nalgebra::{SVector, Vector2, Vector3};
use tactid_dynamics::{
    BaseKind, FrameId, JointKind, JointMotion, Manipulator, ModelFinding, StateError, Workspace,
    inverse_dynamics,
};
use tactid_identify::equations::Instant;

use super::description::LinkDescription;
use super::settings::CalibrationSettings;
use crate::CalibrateError;

/// Velocities of all friction terms, rad/s or m/s. A calibration uses the plain Coulomb term (the
/// last), or a step, what presliding and the Stribeck effect leave, and the curvature of the
/// viscous friction (the first three).
pub(crate) const WIDTHS: [f64; 4] = [0.005, 0.05, 0.5, 0.02];

/// Index in [`WIDTHS`] of the plain Coulomb term, which also shows whether a joint stands still.
pub(crate) const PLAIN: usize = 3;

/// Velocity at which the sign of the load-dependent friction is smoothed, rad/s or m/s.
const SIGN_WIDTH: f64 = 0.01;

/// Number of quantities of a joint beside the regressors and the slopes.
const SCALARS: usize = 4 + WIDTHS.len();

/// Step of the positions and of the tilt for the slopes, rad or m. A forward difference is off by
/// about half the step, and by rounding of 1e-11.
const SLOPE_STEP: f64 = 1e-5;

/// Number of directions into which gravity is tilted.
pub(crate) const TILTS: usize = 2;

/// Number of parameters of a payload, its mass and first moments, that slopes are computed for. Its
/// weight does not depend on the others.
const WEIGHT_PARAMETERS: usize = 4;

/// Number of entries of one slope: one of the links as described, and [`WEIGHT_PARAMETERS`].
const SLOPE_ENTRIES: usize = 1 + WEIGHT_PARAMETERS;

/// The chain from base to tool that a recording is made of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Arm {
    pub(crate) tool: String,
    /// Names of the joints that move the tool, in the robot's order.
    pub(crate) joints: Vec<String>,
    /// Unit of the effort of each joint.
    pub(crate) units: Vec<&'static str>,
    /// Names of the first links of the bodies between base and tool, from the base outwards.
    pub(crate) links: Vec<String>,
    /// Ten parameters of each body, as described.
    pub(crate) described: Vec<f64>,
    /// What the robot's description says of each body.
    pub(crate) descriptions: Vec<LinkDescription>,
    /// For each joint the index of the first of the bodies that it moves.
    pub(crate) first_links: Vec<usize>,
    /// For each joint the place of its entries; then the number of all entries.
    places: Vec<usize>,
    /// Number of [slopes](JointColumns::slope) of each joint.
    pub(crate) slopes: usize,
    pub(crate) gravity: Vector3<f64>,
    pub(crate) cutoff_hz: f64,
    /// What is wrong in the description of the robot.
    pub(crate) findings: Vec<ModelFinding>,
}

/// The quantities of one joint, at one instant or their means over one window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointColumns<'a> {
    /// Regressor of the links from the joint's first one on.
    pub(crate) links: &'a [f64],
    /// Regressor of a payload in the tool frame.
    pub(crate) payload: SVector<f64, 10>,
    /// Torque of all links as described.
    pub(crate) described: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    /// Smoothed sign of the velocity.
    pub(crate) sign: f64,
    /// Smoothed signs of the velocity for [`WIDTHS`].
    pub(crate) friction: &'a [f64],
    /// [`SLOPE_ENTRIES`] of each slope. Empty where contradictions are not to be found.
    slopes: &'a [f64],
}

impl JointColumns<'_> {
    /// Returns 0 for a window with motion in one direction, 1 for one at rest or with a reversal.
    pub(crate) fn standstill(&self) -> f64 {
        (1.0 - self.friction[PLAIN].powi(2)).max(0.0).sqrt()
    }

    /// Returns the change of the torque of the links as described and of a payload (parameters in
    /// the tool frame) with the unknown `slope`: a tilt of gravity towards each of [`TILTS`]
    /// directions, per rad, and then the zero of each joint of the arm, per rad or m.
    pub(crate) fn slope(&self, slope: usize, payload: Option<&SVector<f64, 10>>) -> f64 {
        let entries = &self.slopes[SLOPE_ENTRIES * slope..SLOPE_ENTRIES * (slope + 1)];
        let of_payload = payload.map_or(0.0, |payload| {
            let products = entries[1..].iter().zip(payload.iter());
            products.map(|(entry, parameter)| entry * parameter).sum()
        });
        entries[0] + of_payload
    }
}

impl Arm {
    /// Describes the chain of a robot, of which [`ArmColumns`] computes the columns.
    pub(crate) fn new(
        robot: &Manipulator,
        tool: &str,
        settings: &CalibrationSettings,
    ) -> Result<Self, CalibrateError> {
        let frame = robot.frame(tool)?;
        if robot.base_kind() == BaseKind::Floating {
            return Err(cannot_be_calibrated("the base floats"));
        }
        let bodies = bodies_between(robot, frame);
        if bodies.is_empty() {
            return Err(cannot_be_calibrated("no joint moves the tool"));
        }
        let joints = joints_of(robot, frame);
        let first_link = |&joint: &usize| {
            let name = &robot.joint_names()[joint];
            let moved = |&body: &usize| drives(robot, body, name);
            bodies.iter().position(moved).unwrap_or(0)
        };
        let first_links: Vec<usize> = joints.iter().map(first_link).collect();
        let slopes = if settings.finds_contradictions {
            TILTS + joints.len()
        } else {
            0
        };
        let mut places = vec![0];
        for first in &first_links {
            let entries = 10 * (bodies.len() - first) + 10 + SCALARS + SLOPE_ENTRIES * slopes;
            places.push(places[places.len() - 1] + entries);
        }
        let unit = |&joint: &usize| match robot.joint_kind(joint) {
            Some(JointKind::Prismatic) => "N",
            Some(JointKind::Revolute) | None => "N m",
        };
        let parameters: Vec<_> = robot.bodies().map(|body| body.parameters).collect();
        Ok(Self {
            tool: tool.to_owned(),
            units: joints.iter().map(unit).collect(),
            joints: joints
                .iter()
                .map(|&joint| robot.joint_names()[joint].clone())
                .collect(),
            links: bodies.iter().map(|&body| link_name(robot, body)).collect(),
            described: bodies
                .iter()
                .flat_map(|&body| parameters[body].as_vector().iter().copied())
                .collect(),
            descriptions: LinkDescription::of_bodies(robot, frame, &bodies),
            first_links,
            places,
            slopes,
            gravity: settings.gravity(),
            cutoff_hz: settings.cutoff_hz,
            findings: robot.findings(),
        })
    }

    /// Number of entries of all joints.
    pub(crate) fn entries(&self) -> usize {
        self.places[self.joints.len()]
    }

    /// Returns the quantities of a joint among all entries.
    pub(crate) fn columns<'a>(&self, entries: &'a [f64], joint: usize) -> JointColumns<'a> {
        let (regressors, scalars) =
            entries[self.places[joint]..self.places[joint + 1]].split_at(self.regressors(joint));
        let (links, payload) = regressors.split_at(regressors.len() - 10);
        JointColumns {
            links,
            payload: SVector::from_column_slice(payload),
            described: scalars[0],
            velocity: scalars[1],
            acceleration: scalars[2],
            sign: scalars[3],
            friction: &scalars[4..SCALARS],
            slopes: &scalars[SCALARS..],
        }
    }

    /// Number of entries of the regressors of links and payload of a joint.
    fn regressors(&self, joint: usize) -> usize {
        self.places[joint + 1] - self.places[joint] - SCALARS - SLOPE_ENTRIES * self.slopes
    }

    /// Returns gravity turned towards two directions that are perpendicular to it and to each
    /// other; the tilt has the angle towards each, rad, and its norm is the angle of the turn.
    pub(crate) fn tilted_gravity(&self, tilt: Vector2<f64>) -> Vector3<f64> {
        let down = self.gravity.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let axis = Vector3::ith(down.iamin(), 1.0);
        let across = down.cross(&axis).normalize();
        let sides = across * tilt.x + down.cross(&across) * tilt.y;
        let (sin, cos) = tilt.norm().sin_cos();
        let side = sides.try_normalize(0.0).unwrap_or_default();
        self.gravity.norm() * (down * cos + side * sin)
    }
}

/// Computes the entries of an [`Arm`] at instants, without allocation.
#[derive(Clone, Debug)]
pub(crate) struct ArmColumns {
    workspace: Workspace,
    tool: FrameId,
    /// Index in the robot of each joint of the arm.
    joints: Vec<usize>,
    /// Index in the robot of each body of the arm.
    bodies: Vec<usize>,
    /// Rows of all moving bodies for all joints of the robot.
    link_rows: Vec<SVector<f64, 10>>,
    /// Rows of the payload for all joints of the robot.
    rows: Vec<SVector<f64, 10>>,
    /// Entries of all joints, then their efforts.
    entries: Vec<f64>,
    /// Positions of all joints of the robot, of which one is moved.
    moved: Vec<f64>,
}

fn cannot_be_calibrated(why: &str) -> CalibrateError {
    CalibrateError::Robot(format!(
        "a calibration of joint efforts needs a fixed base and joints that move the tool: {why}"
    ))
}

impl ArmColumns {
    /// Allocates the workspace for an arm of a robot.
    pub(crate) fn new(robot: &Manipulator, arm: &Arm) -> Result<Self, CalibrateError> {
        let tool = robot.frame(&arm.tool)?;
        let moving = robot.bodies().len() - 1;
        Ok(Self {
            workspace: Workspace::new(robot),
            tool,
            joints: joints_of(robot, tool),
            bodies: bodies_between(robot, tool),
            link_rows: vec![SVector::zeros(); robot.dof() * moving],
            rows: vec![SVector::zeros(); robot.dof()],
            entries: vec![0.0; arm.entries() + arm.joints.len()],
            moved: vec![0.0; robot.dof()],
        })
    }

    /// Returns the robot.
    pub(crate) fn robot(&self) -> &Manipulator {
        self.workspace.robot()
    }

    /// Computes the entries of all joints at an instant, then their efforts. Cost: a product for
    /// each joint and body below it; an inverse dynamics and payload regressor for each slope.
    pub(crate) fn at(&mut self, arm: &Arm, instant: &Instant) -> Result<&[f64], StateError> {
        let joints = JointMotion {
            position: &instant.joint_position,
            velocity: &instant.joint_velocity,
            acceleration: &instant.joint_acceleration,
        };
        inverse_dynamics(&mut self.workspace, &instant.base, joints, &arm.gravity)?;
        self.workspace
            .joint_torque_regressor(&arm.gravity, &mut self.link_rows)?;
        let moving = self.workspace.robot().bodies().len() - 1;
        for (link, &body) in self.bodies.iter().enumerate() {
            for (joint, &index) in self.joints.iter().enumerate() {
                if let Some(place) = link.checked_sub(arm.first_links[joint]) {
                    let place = arm.places[joint] + 10 * place;
                    let row = &self.link_rows[index * moving + body - 1];
                    self.entries[place..place + 10].copy_from_slice(row.as_slice());
                }
            }
        }
        self.workspace
            .body_torque_regressor(self.tool, &arm.gravity, &mut self.rows)?;
        let torques = self.workspace.joint_torques()?;
        for (joint, &index) in self.joints.iter().enumerate() {
            let velocity = instant.joint_velocity[index];
            let scalars = arm.places[joint] + arm.regressors(joint);
            let (regressors, scalars) = self.entries.split_at_mut(scalars);
            let payload = regressors.len() - 10;
            regressors[payload..].copy_from_slice(self.rows[index].as_slice());
            scalars[0] = torques[index];
            scalars[1] = velocity;
            scalars[2] = instant.joint_acceleration[index];
            scalars[3] = (velocity / SIGN_WIDTH).tanh();
            for (entry, width) in scalars[4..SCALARS].iter_mut().zip(WIDTHS) {
                *entry = (velocity / width).tanh();
            }
        }
        self.add_slopes(arm, instant)?;
        let efforts = self.entries.iter_mut().skip(arm.entries());
        for (effort, &index) in efforts.zip(&self.joints) {
            *effort = instant.joint_effort[index];
        }
        Ok(&self.entries)
    }

    /// Computes the slopes of the torques as described and of the payload's regressor.
    fn add_slopes(&mut self, arm: &Arm, instant: &Instant) -> Result<(), StateError> {
        let tilted = [Vector2::x(), Vector2::y()].map(|side| arm.tilted_gravity(SLOPE_STEP * side));
        self.moved.copy_from_slice(&instant.joint_position);
        for slope in 0..arm.slopes {
            let moved = slope.checked_sub(TILTS).map(|joint| self.joints[joint]);
            if let Some(index) = moved {
                self.moved[index] += SLOPE_STEP;
            }
            let joints = JointMotion {
                position: &self.moved,
                velocity: &instant.joint_velocity,
                acceleration: &instant.joint_acceleration,
            };
            let gravity = tilted.get(slope).unwrap_or(&arm.gravity);
            inverse_dynamics(&mut self.workspace, &instant.base, joints, gravity)?;
            self.workspace
                .body_torque_regressor(self.tool, gravity, &mut self.rows)?;
            let torques = self.workspace.joint_torques()?;
            for (joint, &index) in self.joints.iter().enumerate() {
                let scalars = arm.places[joint] + arm.regressors(joint);
                let first = scalars + SCALARS + SLOPE_ENTRIES * slope;
                let described = self.entries[scalars];
                self.entries[first] = (torques[index] - described) / SLOPE_STEP;
                for (k, moved) in self.rows[index].iter().take(WEIGHT_PARAMETERS).enumerate() {
                    let unmoved = self.entries[scalars - 10 + k];
                    self.entries[first + 1 + k] = (moved - unmoved) / SLOPE_STEP;
                }
            }
            if let Some(index) = moved {
                self.moved[index] = instant.joint_position[index];
            }
        }
        Ok(())
    }
}

/// Indices of the joints that move a frame, in the robot's order.
fn joints_of(robot: &Manipulator, frame: FrameId) -> Vec<usize> {
    let joints = 0..robot.dof();
    joints.filter(|&joint| robot.moves(joint, frame)).collect()
}

/// Indices of the moving bodies from the base to a frame.
fn bodies_between(robot: &Manipulator, frame: FrameId) -> Vec<usize> {
    let name = robot.frame_name(frame);
    let parents: Vec<Option<usize>> = robot
        .bodies()
        .map(|body| body.joint.map(|joint| joint.parent))
        .collect();
    let last = robot.links().find(|link| link.name == name);
    let mut bodies: Vec<usize> =
        std::iter::successors(last.map(|link| link.body), |&body| parents[body])
            .filter(|&body| parents[body].is_some())
            .collect();
    bodies.reverse();
    bodies
}

/// Whether a body's joint follows the independent joint with a name.
fn drives(robot: &Manipulator, body: usize, name: &str) -> bool {
    let joint = robot.bodies().nth(body).and_then(|body| body.joint);
    joint.is_some_and(|joint| joint.name == name)
}

/// Name of the first link of a body, which has the frame of the body.
fn link_name(robot: &Manipulator, body: usize) -> String {
    let link = robot.links().find(|link| link.body == body);
    link.map_or(String::new(), |link| link.name.to_owned())
}
