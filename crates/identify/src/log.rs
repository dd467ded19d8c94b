//! From a rosbag2 log to the payload, through the same identifier that runs online.

use std::ops::ControlFlow;
use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tactid_dynamics::{BaseKind, Manipulator, Wrench};
use tactid_logs::messages::{self, JointState, Odometry, StringMsg, WrenchStamped};
use tactid_logs::{LogReader, Message, RawMessage, Topic};

use crate::streams::{Aligner, JointSample};
use crate::{BaseState, Identifier, IdentifyError, PayloadEstimate, Sample, Settings, Way};

/// Between two points of the history, s.
const HISTORY_STEP_S: f64 = 0.1;
/// The same within the last part of the log, which is looked at closely.
const FINE_STEP_S: f64 = 0.01;
/// How long that last part is, s.
const FINE_SPAN_S: f64 = 10.0;
/// How many messages are read between two calls of the observer.
const OBSERVE_EVERY: u64 = 5_000;

/// The estimate at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HistoryPoint {
    /// Which presentation of the log it belongs to, from zero.
    pub epoch: u32,
    /// Since the first sample, s.
    pub time_s: f64,
    /// In the order of [`VALUE_NAMES`](crate::VALUE_NAMES); not averaged.
    pub values: [f64; 10],
}

/// What a log says of the payload.
#[derive(Clone, Debug)]
pub struct Identification {
    /// At the end of the log.
    pub estimate: PayloadEstimate,
    /// The estimate over time.
    pub history: Vec<HistoryPoint>,
    /// From the first sample to the last, s.
    pub duration_s: f64,
    /// As they were used.
    pub settings: Settings,
    /// Gravitational acceleration that was assumed, m/s².
    pub gravity: Vector3<f64>,
    /// The link in whose frame the estimate is.
    pub tool: String,
    /// Whether the observer stopped the reading.
    pub interrupted: bool,
    /// Where the log could not be read further, and why.
    pub damage: Vec<String>,
}

/// How far the reading has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Part of the log's time, 0 to 1.
    pub fraction: f64,
}

/// Identifies the payload from a log: an `.mcap` file, or the directory of a bag.
///
/// Needs in the log, found by type: the URDF on a `std_msgs/msg/String` topic, one topic of joint
/// states with velocities, and for the tactile way the fingers' wrenches **on the payload**, each in
/// the frame that its header names. An odometry topic makes the base a floating one. Times are
/// those of the headers, or of the log where a stamp is zero. Metadata records are not read.
///
/// # Errors
/// Where the log cannot be opened, or lacks what the way needs, or contradicts its own URDF. A log
/// that ends early is used up to its end, which [`Identification::damage`] tells.
pub fn identify_log(
    path: &Path,
    tool: &str,
    settings: &Settings,
    observer: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Identification, IdentifyError> {
    let log = LogReader::open(path)?;
    let sources = Sources::find(&log, settings.way)?;
    let robot = sources.robot(&log)?;
    let frames = sources.wrench_frames(&log)?;
    let frames: Vec<&str> = frames.iter().map(String::as_str).collect();
    let identifier = Identifier::new(&robot, tool, &frames, settings.clone())?;
    let gravity = identifier.gravity();
    let mut reading = Reading::new(sources, robot, identifier, settings.max_gap_s);
    let mut interrupted = false;
    for epoch in 0..settings.epochs {
        reading.begin(epoch);
        interrupted = reading.read(&log, &mut |fraction| {
            let fraction = (f64::from(epoch) + fraction) / f64::from(settings.epochs);
            observer(Progress { fraction })
        })?;
        if interrupted {
            break;
        }
    }
    let estimate = reading.identifier.estimate();
    if estimate.intervals == 0 && !interrupted {
        return Err(IdentifyError::NoOverlap(
            reading.sources.measured().join(", "),
        ));
    }
    Ok(Identification {
        estimate,
        history: reading.history,
        duration_s: reading.last_s,
        settings: settings.clone(),
        gravity,
        tool: tool.to_owned(),
        interrupted,
        damage: reading.damage,
    })
}

/// The topics that identification reads.
struct Sources {
    description: String,
    joints: String,
    odometry: Option<String>,
    wrenches: Vec<String>,
}

impl Sources {
    fn find(log: &LogReader, way: Way) -> Result<Self, IdentifyError> {
        let strings: Vec<&Topic> = log.topics_of::<StringMsg>().collect();
        let described = strings
            .iter()
            .find(|topic| topic.name.ends_with("robot_description"));
        let description = match (described, &strings[..]) {
            (Some(topic), _) | (None, [topic]) => topic.name.clone(),
            _ => return Err(missing::<StringMsg>(log, "robot description")),
        };
        let odometry = at_most_one::<Odometry>(log)?;
        let wrenches: Vec<_> = match way {
            Way::Tactile => log
                .topics_of::<WrenchStamped>()
                .map(|topic| topic.name.clone())
                .collect(),
            Way::JointSensing => Vec::new(),
        };
        if way == Way::Tactile && wrenches.is_empty() {
            return Err(missing::<WrenchStamped>(log, "wrench"));
        }
        if way == Way::JointSensing && odometry.is_none() {
            return Err(missing::<Odometry>(log, "motion of the base"));
        }
        Ok(Self {
            description,
            joints: at_most_one::<JointState>(log)?
                .ok_or_else(|| missing::<JointState>(log, "joint states"))?,
            odometry,
            wrenches,
        })
    }

    /// The topics whose messages are samples.
    fn measured(&self) -> Vec<String> {
        let fixed = [Some(self.joints.clone()), self.odometry.clone()];
        fixed
            .into_iter()
            .flatten()
            .chain(self.wrenches.iter().cloned())
            .collect()
    }

    /// First and last log time of what is measured; a description may have been logged long before.
    fn times_ns(&self, log: &LogReader) -> (u64, u64) {
        let topics = self.measured();
        let times = || topics.iter().filter_map(|name| log.topic(name)?.times_ns);
        let (first, last) = (times().map(|t| t.0).min(), times().map(|t| t.1).max());
        first.zip(last).unwrap_or((0, 0))
    }

    /// The robot of the log, on the link that the odometry moves.
    fn robot(&self, log: &LogReader) -> Result<Manipulator, IdentifyError> {
        let urdf: StringMsg = first(log, &self.description)?;
        let Some(odometry) = &self.odometry else {
            return Ok(Manipulator::from_urdf(&urdf.data, BaseKind::Fixed)?);
        };
        let moved: Odometry = first(log, odometry)?;
        let base = Some(moved.child_frame_id.as_str());
        Ok(Manipulator::from_urdf_below(
            &urdf.data,
            BaseKind::Floating,
            base,
        )?)
    }

    fn wrench_frames(&self, log: &LogReader) -> Result<Vec<String>, IdentifyError> {
        let frame = |topic: &String| first::<WrenchStamped>(log, topic).map(|m| m.header.frame_id);
        self.wrenches.iter().map(frame).collect()
    }
}

fn missing<M: Message>(log: &LogReader, what: &'static str) -> IdentifyError {
    let topics: Vec<_> = log
        .topics()
        .iter()
        .map(|topic| topic.name.as_str())
        .collect();
    IdentifyError::MissingTopic {
        what,
        type_name: M::TYPE,
        topics: if topics.is_empty() {
            "none".to_owned()
        } else {
            topics.join(", ")
        },
    }
}

fn at_most_one<M: Message>(log: &LogReader) -> Result<Option<String>, IdentifyError> {
    let names: Vec<_> = log
        .topics_of::<M>()
        .map(|topic| topic.name.clone())
        .collect();
    if names.len() > 1 {
        return Err(IdentifyError::SeveralTopics {
            type_name: M::TYPE,
            topics: names.join(", "),
        });
    }
    Ok(names.into_iter().next())
}

/// The first message on a topic that the log has.
fn first<M: Message>(log: &LogReader, topic: &str) -> Result<M, IdentifyError> {
    match log.messages_on([topic])?.next() {
        Some(message) => Ok(message?.decode()?),
        None => Err(IdentifyError::Message {
            topic: topic.to_owned(),
            time_s: 0.0,
            what: "the topic is there, but has no message".to_owned(),
        }),
    }
}

/// The state of reading a log.
struct Reading {
    sources: Sources,
    robot: Manipulator,
    identifier: Identifier,
    aligner: Aligner,
    /// The joints' order in the last message, and where each of the robot's joints stands in it.
    names: Vec<String>,
    order: Vec<usize>,
    /// Stamp of the first message, ns: seconds since the epoch would lose digits.
    origin_ns: Option<i64>,
    history: Vec<HistoryPoint>,
    next_point_s: f64,
    last_s: f64,
    /// The log's length, s.
    end_s: f64,
    epoch: u32,
    damage: Vec<String>,
}

impl Reading {
    fn new(sources: Sources, robot: Manipulator, identifier: Identifier, max_gap_s: f64) -> Self {
        let floating = sources.odometry.is_some();
        Self {
            aligner: Aligner::new(floating, sources.wrenches.len(), max_gap_s),
            sources,
            robot,
            identifier,
            names: Vec::new(),
            order: Vec::new(),
            origin_ns: None,
            history: Vec::new(),
            next_point_s: 0.0,
            last_s: 0.0,
            end_s: 0.0,
            epoch: 0,
            damage: Vec::new(),
        }
    }

    /// Before each presentation of the log.
    fn begin(&mut self, epoch: u32) {
        self.epoch = epoch;
        self.aligner.clear();
        self.identifier.rewind();
        self.next_point_s = 0.0;
    }

    /// Reads the log once; whether the observer stopped it.
    fn read(
        &mut self,
        log: &LogReader,
        observer: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<bool, IdentifyError> {
        let (begin, end) = self.sources.times_ns(log);
        self.end_s = end.saturating_sub(begin) as f64 * 1e-9;
        let mut messages = log.messages_on(self.sources.measured())?;
        for (count, message) in messages.by_ref().enumerate() {
            let message = message?;
            if (count as u64).is_multiple_of(OBSERVE_EVERY) {
                let passed_s = message.log_time_ns.saturating_sub(begin) as f64 * 1e-9;
                if observer(passed_s / self.end_s.max(1e-9)).is_break() {
                    return Ok(true);
                }
            }
            self.take(&message)?;
        }
        self.damage = messages.damage().iter().map(ToString::to_string).collect();
        Ok(false)
    }

    fn take(&mut self, message: &RawMessage) -> Result<(), IdentifyError> {
        let topic = message.topic.name.as_str();
        if topic == self.sources.joints {
            let state: JointState = message.decode()?;
            let time_s = self.time(message, &state);
            let sample = self.joints(topic, time_s, &state)?;
            self.aligner.push_joints(sample);
        } else if self.sources.odometry.as_deref() == Some(topic) {
            let odometry: Odometry = message.decode()?;
            let time_s = self.time(message, &odometry);
            if let Some(stream) = &mut self.aligner.base {
                stream.push(time_s, base_state(&odometry));
            }
        } else if let Some(sensor) = self.sources.wrenches.iter().position(|name| name == topic) {
            let wrench: WrenchStamped = message.decode()?;
            let time_s = self.time(message, &wrench);
            self.aligner.wrenches[sensor].push(time_s, on_payload(&wrench));
        }
        while let Some(aligned) = self.aligner.next() {
            let sample = Sample {
                time_s: aligned.joints.time_s,
                base: aligned.base,
                joint_position: &aligned.joints.position,
                joint_velocity: &aligned.joints.velocity,
                wrenches: &aligned.wrenches,
            };
            self.identifier.push(&sample)?;
            self.record(sample.time_s);
        }
        Ok(())
    }

    /// The message's time since the first one, s.
    fn time<M: Message>(&mut self, raw: &RawMessage, message: &M) -> f64 {
        let stamp_ns = message.stamp().map_or(0, messages::Time::as_ns);
        let time_ns = if stamp_ns == 0 {
            i64::try_from(raw.log_time_ns).unwrap_or(i64::MAX)
        } else {
            stamp_ns
        };
        let origin_ns = *self.origin_ns.get_or_insert(time_ns);
        time_ns.saturating_sub(origin_ns) as f64 * 1e-9
    }

    /// The robot's joints, in the robot's order.
    fn joints(
        &mut self,
        topic: &str,
        time_s: f64,
        state: &JointState,
    ) -> Result<JointSample, IdentifyError> {
        let refuse = |what| {
            Err(IdentifyError::Message {
                topic: topic.to_owned(),
                time_s,
                what,
            })
        };
        for (field, values) in [
            ("positions", &state.position),
            ("velocities", &state.velocity),
        ] {
            if values.len() != state.name.len() {
                let (names, given) = (state.name.len(), values.len());
                return refuse(format!("{given} {field} for {names} joints"));
            }
        }
        if state.name != self.names {
            let mut order = Vec::with_capacity(self.robot.dof());
            for joint in self.robot.joint_names() {
                match state.name.iter().position(|name| name == joint) {
                    Some(at) => order.push(at),
                    None => return refuse(format!("joint `{joint}` of the URDF is not in it")),
                }
            }
            (self.names, self.order) = (state.name.clone(), order);
        }
        Ok(JointSample {
            time_s,
            position: self.order.iter().map(|&at| state.position[at]).collect(),
            velocity: self.order.iter().map(|&at| state.velocity[at]).collect(),
        })
    }

    fn record(&mut self, time_s: f64) {
        self.last_s = time_s;
        if time_s < self.next_point_s {
            return;
        }
        let fine = time_s > self.end_s - FINE_SPAN_S;
        self.next_point_s = time_s + if fine { FINE_STEP_S } else { HISTORY_STEP_S };
        self.history.push(HistoryPoint {
            epoch: self.epoch,
            time_s,
            values: self.identifier.latest_values(),
        });
    }
}

/// Odometry has its twist in the moving frame; the equations want it in the inertial one.
fn base_state(odometry: &Odometry) -> BaseState {
    let (pose, twist) = (&odometry.pose.pose, &odometry.twist.twist);
    let (p, q) = (&pose.position, &pose.orientation);
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z));
    BaseState {
        pose: Isometry3::from_parts(Translation3::new(p.x, p.y, p.z), rotation),
        velocity: rotation * vector(&twist.linear),
        angular_velocity: rotation * vector(&twist.angular),
    }
}

fn on_payload(message: &WrenchStamped) -> Wrench {
    Wrench {
        force: vector(&message.wrench.force),
        moment: vector(&message.wrench.torque),
    }
}

fn vector(v: &messages::Vector3) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}
