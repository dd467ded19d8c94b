//! The online identifier: one sample at a time, asked at any time.

use nalgebra::Vector3;
use tactid_dynamics::{
    BaseKind, FrameId, InertialParameters, JointMotion, Manipulator, MassProperties, StateError,
    ToolMotion, Workspace, Wrench, motion, wrench_on_end_effector,
};

use crate::equation::MeanEquation;
use crate::estimate::{body, values, without};
use crate::excitation::Excitation;
use crate::method::Method;
use crate::recent::RecentMean;
use crate::sample::{Middle, Node};
use crate::{IdentifyError, PayloadEstimate, Sample, Settings, Way};

/// By how much of its largest principal moment an estimate may miss the triangle inequality and still
/// count as possible: plates and rods lie on the border, and no estimate is exact.
const BORDER: f64 = 0.01;

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pushed {
    /// It was added to the present interval, and gave rows if it ended it.
    Used,
    /// It starts an interval: it is the first, or comes after a gap.
    Started,
    /// It was not finite, or not later than the one before, and changed nothing.
    Refused,
}

/// Identifies the payload of one robot from its samples, online.
///
/// Rows are means over intervals of [`Settings::interval_s`], in which wrench and acceleration belong
/// to each other exactly, whatever the sample rate. Nothing is allocated after construction.
///
/// ```
/// use tactid_dynamics::{BaseKind, Manipulator};
/// use tactid_identify::{Identifier, Settings};
///
/// # let urdf = r#"<robot name="arm"><link name="base"><inertial><mass value="9"/>
/// #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
/// #   <link name="tool0"><inertial><mass value="1"/>
/// #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
/// #   <joint name="hinge" type="continuous"><parent link="base"/><child link="tool0"/></joint></robot>"#;
/// let robot = Manipulator::from_urdf(urdf, BaseKind::Floating)?;
/// let mut identifier = Identifier::new(&robot, "tool0", &["tool0"], Settings::default())?;
/// // for each sample: identifier.push(&sample)?;
/// let estimate = identifier.estimate();
/// assert_eq!(estimate.intervals, 0);
/// assert_eq!(estimate.not_identifiable().count(), 10); // nothing is known yet
/// # Ok::<(), tactid_identify::IdentifyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Identifier {
    settings: Settings,
    gravity: Vector3<f64>,
    robot: Manipulator,
    /// The robot as the equations know it: without its end-effector for the joint-sensing way.
    known: Manipulator,
    tool: FrameId,
    sensors: Vec<FrameId>,
    workspace: Workspace,
    last: Node,
    next: Node,
    middle: Middle,
    equation: MeanEquation,
    method: Method,
    excitation: Excitation,
    recent: Option<RecentMean>,
    refused: u64,
    gaps: u64,
}

impl Identifier {
    /// For a robot whose end-effector frame is the link `tool` and whose wrenches are measured in the
    /// links `sensors`.
    ///
    /// # Errors
    /// A link that the robot does not have, a setting out of range, or a way that this robot does
    /// not allow.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: Settings,
    ) -> Result<Self, IdentifyError> {
        check(robot, sensors, &settings)?;
        let tool = robot.frame(tool)?;
        let sensors: Result<Vec<_>, _> = sensors.iter().map(|name| robot.frame(name)).collect();
        let sensors = sensors?;
        let (joints, wrenches) = (robot.dof(), sensors.len());
        Ok(Self {
            known: match settings.way {
                Way::Tactile => robot.clone(),
                Way::JointSensing => robot.without_subtree(tool),
            },
            robot: robot.clone(),
            tool,
            sensors,
            workspace: Workspace::new(robot),
            last: Node::new(joints, wrenches),
            next: Node::new(joints, wrenches),
            middle: Middle::new(joints, wrenches),
            equation: MeanEquation::new(),
            method: Method::new(settings.estimator)?,
            excitation: Excitation::new(),
            recent: (settings.average_s > 0.0).then(|| RecentMean::new(settings.average_s)),
            refused: 0,
            gaps: 0,
            gravity: settings.gravity_for(robot.base_kind()),
            settings,
        })
    }

    /// The gravitational acceleration that is assumed, in the inertial frame, m/s².
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// Takes one sample.
    ///
    /// Cost: one pass over the robot's bodies and one update of the estimator; no allocation.
    ///
    /// # Errors
    /// Where a slice does not fit the robot or the sensors. Bad data are no error: see [`Pushed`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<Pushed, IdentifyError> {
        self.check_lengths(sample)?;
        if !sample.is_finite() || sample.time_s <= self.last.time_s {
            self.refused += 1;
            return Ok(Pushed::Refused);
        }
        self.next.set(sample);
        let passed_s = sample.time_s - self.last.time_s;
        let gap = passed_s > self.settings.max_gap_s;
        if gap {
            self.gaps += u64::from(passed_s.is_finite());
            self.equation = MeanEquation::new();
        } else {
            self.add(passed_s)?;
        }
        std::mem::swap(&mut self.last, &mut self.next);
        Ok(if gap { Pushed::Started } else { Pushed::Used })
    }

    /// Prepares for the same samples once more: what was learnt stays, times begin anew.
    pub fn rewind(&mut self) {
        self.last.time_s = f64::NEG_INFINITY;
        self.equation = MeanEquation::new();
        self.excitation = Excitation::new();
        if let Some(recent) = &mut self.recent {
            *recent = RecentMean::new(self.settings.average_s);
        }
        (self.refused, self.gaps) = (0, 0);
    }

    /// Adds the time between the last two samples to the equation, and learns from it when it is long
    /// enough.
    fn add(&mut self, duration_s: f64) -> Result<(), StateError> {
        let middle = &mut self.middle;
        middle.set(&self.last, &self.next);
        let joints = JointMotion {
            position: &middle.joint_position,
            velocity: &middle.joint_velocity,
            acceleration: &middle.joint_acceleration,
        };
        motion(&self.known, &mut self.workspace, &middle.base, joints)?;
        let (motion, wrench) = (self.tool_motion(), self.wrench_on_end_effector());
        self.equation.add(&motion, &wrench, duration_s);
        // Sums of steps are right to rounding only.
        if self.equation.duration_s() >= self.settings.interval_s * (1.0 - 1e-6) {
            self.learn();
        }
        Ok(())
    }

    /// Feeds the estimator with the equation, and begins the next one.
    fn learn(&mut self) {
        self.method.update(&self.equation);
        self.excitation.update(&self.equation);
        self.equation = MeanEquation::new();
        if self.recent.is_some() {
            let now = self.latest_values();
            if let Some(recent) = &mut self.recent {
                recent.push(self.next.time_s, &now);
            }
        }
    }

    /// The payload as known now: the mean over the last [`Settings::average_s`], or the latest.
    #[must_use]
    pub fn estimate(&self) -> PayloadEstimate {
        let latest = self.method.body();
        let mean = self.recent.as_ref().and_then(RecentMean::mean);
        let payload = mean.map_or_else(|| self.payload(&latest), |values| body(&values));
        let (singular_values, identifiable) = self.excitation.assess();
        PayloadEstimate {
            body: payload,
            composite: (self.settings.way == Way::JointSensing).then_some(latest),
            identifiable,
            singular_values,
            is_physical: InertialParameters::from(payload).is_physical_within(BORDER),
            intervals: self.excitation.intervals(),
            refused: self.refused,
            gaps: self.gaps,
        }
    }

    /// The latest values, not averaged, in the order of [`VALUE_NAMES`](crate::VALUE_NAMES).
    #[must_use]
    pub fn latest_values(&self) -> [f64; 10] {
        values(&self.payload(&self.method.body()))
    }

    /// The identified body less the gripper, where the way of measuring includes it.
    fn payload(&self, identified: &MassProperties) -> MassProperties {
        match self.settings.way {
            Way::Tactile => *identified,
            Way::JointSensing => {
                let gripper = self.robot.subtree_parameters(&self.workspace, self.tool);
                without(identified, &gripper)
            }
        }
    }

    fn tool_motion(&self) -> ToolMotion {
        let motion = self.workspace.frame_motion(&self.known, self.tool);
        motion.in_frame(&self.gravity)
    }

    /// On the body that is sought, in `Σ_U` and about its origin.
    fn wrench_on_end_effector(&self) -> Wrench {
        match self.settings.way {
            Way::JointSensing => wrench_on_end_effector(&self.known, &self.workspace, self.tool),
            Way::Tactile => {
                // (47): f_U and n_U are the sums over all fingers.
                let tool_from_world = self.workspace.pose(&self.known, self.tool).inverse();
                let wrenches = self.sensors.iter().zip(&self.middle.wrenches);
                wrenches.fold(Wrench::zero(), |sum, (&sensor, wrench)| {
                    let world_from_sensor = self.workspace.pose(&self.known, sensor);
                    sum + wrench.expressed_in(&(tool_from_world * world_from_sensor))
                })
            }
        }
    }

    fn check_lengths(&self, sample: &Sample<'_>) -> Result<(), IdentifyError> {
        self.robot
            .check_length("joint_position", sample.joint_position)?;
        self.robot
            .check_length("joint_velocity", sample.joint_velocity)?;
        if sample.wrenches.len() == self.sensors.len() {
            return Ok(());
        }
        Err(IdentifyError::WrenchCount {
            given: sample.wrenches.len(),
            expected: self.sensors.len(),
        })
    }
}

fn check(robot: &Manipulator, sensors: &[&str], settings: &Settings) -> Result<(), IdentifyError> {
    match settings.way {
        Way::Tactile if sensors.is_empty() => return Err(IdentifyError::NoWrench),
        Way::JointSensing if robot.base_kind() == BaseKind::Fixed => {
            return Err(IdentifyError::FixedBase);
        }
        _ => {}
    }
    let refuse = |name, given, wanted| {
        Err(IdentifyError::Value {
            name,
            given,
            wanted,
        })
    };
    if !(settings.average_s >= 0.0 && settings.average_s.is_finite()) {
        return refuse("average_s", settings.average_s, "zero or more");
    }
    if !(settings.interval_s >= 0.0 && settings.interval_s.is_finite()) {
        return refuse("interval_s", settings.interval_s, "zero or more");
    }
    if settings.epochs == 0 {
        return refuse("epochs", 0.0, "one or more");
    }
    if settings.max_gap_s.is_nan() || settings.max_gap_s <= 0.0 {
        return refuse("max_gap_s", settings.max_gap_s, "more than zero");
    }
    let gravity = settings.gravity_for(robot.base_kind());
    match gravity.iter().find(|entry| !entry.is_finite()) {
        Some(&entry) => refuse("gravity", entry, "finite"),
        None => Ok(()),
    }
}
