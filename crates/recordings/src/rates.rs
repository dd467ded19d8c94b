//! Measured velocities of a recording against the positions that they belong to, and positions and
//! efforts against their limits.

use tactid_batch::Finding as DataFinding;
use tactid_identify::EquationSettings;
use tactid_identify::checks::VelocityCause::NotMeasured;
use tactid_identify::checks::{
    EffortMonitor, JointRates, PositionMonitor, TwistRates, VelocityContradiction, grouped_by_cause,
};

use crate::Finding;
use crate::alignment::{Event, JointValues, Measured};
use crate::recording::Sources;

/// Returns findings about measured velocities that are not the derivatives of the measured
/// positions, and about positions and efforts beyond the limits of the joints. Times between two
/// events that are gaps by the settings are not bridged.
pub(crate) fn contradicted_rates(
    sources: &Sources,
    events: &[Event],
    settings: &EquationSettings,
) -> Vec<Finding> {
    let max_gap_s = settings.max_gap_s;
    let contradictions = contradicted_joints(sources, events, max_gap_s);
    let joints = grouped_by_cause(contradictions).into_iter();
    let finding = |joints| Finding::Data(DataFinding::VelocitiesContradicted(joints));
    // Positions in degrees are no integral of velocities in rad/s, and are the cause to name first.
    let mut findings = beyond_limits(sources, events);
    findings.extend(joints.map(finding));
    findings.extend(contradicted_twist(sources, events, max_gap_s));
    findings
}

/// Returns whether findings say that the velocities of joints are not measured, though they are
/// given.
pub(crate) fn are_unmeasured(findings: &[Finding]) -> bool {
    findings.iter().any(|finding| match finding {
        Finding::Data(DataFinding::VelocitiesContradicted(found)) => !found.are_measured(),
        _ => false,
    })
}

/// Compares the positions and the efforts of all joints with the limits of the robot's description.
fn beyond_limits(sources: &Sources, events: &[Event]) -> Vec<Finding> {
    let mut positions = PositionMonitor::new(&sources.robot);
    let mut efforts = EffortMonitor::new(&sources.robot, f64::INFINITY);
    for event in events {
        if let Measured::Joints(values) = &event.measured {
            // A position of exactly zero may be that of a joint which the recording does not have.
            let measured = values.position.iter().enumerate();
            for (joint, &position) in measured.filter(|(_, position)| **position != 0.0) {
                positions.push(joint, event.time_s, position);
            }
            for (joint, &effort) in values.effort.iter().enumerate() {
                efforts.push(joint, event.time_s, effort);
            }
        }
        if let Measured::MoreJoints(publisher, values) = &event.measured {
            let joints = &sources.streams.more_joints[*publisher];
            for (&joint, &position) in joints.iter().zip(&values.position) {
                positions.push(joint, event.time_s, position);
            }
            for (&joint, &effort) in joints.iter().zip(&values.effort) {
                efforts.push(joint, event.time_s, effort);
            }
        }
    }
    let positions = positions.beyond_limits(f64::INFINITY);
    let efforts = efforts.beyond_limits();
    let found = [
        positions.map(DataFinding::PositionsBeyondLimits),
        efforts.map(DataFinding::EffortsBeyondLimits),
    ];
    found.into_iter().flatten().map(Finding::Data).collect()
}

/// Compares the velocities of each publisher of joint states with its positions.
fn contradicted_joints(
    sources: &Sources,
    events: &[Event],
    max_gap_s: f64,
) -> Vec<VelocityContradiction> {
    let names = sources.robot.joint_names();
    let more_joints = &sources.streams.more_joints;
    let is_first = |joint: &usize| !more_joints.iter().flatten().any(|other| other == joint);
    let first: Vec<usize> = (0..names.len()).filter(is_first).collect();
    let own_names =
        |joints: &[usize]| -> Vec<&str> { joints.iter().map(|&k| names[k].as_str()).collect() };
    let mut rates = PublisherRates::new(first.len(), max_gap_s);
    for event in events {
        // The events of the first publisher have a place for every joint of the robot.
        if let Measured::Joints(values) = &event.measured {
            let (position, velocity) = pick(values, &first, names.len());
            rates.push(event.time_s, &position, &velocity);
        }
    }
    let mut found = rates.contradictions(&own_names(&first));
    for (publisher, joints) in more_joints.iter().enumerate() {
        let mut rates = PublisherRates::new(joints.len(), max_gap_s);
        for event in events {
            match &event.measured {
                Measured::MoreJoints(of, values) if *of == publisher => {
                    rates.push(event.time_s, &values.position, &values.velocity);
                }
                _ => {}
            }
        }
        found.extend(rates.contradictions(&own_names(joints)));
    }
    found
}

/// The rates of the joints of one publisher.
struct PublisherRates {
    rates: JointRates,
    /// Whether all velocities are exactly zero.
    are_zero: bool,
}

impl PublisherRates {
    fn new(joints: usize, max_gap_s: f64) -> Self {
        Self {
            rates: JointRates::new(joints, max_gap_s, None),
            are_zero: true,
        }
    }

    fn push(&mut self, time_s: f64, position: &[f64], velocity: &[f64]) {
        self.are_zero &= velocity.iter().all(|velocity| *velocity == 0.0);
        self.rates.push(time_s, position, velocity);
    }

    /// Returns each joint whose velocities are not the derivatives of its positions.
    fn contradictions(&self, names: &[&str]) -> Vec<VelocityContradiction> {
        let mut found = self.rates.contradictions(names);
        for of_joint in found.iter_mut().filter(|_| self.are_zero) {
            (of_joint.cause, of_joint.other) = (Some(NotMeasured), None);
        }
        found
    }
}

/// Returns the positions and velocities of some of `count` joints; empty where there are none.
fn pick(values: &JointValues, joints: &[usize], count: usize) -> (Vec<f64>, Vec<f64>) {
    let pick = |all: &[f64]| -> Vec<f64> {
        let known = joints.iter().filter(|_| all.len() == count);
        known.map(|&joint| all[joint]).collect()
    };
    (pick(&values.position), pick(&values.velocity))
}

/// Returns a finding if the measured twist is not the derivative of the measured pose.
fn contradicted_twist(sources: &Sources, events: &[Event], max_gap_s: f64) -> Option<Finding> {
    let (source, axes) = sources.measured_twist.as_ref()?;
    let mut rates = TwistRates::new(*axes, max_gap_s, None);
    for event in events {
        if let Measured::Base(base) = &event.measured {
            rates.push(event.time_s, base);
        }
    }
    Some(Finding::Data(DataFinding::TwistContradicted {
        source: source.clone(),
        contradiction: rates.contradiction()?,
    }))
}
