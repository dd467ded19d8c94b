//! Other readings of what was recorded: the axes of the wrenches and the order of forces and
//! moments, what the efforts contain, gravity, the order and the signs of the joints, and the
//! orientations of the base.

use std::borrow::Cow;

use nalgebra::{UnitQuaternion, Vector3};
use tactid_batch::Finding as Data;
use tactid_dynamics::{BaseKind, Manipulator};
use tactid_identify::{BaseState, EffortContent, EquationSettings, Method, WORLD, states_of_poses};

use crate::alignment::{Event, JointValues, Measured};
use crate::defaults::{Motion, Options};
use crate::orientation::{OTHER_READINGS, PoseReading};
use crate::plan::Plan;
use crate::preview::Preview;
use crate::recording::{Recording, Sources};
use crate::{Finding, Observer, RecordingError};

/// Size of the residuals relative to those of the assumed reading, with the first cause that was
/// found, below which another reading is the right one. Drivers that state wrenches or efforts
/// otherwise leave some percent (`tests/readings.rs`).
const MUCH_SMALLER: f64 = 0.4;

/// Angle between links of the base below which both have the same axes, rad: descriptions round
/// multiples of a right angle.
const SAME_ORIENTATION_RAD: f64 = 1e-3;

/// How measurements are read.
#[derive(Clone)]
struct Reading {
    equations: EquationSettings,
    /// Frames about whose origins the moments of the wrenches are.
    sensors: Vec<String>,
    values: Values,
}

/// What is done to values before they are used.
#[derive(Clone)]
enum Values {
    /// Nothing.
    Given,
    /// The values of each of these joints are given for the joint before it, and the values of the
    /// first for the last.
    ExchangedJoints(Vec<usize>),
    /// The values of a joint have the opposite sign.
    OppositeJoint(usize),
    /// Moments are in the places of forces, and forces in those of moments.
    ExchangedKinds,
    /// Poses of the base are read otherwise.
    Poses(PoseReading),
}

/// Returns a finding where another reading of a recording explains its beginning far better than
/// that of the plan with the first cause that was found, which leaves a fraction `left_by_cause` of
/// the residuals.
///
/// Cost: the equations of the beginning, and one fit, for each reading. It is meant for where
/// something is unexplained.
pub(crate) fn contradicted_reading(
    recording: &impl Recording,
    plan: &Plan<'_>,
    left_by_cause: f64,
    observer: &mut Observer<'_>,
) -> Result<Option<Finding>, RecordingError> {
    let given = Reading {
        equations: plan.equations.clone(),
        sensors: plan.sources.sensors.clone(),
        values: Values::Given,
    };
    let with = |equations| Reading {
        equations,
        ..given.clone()
    };
    // Positions of two sources explain whatever is unexplained, and axes can turn where all of them
    // are measured.
    if plan.is_mixed || plan.equations.unmeasured.contains(&true) {
        return Ok(None);
    }
    let mut others: Vec<Reading> = other_axes(plan).into_iter().map(with).collect();
    others.extend(other_contents(plan).into_iter().map(with));
    others.extend(other_gravities(plan).into_iter().map(with));
    others.extend(other_point(plan, &given));
    if recording.measures_poses() && plan.equations.method.uses_wrench() {
        let readings = OTHER_READINGS.into_iter();
        // Messages name the entries of their quaternions as they do their joints.
        let readings = readings.filter(|poses| poses.keeps_order() || !recording.names_joints());
        others.extend(readings.map(|poses| given.with(Values::Poses(poses))));
    }
    let joints = plan.sources.robot.joint_names().len();
    others.extend(joint_values(joints, recording.names_joints()).map(|values| given.with(values)));
    if plan.equations.method == Method::Tactile {
        others.push(given.with(Values::ExchangedKinds));
    }
    let events = recording.beginning(observer)?;
    let Some([assumed, _]) = sizes(plan, &events, &given)? else {
        return Ok(None);
    };
    let mut best = None;
    let mut least = MUCH_SMALLER * assumed * left_by_cause;
    for other in others {
        let Some([residual, measured]) = sizes(plan, &events, &other)? else {
            continue;
        };
        // Motor currents are far smaller than what the arm needs, whatever explains them.
        let explains = other.equations.effort_content != EffortContent::External
            || residual < MUCH_SMALLER * measured;
        if residual < least && explains {
            (least, best) = (residual, Some(other));
        }
    }
    Ok(best.map(|other| finding(plan.sources, &given, other, least / assumed)))
}

/// Returns the sizes of the residuals and of the measurements of the beginning with a reading;
/// `None` where it is too short.
fn sizes(
    plan: &Plan<'_>,
    events: &[Event],
    reading: &Reading,
) -> Result<Option<[f64; 2]>, RecordingError> {
    let sources = Sources {
        sensors: reading.sensors.clone(),
        ..plan.sources.clone()
    };
    let options = Options {
        equations: reading.equations.clone(),
        tip: plan.tip.clone(),
        ..sources.options.clone()
    };
    let preview = Preview {
        sources: &sources,
        options: &options,
        events: &reading.values.of(events),
    };
    preview.residual_at(&plan.streams, plan.delay_s, plan.equations.cutoff_hz)
}

impl Reading {
    fn with(&self, values: Values) -> Self {
        Self {
            values,
            ..self.clone()
        }
    }
}

/// Returns the readings in which the values of two joints are exchanged, or those of one have the
/// opposite sign; and, unless the values have names, those in which three are exchanged in turn.
fn joint_values(joints: usize, are_named: bool) -> impl Iterator<Item = Values> {
    let pairs =
        (0..joints).flat_map(move |first| (first + 1..joints).map(move |second| [first, second]));
    let rest = pairs.clone().filter(move |_| !are_named);
    let threes = rest.flat_map(move |[first, second]| {
        (second + 1..joints)
            .flat_map(move |third| [vec![first, second, third], vec![first, third, second]])
    });
    let exchanged = pairs.map(Vec::from).chain(threes);
    let exchanged = exchanged.map(Values::ExchangedJoints);
    exchanged.chain((0..joints).map(Values::OppositeJoint))
}

impl Values {
    /// Returns events that are read so.
    fn of<'a>(&self, events: &'a [Event]) -> Cow<'a, [Event]> {
        let changed = |change: &dyn Fn(&mut Measured)| {
            let mut events = events.to_vec();
            events
                .iter_mut()
                .for_each(|event| change(&mut event.measured));
            Cow::Owned(events)
        };
        match self {
            Self::Given => Cow::Borrowed(events),
            Self::ExchangedJoints(joints) => changed(&|measured| exchange(measured, joints)),
            Self::OppositeJoint(joint) => changed(&|measured| {
                let values = joint_vectors(measured).into_iter().flatten();
                for value in values.filter_map(|values| values.get_mut(*joint)) {
                    *value = -*value;
                }
            }),
            Self::ExchangedKinds => changed(&|measured| {
                if let Measured::Wrench(_, wrench) = measured {
                    std::mem::swap(&mut wrench.force, &mut wrench.moment);
                }
            }),
            Self::Poses(reading) => Cow::Owned(with_poses(events, *reading)),
        }
    }
}

/// Returns positions, velocities and efforts of all joints of a message.
fn joint_vectors(measured: &mut Measured) -> Option<[&mut Vec<f64>; 3]> {
    match measured {
        Measured::Joints(JointValues {
            position,
            velocity,
            effort,
        }) => Some([position, velocity, effort]),
        _ => None,
    }
}

/// Gives each of these joints the values that are given for the one before it.
fn exchange(measured: &mut Measured, joints: &[usize]) {
    for values in joint_vectors(measured).into_iter().flatten() {
        if joints.iter().all(|joint| *joint < values.len()) {
            for pair in joints.windows(2).rev() {
                values.swap(pair[0], pair[1]);
            }
        }
    }
}

/// Returns events whose poses of the base are read otherwise. Its velocities follow from the poses.
fn with_poses(events: &[Event], reading: PoseReading) -> Vec<Event> {
    let mut events = events.to_vec();
    let of_base = |event: &Event| match &event.measured {
        Measured::Base(base) => Some((event.time_s, reading.read(&base.pose))),
        _ => None,
    };
    let (times_s, poses): (Vec<_>, Vec<_>) = events.iter().filter_map(of_base).unzip();
    let mut states = states_of_poses(&times_s, &poses).into_iter();
    for event in &mut events {
        if let Measured::Base(base) = &mut event.measured
            && let Some(state) = states.next()
        {
            **base = BaseState {
                acceleration: base.acceleration,
                angular_acceleration: base.angular_acceleration,
                ..state
            };
        }
    }
    events
}

/// Returns the finding that another reading explains a recording better than the `given` one.
fn finding(sources: &Sources, given: &Reading, other: Reading, residual_ratio: f64) -> Finding {
    let names = sources.robot.joint_names();
    match other.values {
        Values::Given => {}
        Values::ExchangedJoints(joints) => {
            let joints = joints.iter().map(|index| names[*index].clone());
            return Finding::JointsExchanged {
                joints: joints.collect(),
                residual_ratio,
            };
        }
        Values::OppositeJoint(joint) => {
            return Finding::JointSignContradicted {
                joint: names[joint].clone(),
                residual_ratio,
            };
        }
        Values::ExchangedKinds => return Finding::ForcesAndMomentsExchanged { residual_ratio },
        Values::Poses(poses) => {
            return Finding::OrientationContradicted {
                reading: poses.orientation,
                of_base: sources.contents.motion == Motion::Joints,
                residual_ratio,
            };
        }
    }
    if other.equations.effort_content != given.equations.effort_content {
        return Finding::EffortContentContradicted {
            content: other.equations.effort_content,
            residual_ratio,
        };
    }
    if let Some(better) = other.equations.gravity
        && other.equations.gravity != given.equations.gravity
    {
        return Finding::Data(Data::GravityContradicted {
            better: better.into(),
            residual_ratio,
            method: given.equations.method,
        });
    }
    match other.sensors.into_iter().next() {
        Some(frame) if given.sensors.first() != Some(&frame) => Finding::PointContradicted {
            frame,
            residual_ratio,
        },
        _ => Finding::AxesContradicted {
            axes: other.equations.wrench_axes,
            residual_ratio,
        },
    }
}

/// Returns the reading in which the moments are about the origin of the link whose axes the
/// wrenches have.
fn other_point(plan: &Plan<'_>, given: &Reading) -> Option<Reading> {
    let axes = plan.equations.wrench_axes.clone()?;
    let is_link = plan.sources.robot.frame(&axes).is_ok();
    (is_link && plan.equations.method.uses_wrench()).then(|| Reading {
        equations: EquationSettings {
            wrench_axes: None,
            ..plan.equations.clone()
        },
        sensors: vec![axes; plan.sources.sensors.len()],
        ..given.clone()
    })
}

/// Returns the settings with other axes of the wrenches: those of the links that are fixed to the
/// base, or of the world, and those of the sensor.
fn other_axes(plan: &Plan<'_>) -> Vec<EquationSettings> {
    let Sources { robot, sensors, .. } = plan.sources;
    if !plan.equations.method.uses_wrench() || sensors.is_empty() {
        return Vec::new();
    }
    let axes = if robot.base_kind() == BaseKind::Fixed {
        links_of_base(robot)
    } else {
        vec![WORLD.to_owned()]
    };
    let axes = axes.into_iter().map(Some).chain([None]);
    axes.filter(|axes| *axes != plan.equations.wrench_axes)
        .map(|wrench_axes| EquationSettings {
            wrench_axes,
            ..plan.equations.clone()
        })
        .collect()
}

/// Returns the links that are fixed to the base, one for each orientation.
fn links_of_base(robot: &Manipulator) -> Vec<String> {
    let mut found: Vec<(String, UnitQuaternion<f64>)> = Vec::new();
    for name in robot.frame_names() {
        let frame = robot.frame(name).ok();
        let pose = frame.and_then(|frame| robot.fixed_transform(robot.base_frame(), frame));
        let Some(pose) = pose else { continue };
        let is_same = |other: &(_, UnitQuaternion<f64>)| {
            other.1.angle_to(&pose.rotation) < SAME_ORIENTATION_RAD
        };
        if !found.iter().any(is_same) {
            found.push((name.to_owned(), pose.rotation));
        }
    }
    found.into_iter().map(|(name, _)| name).collect()
}

/// Returns the settings with gravity as on Earth, of either sign, for an arm on a fixed base whose
/// efforts contain its own weight, or for which no gravity is given. Otherwise the wrenches show
/// which gravity acts on the payload.
fn other_gravities(plan: &Plan<'_>) -> Vec<EquationSettings> {
    let base = plan.sources.robot.base_kind();
    let given = plan.equations.gravity_for(base);
    let is_shown = given != Vector3::zeros() && !plan.equations.method.uses_effort();
    if base != BaseKind::Fixed || plan.streams.unloaded || is_shown {
        return Vec::new();
    }
    let down = base.default_gravity();
    let direction = given.try_normalize(0.0);
    let along = direction.map_or(down, |direction| direction * down.norm());
    [along, -along]
        .map(|gravity| EquationSettings {
            gravity: Some(gravity),
            ..plan.equations.clone()
        })
        .into()
}

/// Returns the settings with other contents of the joint efforts that the robot allows.
fn other_contents(plan: &Plan<'_>) -> Vec<EquationSettings> {
    let robot = &plan.sources.robot;
    if !plan.equations.method.uses_effort() || plan.streams.unloaded {
        return Vec::new();
    }
    let has_masses = robot
        .frame(&plan.tip)
        .is_ok_and(|tip| robot.check_masses(Some(tip)).is_ok());
    let contents = [
        EffortContent::Measured,
        EffortContent::WithoutGravity,
        EffortContent::External,
    ];
    contents
        .into_iter()
        .filter(|content| has_masses || *content == EffortContent::External)
        .filter(|content| *content != plan.equations.effort_content)
        .map(|effort_content| EquationSettings {
            effort_content,
            ..plan.equations.clone()
        })
        .collect()
}
