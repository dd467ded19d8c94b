//! Streams of measurements, brought onto the joints' clock.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use tactid_dynamics::{BaseAcceleration, Wrench};

use crate::BaseState;
use crate::stencil::weights;

/// How long a sample waits for the other streams to reach its time, s.
const PATIENCE_S: f64 = 1.0;

/// A weighted sum of values whose weights sum to one: what interpolation needs.
pub(crate) trait Blend: Clone {
    fn blend(values: &[(f64, &Self)]) -> Self;
}

fn sum<T>(values: &[(f64, &T)], of: fn(&T) -> Vector3<f64>) -> Vector3<f64> {
    values
        .iter()
        .map(|(weight, value)| of(value) * *weight)
        .sum()
}

impl Blend for Wrench {
    fn blend(values: &[(f64, &Self)]) -> Self {
        Self {
            force: sum(values, |wrench| wrench.force),
            moment: sum(values, |wrench| wrench.moment),
        }
    }
}

impl Blend for BaseAcceleration {
    fn blend(values: &[(f64, &Self)]) -> Self {
        Self {
            linear: sum(values, |acceleration| acceleration.linear),
            angular: sum(values, |acceleration| acceleration.angular),
        }
    }
}

impl Blend for BaseState {
    fn blend(values: &[(f64, &Self)]) -> Self {
        let first = values[0].1.pose.rotation.coords;
        let rotation: nalgebra::Vector4<f64> = values
            .iter()
            .map(|(weight, base)| {
                let coords = base.pose.rotation.coords;
                // Either sign is the same rotation: all on the side of the first.
                coords * weight.copysign(*weight * coords.dot(&first))
            })
            .sum();
        let measured = |of: fn(&Self) -> Option<Vector3<f64>>| -> Option<Vector3<f64>> {
            values
                .iter()
                .map(|(weight, base)| Some(of(base)? * *weight))
                .sum()
        };
        Self {
            pose: Isometry3::from_parts(
                sum(values, |base| base.pose.translation.vector).into(),
                UnitQuaternion::new_normalize(Quaternion::from(rotation)),
            ),
            velocity: sum(values, |base| base.velocity),
            angular_velocity: sum(values, |base| base.angular_velocity),
            acceleration: measured(|base| base.acceleration),
            angular_acceleration: measured(|base| base.angular_acceleration),
        }
    }
}

/// What an inertial unit feels, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Felt {
    /// `p̈ - g`, m/s².
    pub(crate) force: Vector3<f64>,
    /// rad/s.
    pub(crate) angular_velocity: Vector3<f64>,
}

impl Blend for Felt {
    fn blend(values: &[(f64, &Self)]) -> Self {
        Self {
            force: sum(values, |felt| felt.force),
            angular_velocity: sum(values, |felt| felt.angular_velocity),
        }
    }
}

/// What some joints measured at one time. Velocity and effort are empty where they are not known.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct JointValues {
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) effort: Vec<f64>,
}

impl Blend for JointValues {
    fn blend(values: &[(f64, &Self)]) -> Self {
        let blend = |of: fn(&Self) -> &Vec<f64>| -> Vec<f64> {
            let length = values.iter().map(|(_, v)| of(v).len()).min().unwrap_or(0);
            let at = |k| values.iter().map(|(weight, v)| weight * of(v)[k]).sum();
            (0..length).map(at).collect()
        };
        Self {
            position: blend(|v| &v.position),
            velocity: blend(|v| &v.velocity),
            effort: blend(|v| &v.effort),
        }
    }
}

/// What a stream has to say about a time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum At<T> {
    Value(T),
    /// The stream has not come so far.
    NotYet,
    /// The stream has begun later, or has a gap there.
    Never,
}

/// One measured quantity over time.
#[derive(Clone, Debug)]
pub(crate) struct Stream<T> {
    samples: VecDeque<(f64, T)>,
    max_gap_s: f64,
}

impl<T: Blend> Stream<T> {
    pub(crate) fn new(max_gap_s: f64) -> Self {
        Self {
            samples: VecDeque::new(),
            max_gap_s,
        }
    }

    /// Adds a sample; one that is not later than the last is dropped.
    pub(crate) fn push(&mut self, time_s: f64, value: T) {
        if self.samples.back().is_none_or(|(last, _)| time_s > *last) {
            self.samples.push_back((time_s, value));
        }
    }

    /// The value at a time: of the cubic through two samples before it and two after, or of the line
    /// between its neighbours beside a gap. Times asked for must not decrease: what lies before is
    /// forgotten.
    pub(crate) fn at(&mut self, time_s: f64) -> At<T> {
        while self
            .samples
            .get(2)
            .is_some_and(|(third, _)| *third <= time_s)
        {
            self.samples.pop_front();
        }
        let right = self.samples.partition_point(|(time, _)| *time <= time_s);
        let Some(left) = right.checked_sub(1) else {
            return if self.samples.is_empty() {
                At::NotYet
            } else {
                At::Never
            };
        };
        if self.samples[left].0 == time_s {
            return At::Value(self.samples[left].1.clone());
        }
        let Some((after_s, after)) = self.samples.get(right) else {
            return At::NotYet;
        };
        let (before_s, before) = &self.samples[left];
        if after_s - before_s > self.max_gap_s {
            return At::Never;
        }
        let beyond = self.samples.get(right + 1);
        if left > 0 && beyond.is_none() {
            return At::NotYet;
        }
        let first = left.checked_sub(1).map(|k| &self.samples[k]);
        match (first, beyond) {
            (Some(first), Some(last))
                if before_s - first.0 <= self.max_gap_s && last.0 - after_s <= self.max_gap_s =>
            {
                let nodes = [first.0, *before_s, *after_s, last.0];
                let [w, ..] = weights(&nodes, time_s);
                At::Value(T::blend(&[
                    (w[0], &first.1),
                    (w[1], before),
                    (w[2], after),
                    (w[3], &last.1),
                ]))
            }
            _ => {
                let part = (time_s - before_s) / (after_s - before_s);
                At::Value(T::blend(&[(1.0 - part, before), (part, after)]))
            }
        }
    }
}

/// Joints as measured at one time, in the robot's order.
#[derive(Clone, Debug)]
pub(crate) struct JointSample {
    pub(crate) time_s: f64,
    pub(crate) values: JointValues,
}

/// One message's content, with its time on the log's clock.
#[derive(Clone, Debug)]
pub(crate) struct Event {
    pub(crate) time_s: f64,
    pub(crate) what: Measured,
}

/// What a message measured.
#[derive(Clone, Debug)]
pub(crate) enum Measured {
    /// Joints of the group whose clock all else is brought to; others' entries wait to be filled.
    Joints(JointValues),
    /// Joints of another publisher, by its number.
    MoreJoints(usize, JointValues),
    Base(BaseState),
    /// The moving body's acceleration, expressed in its own frame.
    Acceleration(BaseAcceleration),
    Wrench(usize, Wrench),
    /// By the inertial unit on the base.
    Felt(Felt),
    /// Joints of the recording without the payload, on this recording's clock.
    Unloaded(JointValues),
}

/// What there is to align.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// For each further publisher of joints: which of the robot's joints it has.
    pub(crate) more_joints: Vec<Vec<usize>>,
    pub(crate) base: bool,
    pub(crate) acceleration: bool,
    /// With an inertial unit on the base: the gravitational acceleration, m/s².
    pub(crate) felt_gravity: Option<Vector3<f64>>,
    pub(crate) wrenches: usize,
    pub(crate) unloaded: bool,
}

/// All that was measured at one time.
#[derive(Clone, Debug)]
pub(crate) struct Aligned {
    pub(crate) time_s: f64,
    pub(crate) joints: JointValues,
    pub(crate) base: BaseState,
    pub(crate) wrenches: Vec<Wrench>,
    pub(crate) unloaded: Option<JointValues>,
}

/// Brings everything onto the joints' clock.
#[derive(Clone, Debug)]
pub(crate) struct Aligner {
    layout: Layout,
    /// By how much later than the motion wrenches are stamped, s.
    delay_s: f64,
    joints: VecDeque<JointSample>,
    more_joints: Vec<Stream<JointValues>>,
    base: Stream<BaseState>,
    acceleration: Stream<BaseAcceleration>,
    felt: Stream<Felt>,
    wrenches: Vec<Stream<Wrench>>,
    unloaded: Stream<JointValues>,
    newest_s: f64,
    /// Samples for which some stream had no value.
    pub(crate) incomplete: u64,
}

impl Aligner {
    pub(crate) fn new(layout: Layout, delay_s: f64, max_gap_s: f64) -> Self {
        Self {
            delay_s,
            joints: VecDeque::new(),
            more_joints: vec![Stream::new(max_gap_s); layout.more_joints.len()],
            base: Stream::new(max_gap_s),
            acceleration: Stream::new(max_gap_s),
            felt: Stream::new(max_gap_s),
            wrenches: vec![Stream::new(max_gap_s); layout.wrenches],
            unloaded: Stream::new(max_gap_s),
            newest_s: f64::NEG_INFINITY,
            incomplete: 0,
            layout,
        }
    }

    pub(crate) fn push(&mut self, event: Event) {
        let time_s = event.time_s;
        match event.what {
            Measured::Joints(values) if time_s > self.newest_s => {
                self.newest_s = time_s;
                self.joints.push_back(JointSample { time_s, values });
            }
            Measured::Joints(_) => {}
            Measured::MoreJoints(part, values) => self.more_joints[part].push(time_s, values),
            Measured::Base(base) => self.base.push(time_s, base),
            Measured::Acceleration(value) => self.acceleration.push(time_s, value),
            Measured::Wrench(sensor, wrench) => {
                self.wrenches[sensor].push(time_s - self.delay_s, wrench);
            }
            Measured::Felt(felt) => self.felt.push(time_s, felt),
            Measured::Unloaded(values) => self.unloaded.push(time_s, values),
        }
    }

    /// The next time at which everything is known; `None` until more has come.
    pub(crate) fn next(&mut self) -> Option<Aligned> {
        while let Some(time_s) = self.joints.front().map(|sample| sample.time_s) {
            match self.others(time_s) {
                At::NotYet if self.newest_s - time_s < PATIENCE_S => return None,
                At::NotYet | At::Never => {
                    self.joints.pop_front();
                    self.incomplete += 1;
                }
                At::Value(others) => {
                    let sample = self.joints.pop_front()?;
                    return Some(self.complete(sample, others));
                }
            }
        }
        None
    }

    /// What the other streams have to say about a time.
    fn others(&mut self, time_s: f64) -> At<Others> {
        let mut missing = Missing::default();
        let mut parts = Vec::new();
        for stream in &mut self.more_joints {
            parts.extend(missing.take(stream.at(time_s)));
        }
        let mut base = BaseState::fixed();
        if self.layout.base {
            base = missing.take(self.base.at(time_s)).unwrap_or(base);
        }
        if self.layout.acceleration
            && let Some(own) = missing.take(self.acceleration.at(time_s))
        {
            base.acceleration = Some(base.pose.rotation * own.linear);
            base.angular_acceleration = Some(base.pose.rotation * own.angular);
        }
        if let Some(gravity) = self.layout.felt_gravity
            && let Some(felt) = missing.take(self.felt.at(time_s))
        {
            base.acceleration = Some(base.pose.rotation * felt.force + gravity);
            base.angular_velocity = base.pose.rotation * felt.angular_velocity;
        }
        let mut wrenches = Vec::with_capacity(self.wrenches.len());
        for stream in &mut self.wrenches {
            wrenches.extend(missing.take(stream.at(time_s)));
        }
        let unloaded = self.layout.unloaded.then(|| missing.take(self.unloaded.at(time_s)));
        match missing {
            Missing { never: true, .. } => At::Never,
            Missing { waiting: true, .. } => At::NotYet,
            Missing { .. } => At::Value(Others {
                parts,
                base,
                wrenches,
                unloaded: unloaded.flatten(),
            }),
        }
    }

    /// A sample of the joints with what belongs to it.
    fn complete(&self, sample: JointSample, others: Others) -> Aligned {
        let mut joints = sample.values;
        for (part, places) in others.parts.iter().zip(&self.layout.more_joints) {
            fill(&mut joints, places, part);
        }
        Aligned {
            time_s: sample.time_s,
            joints,
            base: others.base,
            wrenches: others.wrenches,
            unloaded: others.unloaded,
        }
    }
}

/// What is known at a time of a sample, beside the sample itself.
#[derive(Clone, Debug, PartialEq)]
struct Others {
    /// Of each further publisher of joints.
    parts: Vec<JointValues>,
    base: BaseState,
    wrenches: Vec<Wrench>,
    unloaded: Option<JointValues>,
}

/// Why a sample is not complete.
#[derive(Default)]
struct Missing {
    never: bool,
    waiting: bool,
}

impl Missing {
    fn take<T>(&mut self, at: At<T>) -> Option<T> {
        match at {
            At::Value(value) => return Some(value),
            At::NotYet => self.waiting = true,
            At::Never => self.never = true,
        }
        None
    }
}

/// Puts the joints of one publisher into their places among all.
fn fill(joints: &mut JointValues, places: &[usize], part: &JointValues) {
    let pairs = [
        (&mut joints.position, &part.position),
        (&mut joints.velocity, &part.velocity),
        (&mut joints.effort, &part.effort),
    ];
    for (all, part) in pairs {
        if part.len() != places.len() {
            // What one publisher does not measure is not known of all.
            all.clear();
        }
        if !all.is_empty() {
            for (&place, &value) in places.iter().zip(part) {
                all[place] = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(x: f64) -> Wrench {
        Wrench {
            force: Vector3::new(x, 0.0, 0.0),
            moment: Vector3::new(0.0, -x, 0.0),
        }
    }

    fn joints(time_s: f64) -> Event {
        Event {
            time_s,
            what: Measured::Joints(JointValues::default()),
        }
    }

    fn wrench(time_s: f64, x: f64) -> Event {
        Event {
            time_s,
            what: Measured::Wrench(0, push(x)),
        }
    }

    /// A cubic is met between its samples; on a sample the value is the sample, bit by bit.
    #[test]
    fn interpolates_and_is_exact_on_a_sample() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 30.0 * t * t - 100.0 * t * t * t;
        let mut stream = Stream::new(1.0);
        for time_s in [0.1, 0.19, 0.31, 0.4] {
            stream.push(time_s, push(cubic(time_s)));
        }
        stream.push(0.4, push(9.0));
        assert_eq!(stream.at(0.0), At::Never);
        assert_eq!(stream.at(0.1), At::Value(push(cubic(0.1))));
        let At::Value(middle) = stream.at(0.25) else {
            panic!("no value between two samples")
        };
        assert!((middle.force.x - cubic(0.25)).abs() < 1e-12);
        assert_eq!(stream.at(0.31), At::Value(push(cubic(0.31))));
        assert_eq!(
            stream.at(0.35),
            At::NotYet,
            "the next sample may still come"
        );
    }

    /// A turn through half of the quaternions' sphere is interpolated along the shorter way,
    /// whatever sign the quaternions were written with.
    #[test]
    fn interpolates_rotations_of_either_sign() {
        let turned = |angle: f64, sign: f64| {
            let q = UnitQuaternion::from_euler_angles(0.0, 0.0, angle);
            let q = UnitQuaternion::new_unchecked(q.into_inner() * sign);
            let mut base = BaseState::fixed();
            base.pose.rotation = q;
            base
        };
        let mut stream = Stream::new(1.0);
        for (k, sign) in [1.0, -1.0, 1.0, -1.0].into_iter().enumerate() {
            stream.push(0.1 * k as f64, turned(0.1 * k as f64, sign));
        }
        let At::Value(middle) = stream.at(0.15) else {
            panic!("no value between two samples")
        };
        let target = turned(0.15, 1.0).pose.rotation;
        assert!(middle.pose.rotation.angle_to(&target) < 1e-5);
    }

    /// A gap is cut out, not bridged.
    #[test]
    fn does_not_bridge_a_gap() {
        let mut stream = Stream::new(0.05);
        stream.push(0.0, push(1.0));
        stream.push(0.2, push(2.0));
        assert_eq!(stream.at(0.1), At::Never);
        assert_eq!(stream.at(0.2), At::Value(push(2.0)));
    }

    /// A sample waits for a late stream, but not for one that has stopped; what it lacked is counted.
    #[test]
    fn waits_for_a_late_stream_but_not_for_a_dead_one() {
        let layout = Layout {
            wrenches: 1,
            ..Layout::default()
        };
        let mut aligner = Aligner::new(layout, 0.0, 0.1);
        aligner.push(joints(0.00));
        aligner.push(joints(0.01));
        assert!(aligner.next().is_none());
        aligner.push(wrench(-0.005, 1.0));
        aligner.push(wrench(0.005, 3.0));
        let first = aligner.next().unwrap();
        assert_eq!(first.time_s, 0.0);
        assert!((first.wrenches[0].force.x - 2.0).abs() < 1e-12);
        assert!(aligner.next().is_none());
        for k in 2..1000 {
            aligner.push(joints(0.01 * f64::from(k)));
            assert!(aligner.next().is_none());
        }
        assert!(
            aligner.joints.len() < 110,
            "memory grows behind a stream that stopped"
        );
        assert!(aligner.incomplete > 880);
    }

    /// A wrench that is stamped late is taken for the motion that it belongs to.
    #[test]
    fn takes_off_the_delay() {
        let layout = Layout {
            wrenches: 1,
            ..Layout::default()
        };
        let mut aligner = Aligner::new(layout, 0.25, 1.0);
        aligner.push(joints(1.0));
        aligner.push(wrench(1.25, 7.0));
        let found = aligner.next().unwrap();
        assert_eq!((found.time_s, found.wrenches[0]), (1.0, push(7.0)));
    }

    /// Two publishers' joints become one sample; what only one of them measures is not known of all.
    #[test]
    fn puts_publishers_together() {
        let layout = Layout {
            more_joints: vec![vec![1]],
            ..Layout::default()
        };
        let mut aligner = Aligner::new(layout, 0.0, 0.1);
        let values = |position: Vec<f64>, velocity: Vec<f64>| JointValues {
            position,
            velocity,
            effort: vec![],
        };
        aligner.push(Event {
            time_s: 0.0,
            what: Measured::Joints(values(vec![1.0, f64::NAN], vec![3.0, f64::NAN])),
        });
        aligner.push(Event {
            time_s: 0.0,
            what: Measured::MoreJoints(0, values(vec![2.0], vec![])),
        });
        assert_eq!(
            aligner.next().unwrap().joints,
            values(vec![1.0, 2.0], vec![])
        );
    }
}
