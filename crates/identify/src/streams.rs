//! Streams of measurements, brought onto the joints' clock.

use std::collections::VecDeque;

use nalgebra::Isometry3;
use tactid_dynamics::Wrench;

use crate::BaseState;

/// How long a sample waits for the other streams to reach its time, s.
const PATIENCE_S: f64 = 1.0;

/// A value between two others in time.
pub(crate) trait Interpolate: Clone {
    /// `self` at 0, `later` at 1.
    fn interpolate(&self, later: &Self, part: f64) -> Self;
}

impl Interpolate for Wrench {
    fn interpolate(&self, later: &Self, part: f64) -> Self {
        Self {
            force: self.force.lerp(&later.force, part),
            moment: self.moment.lerp(&later.moment, part),
        }
    }
}

impl Interpolate for BaseState {
    fn interpolate(&self, later: &Self, part: f64) -> Self {
        Self {
            pose: Isometry3::from_parts(
                self.pose
                    .translation
                    .vector
                    .lerp(&later.pose.translation.vector, part)
                    .into(),
                self.pose.rotation.nlerp(&later.pose.rotation, part),
            ),
            velocity: self.velocity.lerp(&later.velocity, part),
            angular_velocity: self.angular_velocity.lerp(&later.angular_velocity, part),
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

impl<T: Interpolate> Stream<T> {
    pub(crate) fn new(max_gap_s: f64) -> Self {
        Self {
            samples: VecDeque::new(),
            max_gap_s,
        }
    }

    /// Adds a sample; one that is not later than the last is dropped and gives `false`.
    pub(crate) fn push(&mut self, time_s: f64, value: T) -> bool {
        let later = self.samples.back().is_none_or(|(last, _)| time_s > *last);
        if later {
            self.samples.push_back((time_s, value));
        }
        later
    }

    /// The value at a time. Times asked for must not decrease: what lies before is forgotten.
    pub(crate) fn at(&mut self, time_s: f64) -> At<T> {
        while self.samples.get(1).is_some_and(|(next, _)| *next <= time_s) {
            self.samples.pop_front();
        }
        match (self.samples.front(), self.samples.get(1)) {
            (Some((time, value)), _) if *time == time_s => At::Value(value.clone()),
            (Some((time, _)), _) if *time > time_s => At::Never,
            (Some((before, value)), Some((after, next))) => {
                if after - before > self.max_gap_s {
                    return At::Never;
                }
                At::Value(value.interpolate(next, (time_s - before) / (after - before)))
            }
            _ => At::NotYet,
        }
    }
}

/// Joints as measured at one time, in the robot's order.
#[derive(Clone, Debug)]
pub(crate) struct JointSample {
    pub(crate) time_s: f64,
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
}

/// All that was measured at one time.
#[derive(Clone, Debug)]
pub(crate) struct Aligned {
    pub(crate) joints: JointSample,
    pub(crate) base: BaseState,
    pub(crate) wrenches: Vec<Wrench>,
}

/// Brings base and wrenches onto the joints' clock.
#[derive(Clone, Debug)]
pub(crate) struct Aligner {
    joints: VecDeque<JointSample>,
    /// `None` where the base is fixed.
    pub(crate) base: Option<Stream<BaseState>>,
    pub(crate) wrenches: Vec<Stream<Wrench>>,
    newest_s: f64,
}

impl Aligner {
    pub(crate) fn new(floating: bool, wrenches: usize, max_gap_s: f64) -> Self {
        Self {
            joints: VecDeque::new(),
            base: floating.then(|| Stream::new(max_gap_s)),
            wrenches: vec![Stream::new(max_gap_s); wrenches],
            newest_s: f64::NEG_INFINITY,
        }
    }

    /// Forgets every sample.
    pub(crate) fn clear(&mut self) {
        self.joints.clear();
        for stream in &mut self.wrenches {
            stream.samples.clear();
        }
        if let Some(stream) = &mut self.base {
            stream.samples.clear();
        }
        self.newest_s = f64::NEG_INFINITY;
    }

    pub(crate) fn push_joints(&mut self, sample: JointSample) {
        self.newest_s = self.newest_s.max(sample.time_s);
        self.joints.push_back(sample);
    }

    /// The next time at which everything is known; `None` until more has come.
    pub(crate) fn next(&mut self) -> Option<Aligned> {
        while let Some(joints) = self.joints.pop_front() {
            let base = match &mut self.base {
                Some(stream) => stream.at(joints.time_s),
                None => At::Value(BaseState::fixed()),
            };
            let mut complete = matches!(base, At::Value(_));
            let mut waiting = base == At::NotYet;
            let mut wrenches = Vec::with_capacity(self.wrenches.len());
            for stream in &mut self.wrenches {
                match stream.at(joints.time_s) {
                    At::Value(wrench) => wrenches.push(wrench),
                    At::NotYet => waiting = true,
                    At::Never => complete = false,
                }
            }
            complete &= wrenches.len() == self.wrenches.len();
            match base {
                At::Value(base) if complete => {
                    return Some(Aligned {
                        joints,
                        base,
                        wrenches,
                    });
                }
                _ => {}
            }
            if waiting && self.newest_s - joints.time_s < PATIENCE_S {
                self.joints.push_front(joints);
                return None;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn push(x: f64) -> Wrench {
        Wrench {
            force: Vector3::new(x, 0.0, 0.0),
            moment: Vector3::new(0.0, -x, 0.0),
        }
    }

    fn joints(time_s: f64) -> JointSample {
        JointSample {
            time_s,
            position: vec![],
            velocity: vec![],
        }
    }

    /// Between samples the value is on the straight line; on a sample it is the sample, bit by bit.
    #[test]
    fn interpolates_and_is_exact_on_a_sample() {
        let mut stream = Stream::new(1.0);
        assert!(stream.push(0.1, push(1.0)));
        assert!(stream.push(0.3, push(2.0)));
        assert!(!stream.push(0.3, push(9.0)));
        assert_eq!(stream.at(0.0), At::Never);
        assert_eq!(stream.at(0.1), At::Value(push(1.0)));
        let At::Value(middle) = stream.at(0.25) else {
            panic!("no value between two samples")
        };
        assert!((middle.force.x - 1.75).abs() < 1e-12);
        assert_eq!(stream.at(0.3), At::Value(push(2.0)));
        assert_eq!(stream.at(0.31), At::NotYet);
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

    /// A sample waits for a late stream, but not for one that has stopped.
    #[test]
    fn waits_for_a_late_stream_but_not_for_a_dead_one() {
        let mut aligner = Aligner::new(false, 1, 0.1);
        aligner.push_joints(joints(0.00));
        aligner.push_joints(joints(0.01));
        assert!(aligner.next().is_none());
        aligner.wrenches[0].push(-0.005, push(1.0));
        aligner.wrenches[0].push(0.005, push(3.0));
        let first = aligner.next().unwrap();
        assert_eq!(first.joints.time_s, 0.0);
        assert!((first.wrenches[0].force.x - 2.0).abs() < 1e-12);
        assert!(aligner.next().is_none());
        for k in 2..1000 {
            aligner.push_joints(joints(0.01 * f64::from(k)));
            assert!(aligner.next().is_none());
        }
        assert!(
            aligner.joints.len() < 110,
            "memory grows behind a stream that stopped"
        );
    }
}
