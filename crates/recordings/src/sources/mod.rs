//! Sources of a log: topics, robot and frames of the sensors.

mod drivers;
mod frames;
mod moving_frames;
mod robot;
mod topics;
mod transforms;

use tactid_dynamics::{FrameId, Manipulator, ModelError};
use tactid_identify::WORLD;
use tactid_logs::LogReader;
use tactid_logs::messages::{Imu, JointState, Odometry};

use crate::defaults::{Contents, Options, check_tip};
use crate::{Finding, RecordingError, Request, SensorFrame};
pub(crate) use drivers::proposes_weight;
pub(crate) use frames::place_sensor;
use frames::{FrameOf, is_fixed_to_ground, place_frame};
pub(crate) use topics::{
    MeasuredTopics, MotionTopics, OWN_WRENCHES, is_of_tactid, joint_topics, several_topics,
    times_ns,
};
use topics::{first, frame_of_wrenches, missing, slowest_period_s};
use transforms::Transforms;

/// Name of the frame of a sensor that is carried about, where nothing names one.
pub(crate) const SENSOR_FRAME: &str = "sensor";

/// Which topics of a log are read, and the robot that they belong to.
#[derive(Clone, Debug)]
pub(crate) struct LogSources {
    pub(crate) topics: MeasuredTopics,
    pub(crate) contents: Contents,
    pub(crate) options: Options,
    pub(crate) robot: Manipulator,
    /// Frame of each wrench, a frame of the robot.
    pub(crate) sensors: Vec<String>,
    pub(crate) findings: Vec<Finding>,
}

impl LogSources {
    /// Finds the topics of a request in a log.
    pub(crate) fn find(log: &LogReader, request: &Request) -> Result<Self, RecordingError> {
        let topics = MeasuredTopics::find(log, request)?;
        let frames = NamedFrames::read(log, &topics)?;
        let contents = contents(log, request, &topics, &frames);
        let mut options = Options::resolve(request, &contents);
        let robot = match &topics.motion {
            MotionTopics::Joints { base_odometry, .. } => {
                let robot = robot::robot(log, request.urdf.as_ref(), base_odometry.as_ref())?;
                check_tip(&robot, &options.tip)?;
                robot
            }
            _ if request.urdf.is_some() => {
                return Err(missing::<JointState>(log, "joint states"));
            }
            _ => Manipulator::lone_body(&frames.body()),
        };
        let assumed = match &frames.moved {
            Some(_) => frames.body(),
            None => options.tip.clone(),
        };
        let transforms = Transforms::read(log, topics.joints())?;
        let mut placed = Placed::new(robot, transforms);
        match &request.sensor_frame {
            Some(given) if !topics.wrenches.is_empty() => {
                placed.place_by_request(&frames.wrenches, given)?;
                placed.place(&options.tip, FrameOf::Tip)?;
            }
            _ => {
                placed.place_wrenches(&topics.wrenches, frames.wrenches, &assumed)?;
                placed.place(&options.tip, FrameOf::Tip)?;
                placed.assume_axes_of_fixed_frame(&topics.wrenches, &mut options);
            }
        }
        placed.place_axes(&options)?;
        let robot = placed.robot;
        check_sum(&robot, &options.tip, &placed.sensors, &topics, request)?;
        check_base_imu(log, &topics, &robot)?;
        request.check_counts(&robot, placed.sensors.len())?;
        let mut findings = placed.findings;
        let read = topics.without_acceleration();
        findings.extend(drivers::recognized(log, &read, &robot, request, &options));
        if topics.are_summed_forces {
            findings.push(Finding::ForcesSummed {
                topics: topics.wrenches.clone(),
            });
        }
        if topics.wrenches.len() > 1 {
            findings.push(Finding::WrenchesSummed {
                topics: topics.wrenches.clone(),
            });
        }
        Ok(Self {
            sensors: placed.sensors,
            topics,
            contents,
            options,
            robot,
            findings,
        })
    }
}

/// Returns what a log contains, as far as the defaults depend on it.
fn contents(
    log: &LogReader,
    request: &Request,
    topics: &MeasuredTopics,
    frames: &NamedFrames,
) -> Contents {
    Contents {
        motion: topics.motion_kind(),
        has_wrenches: !topics.wrenches.is_empty(),
        has_efforts: topics.has_efforts,
        has_unloaded: request.unloaded.is_some(),
        sensor_frame: frames.sensor(),
        motion_period_s: slowest_period_s(log, &topics.motion_topics()),
        acceleration_period_s: slowest_period_s(log, topics.acceleration()),
        wrench_period_s: slowest_period_s(log, &topics.wrenches),
    }
}

/// Frames that the first messages of a log name; empty where they name none.
struct NamedFrames {
    /// Frame of each wrench.
    wrenches: Vec<String>,
    /// Frame whose motion is measured without joints.
    moved: Option<String>,
}

impl NamedFrames {
    fn read(log: &LogReader, topics: &MeasuredTopics) -> Result<Self, RecordingError> {
        let frame = |topic: &String| frame_of_wrenches(log, topic);
        let wrenches: Result<Vec<String>, RecordingError> =
            topics.wrenches.iter().map(frame).collect();
        Ok(Self {
            wrenches: wrenches?,
            moved: match &topics.motion {
                MotionTopics::Joints { .. } => None,
                MotionTopics::Odometry { odometry, .. } => {
                    Some(first::<Odometry>(log, odometry)?.child_frame_id)
                }
                MotionTopics::Imu(topic) => Some(first::<Imu>(log, topic)?.header.frame_id),
            },
        })
    }

    /// Returns the frame whose motion is measured; that of the first sensor where none is named.
    fn body(&self) -> String {
        let frames = self.moved.iter().chain(self.wrenches.first());
        first_named(frames)
    }

    /// Returns the frame of the first sensor; that whose motion is measured where none is named.
    fn sensor(&self) -> String {
        let frames = self.wrenches.first().into_iter().chain(&self.moved);
        first_named(frames)
    }
}

fn first_named<'a>(mut frames: impl Iterator<Item = &'a String>) -> String {
    let named = frames.find(|frame| !frame.is_empty());
    named.map_or(SENSOR_FRAME, String::as_str).to_owned()
}

/// The frames of the wrenches among those of a robot.
struct Placed<'a> {
    robot: Manipulator,
    sensors: Vec<String>,
    transforms: Transforms<'a>,
    findings: Vec<Finding>,
}

impl<'a> Placed<'a> {
    /// Takes a robot without sensors.
    fn new(robot: Manipulator, transforms: Transforms<'a>) -> Self {
        Self {
            robot,
            sensors: Vec::new(),
            transforms,
            findings: Vec::new(),
        }
    }

    /// Adds a frame to those of the robot, unless it has it.
    fn place(&mut self, frame: &str, of: FrameOf<'_>) -> Result<(), RecordingError> {
        if self.robot.frame(frame).is_err() {
            let (placed, finding) = place_frame(&self.transforms, &self.robot, frame, of)?;
            self.robot = placed;
            self.findings.extend(finding);
        }
        Ok(())
    }

    /// Places the frames of the wrenches; `assumed` is that of a topic that names none.
    fn place_wrenches(
        &mut self,
        topics: &[String],
        frames: Vec<String>,
        assumed: &str,
    ) -> Result<(), RecordingError> {
        for (topic, mut frame) in topics.iter().zip(frames) {
            if frame.is_empty() {
                assumed.clone_into(&mut frame);
                self.findings.push(Finding::FrameAssumed {
                    topic: topic.clone(),
                    frame: frame.clone(),
                });
            }
            self.place(&frame, FrameOf::Wrenches(topic))?;
            self.sensors.push(frame);
        }
        Ok(())
    }

    /// Places the frame of the only sensor, whose messages name `frames`, as a request says.
    fn place_by_request(
        &mut self,
        frames: &[String],
        given: &SensorFrame,
    ) -> Result<(), RecordingError> {
        let (robot, sensor) = place_sensor(&self.robot, given, frames)?;
        self.robot = robot;
        self.sensors = vec![sensor];
        Ok(())
    }

    /// Places the frame along whose axes the wrenches are, unless these axes are those of the
    /// world.
    fn place_axes(&mut self, options: &Options) -> Result<(), RecordingError> {
        match options.equations.wrench_axes.as_deref() {
            None | Some(WORLD) => Ok(()),
            Some(axes) => self.place(axes, FrameOf::Axes),
        }
    }

    /// Where the only wrench is in a frame that does not move with the tip, this frame has its
    /// axes, and the moments are about the origin of the tip: no sensor that stands still feels the
    /// payload alone.
    fn assume_axes_of_fixed_frame(&mut self, topics: &[String], options: &mut Options) {
        let (Some(sensor), [topic]) = (self.sensors.first_mut(), topics) else {
            return;
        };
        if !is_fixed_to_ground(&self.robot, sensor, &options.tip) {
            return;
        }
        let frame = std::mem::replace(sensor, options.tip.clone());
        let axes = options.equations.wrench_axes.get_or_insert(frame);
        self.findings.push(Finding::AxesAssumed {
            topic: topic.clone(),
            axes: axes.clone(),
            point: options.tip.clone(),
        });
    }
}

/// Checks that wrenches which the request does not name may be summed: those of the fingers of one
/// gripper.
///
/// Each finger is a link that joints beyond the tip move, and no finger carries another. Sensors of
/// one link, or one behind the other in a chain, measure the same load, and those of two arms
/// measure two.
fn check_sum(
    robot: &Manipulator,
    tip: &str,
    sensors: &[String],
    topics: &MeasuredTopics,
    request: &Request,
) -> Result<(), RecordingError> {
    let names_topics = request
        .wrench_topic
        .as_ref()
        .is_some_and(|topics| !topics.is_empty());
    if names_topics || sensors.len() < 2 {
        return Ok(());
    }
    let tip_frame = robot.frame(tip)?;
    let frames: Result<Vec<FrameId>, ModelError> =
        sensors.iter().map(|sensor| robot.frame(sensor)).collect();
    let frames = frames?;
    let is_apart = |a: FrameId, b: FrameId| {
        robot.fixed_transform(a, b).is_none() && !robot.carries(a, b) && !robot.carries(b, a)
    };
    let is_finger = |k: usize| {
        let mut before = frames[..k].iter();
        robot.carries(tip_frame, frames[k]) && before.all(|&other| is_apart(frames[k], other))
    };
    if (0..frames.len()).all(is_finger) {
        return Ok(());
    }
    let pairs = topics.wrenches.iter().zip(sensors);
    let named = pairs.map(|(topic, frame)| format!("{topic} in `{frame}`"));
    Err(RecordingError::data_of(
        "wrench_topic",
        format!(
            "the log has several topics of wrenches: {}; they are summed where each is of another finger, a link that \
             joints beyond `{tip}` move; name the topic to use, or those whose sum acts on the payload; `wrench_topic` \
             names the topic",
            named.collect::<Vec<_>>().join(", ")
        ),
    ))
}

/// Checks that an inertial unit on the base measures in the base's own frame.
fn check_base_imu(
    log: &LogReader,
    topics: &MeasuredTopics,
    robot: &Manipulator,
) -> Result<(), RecordingError> {
    let Some(topic) = topics.base_imu() else {
        return Ok(());
    };
    let frame = first::<Imu>(log, topic)?.header.frame_id;
    let base = robot.frame_name(robot.base_frame());
    if frame.is_empty() || frame == base {
        return Ok(());
    }
    Err(RecordingError::data_of(
        "imu_topic",
        format!(
            "{topic} is in the frame `{frame}`, but an inertial unit on a moving base must be in the base's own, `{base}`: \
             transform its messages, or do not use it"
        ),
    ))
}
