//! Channels of wrench sensors that measure nothing: zero or no number in all samples, as drivers
//! fill what a sensor with three axes or one does not have.

use tactid_batch::Finding as DataFinding;
use tactid_dynamics::Manipulator;
use tactid_identify::EquationSettings;
use tactid_identify::checks::{ChannelMonitor, ConstantChannels, FEWEST_SAMPLES};

use crate::Finding;
use crate::alignment::{Event, Measured, first_joints};
use crate::recording::Sources;

/// Motion of a joint that moves the sensor, rad or m, beside which noise and the load would change
/// some channel.
const LARGE_MOTION: f64 = 0.3;

/// The moments of a wrench.
const MOMENTS: [bool; 6] = [false, false, false, true, true, true];

/// In which axes the channels of the wrenches are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChannelAxes {
    /// Those of the only sensor, which does not move relative to the tip: each channel can be
    /// missing by itself.
    OfTheSensor,
    /// Those of several sensors, of one that moves, or other ones: where moments are missing, the
    /// moments about the tip are not known, but the forces are.
    Turning,
}

impl ChannelAxes {
    /// Returns the axes of sensors whose wrenches are summed in the frame `tip`.
    pub(crate) fn new(
        robot: &Manipulator,
        sensors: &[String],
        tip: &str,
        equations: &EquationSettings,
    ) -> Self {
        let [sensor] = sensors else {
            return Self::Turning;
        };
        let is_fixed = match (robot.frame(sensor), robot.frame(tip)) {
            (Ok(sensor), Ok(tip)) => robot.fixed_transform(sensor, tip).is_some(),
            _ => false,
        };
        if is_fixed && equations.wrench_axes.is_none() {
            Self::OfTheSensor
        } else {
            Self::Turning
        }
    }

    /// Returns the axes of the sensors of a recording.
    fn of(sources: &Sources, tip: &str, equations: &EquationSettings) -> Self {
        Self::new(&sources.robot, &sources.sensors, tip, equations)
    }

    /// Returns which channels the equations are without, given those that each sensor does not
    /// measure: channels of the only sensor, or all moments.
    fn left_out(self, of_sensors: &[[bool; 6]]) -> [bool; 6] {
        let any: [bool; 6] = std::array::from_fn(|k| of_sensors.iter().any(|each| each[k]));
        match self {
            Self::OfTheSensor => any,
            Self::Turning if has_only_moments(&any) => MOMENTS,
            Self::Turning => [false; 6],
        }
    }

    /// Returns the channels of one sensor that have no number in any of some wrenches, but not all,
    /// if the equations can be without them. They are read as zero.
    pub(crate) fn without_numbers(self, wrenches: impl Iterator<Item = [f64; 6]>) -> [bool; 6] {
        let none = in_all(wrenches, |value| !value.is_finite());
        match self {
            Self::Turning if !has_only_moments(&none) => [false; 6],
            _ => none,
        }
    }
}

/// Returns whether there are channels, and all of them are moments.
fn has_only_moments(channels: &[bool; 6]) -> bool {
    channels[..3] == [false; 3] && channels[3..].contains(&true)
}

/// Returns which channels, but not all, measure nothing in every one of some wrenches.
fn in_all(
    wrenches: impl Iterator<Item = [f64; 6]>,
    measures_nothing: impl Fn(f64) -> bool,
) -> [bool; 6] {
    let mut in_all = [true; 6];
    for wrench in wrenches {
        for (channel, value) in in_all.iter_mut().zip(wrench) {
            *channel &= measures_nothing(value);
        }
    }
    if in_all == [true; 6] {
        [false; 6]
    } else {
        in_all
    }
}

/// Returns the channels that each sensor does not measure: they are zero or no number in every one
/// of its wrenches, which follow each other, one of each sensor in turn.
pub(crate) fn unmeasured_in_all(sources: &Sources, wrenches: &[f64]) -> Vec<[bool; 6]> {
    let count = sources.sensors.len();
    let six = wrenches.chunks_exact(6);
    let wrenches = six.filter_map(|wrench| <[f64; 6]>::try_from(wrench).ok());
    let of_sensor = |sensor| {
        let wrenches = wrenches.clone().skip(sensor).step_by(count);
        in_all(wrenches, |value| value == 0.0 || !value.is_finite())
    };
    (0..count).map(of_sensor).collect()
}

/// Returns the channels that the equations are without because some sensor does not measure them,
/// given those of each sensor.
pub(crate) fn without_channels(
    sources: &Sources,
    tip: &str,
    equations: &EquationSettings,
    of_sensors: &[[bool; 6]],
) -> [bool; 6] {
    ChannelAxes::of(sources, tip, equations).left_out(of_sensors)
}

/// Returns the channels that each sensor does not measure in the beginning of a recording: they are
/// zero there, as those that have `no_numbers` are read.
pub(crate) fn unmeasured_channels(no_numbers: &[[bool; 6]], events: &[Event]) -> Vec<[bool; 6]> {
    let mut monitor = ChannelMonitor::new(no_numbers.len());
    for event in events {
        if let Measured::Wrench(sensor, wrench) = &event.measured {
            monitor.push(*sensor, event.time_s, wrench);
        }
    }
    let mut unmeasured = vec![[false; 6]; no_numbers.len()];
    for (sensor, zero) in zero_channels(&monitor) {
        // A sensor of which all channels are zero feels nothing: no contact, as of a finger. What
        // has no number is not measured all the same.
        unmeasured[sensor] = if zero == [true; 6] {
            no_numbers[sensor]
        } else {
            zero
        };
    }
    unmeasured
}

/// Returns the channels of each sensor that are zero in all samples, if there are any.
fn zero_channels(monitor: &ChannelMonitor) -> impl Iterator<Item = (usize, [bool; 6])> {
    let constant = monitor.constant_channels(f64::INFINITY).into_iter();
    constant
        .filter(|channels| channels.is_zero)
        .map(|channels| (channels.sensor, channels.mask()))
}

/// The channels of the wrenches as they are measured, before they are averaged.
pub(crate) struct WrenchChannels {
    monitor: ChannelMonitor,
    /// What follows the last change of each sensor.
    constant: Vec<ConstantWrench>,
    /// Indices of the joints of the first publisher among the robot's.
    first_joints: Vec<usize>,
    /// The same of each further publisher.
    more_joints: Vec<Vec<usize>>,
    axes: ChannelAxes,
    /// Channels that the equations are without.
    left_out: [bool; 6],
    /// Channels that each sensor does not measure in the beginning.
    unmeasured: Vec<[bool; 6]>,
}

impl WrenchChannels {
    /// Creates the channels of the sensors of a recording, given those that each does not measure
    /// in the beginning.
    pub(crate) fn new(
        sources: &Sources,
        tip: &str,
        equations: &EquationSettings,
        unmeasured: &[[bool; 6]],
    ) -> Self {
        let (robot, more_joints) = (&sources.robot, &sources.streams.more_joints);
        let constant = |sensor: &String| ConstantWrench::new(robot, sensor);
        Self {
            monitor: ChannelMonitor::new(unmeasured.len()),
            constant: sources.sensors.iter().map(constant).collect(),
            first_joints: first_joints(robot.dof(), more_joints),
            more_joints: more_joints.clone(),
            axes: ChannelAxes::of(sources, tip, equations),
            left_out: equations.unmeasured,
            unmeasured: unmeasured.to_vec(),
        }
    }

    /// Adds an event, if it is a wrench or a motion of joints.
    pub(crate) fn push(&mut self, event: &Event) {
        match &event.measured {
            Measured::Wrench(sensor, wrench) => {
                self.monitor.push(*sensor, event.time_s, wrench);
                if let Some(constant) = self.constant.get_mut(*sensor) {
                    constant.push(self.monitor.changed_s(*sensor));
                }
            }
            Measured::Joints(values) => {
                for k in 0..self.first_joints.len() {
                    let joint = self.first_joints[k];
                    if let Some(&to) = values.position.get(joint) {
                        self.move_to(joint, to);
                    }
                }
            }
            Measured::MoreJoints(publisher, values) => {
                for (k, &to) in values.position.iter().enumerate() {
                    self.move_to(self.more_joints[*publisher][k], to);
                }
            }
            _ => {}
        }
    }

    fn move_to(&mut self, joint: usize, to: f64) {
        for constant in &mut self.constant {
            constant.move_to(joint, to);
        }
    }

    /// Reports the sensors whose wrenches are constant from a time on although joints move.
    fn stopped(&self, sources: &Sources) -> impl Iterator<Item = Finding> {
        let sensors = self.constant.iter().enumerate();
        let stopped = sensors.filter(|(_, constant)| constant.is_stopped());
        stopped.map(|(sensor, constant)| {
            let all = ConstantChannels::new(sensor, [true; 6], false);
            finding(all, false, Some(constant), self.axes, sources)
        })
    }

    /// Reports the channels of each sensor that did not change in the last `span_s` seconds, or
    /// never for an infinite span, and those that were left out because they measured nothing in
    /// the beginning.
    pub(crate) fn findings(&self, span_s: f64, sources: &Sources) -> Vec<Finding> {
        let left_out = self.left_out_channels().into_iter();
        let left_out = left_out.map(|channels| (channels, true));
        let used = self.left_out.map(|is_left_out| !is_left_out);
        let constant = self.monitor.constant_channels(span_s).into_iter();
        let constant = constant.map(|each| {
            let of_used = both(&each.mask(), &used);
            let channels = ConstantChannels::new(each.sensor, of_used, each.is_zero);
            (channels, false)
        });
        left_out
            .chain(constant)
            .filter(|(channels, _)| !channels.channels.is_empty())
            .map(|(channels, is_left_out)| finding(channels, is_left_out, None, self.axes, sources))
            .chain(self.stopped(sources).filter(|_| span_s.is_infinite()))
            .collect()
    }

    /// Returns the channels of each sensor that were left out: those that are zero, then those that
    /// measured nothing in the beginning and do later.
    fn left_out_channels(&self) -> Vec<ConstantChannels> {
        let zero: Vec<_> = zero_channels(&self.monitor).collect();
        let always = zero
            .iter()
            .map(|(sensor, zero)| ConstantChannels::new(*sensor, both(zero, &self.left_out), true));
        let later = self.unmeasured.iter().enumerate().map(|(sensor, own)| {
            let zero = zero.iter().find(|(index, _)| *index == sensor);
            let is_zero = zero.map_or([false; 6], |(_, zero)| *zero);
            let later = both(&both(own, &self.left_out), &is_zero.map(|is_zero| !is_zero));
            ConstantChannels::new(sensor, later, false)
        });
        always.chain(later).collect()
    }
}

/// The wrenches of one sensor since its last change.
#[derive(Clone, Debug)]
struct ConstantWrench {
    /// Whether each joint of the robot moves the sensor.
    moves: Vec<bool>,
    /// Time of the last change, s.
    changed_s: f64,
    /// Number of wrenches since then, and of all.
    samples: u64,
    all: u64,
    /// First position of each joint since then, rad or m, NaN before there is one, and the largest
    /// distance of one of them that moves the sensor from there.
    position: Vec<f64>,
    moved: f64,
}

impl ConstantWrench {
    fn new(robot: &Manipulator, sensor: &str) -> Self {
        let sensor = robot.frame(sensor).ok();
        let moves = |joint| sensor.is_some_and(|sensor| robot.moves(joint, sensor));
        Self {
            moves: (0..robot.dof()).map(moves).collect(),
            changed_s: 0.0,
            samples: 0,
            all: 0,
            position: vec![f64::NAN; robot.dof()],
            moved: 0.0,
        }
    }

    /// Adds a wrench of a sensor that changed at a time, s.
    fn push(&mut self, changed_s: f64) {
        if changed_s != self.changed_s {
            self.position.fill(f64::NAN);
            (self.changed_s, self.samples, self.moved) = (changed_s, 0, 0.0);
        }
        self.samples += 1;
        self.all += 1;
    }

    fn move_to(&mut self, joint: usize, to: f64) {
        let from = &mut self.position[joint];
        if from.is_nan() {
            *from = to;
        }
        if self.moves[joint] {
            self.moved = self.moved.max((to - *from).abs());
        }
    }

    fn is_stopped(&self) -> bool {
        self.changed_s.is_finite() && self.samples > FEWEST_SAMPLES && self.moved > LARGE_MOTION
    }
}

/// Returns the channels that both masks have.
fn both(a: &[bool; 6], b: &[bool; 6]) -> [bool; 6] {
    std::array::from_fn(|k| a[k] && b[k])
}

/// Reports the channels of each sensor that were left out because they are zero, or no number, in
/// all wrenches.
pub(crate) fn left_out_channels(
    equations: &EquationSettings,
    sources: &Sources,
    tip: &str,
    unmeasured: &[[bool; 6]],
) -> Vec<Finding> {
    let axes = ChannelAxes::of(sources, tip, equations);
    let of_sensors = unmeasured.iter().enumerate().map(|(sensor, own)| {
        let own = std::array::from_fn(|k| own[k] && equations.unmeasured[k]);
        ConstantChannels::new(sensor, own, true)
    });
    of_sensors
        .filter(|channels| !channels.channels.is_empty())
        .map(|channels| finding(channels, true, None, axes, sources))
        .collect()
}

fn finding(
    of: ConstantChannels,
    is_left_out: bool,
    stopped: Option<&ConstantWrench>,
    axes: ChannelAxes,
    sources: &Sources,
) -> Finding {
    let moments = of.mask()[3..]
        .iter()
        .filter(|is_listed| **is_listed)
        .count();
    let are_others = sources.sensors.len() > 1 || moments < 3;
    Finding::Data(DataFinding::ConstantChannels {
        source: sources.wrench_names[of.sensor].clone(),
        frame: sources.sensors[of.sensor].clone(),
        channels: of.channels.into_iter().map(Into::into).collect(),
        is_zero: of.is_zero,
        is_left_out,
        without_moments: is_left_out && axes == ChannelAxes::Turning && are_others,
        since_s: stopped.map(|constant| constant.changed_s),
        is_most: stopped.is_some_and(|constant| 2 * constant.samples >= constant.all),
    })
}

#[cfg(test)]
mod tests {
    use tactid_dynamics::Wrench;

    use super::*;
    use crate::alignment::JointValues;
    use crate::rates::tests::arm_with_finger;

    /// A wrench that is constant beside the motion of a finger may be right, but not beside that of
    /// a joint which moves the sensor, whichever publisher measures it.
    #[test]
    fn only_joints_that_move_the_sensor_show_that_it_has_stopped() {
        let robot = arm_with_finger();
        let place = |name: &str| robot.joint_index(name).unwrap();
        let is_stopped = |moving: &str, of_another: bool| {
            let others = if of_another {
                vec![vec![place(moving)]]
            } else {
                Vec::new()
            };
            let mut channels = WrenchChannels {
                monitor: ChannelMonitor::new(1),
                constant: vec![ConstantWrench::new(&robot, "tip")],
                axes: ChannelAxes::OfTheSensor,
                left_out: [false; 6],
                unmeasured: vec![[false; 6]],
                first_joints: first_joints(robot.dof(), &others),
                more_joints: others,
            };
            for k in 0..2000 {
                let time_s = 0.001 * f64::from(k);
                let mut push = |measured| channels.push(&Event { time_s, measured });
                let mut position = vec![0.0; 2];
                if of_another {
                    let of_other = JointValues {
                        position: vec![1.0 + 0.5 * time_s],
                        ..JointValues::default()
                    };
                    push(Measured::MoreJoints(0, of_other));
                } else {
                    position[place(moving)] = 1.0 + 0.5 * time_s;
                }
                push(Measured::Joints(JointValues {
                    position,
                    ..JointValues::default()
                }));
                let mut wrench = Wrench::zero();
                wrench.force.x = time_s.min(0.5);
                push(Measured::Wrench(0, wrench));
            }
            channels.constant[0].is_stopped()
        };
        for of_another in [false, true] {
            assert!(is_stopped("elbow", of_another));
            assert!(!is_stopped("slide", of_another));
        }
    }
}
