//! The aligner: all streams at the times of the joints.

use std::collections::VecDeque;

use tactid_dynamics::{BaseAcceleration, Manipulator, Wrench};
use tactid_identify::equations::Continuation;
use tactid_identify::{BaseState, Sample};

use super::event::{Event, JointValues, Measured, SpecificForce, Streams};
use super::stream::{Stream, ValueAt};

/// Time for which a sample waits for the other streams to reach its own, s.
const LONGEST_WAIT_S: f64 = 1.0;

/// All measurements at one time.
#[derive(Clone, Debug)]
pub(crate) struct Aligned {
    pub(crate) time_s: f64,
    pub(crate) joints: JointValues,
    pub(crate) base: BaseState,
    pub(crate) wrenches: Vec<Wrench>,
    pub(crate) unloaded: Option<JointValues>,
}

impl Aligned {
    /// Creates a place for measurements.
    pub(crate) fn empty() -> Self {
        Self {
            time_s: f64::NEG_INFINITY,
            joints: JointValues::default(),
            base: BaseState::fixed(),
            wrenches: Vec::new(),
            unloaded: None,
        }
    }

    /// Returns the sample for an equation stream.
    pub(crate) fn sample(&self) -> Sample<'_> {
        Sample {
            time_s: self.time_s,
            base: self.base,
            joint_position: &self.joints.position,
            joint_velocity: &self.joints.velocity,
            joint_effort: &self.joints.effort,
            wrenches: &self.wrenches,
        }
    }
}

/// Averages or interpolates all streams at the times of the joints. Memory is bounded: a sample
/// waits for at most [`LONGEST_WAIT_S`] beyond what is averaged.
#[derive(Clone, Debug)]
pub(crate) struct Aligner {
    streams: Streams,
    /// Delay of the wrenches' stamps relative to the motion, s.
    delay_s: f64,
    joints: VecDeque<(f64, JointValues)>,
    more_joints: Vec<ContinuedJoints>,
    base: Stream<BaseState>,
    acceleration: Stream<BaseAcceleration>,
    base_imu: Stream<SpecificForce>,
    wrenches: Vec<Stream<Wrench>>,
    unloaded: ContinuedJoints,
    newest_s: f64,
    longest_wait_s: f64,
    incomplete: u64,
}

impl Aligner {
    /// Creates an aligner for some streams of a robot. `delay_s` is subtracted from the times of
    /// the wrenches, and gaps longer than `max_gap_s` are not bridged.
    pub(crate) fn new(streams: Streams, robot: &Manipulator, delay_s: f64, max_gap_s: f64) -> Self {
        let averaging = &streams.averaging;
        let period_s = |periods_s: &[Option<f64>], k: usize| periods_s.get(k).copied().flatten();
        Self {
            delay_s,
            joints: VecDeque::new(),
            more_joints: streams
                .more_joints
                .iter()
                .enumerate()
                .map(|(k, joints)| ContinuedJoints {
                    continuation: Continuation::of_joints(robot, joints),
                    stream: Stream::new(max_gap_s, period_s(&averaging.more_joints, k)),
                })
                .collect(),
            base: Stream::new(max_gap_s, averaging.base),
            acceleration: Stream::new(max_gap_s, averaging.acceleration),
            base_imu: Stream::new(max_gap_s, averaging.base_imu),
            wrenches: (0..streams.wrenches)
                .map(|k| Stream::new(max_gap_s, period_s(&averaging.wrenches, k)))
                .collect(),
            unloaded: ContinuedJoints {
                continuation: Continuation::new(robot),
                stream: Stream::new(max_gap_s, None),
            },
            newest_s: f64::NEG_INFINITY,
            longest_wait_s: LONGEST_WAIT_S + averaging.reach_s(),
            incomplete: 0,
            streams,
        }
    }

    /// Number of samples that were left out because another stream has no value at their time.
    pub(crate) fn incomplete(&self) -> u64 {
        self.incomplete
    }

    /// Adds a measurement. One of a stream that is not aligned is ignored.
    pub(crate) fn push(&mut self, event: Event) {
        let time_s = event.time_s;
        match event.measured {
            Measured::Joints(values) if time_s > self.newest_s => {
                self.newest_s = time_s;
                self.joints.push_back((time_s, values));
            }
            Measured::Joints(_) => {}
            Measured::MoreJoints(publisher, values) => {
                if let Some(stream) = self.more_joints.get_mut(publisher) {
                    stream.push(time_s, values);
                }
            }
            Measured::Base(base) if self.streams.base => self.base.push(time_s, *base),
            Measured::Acceleration(value) if self.streams.acceleration => {
                self.acceleration.push(time_s, value);
            }
            Measured::Wrench(sensor, wrench) => {
                if let Some(stream) = self.wrenches.get_mut(sensor) {
                    stream.push(time_s - self.delay_s, wrench);
                }
            }
            Measured::BaseImu(value) if self.streams.base_imu.is_some() => {
                self.base_imu.push(time_s, value);
            }
            Measured::Unloaded(values) if self.streams.unloaded => {
                self.unloaded.push(time_s, values);
            }
            Measured::Base(_)
            | Measured::Acceleration(_)
            | Measured::BaseImu(_)
            | Measured::Unloaded(_) => {}
        }
    }

    /// Writes the next sample for which all streams have a value to `aligned`, which keeps the memory
    /// of its wrenches. Returns whether there is one: `false` until more events have come, with
    /// unspecified values.
    pub(crate) fn next_into(&mut self, aligned: &mut Aligned) -> bool {
        while let Some(time_s) = self.joints.front().map(|(time_s, _)| *time_s) {
            let is_due = self.newest_s - time_s >= self.longest_wait_s;
            // A sample is asked for with each event that follows its joints. The values are
            // computed once all streams have reached its time.
            if !is_due && self.lags(time_s) {
                return false;
            }
            let (missing, more_joints) = self.read_others(time_s, aligned);
            if missing.not_yet && !missing.never && !is_due {
                return false;
            }
            let Some((time_s, joints)) = self.joints.pop_front() else {
                return false;
            };
            if !missing.not_yet && !missing.never {
                (aligned.time_s, aligned.joints) = (time_s, joints);
                for (values, places) in more_joints.iter().zip(&self.streams.more_joints) {
                    fill(&mut aligned.joints, places, values);
                }
                if self.streams.without_velocities {
                    aligned.joints.velocity.clear();
                }
                return true;
            }
            self.incomplete += 1;
        }
        false
    }

    /// Returns whether some stream has not reached a time.
    fn lags(&self, time_s: f64) -> bool {
        let streams = &self.streams;
        self.wrenches.iter().any(|stream| stream.lags(time_s))
            || streams.base && self.base.lags(time_s)
            || streams.acceleration && self.acceleration.lags(time_s)
            || streams.base_imu.is_some() && self.base_imu.lags(time_s)
            || streams.unloaded && self.unloaded.stream.lags(time_s)
            || self.more_joints.iter().any(|of| of.stream.lags(time_s))
    }

    /// Writes the values of all streams but the joints' own at a time to `aligned`. Returns what is
    /// missing of them, and the joints of further publishers. Each stream is asked, because it then
    /// discards what it does not need any more.
    fn read_others(&mut self, time_s: f64, aligned: &mut Aligned) -> (Missing, Vec<JointValues>) {
        let mut missing = Missing::default();
        let mut more_joints = Vec::new();
        for stream in &mut self.more_joints {
            more_joints.extend(missing.check(stream.at(time_s)));
        }
        aligned.base = self.base_at(time_s, &mut missing);
        aligned.wrenches.clear();
        for stream in &mut self.wrenches {
            aligned.wrenches.extend(missing.check(stream.at(time_s)));
        }
        if self.streams.unloaded {
            aligned.unloaded = missing.check(self.unloaded.at(time_s));
        }
        (missing, more_joints)
    }

    /// Returns the state of the base at a time, with its measured accelerations.
    fn base_at(&mut self, time_s: f64, missing: &mut Missing) -> BaseState {
        let mut base = BaseState::fixed();
        if self.streams.base {
            base = missing.check(self.base.at(time_s)).unwrap_or(base);
        }
        if self.streams.acceleration
            && let Some(in_base) = missing.check(self.acceleration.at(time_s))
        {
            base.acceleration = Some(base.pose.rotation * in_base.linear);
            base.angular_acceleration = Some(base.pose.rotation * in_base.angular);
        }
        if let Some(gravity) = self.streams.base_imu
            && let Some(in_base) = missing.check(self.base_imu.at(time_s))
        {
            base.acceleration = Some(base.pose.rotation * in_base.linear + gravity);
            base.angular_velocity = base.pose.rotation * in_base.angular_velocity;
        }
        base
    }
}

/// The joints of one stream, whose angles go on where they start again after a turn: between the
/// ends of a turn there is nothing to interpolate. Those to whose times all are aligned are not
/// interpolated.
#[derive(Clone, Debug)]
struct ContinuedJoints {
    continuation: Continuation,
    stream: Stream<JointValues>,
}

impl ContinuedJoints {
    fn push(&mut self, time_s: f64, mut values: JointValues) {
        let position = self.continuation.push(time_s, &values.position).to_vec();
        values.position = position;
        self.stream.push(time_s, values);
    }

    fn at(&mut self, time_s: f64) -> ValueAt<JointValues> {
        self.stream.at(time_s)
    }
}

/// Whether a stream has no value at a time.
#[derive(Default)]
struct Missing {
    never: bool,
    not_yet: bool,
}

impl Missing {
    fn check<T>(&mut self, at: ValueAt<T>) -> Option<T> {
        match at {
            ValueAt::Known(value) => return Some(value),
            ValueAt::NotYet => self.not_yet = true,
            ValueAt::Never => self.never = true,
        }
        None
    }
}

/// Writes the joints of one publisher to their places among all.
fn fill(all: &mut JointValues, places: &[usize], values: &JointValues) {
    let pairs = [
        (&mut all.position, &values.position),
        (&mut all.velocity, &values.velocity),
        (&mut all.effort, &values.effort),
    ];
    for (all, values) in pairs {
        if values.len() != places.len() {
            // A quantity that one publisher does not measure is not known of the robot.
            all.clear();
        }
        if !all.is_empty() {
            for (&place, &value) in places.iter().zip(values) {
                all[place] = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use tactid_dynamics::Wrench;

    use super::*;

    fn wrench_of(x: f64) -> Wrench {
        Wrench {
            force: Vector3::new(x, 0.0, 0.0),
            moment: Vector3::new(0.0, -x, 0.0),
        }
    }

    fn joints(time_s: f64) -> Event {
        Event {
            time_s,
            measured: Measured::Joints(JointValues::default()),
        }
    }

    fn wrench(time_s: f64, x: f64) -> Event {
        Event {
            time_s,
            measured: Measured::Wrench(0, wrench_of(x)),
        }
    }

    fn next(aligner: &mut Aligner) -> Option<Aligned> {
        let mut aligned = Aligned::empty();
        aligner.next_into(&mut aligned).then_some(aligned)
    }

    fn one_wrench() -> Streams {
        Streams {
            wrenches: 1,
            ..Streams::default()
        }
    }

    /// A sample waits for a late stream, but not for one that has stopped, and missing values are
    /// counted.
    #[test]
    fn waits_for_a_late_stream_but_not_for_a_dead_one() {
        let mut aligner = Aligner::new(one_wrench(), &Manipulator::lone_body("tool0"), 0.0, 0.1);
        aligner.push(joints(0.00));
        aligner.push(joints(0.01));
        assert!(next(&mut aligner).is_none());
        aligner.push(wrench(-0.005, 1.0));
        aligner.push(wrench(0.005, 3.0));
        let first = next(&mut aligner).unwrap();
        assert_eq!(first.time_s, 0.0);
        assert!((first.wrenches[0].force.x - 2.0).abs() < 1e-12);
        assert!(next(&mut aligner).is_none());
        for k in 2..1000 {
            aligner.push(joints(0.01 * f64::from(k)));
            assert!(next(&mut aligner).is_none());
        }
        assert!(
            aligner.joints.len() < 110,
            "memory grows behind a stream that stopped"
        );
        assert!(aligner.incomplete > 880);
    }

    /// A wrench that is stamped late is paired with the motion that it belongs to.
    #[test]
    fn subtracts_the_delay() {
        let mut aligner = Aligner::new(one_wrench(), &Manipulator::lone_body("tool0"), 0.25, 1.0);
        aligner.push(joints(1.0));
        aligner.push(wrench(1.25, 7.0));
        let found = next(&mut aligner).unwrap();
        assert_eq!((found.time_s, found.wrenches[0]), (1.0, wrench_of(7.0)));
    }

    /// A wrench of a sensor that is not aligned is ignored.
    #[test]
    fn ignores_a_stream_that_is_not_aligned() {
        let mut aligner = Aligner::new(one_wrench(), &Manipulator::lone_body("tool0"), 0.0, 1.0);
        aligner.push(Event {
            time_s: 1.0,
            measured: Measured::Wrench(1, wrench_of(3.0)),
        });
        aligner.push(joints(1.0));
        aligner.push(wrench(1.0, 7.0));
        assert_eq!(next(&mut aligner).unwrap().wrenches, [wrench_of(7.0)]);
    }

    /// Joints of two publishers become one sample; what only one of them measures is not known of
    /// all.
    #[test]
    fn puts_publishers_together() {
        let streams = Streams {
            more_joints: vec![vec![1]],
            ..Streams::default()
        };
        let mut aligner = Aligner::new(streams, &Manipulator::lone_body("tool0"), 0.0, 0.1);
        let values = |position: Vec<f64>, velocity: Vec<f64>| JointValues {
            position,
            velocity,
            effort: vec![],
        };
        aligner.push(Event {
            time_s: 0.0,
            measured: Measured::Joints(values(vec![1.0, f64::NAN], vec![3.0, f64::NAN])),
        });
        aligner.push(Event {
            time_s: 0.0,
            measured: Measured::MoreJoints(0, values(vec![2.0], vec![])),
        });
        assert_eq!(
            next(&mut aligner).unwrap().joints,
            values(vec![1.0, 2.0], vec![])
        );
    }
}
