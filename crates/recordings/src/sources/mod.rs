//! Which topics of a log say what, and the robot that they belong to.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use tactid_dynamics::{BaseKind, Manipulator};
use tactid_logs::messages::{
    AccelStamped, Imu, JointState, Odometry, StringMsg, TFMessage, WrenchStamped,
};
use tactid_logs::{LogReader, Message, Topic};

use super::request::Request;
use crate::{IdentifyError, Method};

/// The frame of the end-effector where none is named.
const DEFAULT_TOOL: &str = "tool0";

/// What says how the end-effector moves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// Joints, a topic or several, on a base that is fixed or moved by odometry.
    Joints(Vec<String>),
    /// Odometry of the sensor itself.
    Odometry(String),
    /// An inertial measurement unit on the tool.
    Imu(String),
}

/// The topics that identification reads, and what they mean.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    pub(crate) method: Method,
    pub(crate) motion: Motion,
    /// Of the base, where there are joints.
    pub(crate) odometry: Option<String>,
    pub(crate) acceleration: Option<String>,
    /// The inertial unit on a moving base.
    pub(crate) base_imu: Option<String>,
    pub(crate) wrenches: Vec<String>,
    /// The frame of each wrench, a frame of the robot.
    pub(crate) sensors: Vec<String>,
    pub(crate) robot: Manipulator,
    pub(crate) tool: String,
    /// What a reader should know of the choice.
    pub(crate) remarks: Vec<String>,
}

impl Sources {
    pub(crate) fn find(log: &LogReader, request: &Request) -> Result<Self, IdentifyError> {
        let wrenches = choose::<WrenchStamped>(log, &request.topics.wrenches)?;
        let joints = choose::<JointState>(log, &request.topics.joints)?;
        let odometry = one::<Odometry>(log, request.topics.odometry.as_ref(), "odometry")?;
        let method = match request.method {
            Some(Method::Combined { .. }) => Method::Combined {
                effort: has_efforts(log, &joints)?,
            },
            Some(method) => method,
            None if wrenches.is_empty() => Method::Effort,
            None => Method::Tactile,
        };
        if request.method.is_none() && method == Method::Effort && !has_efforts(log, &joints)? {
            return Err(IdentifyError::NoLoad(topic_names(log)));
        }
        if method == Method::Tactile && wrenches.is_empty() {
            return Err(missing::<WrenchStamped>(log, "wrench"));
        }
        if method == Method::JointSensing && odometry.is_none() {
            return Err(missing::<Odometry>(log, "motion of the base"));
        }
        let wrenches = if method.uses_wrench() {
            wrenches
        } else {
            Vec::new()
        };
        if joints.is_empty() {
            if request.urdf.is_some() {
                return Err(missing::<JointState>(log, "joint states"));
            }
            return Self::of_a_sensor(log, request, method, odometry, wrenches);
        }
        let robot = robot(log, request, odometry.as_ref())?;
        let mut found = Self {
            method,
            motion: Motion::Joints(joints),
            odometry,
            acceleration: None,
            base_imu: None,
            wrenches,
            sensors: Vec::new(),
            robot,
            tool: request.tool.clone().unwrap_or(DEFAULT_TOOL.to_owned()),
            remarks: Vec::new(),
        };
        found.robot.frame(&found.tool)?;
        found.place_sensors(log, request)?;
        found.find_base_imu(log, request)?;
        Ok(found)
    }

    /// An inertial unit on the base is used when it is asked for.
    fn find_base_imu(&mut self, log: &LogReader, request: &Request) -> Result<(), IdentifyError> {
        let Some(topic) = &request.topics.imu else {
            return Ok(());
        };
        if self.odometry.is_none() {
            return Err(missing::<Odometry>(log, "motion of the base"));
        }
        self.base_imu = one::<Imu>(log, Some(topic), "imu")?;
        let frame = first::<Imu>(log, topic)?.header.frame_id;
        let base = self.robot.frame_names().next().unwrap_or_default();
        if frame.is_empty() || frame == base {
            return Ok(());
        }
        Err(IdentifyError::ImuFrame {
            topic: topic.clone(),
            frame,
            base: base.to_owned(),
        })
    }

    /// Without joints: the wrench's sensor is the body whose motion is measured.
    fn of_a_sensor(
        log: &LogReader,
        request: &Request,
        method: Method,
        odometry: Option<String>,
        wrenches: Vec<String>,
    ) -> Result<Self, IdentifyError> {
        if method != Method::Tactile {
            return Err(missing::<JointState>(log, "joint states"));
        }
        let imu = one::<Imu>(log, request.topics.imu.as_ref(), "imu")?;
        let acceleration = one::<AccelStamped>(log, request.topics.acceleration.as_ref(), "accel")?;
        let first_frame = first::<WrenchStamped>(log, &wrenches[0])?.header.frame_id;
        let (motion, moved) = match (odometry, imu) {
            (Some(topic), _) => {
                let moved = first::<Odometry>(log, &topic)?.child_frame_id;
                (Motion::Odometry(topic), moved)
            }
            (None, Some(topic)) => {
                let moved = first::<Imu>(log, &topic)?.header.frame_id;
                (Motion::Imu(topic), moved)
            }
            (None, None) => return Err(IdentifyError::NoMotion(topic_names(log))),
        };
        let moved = if moved.is_empty() {
            first_frame.clone()
        } else {
            moved
        };
        let is_odometry = matches!(motion, Motion::Odometry(_));
        let mut found = Self {
            method,
            motion,
            odometry: None,
            acceleration: acceleration.filter(|_| is_odometry),
            base_imu: None,
            wrenches,
            sensors: Vec::new(),
            robot: Manipulator::lone_body(&moved),
            tool: String::new(),
            remarks: Vec::new(),
        };
        found.place_sensors(log, request)?;
        found.tool = request.tool.clone().unwrap_or(first_frame);
        if found.tool.is_empty() {
            found.tool = moved;
        }
        if found.robot.frame(&found.tool).is_err() {
            let tool = found.tool.clone();
            found.place(&static_transforms(log)?, &tool, "the end-effector")?;
        }
        Ok(found)
    }

    /// Finds the frame of each wrench among the robot's links, or fixed to one by /tf_static.
    fn place_sensors(&mut self, log: &LogReader, request: &Request) -> Result<(), IdentifyError> {
        let transforms = static_transforms(log)?;
        for topic in self.wrenches.clone() {
            let mut frame = first::<WrenchStamped>(log, &topic)?.header.frame_id;
            if frame.is_empty() {
                let base = self.robot.frame_names().next().unwrap_or_default();
                frame = if self.tool.is_empty() {
                    base
                } else {
                    &self.tool
                }
                .to_owned();
                self.remarks.push(format!(
                    "{topic} names no frame: its wrenches are taken to be in `{frame}`."
                ));
            }
            if self.robot.frame(&frame).is_err() {
                self.place(&transforms, &frame, &topic)?;
            }
            self.sensors.push(frame);
        }
        self.check_sensors(request)
    }

    /// Two topics of one sensor would count its wrench twice.
    fn check_sensors(&mut self, request: &Request) -> Result<(), IdentifyError> {
        let twice = |k: &usize| self.sensors[..*k].contains(&self.sensors[*k]);
        let chosen = !request.topics.wrenches.is_empty();
        if !chosen && (1..self.sensors.len()).any(|k| twice(&k)) {
            return Err(IdentifyError::SeveralTopics {
                what: "wrenches in one frame",
                topics: self.wrenches.join(", "),
                option: "--wrench",
            });
        }
        if self.wrenches.len() > 1 {
            self.remarks.push(format!(
                "The wrenches of {} are summed.",
                self.wrenches.join(" and ")
            ));
        }
        Ok(())
    }

    /// Adds a frame that /tf_static fixes to one of the robot's.
    fn place(
        &mut self,
        transforms: &Transforms,
        frame: &str,
        whose: &str,
    ) -> Result<(), IdentifyError> {
        let unknown = || IdentifyError::UnknownFrame {
            frame: frame.to_owned(),
            whose: whose.to_owned(),
            links: self.robot.frame_names().collect::<Vec<_>>().join(", "),
        };
        let mut above = frame;
        let mut above_from_frame = Isometry3::identity();
        // A chain longer than there are transforms is a ring.
        for _ in 0..transforms.len() {
            let (parent, transform) = transforms.get(above).ok_or_else(unknown)?;
            (above, above_from_frame) = (parent, transform * above_from_frame);
            if let Ok(link) = self.robot.frame(above) {
                self.robot = self.robot.with_frame(frame, link, &above_from_frame);
                return Ok(());
            }
        }
        Err(unknown())
    }

    /// The topics whose messages are samples.
    pub(crate) fn measured(&self) -> Vec<String> {
        let motion = match &self.motion {
            Motion::Joints(topics) => topics.clone(),
            Motion::Odometry(topic) | Motion::Imu(topic) => vec![topic.clone()],
        };
        let others = self.odometry.iter().chain(&self.acceleration);
        let others = others.chain(&self.base_imu);
        let all = motion.iter().chain(others).chain(&self.wrenches);
        all.cloned().collect()
    }

    /// Whether the base moves and says so.
    pub(crate) fn has_base(&self) -> bool {
        self.odometry.is_some() || !matches!(self.motion, Motion::Joints(_))
    }

    /// The period of the slowest stream, by the log's times, s.
    pub(crate) fn slowest_period_s(&self, log: &LogReader) -> f64 {
        let topics = self.measured();
        let rates = topics
            .iter()
            .filter_map(|name| log.topic(name)?.frequency_hz());
        let slowest = rates.fold(f64::INFINITY, f64::min);
        if slowest.is_finite() {
            1.0 / slowest
        } else {
            0.01
        }
    }

    /// First and last log time of what is measured; a description may have been logged long before.
    pub(crate) fn times_ns(&self, log: &LogReader) -> (u64, u64) {
        let topics = self.measured();
        let times = || topics.iter().filter_map(|name| log.topic(name)?.times_ns);
        let (first, last) = (times().map(|t| t.0).min(), times().map(|t| t.1).max());
        first.zip(last).unwrap_or((0, 0))
    }
}

/// The robot of the URDF, on the link that the odometry moves.
fn robot(
    log: &LogReader,
    request: &Request,
    odometry: Option<&String>,
) -> Result<Manipulator, IdentifyError> {
    let urdf = match &request.urdf {
        Some(text) => text.clone(),
        None => described(log)?,
    };
    let Some(odometry) = odometry else {
        return Ok(Manipulator::from_urdf(&urdf, BaseKind::Fixed)?);
    };
    let moved = first::<Odometry>(log, odometry)?.child_frame_id;
    let base = (!moved.is_empty()).then_some(moved.as_str());
    Ok(Manipulator::from_urdf_below(
        &urdf,
        BaseKind::Floating,
        base,
    )?)
}

fn described(log: &LogReader) -> Result<String, IdentifyError> {
    let strings: Vec<&Topic> = log.topics_of::<StringMsg>().collect();
    let named = strings
        .iter()
        .find(|topic| topic.name.ends_with("robot_description"));
    match named {
        Some(topic) => Ok(first::<StringMsg>(log, &topic.name)?.data),
        None => Err(IdentifyError::NoUrdf(topic_names(log))),
    }
}

/// For each frame its parent, and `parent_from_frame`.
type Transforms = BTreeMap<String, (String, Isometry3<f64>)>;

fn static_transforms(log: &LogReader) -> Result<Transforms, IdentifyError> {
    let mut transforms = Transforms::new();
    let topics = log.topics_of::<TFMessage>();
    let names: Vec<&str> = topics
        .map(|topic| topic.name.as_str())
        .filter(|name| name.ends_with("tf_static"))
        .collect();
    for message in log.messages_on(names)? {
        for stamped in message?.decode::<TFMessage>()?.transforms {
            let (t, q) = (stamped.transform.translation, stamped.transform.rotation);
            let pose = Isometry3::from_parts(
                Translation3::new(t.x, t.y, t.z),
                UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z)),
            );
            transforms.insert(stamped.child_frame_id, (stamped.header.frame_id, pose));
        }
    }
    Ok(transforms)
}

fn has_efforts(log: &LogReader, joints: &[String]) -> Result<bool, IdentifyError> {
    for topic in joints {
        if !first::<JointState>(log, topic)?.effort.is_empty() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The topics that were asked for, or all of the type.
fn choose<M: Message>(log: &LogReader, asked: &[String]) -> Result<Vec<String>, IdentifyError> {
    if asked.is_empty() {
        let topics = log.topics_of::<M>().filter(|topic| topic.count > 0);
        return Ok(topics.map(|topic| topic.name.clone()).collect());
    }
    for name in asked {
        if !log.topics_of::<M>().any(|topic| topic.name == *name) {
            return Err(IdentifyError::NoSuchTopic {
                topic: name.clone(),
                type_name: M::TYPE,
                topics: topic_names(log),
            });
        }
    }
    Ok(asked.to_vec())
}

/// The topics of joint states to be read.
pub(crate) fn joint_topics(
    log: &LogReader,
    asked: &[String],
) -> Result<Vec<String>, IdentifyError> {
    let topics = choose::<JointState>(log, asked)?;
    if topics.is_empty() {
        return Err(missing::<JointState>(log, "joint states"));
    }
    Ok(topics)
}

/// The topic that was asked for, or the only one of the type.
fn one<M: Message>(
    log: &LogReader,
    asked: Option<&String>,
    name: &'static str,
) -> Result<Option<String>, IdentifyError> {
    let found = choose::<M>(log, asked.map_or(&[], std::slice::from_ref))?;
    if found.len() > 1 {
        return Err(IdentifyError::SeveralTopics {
            what: name,
            topics: found.join(", "),
            option: match name {
                "odometry" => "--odometry",
                "imu" => "--imu",
                _ => "--accel",
            },
        });
    }
    Ok(found.into_iter().next())
}

fn topic_names(log: &LogReader) -> String {
    let topics = log.topics().iter();
    let names: Vec<_> = topics
        .map(|topic| format!("{} ({})", topic.name, topic.type_name))
        .collect();
    if names.is_empty() {
        return "none".to_owned();
    }
    names.join(", ")
}

fn missing<M: Message>(log: &LogReader, what: &'static str) -> IdentifyError {
    IdentifyError::MissingTopic {
        what,
        type_name: M::TYPE,
        topics: topic_names(log),
    }
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
