//! Means of the raw samples over short bins, of which a trajectory is estimated.

use std::ops::Range;

use tactid_dynamics::{BaseKind, Manipulator};
use tactid_identify::IdentifyError;
use tactid_identify::equations::{Continuation, EquationSettings, Sample};

use super::{MotionEstimate, SETTINGS};

/// Where the channels of a bin are: positions and velocities of the joints, pose and velocities of
/// the base (position, velocity, quaternion, angular velocity), its accelerations as far as they are
/// measured (linear, angular), efforts, and wrenches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub(super) joints: usize,
    pub(super) sensors: usize,
    /// Whether the linear and the angular acceleration of the base are measured.
    pub(super) has_accelerations: [bool; 2],
}

impl Layout {
    /// Channels of a joint's position and velocity, or, after the joints, of those of the base.
    pub(super) fn channels_of(self, coordinate: usize) -> [usize; 2] {
        match coordinate.checked_sub(self.joints) {
            None => [coordinate, coordinate + self.joints],
            Some(axis) => [self.position() + axis, self.position() + 3 + axis],
        }
    }

    /// First channel of the base's position, followed by its velocity.
    pub(super) fn position(self) -> usize {
        2 * self.joints
    }

    /// First channel of the base's quaternion x, y, z, w.
    pub(super) fn quaternion(self) -> usize {
        self.position() + 6
    }

    /// First channel of the base's angular velocity in the inertial frame.
    pub(super) fn angular_velocity(self) -> usize {
        self.quaternion() + 4
    }

    /// Channels of the base's linear and angular acceleration in the inertial frame, none where
    /// they are not measured.
    pub(super) fn accelerations(self) -> [Range<usize>; 2] {
        let first = self.angular_velocity() + 3;
        let [linear, angular] = self.has_accelerations.map(|has| 3 * usize::from(has));
        let middle = first + linear;
        [first..middle, middle..middle + angular]
    }

    /// Channel of the second derivative of half the square of the quaternion, which is zero, beside
    /// a measured angular acceleration, which does not determine it.
    pub(super) fn lengthening(self) -> Option<usize> {
        self.has_accelerations[1].then_some(self.accelerations()[1].end)
    }

    /// First channel of the joint efforts, after those of the motion.
    pub(super) fn effort(self) -> usize {
        self.accelerations()[1].end + usize::from(self.has_accelerations[1])
    }

    /// First channel of the wrenches, force and moment of each sensor.
    pub(super) fn wrenches(self) -> usize {
        self.effort() + self.joints
    }

    /// Number of coordinates: the joints, the position of the base, and its quaternion.
    pub(super) fn coordinates(self) -> usize {
        self.joints + 3 + 4
    }

    /// Number of channels.
    pub(super) fn count(self) -> usize {
        self.wrenches() + 6 * self.sensors
    }
}

/// The mean of the samples of a bin.
#[derive(Clone, Debug)]
pub(super) struct Bin {
    /// Mean time of the samples, s.
    pub(super) time_s: f64,
    /// Mean square distance of the times from their mean, s².
    pub(super) spread_s2: f64,
    /// Means of the channels, in the order of the [`Layout`].
    pub(super) values: Vec<f64>,
}

/// Sums over the samples of a bin, relative to the first of them.
#[derive(Clone, Debug)]
struct Sums {
    count: f64,
    first_s: f64,
    times_s: f64,
    squares_s2: f64,
    values: Vec<f64>,
}

impl Sums {
    fn clear(&mut self) {
        (self.count, self.times_s, self.squares_s2) = (0.0, 0.0, 0.0);
        self.values.fill(0.0);
    }
}

/// Bins of the samples of a free-floating robot, stretch by stretch.
#[derive(Clone, Debug)]
pub(crate) struct SampleBins {
    layout: Layout,
    continuation: Continuation,
    length_s: f64,
    /// Bins of each stretch without gaps; empty where samples lack what a trajectory needs.
    stretches: Vec<Vec<Bin>>,
    sums: Sums,
    /// Channels of the last sample.
    last: Vec<f64>,
    count: usize,
    /// Why a trajectory cannot be estimated together with the payload.
    unsuited: Option<MotionEstimate>,
}

impl SampleBins {
    /// Creates the bins of a robot with so many wrench sensors. They stay empty where motion and
    /// payload are not estimated at once, for the `given` reason or one in the settings.
    pub(crate) fn new(
        robot: &Manipulator,
        sensors: usize,
        settings: &EquationSettings,
        given: Option<MotionEstimate>,
    ) -> Self {
        let joints = robot.dof();
        let layout = Layout {
            joints,
            sensors,
            has_accelerations: [false; 2],
        };
        let unsuited = check_suited(robot, settings).err();
        let unsuited = unsuited.map(|_| MotionEstimate::Smoothed);
        Self {
            layout,
            continuation: Continuation::new(robot),
            length_s: length_s(),
            stretches: Vec::new(),
            sums: Sums {
                count: 0.0,
                first_s: 0.0,
                times_s: 0.0,
                squares_s2: 0.0,
                values: vec![0.0; layout.count()],
            },
            last: vec![0.0; layout.count()],
            count: 0,
            unsuited: unsuited.or(given),
        }
    }

    /// Where the channels are.
    pub(super) fn layout(&self) -> Layout {
        self.layout
    }

    /// The bins of each stretch without gaps.
    pub(super) fn stretches(&self) -> &[Vec<Bin>] {
        &self.stretches
    }

    /// Returns whether further samples of a recording are left out, which bounds time and memory.
    pub(crate) fn is_full(&self) -> bool {
        let of_memory = SETTINGS.most_entries / self.layout.coordinates().pow(2);
        self.count >= SETTINGS.most_bins.min(of_memory)
    }

    /// Why a trajectory cannot be estimated together with the payload, as far as settings and
    /// samples show it at once.
    pub(super) fn unsuited(&self) -> Option<MotionEstimate> {
        self.unsuited
    }

    /// Adds a sample whose slices fit the robot; `starts` where it follows a gap.
    pub(crate) fn push(&mut self, sample: &Sample<'_>, starts: bool) {
        if self.unsuited.is_none() {
            self.unsuited = self.unsuited_by(sample);
        }
        if self.unsuited.is_some() {
            self.stretches.clear();
            return;
        }
        if self.stretches.is_empty() {
            self.layout.has_accelerations = has_accelerations(sample);
            let count = self.layout.count();
            self.sums.values.resize(count, 0.0);
            self.last.resize(count, 0.0);
        }
        if starts || self.stretches.is_empty() {
            self.finish();
            self.stretches.push(Vec::new());
        } else if sample.time_s - self.sums.first_s >= self.least_s() {
            self.finish();
        }
        self.set_last(sample);
        let sums = &mut self.sums;
        if sums.count == 0.0 {
            sums.first_s = sample.time_s;
        }
        let since_s = sample.time_s - sums.first_s;
        sums.count += 1.0;
        sums.times_s += since_s;
        sums.squares_s2 += since_s * since_s;
        for (sum, value) in sums.values.iter_mut().zip(&self.last) {
            *sum += value;
        }
    }

    /// Least time from the first sample of the open bin to that of the next. Of one and of two samples
    /// in a bin, the bin has the number whose time is nearer to its length.
    fn least_s(&self) -> f64 {
        let fraction = if self.sums.count == 1.0 {
            2.0 / 3.0
        } else {
            1.0
        };
        self.length_s * fraction
    }

    /// Returns what a sample lacks.
    fn unsuited_by(&self, sample: &Sample<'_>) -> Option<MotionEstimate> {
        let is_first = self.stretches.is_empty();
        if sample.joint_velocity.len() != self.layout.joints {
            Some(MotionEstimate::NoVelocities)
        } else {
            let is_other = !is_first && has_accelerations(sample) != self.layout.has_accelerations;
            is_other.then_some(MotionEstimate::Smoothed)
        }
    }

    /// Returns the bins that are complete since the last gap.
    pub(super) fn newest(&self) -> &[Bin] {
        self.stretches.last().map_or(&[], Vec::as_slice)
    }

    /// Forgets all samples. The next one starts a stretch, and shows which accelerations there are.
    pub(super) fn clear(&mut self) {
        self.stretches.clear();
        self.sums.clear();
        self.count = 0;
    }

    /// Forgets the bins of the last stretch before a time, s.
    pub(super) fn forget(&mut self, until_s: f64) {
        if let Some(newest) = self.stretches.last_mut() {
            let earlier = newest.partition_point(|bin| bin.time_s < until_s);
            newest.drain(..earlier);
            self.count -= earlier;
        }
    }

    /// Mean time of the samples of the last bin, s; `None` where there is none.
    pub(crate) fn end_s(&self) -> Option<f64> {
        self.newest().last().map(|bin| bin.time_s)
    }

    /// Ends the bin.
    pub(crate) fn finish(&mut self) {
        let sums = &mut self.sums;
        let Some(stretch) = self.stretches.last_mut().filter(|_| sums.count > 0.0) else {
            return;
        };
        let weight = sums.count.recip();
        let mean_s = sums.times_s * weight;
        stretch.push(Bin {
            time_s: sums.first_s + mean_s,
            spread_s2: (sums.squares_s2 * weight - mean_s * mean_s).max(0.0),
            values: sums.values.iter().map(|sum| sum * weight).collect(),
        });
        self.count += 1;
        sums.clear();
    }

    /// Writes the channels of a sample. Angles and the sign of the quaternion continue those of the
    /// sample before.
    fn set_last(&mut self, sample: &Sample<'_>) {
        let layout = self.layout;
        let joints = layout.joints;
        let positions = self.continuation.push(sample.time_s, sample.joint_position);
        let base = &sample.base;
        let rotation = base.pose.rotation.coords;
        let last = &mut self.last;
        let before = &last[layout.quaternion()..layout.angular_velocity()];
        let along: f64 = rotation.iter().zip(before).map(|(a, b)| a * b).sum();
        let rotation = rotation * 1f64.copysign(along);
        last[..joints].copy_from_slice(positions);
        last[joints..2 * joints].copy_from_slice(sample.joint_velocity);
        let of_base = base.pose.translation.vector.iter().chain(&base.velocity);
        let of_base = of_base.chain(&rotation).chain(&base.angular_velocity);
        let accelerations = base.acceleration.iter().chain(&base.angular_acceleration);
        let of_base = of_base.chain(accelerations.flat_map(|vector| vector.iter()));
        let (effort, wrenches) = (layout.effort(), layout.wrenches());
        for (place, value) in last[layout.position()..effort].iter_mut().zip(of_base) {
            *place = *value;
        }
        let efforts = last[effort..wrenches].iter_mut().zip(sample.joint_effort);
        efforts.for_each(|(place, value)| *place = *value);
        for (place, wrench) in last[wrenches..].chunks_exact_mut(6).zip(sample.wrenches) {
            place[..3].copy_from_slice(wrench.force.as_slice());
            place[3..].copy_from_slice(wrench.moment.as_slice());
        }
    }
}

/// Length of a bin, s.
fn length_s() -> f64 {
    1.0 / (SETTINGS.bins_of_interval * SETTINGS.knots_hz)
}

/// Checks that a robot and settings allow motion and payload to be estimated at once.
///
/// # Errors
/// Returns [`IdentifyError::Option`] with what excludes it, whatever the samples are.
pub(super) fn check_suited(
    robot: &Manipulator,
    settings: &EquationSettings,
) -> Result<(), IdentifyError> {
    let is_fixed = robot.base_kind() != BaseKind::Floating || robot.dof() == 0;
    let gains = &settings.effort_gain_std_dev;
    let has_gains = gains.iter().any(|std_dev| *std_dev > 0.0);
    let (option, what) = if is_fixed {
        ("robot", "of a robot whose base is fixed or has no joints")
    } else if settings.wrench_offset {
        ("wrench_offset", "beside an unknown offset of the wrenches")
    } else if settings.unknowns.any() {
        ("unknowns", "beside other unknowns")
    } else if settings.unmeasured != [false; 6] {
        (
            "unmeasured",
            "where channels of the wrenches are not measured",
        )
    } else if settings.shared_noise_s >= length_s() {
        ("shared_noise_s", "from wrenches that are interpolated")
    } else if settings.method.uses_effort() && has_gains {
        (
            "effort_gain_std_dev",
            "beside uncertain gains of the efforts",
        )
    } else {
        return Ok(());
    };
    Err(IdentifyError::Option {
        option,
        what: format!(
            "`{option}`: LagIdentifier does not estimate motion and payload {what}: use Identifier"
        ),
    })
}

/// Returns whether a sample has the linear and the angular acceleration of the base.
pub(super) fn has_accelerations(sample: &Sample<'_>) -> [bool; 2] {
    let base = &sample.base;
    [base.acceleration, base.angular_acceleration].map(|measured| measured.is_some())
}

#[cfg(test)]
mod tests {
    use tactid_identify::BaseState;

    use super::*;

    /// A recording has at most 6000 bins, and fewer of a robot with many joints.
    #[test]
    fn bins_are_bounded() {
        for (joints, most) in [(8, 6000), (20, 1851)] {
            let chain = (0..joints).map(|k| {
                format!(
                    r#"<link name="{}"/><joint name="{k}" type="continuous"><parent link="{k}"/>
                       <child link="{}"/></joint>"#,
                    k + 1,
                    k + 1
                )
            });
            let chain: String = chain.collect();
            let urdf = format!(r#"<robot name="chain"><link name="0"/>{chain}</robot>"#);
            let robot = Manipulator::from_urdf(&urdf, BaseKind::Floating).unwrap();
            let mut bins = SampleBins::new(&robot, 0, &EquationSettings::default(), None);
            let zeros = vec![0.0; joints];
            let mut time_s = 0.0;
            while !bins.is_full() {
                let sample = Sample {
                    time_s,
                    base: BaseState::fixed(),
                    joint_position: &zeros,
                    joint_velocity: &zeros,
                    joint_effort: &zeros,
                    wrenches: &[],
                };
                bins.push(&sample, time_s == 0.0);
                time_s += 0.02;
            }
            assert_eq!(bins.stretches()[0].len(), most);
        }
    }
}
