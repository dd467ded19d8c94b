//! The motion stream: from samples to the smoothed and differentiated motion at their times.

use tactid_dynamics::Manipulator;

use super::clock_watch::{ClockWatch, Order};
use super::continuation::Continuation;
use super::instant::Instant;
use super::sample::Sample;
use super::sample_ring::SampleRing;

/// Keeps the last samples, and computes the motion at the time of each from its neighbours, without
/// allocation.
#[derive(Clone, Debug)]
pub struct MotionStream {
    max_gap_s: f64,
    continuation: Continuation,
    samples: SampleRing,
    instant: Instant,
    clock: ClockWatch,
    /// Time of the first accepted sample, s.
    start_s: Option<f64>,
    accepted: u64,
    rejected: u64,
    gaps: u64,
}

/// What a sample adds to a [`MotionStream`].
#[derive(Clone, Copy, Debug)]
pub enum MotionStep<'a> {
    /// The sample has a number that is not finite, or has a magnitude of 1e30 or more, or it is not
    /// later than the one before, and was ignored.
    Rejected,
    /// The sample starts a new stretch without gaps: it is the first, comes after a gap, or follows
    /// samples that were earlier, because the clock had gone back.
    Started,
    /// The stretch has too few samples yet for an instant.
    Waiting,
    /// The instant that the sample completes, some samples earlier.
    Instant(&'a Instant),
}

impl MotionStream {
    /// Creates a stream of samples of a robot with so many wrenches, whose polynomials are accurate
    /// up to `cutoff_hz`.
    pub fn new(robot: &Manipulator, wrenches: usize, cutoff_hz: f64, max_gap_s: f64) -> Self {
        let joints = robot.dof();
        Self {
            max_gap_s,
            continuation: Continuation::new(robot),
            samples: SampleRing::new(joints, wrenches, cutoff_hz),
            instant: Instant::new(joints, wrenches),
            clock: ClockWatch::default(),
            start_s: None,
            accepted: 0,
            rejected: 0,
            gaps: 0,
        }
    }

    /// Adds a sample whose slices have the right lengths. Angles that start again after a turn are
    /// continued.
    pub fn push(&mut self, sample: &Sample<'_>) -> MotionStep<'_> {
        let passed_s = sample.time_s - self.time_s();
        let started = match self.clock.observe(sample, self.time_s()) {
            Order::Rejected => {
                self.rejected += 1;
                return MotionStep::Rejected;
            }
            Order::Follows => passed_s > self.max_gap_s,
            Order::Interrupted => true,
        };
        if started {
            self.gaps += u64::from(passed_s.is_finite());
            self.samples.start_stretch();
        }
        let position = self.continuation.push(sample.time_s, sample.joint_position);
        self.samples.push(&Sample {
            joint_position: position,
            ..*sample
        });
        self.start_s.get_or_insert(sample.time_s);
        self.accepted += 1;
        if started {
            return MotionStep::Started;
        }
        let Some(nodes) = self.samples.nodes() else {
            return MotionStep::Waiting;
        };
        self.instant.set(&nodes);
        MotionStep::Instant(&self.instant)
    }

    /// Lets the next sample start a stretch, because it does not follow the last one by the time
    /// that they say.
    pub(crate) fn interrupt(&mut self) {
        self.clock.interrupt();
    }

    /// Discards all samples and resets the counts, so that the same samples can be presented again.
    pub(crate) fn rewind(&mut self) {
        self.samples.clear();
        self.continuation.clear();
        self.start_s = None;
        (self.accepted, self.rejected, self.gaps) = (0, 0, 0);
        self.clock = ClockWatch::default();
    }

    /// Time of the last accepted sample, s; minus infinity before the first.
    pub fn time_s(&self) -> f64 {
        self.samples.time_s()
    }

    /// Longest time between two samples that is not a gap, s.
    pub fn max_gap_s(&self) -> f64 {
        self.max_gap_s
    }

    /// Number of samples that were accepted.
    pub fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Number of samples that were rejected: with a number that is not finite or beyond 1e30, or
    /// not later than the one before.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Number of gaps that were too long to be bridged, the times at which the clock went back
    /// among them.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Time from the first accepted sample to the last, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.start_s.map_or(0.0, |start_s| self.time_s() - start_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::sample::BaseState;

    /// Instants after the samples of these times, and the numbers of rejected samples and of gaps.
    fn counts(times_ms: impl Iterator<Item = u32>) -> (usize, u64, u64) {
        let robot = Manipulator::lone_body("flange");
        let mut stream = MotionStream::new(&robot, 0, 10.0, 0.1);
        let instants = times_ms
            .filter(|&time_ms| {
                let sample = Sample {
                    time_s: 1e-3 * f64::from(time_ms),
                    base: BaseState::fixed(),
                    joint_position: &[],
                    joint_velocity: &[],
                    joint_effort: &[],
                    wrenches: &[],
                };
                matches!(stream.push(&sample), MotionStep::Instant(_))
            })
            .count();
        (instants, stream.rejected(), stream.gaps())
    }

    /// Samples before and after a step of the clock are in no instant together, and the third one
    /// after it is used. A sample that comes late alone leaves the stretch whole.
    #[test]
    fn a_clock_that_went_back_starts_a_stretch() {
        let (whole, ..) = counts(0..1000);
        let (apart, ..) = counts(0..500);
        assert_eq!(counts((0..500).chain(450..952)), (2 * apart, 2, 1));
        assert!(2 * apart < whole);
        let far = counts((0..500).chain([4_000_000_000]).chain(500..1002));
        assert_eq!(far, (2 * apart, 2, 2));
        assert_eq!(
            counts((0..500).chain([480]).chain(500..1000)),
            (whole, 1, 0)
        );
    }
}
