//! Joint velocities against joint positions.

use std::f64::consts::PI;

use super::increments::Increments;
use super::judge;
use crate::Finding;
use crate::alignment::{Event, JointValues, Measured};
use crate::finding::VelocityCause;
use crate::recording::Sources;

/// Velocities of one joint that are not the derivative of its positions.
struct Contradiction {
    joint: String,
    relative_difference: f64,
    cause: Option<VelocityCause>,
}

/// Returns a finding for the joints of each cause.
pub(super) fn contradicted(sources: &Sources, events: &[Event], max_gap_s: f64) -> Vec<Finding> {
    let names = sources.robot.joint_names();
    let more_joints = &sources.streams.more_joints;
    let is_first = |joint: &usize| !more_joints.iter().flatten().any(|other| other == joint);
    let first: Vec<usize> = (0..names.len()).filter(is_first).collect();
    // The events of the first publisher have a place for every joint of the robot.
    let all = |measured: &Measured| match measured {
        Measured::Joints(values) => Some(pick(values, &first, names.len())),
        _ => None,
    };
    let mut found = of_publisher(&series(events, all), &first, names, max_gap_s);
    for (publisher, joints) in more_joints.iter().enumerate() {
        let own = |measured: &Measured| match measured {
            Measured::MoreJoints(of, values) if *of == publisher => Some(values.clone()),
            _ => None,
        };
        found.extend(of_publisher(&series(events, own), joints, names, max_gap_s));
    }
    group(found)
}

/// Returns the joint values of some events with their times.
fn series(
    events: &[Event],
    values: impl Fn(&Measured) -> Option<JointValues>,
) -> Vec<(f64, JointValues)> {
    let timed = events
        .iter()
        .map(|event| (event.time_s, values(&event.measured)));
    timed
        .filter_map(|(time_s, values)| Some((time_s, values?)))
        .collect()
}

/// Returns the positions and velocities of some of `count` joints.
fn pick(values: &JointValues, joints: &[usize], count: usize) -> JointValues {
    let pick = |all: &[f64]| -> Vec<f64> {
        let known = joints.iter().filter(|_| all.len() == count);
        known.map(|&joint| all[joint]).collect()
    };
    JointValues {
        position: pick(&values.position),
        velocity: pick(&values.velocity),
        effort: Vec::new(),
    }
}

/// Compares the velocities of one publisher with its positions; `joints` are the indices of its joints.
fn of_publisher(
    series: &[(f64, JointValues)],
    joints: &[usize],
    names: &[String],
    max_gap_s: f64,
) -> Vec<Contradiction> {
    let Some(increments) = Increments::new(series, max_gap_s, step) else {
        return Vec::new();
    };
    let count = joints.len();
    let difference = |joint: usize, other: usize, scale: f64| {
        let (change, integral) = (joint..joint + 1, count + other..count + other + 1);
        increments.relative_difference(change, integral, scale)
    };
    let contradiction = |joint: usize| {
        let own = [
            (-1.0, VelocityCause::OppositeSign),
            (PI / 180.0, VelocityCause::Degrees),
            (180.0 / PI, VelocityCause::PositionsInDegrees),
        ];
        let own = own.map(|(scale, cause)| Some((difference(joint, joint, scale)?, cause)));
        let others = (0..count).filter(|other| *other != joint).map(|other| {
            let cause = VelocityCause::OtherJoint(names[joints[other]].clone());
            Some((difference(joint, other, 1.0)?, cause))
        });
        let relative_difference = difference(joint, joint, 1.0)?;
        Some(Contradiction {
            joint: names[joints[joint]].clone(),
            relative_difference,
            cause: judge(relative_difference, own.into_iter().chain(others).flatten())?,
        })
    };
    (0..count).filter_map(contradiction).collect()
}

/// Returns the change of each joint's position, then the integral of each joint's velocity. A jump by more than half a
/// turn is that of an angle which starts again.
fn step(a: &JointValues, b: &JointValues, duration_s: f64) -> Option<Vec<f64>> {
    let count = a.position.len();
    if a.velocity.len() != count || b.velocity.len() != count {
        return None;
    }
    let changes = a.position.iter().zip(&b.position).map(|(a, b)| b - a);
    let changes: Vec<f64> = changes.collect();
    let means = a
        .velocity
        .iter()
        .zip(&b.velocity)
        .map(|(a, b)| 0.5 * (a + b));
    let has_jump = changes.iter().any(|change| change.abs() > PI);
    (!has_jump).then(|| {
        let integrals = means.map(|mean| mean * duration_s);
        changes.iter().copied().chain(integrals).collect()
    })
}

/// Puts joints with one cause together.
fn group(found: Vec<Contradiction>) -> Vec<Finding> {
    let mut groups: Vec<(Vec<String>, f64, Option<VelocityCause>)> = Vec::new();
    for one in found {
        match groups.iter_mut().find(|(_, _, cause)| *cause == one.cause) {
            Some((joints, largest, _)) => {
                joints.push(one.joint);
                *largest = largest.max(one.relative_difference);
            }
            None => groups.push((vec![one.joint], one.relative_difference, one.cause)),
        }
    }
    let finding = |(joints, relative_difference, cause)| Finding::VelocitiesContradicted {
        joints,
        relative_difference,
        cause,
    };
    groups.into_iter().map(finding).collect()
}
