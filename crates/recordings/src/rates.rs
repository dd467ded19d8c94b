//! Measured velocities of a recording against the positions that they belong to, and positions and
//! efforts against their limits.

use tactid_batch::Finding as DataFinding;
use tactid_dynamics::Manipulator;
use tactid_identify::checks::VelocityCause::NotMeasured;
use tactid_identify::checks::{
    EffortMonitor, JointRates, PositionMonitor, TwistRates, VelocityContradiction, grouped_by_cause,
};

use crate::Finding;
use crate::alignment::{Event, JointValues, Measured, first_joints};
use crate::defaults::Options;
use crate::recording::Sources;

/// Returns findings about measured velocities that are not the derivatives of the measured
/// positions, and about positions and efforts beyond the limits of the joints. Times between two
/// events that are gaps by the options are not bridged. Velocities that are not measured are
/// reported where the joints move the tip.
pub(crate) fn contradicted_rates(
    sources: &Sources,
    events: &[Event],
    options: &Options,
) -> Vec<Finding> {
    let (max_gap_s, tip) = (options.equations.max_gap_s, &options.tip);
    let more_joints = &sources.streams.more_joints;
    let contradictions = contradicted_joints(&sources.robot, tip, more_joints, events, max_gap_s);
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
    robot: &Manipulator,
    tip: &str,
    more_joints: &[Vec<usize>],
    events: &[Event],
    max_gap_s: f64,
) -> Vec<VelocityContradiction> {
    let count = robot.dof();
    let first = first_joints(count, more_joints);
    let mut rates = PublisherRates::new(first.len(), max_gap_s);
    for event in events {
        // The events of the first publisher have a place for every joint of the robot.
        if let Measured::Joints(values) = &event.measured {
            let (position, velocity) = pick(values, &first, count);
            rates.push(event.time_s, &position, &velocity);
        }
    }
    let mut found = rates.contradictions(robot, tip, &first);
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
        found.extend(rates.contradictions(robot, tip, joints));
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

    /// Returns each of some joints whose velocities are not the derivatives of its positions. Where
    /// they are not measured, there are none unless one of these joints moves the tip: those of a
    /// gripper do not matter.
    fn contradictions(
        &self,
        robot: &Manipulator,
        tip: &str,
        joints: &[usize],
    ) -> Vec<VelocityContradiction> {
        let names = robot.joint_names();
        let of_joints: Vec<&str> = joints.iter().map(|&joint| names[joint].as_str()).collect();
        let mut found = self.rates.contradictions(&of_joints);
        if !self.are_zero {
            return found;
        }
        let moves_tip = |name: &String| {
            let joint_and_tip = robot.joint_index(name).zip(robot.frame(tip).ok());
            joint_and_tip.is_some_and(|(joint, tip)| robot.moves(joint, tip))
        };
        if !found.iter().flat_map(|of| &of.joints).any(moves_tip) {
            return Vec::new();
        }
        for of_joint in &mut found {
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

#[cfg(test)]
pub(crate) mod tests {
    use tactid_dynamics::BaseKind;

    use super::*;

    /// Returns an arm of one joint, the elbow, whose tip carries a finger on a slide.
    pub(crate) fn arm_with_finger() -> Manipulator {
        let urdf = r#"<robot name="arm"><link name="base"/><link name="tip"/><link name="finger"/>
            <joint name="elbow" type="revolute"><parent link="base"/><child link="tip"/>
                <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
            <joint name="slide" type="prismatic"><parent link="tip"/><child link="finger"/>
                <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="9" velocity="9"/></joint></robot>"#;
        Manipulator::from_urdf(urdf, BaseKind::Fixed).unwrap()
    }

    /// Returns the joints whose velocities are not measured, by an arm of two publishers, one of
    /// which publishes velocities of zero: that of the elbow, or that of the finger.
    fn unmeasured(is_zero: [bool; 2]) -> Vec<String> {
        let robot = arm_with_finger();
        let more_joints = [vec![robot.joint_index("slide").unwrap()]];
        let elbow = robot.joint_index("elbow").unwrap();
        let mut events = Vec::new();
        for k in 0..5000 {
            let time_s = 0.001 * f64::from(k);
            let rate = |is_zero| if is_zero { 0.0 } else { time_s.cos() };
            let spread = |value: f64| {
                let mut all = vec![0.0; 2];
                all[elbow] = value;
                all
            };
            let values = |position, velocity| JointValues {
                position,
                velocity,
                effort: Vec::new(),
            };
            let at = time_s.sin();
            let of_arm = values(spread(at), spread(rate(is_zero[0])));
            let of_finger = values(vec![at], vec![rate(is_zero[1])]);
            for measured in [Measured::Joints(of_arm), Measured::MoreJoints(0, of_finger)] {
                events.push(Event { time_s, measured });
            }
        }
        let found = contradicted_joints(&robot, "tip", &more_joints, &events, 0.1);
        assert!(found.iter().all(|of| !of.are_measured()), "{found:?}");
        found.into_iter().flat_map(|of| of.joints).collect()
    }

    /// A gripper whose driver does not measure velocities says nothing about those of the arm.
    #[test]
    fn velocities_of_zero_of_a_gripper_do_not_matter() {
        assert_eq!(unmeasured([false, false]), [""; 0]);
        assert_eq!(unmeasured([false, true]), [""; 0]);
        assert_eq!(unmeasured([true, false]), ["elbow"]);
        assert_eq!(unmeasured([true, true]), ["elbow"]);
    }
}
