//! What an experiment uses the links and joints of its robot for, with checks that they fit.

use tactid_dynamics::words::counted;
use tactid_dynamics::{MassProperties, list_similar};

use crate::experiment::{BaseProperties, ExcitationKind, JointExcitation, Noise, StdDev, refuse};
use crate::motion::JointMotion;
use crate::robot::{LinkFrame, MovingJoint, Robot};
use crate::{Experiment, SimError};

/// The tool, the fingers and the arm of an experiment's robot.
#[derive(Clone, Debug)]
pub(crate) struct Roles {
    /// Link with the frame in which the payload is described.
    pub tool: LinkFrame,
    /// Indices of the bodies that the finger joints move.
    pub fingers: [usize; 2],
    /// Indices of the bodies that the arm's joints move, in the order of the posture.
    pub arm: Vec<usize>,
    /// What moves the arm's joints.
    pub drive: ArmDrive,
}

/// What moves the joints of an arm.
#[derive(Clone, Debug)]
pub(crate) enum ArmDrive {
    /// Cosines move some joints, given by their positions in the arm.
    Cosines(Vec<usize>),
    /// A motion of all joints, in the order of the arm.
    Designed(JointMotion),
    /// Motions that are planned while the payload is identified.
    Active,
}

/// Reads the robot of an experiment and finds the roles of its links and joints.
///
/// # Errors
/// Returns [`SimError::File`] or [`SimError::Model`] for a robot that cannot be read or modelled,
/// [`SimError::Robot`] for one that cannot be simulated, and [`SimError::Value`] for a field that
/// does not fit the robot.
pub(crate) fn robot_with_roles(experiment: &Experiment) -> Result<(Robot, Roles), SimError> {
    let robot = robot(experiment)?;
    let roles = Roles::find(&robot, experiment)?;
    Ok((robot, roles))
}

/// Reads the robot of an experiment.
fn robot(experiment: &Experiment) -> Result<Robot, SimError> {
    let mass: Option<MassProperties> = experiment
        .base
        .as_ref()
        .map(BaseProperties::mass_properties);
    let kind = experiment.robot.base.kind();
    Robot::from_urdf(&experiment.urdf()?, kind, mass.as_ref())
}

/// Reads the motion of the arm's joints from the file of an experiment's excitation; `None` for
/// another kind of excitation.
///
/// # Errors
/// Returns the errors of reading the robot, and [`SimError::File`] or [`SimError::Motion`] for a
/// file that is no motion of its arm.
pub(crate) fn arm_motion(experiment: &Experiment) -> Result<Option<JointMotion>, SimError> {
    if experiment.excitation.kind != ExcitationKind::Designed {
        return Ok(None);
    }
    let robot = robot(experiment)?;
    let (_, arm) = fingers_and_arm(&robot, experiment)?;
    motion(&robot, &arm, experiment)
}

fn motion(
    robot: &Robot,
    arm: &[usize],
    experiment: &Experiment,
) -> Result<Option<JointMotion>, SimError> {
    let (ExcitationKind::Designed, Some(file)) =
        (experiment.excitation.kind, &experiment.excitation.file)
    else {
        return Ok(None);
    };
    let motion = JointMotion::read(file)?.of_joints(&joint_names(robot, arm))?;
    for (row, positions) in motion.rows().enumerate() {
        for (&body, position) in arm.iter().zip(positions) {
            if let Some((joint, (lower, upper))) = exceeded(robot, body, position) {
                let what =
                    format!("{joint} is at {position}, outside its limits {lower} to {upper}");
                return Err(motion.fault(row, &what));
            }
        }
    }
    Ok(Some(motion))
}

/// Returns the bodies that the finger joints move, and those that the arm's joints move.
fn fingers_and_arm(
    robot: &Robot,
    experiment: &Experiment,
) -> Result<([usize; 2], Vec<usize>), SimError> {
    let fingers = [finger(robot, experiment, 0)?, finger(robot, experiment, 1)?];
    let bodies = robot.joints().map(|(body, _)| body);
    Ok((
        fingers,
        bodies.filter(|body| !fingers.contains(body)).collect(),
    ))
}

impl Roles {
    /// Finds the roles that an experiment gives to a robot's links and joints.
    ///
    /// # Errors
    /// Returns [`SimError::Value`] for the first field that does not fit the robot.
    fn find(robot: &Robot, experiment: &Experiment) -> Result<Self, SimError> {
        let name = &experiment.robot.tool;
        let tool = robot.link(name).ok_or_else(|| {
            let links = list_similar(name, robot.links.iter().map(|link| link.name.as_str()));
            let why = format!("there is no such link; the robot has {links}");
            refuse("robot.tool", name, &why)
        })?;
        let (fingers, arm) = fingers_and_arm(robot, experiment)?;
        check_posture(robot, &arm, experiment)?;
        let drive = ArmDrive::find(robot, &arm, experiment)?;
        check_noise(robot.joints().count(), &experiment.noise)?;
        Ok(Self {
            tool: tool.clone(),
            fingers,
            drive,
            arm,
        })
    }
}

impl ArmDrive {
    /// Finds what an experiment moves the joints of its arm by.
    fn find(robot: &Robot, arm: &[usize], experiment: &Experiment) -> Result<Self, SimError> {
        if let Some(motion) = motion(robot, arm, experiment)? {
            check_start(&motion, experiment)?;
            return Ok(Self::Designed(motion));
        }
        if experiment.excitation.kind == ExcitationKind::Active {
            return Ok(Self::Active);
        }
        Ok(Self::Cosines(driven(robot, arm, experiment)?))
    }
}

/// What the joint of a finger must be.
const FINGER: &str =
    "a finger needs a prismatic joint that closes the gripper as its position increases";

/// Returns the index of the body that a finger joint moves.
fn finger(robot: &Robot, experiment: &Experiment, index: usize) -> Result<usize, SimError> {
    let name = &experiment.robot.fingers[index];
    let field = format!("robot.fingers[{index}]");
    let Some((body, joint)) = robot.joints().find(|(_, joint)| joint.name == *name) else {
        let why = format!("there is no such joint: {FINGER}; {}", joints(robot));
        return Err(refuse(field, name, &why));
    };
    if !joint.prismatic {
        let why = format!("this joint is revolute: {FINGER}; {}", joints(robot));
        return Err(refuse(field, name, &why));
    }
    if robot.bodies[body].boxes.is_empty() {
        let why = "the link of this finger has no collision box, which is its pad: give it a <collision> with a <box>";
        return Err(refuse(field, name, why));
    }
    Ok(body)
}

/// Lists the joints of a robot with their kinds, as a clause.
fn joints(robot: &Robot) -> String {
    let kind = |joint: &MovingJoint| {
        if joint.prismatic {
            "prismatic"
        } else {
            "revolute"
        }
    };
    let joints = robot.joints();
    let joints: Vec<_> = joints
        .map(|(_, joint)| format!("{} ({})", joint.name, kind(joint)))
        .collect();
    if joints.is_empty() {
        return "no joint of the robot moves".to_owned();
    }
    format!("the robot has {}", joints.join(", "))
}

/// Returns the names of the arm's joints in their order.
pub(crate) fn joint_names<'a>(robot: &'a Robot, arm: &[usize]) -> Vec<&'a str> {
    let joints = robot.joints().filter(|(body, _)| arm.contains(body));
    joints.map(|(_, joint)| joint.name.as_str()).collect()
}

/// Checks that the posture has one position within the limits for each joint of the arm.
fn check_posture(robot: &Robot, arm: &[usize], experiment: &Experiment) -> Result<(), SimError> {
    let posture = &experiment.posture;
    let positions = posture.positions();
    if positions.len() != arm.len() {
        let why = format!(
            "has {} joint positions, but the arm has {}: give one for each of {}",
            positions.len(),
            counted(arm.len(), "joint"),
            joint_names(robot, arm).join(", ")
        );
        return Err(refuse("posture", format_args!("{posture}"), &why));
    }
    for (&body, position) in arm.iter().zip(positions) {
        if let Some((joint, (lower, upper))) = exceeded(robot, body, position) {
            let why = format!(
                "joint `{joint}` would begin at {position}, outside its limits {lower} to {upper}"
            );
            return Err(refuse("posture", format_args!("{posture}"), &why));
        }
    }
    Ok(())
}

/// Distance between the posture and the beginning of a motion that is rounding, rad or m.
const SAME_POSITION: f64 = 1e-6;

/// Checks that a motion begins in the posture of the experiment.
fn check_start(motion: &JointMotion, experiment: &Experiment) -> Result<(), SimError> {
    let positions = experiment.posture.positions();
    let start = motion.start();
    let is_start = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME_POSITION;
    if positions.iter().zip(&start).all(is_start) {
        return Ok(());
    }
    let why = format!("the motion of excitation.file begins at {start:?}");
    Err(refuse(
        "posture",
        format_args!("{}", experiment.posture),
        &why,
    ))
}

/// Returns the name and the limits of a body's joint if a position is outside the limits.
pub(crate) fn exceeded(robot: &Robot, body: usize, position: f64) -> Option<(&str, (f64, f64))> {
    let joint = robot.bodies[body].joint.as_ref()?;
    let (lower, upper) = joint.limits?;
    let exceeds = !(lower..=upper).contains(&position);
    exceeds.then_some((joint.name.as_str(), (lower, upper)))
}

/// Returns the position in the arm of each joint that the excitation drives.
fn driven(robot: &Robot, arm: &[usize], experiment: &Experiment) -> Result<Vec<usize>, SimError> {
    let names = joint_names(robot, arm);
    let joints = experiment.excitation.joints.iter().enumerate();
    let position = |(index, joint): (usize, &JointExcitation)| {
        let found = names.iter().position(|name| *name == joint.name);
        found.ok_or_else(|| {
            let known = list_similar(&joint.name, names.iter().copied());
            let why = format!("there is no such joint; the arm has {known}");
            let field = format!("excitation.joints[{index}].name");
            refuse(field, &joint.name, &why)
        })
    };
    joints.map(position).collect()
}

/// Checks that each list of noise has one entry for each of the robot's moving joints.
fn check_noise(joints: usize, noise: &Noise) -> Result<(), SimError> {
    for (field, std_dev) in [
        ("joint_position_rad", &noise.joint_position_rad),
        ("joint_velocity_rad_s", &noise.joint_velocity_rad_s),
        ("joint_torque_nm", &noise.joint_torque_nm),
    ] {
        if let StdDev::Each(values) = std_dev
            && values.len() != joints
        {
            let why = format!(
                "has {} values, but the robot has {joints} moving joints: give one number, or one for each",
                values.len()
            );
            return Err(refuse(format!("noise.{field}"), values, &why));
        }
    }
    Ok(())
}
