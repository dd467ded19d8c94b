//! Sources of a log: topics, robot and frames of the sensors.

mod frames;
mod robot;
mod topics;

use tactid_dynamics::{FrameId, Manipulator, ModelError};
use tactid_logs::LogReader;
use tactid_logs::messages::{Imu, JointState, Odometry, WrenchStamped};

use crate::defaults::{Contents, Options, check_tip};
use crate::{Finding, RecordingError, Request, SensorFrame};
use frames::StaticTransforms;
pub(crate) use frames::place_sensor;
pub(crate) use topics::{MeasuredTopics, MotionTopics, joint_topics, several_topics, times_ns};
use topics::{first, missing, slowest_period_s};

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
        let contents = Contents {
            motion: topics.motion_kind(),
            has_wrenches: !topics.wrenches.is_empty(),
            has_efforts: topics.has_efforts,
            has_unloaded: request.unloaded.is_some(),
            sensor_frame: frames.sensor(),
            motion_period_s: slowest_period_s(log, &topics.motion_topics()),
            acceleration_period_s: slowest_period_s(log, topics.acceleration()),
            wrench_period_s: slowest_period_s(log, &topics.wrenches),
        };
        let options = Options::resolve(request, &contents);
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
        let placed = match &request.sensor_frame {
            Some(given) if !topics.wrenches.is_empty() => {
                Placed::by_request(log, &robot, &frames.wrenches, given)?
            }
            _ => Placed::new(log, robot, &topics.wrenches, frames.wrenches, &assumed)?,
        };
        let robot = placed.transforms.place(placed.robot, &options.tip, None)?;
        check_sum(&robot, &options.tip, &placed.sensors, &topics, request)?;
        check_base_imu(log, &topics, &robot)?;
        request.check_counts(&robot, placed.sensors.len())?;
        let mut findings = placed.findings;
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

/// Frames that the first messages of a log name; empty where they name none.
struct NamedFrames {
    /// Frame of each wrench.
    wrenches: Vec<String>,
    /// Frame whose motion is measured without joints.
    moved: Option<String>,
}

impl NamedFrames {
    fn read(log: &LogReader, topics: &MeasuredTopics) -> Result<Self, RecordingError> {
        let frame = |topic: &String| Ok(first::<WrenchStamped>(log, topic)?.header.frame_id);
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
struct Placed {
    robot: Manipulator,
    sensors: Vec<String>,
    transforms: StaticTransforms,
    findings: Vec<Finding>,
}

impl Placed {
    /// Places the frames of the wrenches; `assumed` is that of a topic that names none.
    fn new(
        log: &LogReader,
        mut robot: Manipulator,
        topics: &[String],
        frames: Vec<String>,
        assumed: &str,
    ) -> Result<Self, RecordingError> {
        let transforms = StaticTransforms::read(log)?;
        let mut findings = Vec::new();
        let mut sensors = Vec::new();
        for (topic, mut frame) in topics.iter().zip(frames) {
            if frame.is_empty() {
                assumed.clone_into(&mut frame);
                findings.push(Finding::FrameAssumed {
                    topic: topic.clone(),
                    frame: frame.clone(),
                });
            }
            robot = transforms.place(robot, &frame, Some(topic))?;
            sensors.push(frame);
        }
        Ok(Self {
            robot,
            sensors,
            transforms,
            findings,
        })
    }
}

impl Placed {
    /// Places the frame of the only sensor, whose messages name `frames`, as a request says.
    fn by_request(
        log: &LogReader,
        robot: &Manipulator,
        frames: &[String],
        given: &SensorFrame,
    ) -> Result<Self, RecordingError> {
        let (robot, sensor) = place_sensor(robot, given, frames)?;
        Ok(Self {
            robot,
            sensors: vec![sensor],
            transforms: StaticTransforms::read(log)?,
            findings: Vec::new(),
        })
    }
}

/// Checks that wrenches which the request does not name may be summed: those of the fingers of one gripper.
///
/// Each finger is a link that joints beyond the tip move, and no finger carries another. Sensors of one link, or one
/// behind the other in a chain, measure the same load, and those of two arms measure two.
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
