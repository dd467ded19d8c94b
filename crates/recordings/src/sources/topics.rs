//! Topics of a log: found by type, or as requested.

use tactid_dynamics::list_similar;
use tactid_logs::messages::{AccelStamped, Imu, JointState, Odometry, PointCloud2, WrenchStamped};
use tactid_logs::{LogReader, Message, Topic};

use crate::contacts::why_no_forces;
use crate::defaults::Motion;
use crate::error::RecordingError;
use crate::topic_kind::TopicKind;
use crate::{Method, Request};

/// Topics that measure the motion of the end-effector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum MotionTopics {
    /// Joint states, on a base that is fixed or measured by odometry and, if requested, an inertial unit.
    Joints {
        joints: Vec<String>,
        base_odometry: Option<String>,
        base_imu: Option<String>,
    },
    /// Odometry of the sensor itself, and its acceleration if that is measured.
    Odometry {
        odometry: String,
        acceleration: Option<String>,
    },
    /// An inertial unit on the sensor.
    Imu(String),
}

/// Topics that an identification reads.
#[derive(Clone, Debug)]
pub(crate) struct MeasuredTopics {
    pub(crate) motion: MotionTopics,
    /// Topics of wrenches, and of forces at points.
    pub(crate) wrenches: Vec<String>,
    /// Whether forces at points, which the request does not name, are summed to wrenches.
    pub(crate) are_summed_forces: bool,
    pub(crate) has_efforts: bool,
}

impl MeasuredTopics {
    /// Returns the topics of the joints.
    pub(crate) fn joints(&self) -> &[String] {
        match &self.motion {
            MotionTopics::Joints { joints, .. } => joints,
            MotionTopics::Odometry { .. } | MotionTopics::Imu(_) => &[],
        }
    }

    /// Finds the topics that a request names, or that have the right types.
    pub(crate) fn find(log: &LogReader, request: &Request) -> Result<Self, RecordingError> {
        let method = request.method;
        let (wrenches, are_forces) = choose_wrenches(log, several(&request.wrench_topic))?;
        let joints = choose::<JointState>(log, several(&request.joint_topic), TopicKind::Joints)?;
        let requested = request.odometry_topic.as_ref();
        let odometry = choose_one::<Odometry>(log, requested, TopicKind::Odometry)?;
        let may_use_efforts = match method {
            Some(method) => matches!(method, Method::Combined { .. }),
            None => wrenches.is_empty(),
        };
        let has_efforts = may_use_efforts && has_efforts(log, &joints)?;
        if method.is_none() && wrenches.is_empty() && !has_efforts {
            let clouds = log.topics_of::<PointCloud2>();
            let clouds = clouds.filter_map(|topic| why_no_forces(log, topic));
            let clouds: Vec<String> = clouds.map(|lacks| format!("; {lacks}")).collect();
            return Err(RecordingError::data(format!(
                "the log has neither a wrench (type {}) nor joint states with an effort: nothing \
                 measures the load{}; its topics are: {}",
                WrenchStamped::TYPE,
                clouds.concat(),
                topic_names(log, "")
            )));
        }
        if method == Some(Method::Tactile) && wrenches.is_empty() {
            return Err(missing::<WrenchStamped>(log, "wrench"));
        }
        if method == Some(Method::JointSensing) && odometry.is_none() {
            return Err(missing::<Odometry>(log, "motion of the base"));
        }
        let motion = if joints.is_empty() {
            if method.is_some_and(|method| method != Method::Tactile) {
                return Err(missing::<JointState>(log, "joint states"));
            }
            MotionTopics::of_sensor(log, request, odometry)?
        } else {
            MotionTopics::of_joints(log, request, joints, odometry)?
        };
        let uses_wrenches = method.is_none_or(Method::uses_wrench);
        Ok(Self {
            are_summed_forces: uses_wrenches && are_forces,
            motion,
            wrenches: if uses_wrenches { wrenches } else { Vec::new() },
            has_efforts,
        })
    }

    /// Returns what measures the motion.
    pub(crate) fn motion_kind(&self) -> Motion {
        match &self.motion {
            MotionTopics::Joints { .. } => Motion::Joints,
            MotionTopics::Odometry { .. } => Motion::Carried,
            MotionTopics::Imu(_) => Motion::InertialUnit,
        }
    }

    /// Returns the topic of the measured accelerations of a sensor.
    pub(crate) fn acceleration(&self) -> Option<&String> {
        match &self.motion {
            MotionTopics::Odometry { acceleration, .. } => acceleration.as_ref(),
            MotionTopics::Joints { .. } | MotionTopics::Imu(_) => None,
        }
    }

    /// Returns the topic of the odometry of a base, or of a sensor.
    pub(crate) fn odometry(&self) -> Option<&String> {
        match &self.motion {
            MotionTopics::Joints { base_odometry, .. } => base_odometry.as_ref(),
            MotionTopics::Odometry { odometry, .. } => Some(odometry),
            MotionTopics::Imu(_) => None,
        }
    }

    /// Returns the topic of the inertial unit on a moving base.
    pub(crate) fn base_imu(&self) -> Option<&String> {
        match &self.motion {
            MotionTopics::Joints { base_imu, .. } => base_imu.as_ref(),
            MotionTopics::Odometry { .. } | MotionTopics::Imu(_) => None,
        }
    }

    /// Returns whether the motion of a base (or of the sensor itself) is measured.
    pub(crate) fn has_base(&self) -> bool {
        match &self.motion {
            MotionTopics::Joints { base_odometry, .. } => base_odometry.is_some(),
            MotionTopics::Odometry { .. } | MotionTopics::Imu(_) => true,
        }
    }

    /// Returns the topics of joints and base, without those of the accelerations.
    pub(crate) fn motion_topics(&self) -> Vec<String> {
        match &self.motion {
            MotionTopics::Joints {
                joints,
                base_odometry,
                base_imu,
            } => {
                let others = base_odometry.iter().chain(base_imu);
                joints.iter().chain(others).cloned().collect()
            }
            MotionTopics::Odometry { odometry, .. } => vec![odometry.clone()],
            MotionTopics::Imu(topic) => vec![topic.clone()],
        }
    }

    /// Returns all topics but that of the accelerations.
    pub(crate) fn without_acceleration(&self) -> Vec<String> {
        let motion = self.motion_topics();
        motion.into_iter().chain(self.wrenches.clone()).collect()
    }
}

impl MotionTopics {
    /// An inertial unit on the base is used only on request.
    fn of_joints(
        log: &LogReader,
        request: &Request,
        joints: Vec<String>,
        base_odometry: Option<String>,
    ) -> Result<Self, RecordingError> {
        let base_imu = match &request.imu_topic {
            Some(topic) => choose_one::<Imu>(log, Some(topic), TopicKind::Imu)?,
            None => None,
        };
        if base_imu.is_some() && base_odometry.is_none() {
            let what = "motion of the base, on which a requested inertial unit is";
            return Err(missing::<Odometry>(log, what));
        }
        // With joints it is not used, but its name must not be a mistake.
        if let Some(topic) = &request.acceleration_topic {
            choose_one::<AccelStamped>(log, Some(topic), TopicKind::Acceleration)?;
        }
        Ok(Self::Joints {
            joints,
            base_odometry,
            base_imu,
        })
    }

    /// Without joints, the sensor is the body whose motion is measured.
    fn of_sensor(
        log: &LogReader,
        request: &Request,
        odometry: Option<String>,
    ) -> Result<Self, RecordingError> {
        let imu = choose_one::<Imu>(log, request.imu_topic.as_ref(), TopicKind::Imu)?;
        let requested = request.acceleration_topic.as_ref();
        let acceleration = choose_one::<AccelStamped>(log, requested, TopicKind::Acceleration)?;
        match (odometry, imu) {
            (Some(odometry), _) => Ok(Self::Odometry {
                odometry,
                acceleration,
            }),
            (None, Some(topic)) => Ok(Self::Imu(topic)),
            (None, None) => Err(RecordingError::data(format!(
                "the log has wrenches but no motion: neither joint states, nor odometry of the sensor, nor an IMU; its \
                 topics are: {}",
                topic_names(log, "")
            ))),
        }
    }
}

/// Longest recording, s. A longer one has wrong times of logging, such as those of a clock that was not set.
const LONGEST_S: f64 = 30.0 * 86_400.0;

/// First messages whose middle times are used then.
const FIRST_MESSAGES: usize = 2000;

/// Returns the period of the slowest of some topics by the times of logging, s.
pub(crate) fn slowest_period_s<'a>(
    log: &LogReader,
    topics: impl IntoIterator<Item = &'a String>,
) -> Option<f64> {
    let periods = topics.into_iter().filter_map(|name| period_s(log, name));
    periods.reduce(f64::max)
}

/// Returns the mean period of a topic, s. Where it would be that of a recording of more than a month, a few times of logging are
/// wrong, and it is that of the first messages without the earliest and the latest tenth of them.
fn period_s(log: &LogReader, name: &str) -> Option<f64> {
    let topic = log.topic(name)?;
    let (first_ns, last_ns) = topic.times_ns?;
    let mean_s = topic.frequency_hz().filter(|hz| *hz > 0.0).map(f64::recip);
    if last_ns.saturating_sub(first_ns) as f64 * 1e-9 <= LONGEST_S {
        return mean_s;
    }
    let messages = log.messages_on([name]).ok()?.take(FIRST_MESSAGES);
    let times: Vec<u64> = messages
        .map_while(Result::ok)
        .map(|message| message.log_time_ns)
        .collect();
    let (lower, upper) = (times.len() / 10, times.len() * 9 / 10);
    let span_ns = times.get(upper)?.saturating_sub(times[lower]);
    let count = (upper - lower) as f64;
    (span_ns > 0)
        .then(|| span_ns as f64 * 1e-9 / count)
        .or(mean_s)
}

/// Returns the first and the last time of logging on some topics, ns.
pub(crate) fn times_ns(log: &LogReader, topics: &[String]) -> (u64, u64) {
    let times = || topics.iter().filter_map(|name| log.topic(name)?.times_ns);
    let (first, last) = (times().map(|t| t.0).min(), times().map(|t| t.1).max());
    first.zip(last).unwrap_or((0, 0))
}

/// Returns the topics that an option names, none where it is not given.
fn several(requested: &Option<Vec<String>>) -> &[String] {
    requested.as_deref().unwrap_or_default()
}

/// Last parts of the names of the topics on which tactid publishes the wrenches of the load and of the contact.
pub(crate) const OWN_WRENCHES: [&str; 2] = ["load_wrench", "contact_wrench"];

/// Returns whether tactid publishes a topic of wrenches, by its name.
pub(crate) fn is_of_tactid(topic: &str) -> bool {
    let last = topic.rsplit('/').next();
    last.is_some_and(|last| OWN_WRENCHES.contains(&last))
}

/// Returns the requested topics of wrenches or of forces at points; else all wrenches but those of tactid beside others, and
/// where there are none, all forces at points. The second value is whether it is the latter.
fn choose_wrenches(
    log: &LogReader,
    requested: &[String],
) -> Result<(Vec<String>, bool), RecordingError> {
    if requested.is_empty() {
        let mut topics = choose::<WrenchStamped>(log, requested, TopicKind::Wrenches)?;
        if !topics.iter().all(|name| is_of_tactid(name)) {
            topics.retain(|name| !is_of_tactid(name));
        }
        let are_wrenches = !topics.is_empty();
        if !are_wrenches {
            let clouds = log.topics_of::<PointCloud2>();
            let forces = clouds.filter(|topic| why_no_forces(log, topic).is_none());
            topics.extend(forces.map(|topic| topic.name.clone()));
        }
        let are_forces = !are_wrenches && !topics.is_empty();
        return Ok((topics, are_forces));
    }
    for name in requested {
        let cloud = log.topic(name).filter(|topic| topic.is::<PointCloud2>());
        let Some(cloud) = cloud else {
            choose::<WrenchStamped>(log, std::slice::from_ref(name), TopicKind::Wrenches)?;
            continue;
        };
        if let Some(what) = why_no_forces(log, cloud) {
            return Err(RecordingError::Option {
                option: TopicKind::Wrenches.option(),
                what,
            });
        }
    }
    Ok((requested.to_vec(), false))
}

/// Returns the frame of the first message of a topic of wrenches or of forces at points.
pub(crate) fn frame_of_wrenches(log: &LogReader, topic: &str) -> Result<String, RecordingError> {
    if log.topic(topic).is_some_and(Topic::is::<PointCloud2>) {
        return Ok(first::<PointCloud2>(log, topic)?.header.frame_id);
    }
    Ok(first::<WrenchStamped>(log, topic)?.header.frame_id)
}

/// Returns the requested topics, or all of the type.
fn choose<M: Message>(
    log: &LogReader,
    requested: &[String],
    kind: TopicKind,
) -> Result<Vec<String>, RecordingError> {
    if requested.is_empty() {
        let topics = log.topics_of::<M>().filter(|topic| topic.count > 0);
        return Ok(topics.map(|topic| topic.name.clone()).collect());
    }
    let is_absent = |name: &&String| !log.topics_of::<M>().any(|topic| topic.name == **name);
    match requested.iter().find(is_absent) {
        Some(name) => Err(RecordingError::Option {
            option: kind.option(),
            what: format!(
                "the log has no topic {name} of type {}; its topics are: {}",
                M::TYPE,
                topic_names(log, name)
            ),
        }),
        None => Ok(requested.to_vec()),
    }
}

/// Returns the requested topic, or the only one of the type.
fn choose_one<M: Message>(
    log: &LogReader,
    requested: Option<&String>,
    kind: TopicKind,
) -> Result<Option<String>, RecordingError> {
    let mut found = choose::<M>(log, requested.map_or(&[], std::slice::from_ref), kind)?;
    if found.len() > 1 {
        let what = match kind {
            TopicKind::Joints => "joint states",
            TopicKind::Wrenches => "wrenches",
            TopicKind::Odometry => "odometry",
            TopicKind::Imu => "inertial units",
            TopicKind::Acceleration => "accelerations",
        };
        return Err(several_topics(what, &found.join(", "), kind));
    }
    Ok(found.pop())
}

/// Returns the error of several topics of which one must be chosen.
pub(crate) fn several_topics(what: &str, topics: &str, kind: TopicKind) -> RecordingError {
    let option = kind.option();
    let what = format!(
        "the log has several topics of {what}: {topics}; choose one; `{option}` names the topic"
    );
    RecordingError::data_of(option, what)
}

/// Returns the topics of joint states that are requested, or all.
pub(crate) fn joint_topics(
    log: &LogReader,
    request: &Request,
) -> Result<Vec<String>, RecordingError> {
    let topics = choose::<JointState>(log, several(&request.joint_topic), TopicKind::Joints)?;
    if topics.is_empty() {
        return Err(missing::<JointState>(log, "joint states"));
    }
    Ok(topics)
}

fn has_efforts(log: &LogReader, joints: &[String]) -> Result<bool, RecordingError> {
    for topic in joints {
        if !first::<JointState>(log, topic)?.effort.is_empty() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Lists the names and types of the topics, those that are similar to a name first where there are many, for an error.
pub(crate) fn topic_names(log: &LogReader, similar_to: &str) -> String {
    let topics = log.topics().iter();
    let names: Vec<_> = topics.map(|topic| topic.described()).collect();
    if names.is_empty() {
        return "none".to_owned();
    }
    list_similar(similar_to, names.iter().map(String::as_str))
}

/// Returns the error that the log has no topic of a type.
pub(crate) fn missing<M: Message>(log: &LogReader, what: &str) -> RecordingError {
    RecordingError::data(format!(
        "the log has no {what} (type {}); its topics are: {}",
        M::TYPE,
        topic_names(log, "")
    ))
}

/// Returns the first message on a topic that the log has.
pub(crate) fn first<M: Message>(log: &LogReader, topic: &str) -> Result<M, RecordingError> {
    match log.messages_on([topic])?.next() {
        Some(message) => Ok(message?.decode()?),
        None => Err(RecordingError::data(format!(
            "{topic} is in the log, but has no message: record it once more, or use another topic"
        ))),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use tactid_logs::{Durability, LogWriter};

    use super::*;

    /// Wrenches that tactid has published are used where there are no others, or on request.
    #[test]
    fn wrenches_of_tactid_are_no_candidates_beside_others() {
        let (ft, other) = ("/ft", "/my_load_wrench");
        let (load, contact) = ("/load_wrench", "/ft/contact_wrench");
        let cases: [(&[&str], &[&str], &[&str]); 3] = [
            (&[ft, other, load, contact], &[], &[ft, other]),
            (&[contact], &[], &[contact]),
            (&[ft, contact], &[contact], &[contact]),
        ];
        let file = tempfile::NamedTempFile::new().unwrap();
        for (topics, requested, expected) in cases {
            let mut log = LogWriter::create(file.path()).unwrap();
            for name in topics {
                let topic = log.channel(name, Durability::Volatile).unwrap();
                log.write(&topic, 1, &WrenchStamped::default()).unwrap();
            }
            log.finish().unwrap();
            let requested: Vec<_> = requested.iter().map(ToString::to_string).collect();
            let log = LogReader::open(file.path()).unwrap();
            let (chosen, _) = choose_wrenches(&log, &requested).unwrap();
            assert_eq!(chosen, expected);
        }
    }
}
