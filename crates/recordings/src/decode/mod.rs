//! From messages to events: units, signs, clocks, and what cannot be used.

use std::borrow::Cow;
use std::mem;
use std::sync::Arc;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tactid_dynamics::{BaseAcceleration, Wrench};
use tactid_logs::messages::{self, AccelStamped, Imu, JointState, Odometry, Time, WrenchStamped};
use tactid_logs::{LogReader, RawMessage};

use super::faults::{FaultCounts, fault};
use super::joints::{Groups, Mapping};
use super::request::{ActsOn, Request};
use super::sources::{Motion, Sources};
use super::streams::{Event, Felt, JointValues, Layout, Measured};
use crate::{BaseState, IdentifyError};

/// A stamp that is further than this from where the log's time puts it is a fault, s.
const FAR_S: f64 = 60.0;
/// Streams that begin or end further apart than this are worth a word, s.
const UNEQUAL_S: f64 = 1.0;
/// How many messages are looked at to compare stamps with log times.
const LOOKED_AT: usize = 200;

/// What a topic's messages are.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Joints,
    Odometry,
    Acceleration,
    Imu,
    BaseImu,
    Wrench(usize),
}

/// Turns the messages of one log into events.
#[derive(Clone, Debug)]
pub(crate) struct Decoder {
    sources: Sources,
    routes: Vec<(String, Kind)>,
    groups: Groups,
    /// Names that were met, and what they mean.
    mappings: Vec<(Vec<String>, Option<Arc<Mapping>>)>,
    /// The last message of each kind: decoding the next one reuses what it holds.
    joint_state: JointState,
    odometry: Odometry,
    wrench: WrenchStamped,
    /// +1, or -1 where wrenches act on the sensor.
    sign: f64,
    gains: Vec<f64>,
    clock: Clock,
    /// Longer silences of a publisher are gaps, s.
    max_gap_s: f64,
    publishers: Vec<Publisher>,
    pub(crate) faults: FaultCounts,
}

/// The messages of one kind from one publisher.
#[derive(Clone, Debug)]
struct Publisher {
    topic: String,
    /// Tells apart the publishers of one topic.
    part: usize,
    first_s: f64,
    last_s: f64,
}

/// The log's clock: header stamps, or log times where there are none.
#[derive(Clone, Copy, Debug)]
struct Clock {
    /// Zero of the events' times, ns.
    origin_ns: i64,
    /// Stamp less log time, ns, as in most messages; none where there is no stamp.
    offset_ns: Option<i64>,
}

impl Decoder {
    pub(crate) fn new(
        log: &LogReader,
        sources: Sources,
        request: &Request,
    ) -> Result<Self, IdentifyError> {
        let mut routes = Vec::new();
        match &sources.motion {
            Motion::Joints(topics) => {
                routes.extend(topics.iter().map(|topic| (topic.clone(), Kind::Joints)));
            }
            Motion::Odometry(topic) => routes.push((topic.clone(), Kind::Odometry)),
            Motion::Imu(topic) => routes.push((topic.clone(), Kind::Imu)),
        }
        routes.extend(sources.odometry.iter().map(|t| (t.clone(), Kind::Odometry)));
        let acceleration = sources.acceleration.iter();
        routes.extend(acceleration.map(|t| (t.clone(), Kind::Acceleration)));
        routes.extend(sources.base_imu.iter().map(|t| (t.clone(), Kind::BaseImu)));
        let wrenches = sources.wrenches.iter().enumerate();
        routes.extend(wrenches.map(|(k, topic)| (topic.clone(), Kind::Wrench(k))));
        let dof = sources.robot.dof();
        if !request.effort_gain.is_empty() && request.effort_gain.len() != dof {
            return Err(IdentifyError::EffortGains {
                given: request.effort_gain.len(),
                count: dof,
                joints: sources.robot.joint_names().join(", "),
            });
        }
        let mut decoder = Self {
            groups: Groups::find(log, &sources)?,
            mappings: Vec::new(),
            joint_state: JointState::default(),
            odometry: Odometry::default(),
            wrench: WrenchStamped::default(),
            sign: match request.wrench_acts_on {
                ActsOn::Payload => 1.0,
                ActsOn::Sensor => -1.0,
            },
            gains: if request.effort_gain.is_empty() {
                vec![1.0; dof]
            } else {
                request.effort_gain.clone()
            },
            clock: Clock {
                origin_ns: 0,
                offset_ns: None,
            },
            max_gap_s: f64::INFINITY,
            publishers: Vec::new(),
            faults: FaultCounts::default(),
            routes,
            sources,
        };
        decoder.set_clock(log)?;
        Ok(decoder)
    }

    /// Counts silences that are longer than this as gaps.
    pub(crate) fn set_max_gap_s(&mut self, max_gap_s: f64) {
        self.max_gap_s = max_gap_s;
    }

    /// That a message comes after the one before of its publisher.
    fn follow(&mut self, message: &RawMessage, part: usize, time_s: f64) -> Result<(), Fault> {
        let topic = message.topic.name.as_str();
        let known = self.publishers.iter_mut();
        let found = known
            .into_iter()
            .find(|p| p.topic == topic && p.part == part);
        let Some(publisher) = found else {
            self.publishers.push(Publisher {
                topic: topic.to_owned(),
                part,
                first_s: time_s,
                last_s: time_s,
            });
            return Ok(());
        };
        let passed_s = time_s - publisher.last_s;
        if passed_s <= 0.0 {
            return Err("message out of order, left out".into());
        }
        let last_s = publisher.last_s;
        publisher.last_s = time_s;
        if passed_s > self.max_gap_s {
            self.faults.add(topic, "gap, not bridged", last_s);
        }
        Ok(())
    }

    /// Which publishers began long after the others, or ended long before them, a sentence each.
    pub(crate) fn unequal_ends(&self) -> Vec<String> {
        let times = |of: fn(&Publisher) -> f64| self.publishers.iter().map(of);
        let begin_s = times(|p| p.first_s).fold(f64::INFINITY, f64::min);
        let end_s = times(|p| p.last_s).fold(f64::NEG_INFINITY, f64::max);
        let mut sentences = Vec::new();
        for Publisher {
            topic,
            first_s,
            last_s,
            ..
        } in &self.publishers
        {
            let (late_s, early_s) = (first_s - begin_s, end_s - last_s);
            if late_s > UNEQUAL_S {
                sentences.push(format!(
                    "{topic} begins {late_s:.3} s after the others: what came before was left out."
                ));
            }
            if early_s > UNEQUAL_S {
                sentences.push(format!(
                    "{topic} ends at {last_s:.3} s, {early_s:.3} s before the others: what came \
                     after was left out."
                ));
            }
        }
        sentences
    }

    pub(crate) fn sources(&self) -> &Sources {
        &self.sources
    }

    pub(crate) fn groups(&self) -> &Groups {
        &self.groups
    }

    pub(crate) fn layout(&self) -> Layout {
        Layout {
            more_joints: self.groups.places.iter().skip(1).cloned().collect(),
            base: self.sources.has_base(),
            acceleration: self.sources.acceleration.is_some(),
            felt_gravity: None,
            wrenches: self.sources.wrenches.len(),
            unloaded: false,
        }
    }

    /// Stamp of time zero, ns since the epoch.
    pub(crate) fn origin_ns(&self) -> i64 {
        self.clock.origin_ns
    }

    /// Whether the messages carry stamps.
    pub(crate) fn has_stamps(&self) -> bool {
        self.clock.offset_ns.is_some()
    }

    /// Compares stamps with log times in the beginning of the log.
    fn set_clock(&mut self, log: &LogReader) -> Result<(), IdentifyError> {
        let mut offsets = Vec::new();
        let mut first_ns = None;
        for message in log.messages_on(self.sources.measured())?.take(LOOKED_AT) {
            let message = message?;
            let log_ns = i64::try_from(message.log_time_ns).unwrap_or(i64::MAX);
            first_ns.get_or_insert(log_ns);
            match stamp(&message).map(Time::as_ns) {
                Some(0) | None => {}
                Some(stamp_ns) => offsets.push(stamp_ns.saturating_sub(log_ns)),
            }
        }
        offsets.sort_unstable();
        self.clock.offset_ns = offsets.get(offsets.len() / 2).copied();
        let offset_ns = self.clock.offset_ns.unwrap_or(0);
        self.clock.origin_ns = first_ns.unwrap_or(0).saturating_add(offset_ns);
        Ok(())
    }

    /// Adds what a message says to `events`; what is wrong with it is counted.
    pub(crate) fn decode(&mut self, message: &RawMessage, events: &mut Vec<Event>) {
        let topic = message.topic.name.as_str();
        let Some((_, kind)) = self.routes.iter().find(|(name, _)| name == topic) else {
            return;
        };
        let kind = *kind;
        let result = match kind {
            Kind::Joints => self.joints(message, events),
            Kind::Odometry => self.odometry(message, events),
            Kind::Acceleration => self.acceleration(message, events),
            Kind::Imu => self.imu(message, events),
            Kind::BaseImu => self.base_imu(message, events),
            Kind::Wrench(sensor) => self.wrench(sensor, message, events),
        };
        if let Err(what) = result {
            let time_s = self.log_time_s(message);
            self.faults.add(topic, &what, time_s);
        }
    }

    fn joints(&mut self, message: &RawMessage, events: &mut Vec<Event>) -> Result<(), Fault> {
        let mut state = mem::take(&mut self.joint_state);
        let decoded = message.decode_into(&mut state).map_err(|_| UNDECODABLE);
        let result = decoded.and_then(|()| self.joint_values(message, &state, events));
        self.joint_state = state;
        result
    }

    fn joint_values(
        &mut self,
        message: &RawMessage,
        state: &JointState,
        events: &mut Vec<Event>,
    ) -> Result<(), Fault> {
        let time_s = self.time_s(message, state.header.stamp)?;
        let known = self
            .mappings
            .iter()
            .position(|(names, _)| *names == state.name);
        let at = known.unwrap_or_else(|| {
            let mapping = self.groups.mapping(&self.sources, &state.name);
            self.mappings
                .push((state.name.clone(), mapping.map(Arc::new)));
            self.mappings.len() - 1
        });
        let mapping = self.mappings[at].1.clone();
        let mapping = mapping.ok_or("message with only a part of the joints, left out")?;
        self.follow(message, mapping.group, time_s)?;
        let count = state.name.len();
        if state.position.len() != count {
            return Err("message with another number of positions than of names, left out".into());
        }
        let pick = |values: &[f64]| -> Vec<f64> {
            mapping.entries.iter().map(|&entry| values[entry]).collect()
        };
        let position = pick(&state.position);
        check(&position)?;
        let mut velocity = Vec::new();
        if state.velocity.len() == count {
            velocity = pick(&state.velocity);
            if velocity.iter().any(|v| !v.is_finite()) {
                velocity.clear();
                let what = "velocity that is not finite, derived from positions";
                self.faults.add(&message.topic.name, what, time_s);
            }
            check(&velocity)?;
        } else {
            let what = "message without velocities, derived from positions";
            self.faults.add(&message.topic.name, what, time_s);
        }
        let places = &mapping.places;
        let mut effort = Vec::new();
        if self.sources.method.uses_effort() {
            if state.effort.len() != count {
                return Err("message without efforts, left out".into());
            }
            effort = pick(&state.effort);
            if let Some(at) = effort.iter().position(|effort| !effort.is_finite()) {
                let joint = &self.sources.robot.joint_names()[places[at]];
                return Err(format!("effort of {joint} that is not finite, left out").into());
            }
            check(&effort)?;
            for (effort, &place) in effort.iter_mut().zip(places) {
                *effort *= self.gains[place];
            }
        }
        let values = JointValues {
            position,
            velocity,
            effort,
        };
        let what = if mapping.group == 0 {
            Measured::Joints(self.spread(values, places))
        } else {
            Measured::MoreJoints(mapping.group - 1, values)
        };
        events.push(Event { time_s, what });
        Ok(())
    }

    /// Puts the joints of the first group into their places; the others wait at zero.
    fn spread(&self, part: JointValues, places: &[usize]) -> JointValues {
        let dof = self.sources.robot.dof();
        if places.len() == dof {
            return part;
        }
        let spread = |values: Vec<f64>| -> Vec<f64> {
            let mut all = vec![0.0; if values.is_empty() { 0 } else { dof }];
            for (&place, value) in places.iter().zip(values) {
                all[place] = value;
            }
            all
        };
        JointValues {
            position: spread(part.position),
            velocity: spread(part.velocity),
            effort: spread(part.effort),
        }
    }

    fn odometry(&mut self, message: &RawMessage, events: &mut Vec<Event>) -> Result<(), Fault> {
        let decoded = message.decode_into(&mut self.odometry);
        decoded.map_err(|_| UNDECODABLE)?;
        let time_s = self.time_s(message, self.odometry.header.stamp)?;
        self.follow(message, 0, time_s)?;
        let (pose, twist) = (&self.odometry.pose.pose, &self.odometry.twist.twist);
        let (p, q) = (&pose.position, &pose.orientation);
        check(&[p.x, p.y, p.z, q.w, q.x, q.y, q.z])?;
        let rotation = Quaternion::new(q.w, q.x, q.y, q.z);
        if (rotation.norm() - 1.0).abs() > 0.1 {
            return Err("orientation that is no unit quaternion, message left out".into());
        }
        let rotation = UnitQuaternion::new_normalize(rotation);
        // Odometry has its twist in the moving frame; the equations want it in the inertial one.
        let base = BaseState {
            pose: Isometry3::from_parts(Translation3::new(p.x, p.y, p.z), rotation),
            velocity: rotation * vector(twist.linear),
            angular_velocity: rotation * vector(twist.angular),
            acceleration: None,
            angular_acceleration: None,
        };
        check(base.velocity.iter().chain(&base.angular_velocity))?;
        self.moved(time_s, base, events);
        Ok(())
    }

    /// Without joints the moving body is the robot, and its clock the one that counts.
    fn moved(&self, time_s: f64, base: BaseState, events: &mut Vec<Event>) {
        events.push(Event {
            time_s,
            what: Measured::Base(base),
        });
        if !matches!(self.sources.motion, Motion::Joints(_)) {
            events.push(Event {
                time_s,
                what: Measured::Joints(JointValues::default()),
            });
        }
    }

    fn acceleration(&mut self, message: &RawMessage, events: &mut Vec<Event>) -> Result<(), Fault> {
        let stamped: AccelStamped = message.decode().map_err(|_| UNDECODABLE)?;
        let time_s = self.time_s(message, stamped.header.stamp)?;
        self.follow(message, 0, time_s)?;
        let acceleration = BaseAcceleration {
            linear: vector(stamped.accel.linear),
            angular: vector(stamped.accel.angular),
        };
        let values = acceleration.linear.iter().chain(&acceleration.angular);
        check(values)?;
        events.push(Event {
            time_s,
            what: Measured::Acceleration(acceleration),
        });
        Ok(())
    }

    /// An inertial unit feels `p̈ - g` in its own frame, which is all that the equations need: its
    /// world is a frame that turns with it, in which there is no gravity left.
    fn imu(&mut self, message: &RawMessage, events: &mut Vec<Event>) -> Result<(), Fault> {
        let (time_s, felt) = self.felt(message)?;
        let base = BaseState {
            angular_velocity: felt.angular_velocity,
            acceleration: Some(felt.force),
            ..BaseState::fixed()
        };
        self.moved(time_s, base, events);
        Ok(())
    }

    fn base_imu(&mut self, message: &RawMessage, events: &mut Vec<Event>) -> Result<(), Fault> {
        let (time_s, felt) = self.felt(message)?;
        events.push(Event {
            time_s,
            what: Measured::Felt(felt),
        });
        Ok(())
    }

    fn felt(&mut self, message: &RawMessage) -> Result<(f64, Felt), Fault> {
        let imu: Imu = message.decode().map_err(|_| UNDECODABLE)?;
        let time_s = self.time_s(message, imu.header.stamp)?;
        self.follow(message, 0, time_s)?;
        let felt = Felt {
            force: vector(imu.linear_acceleration),
            angular_velocity: vector(imu.angular_velocity),
        };
        check(felt.force.iter().chain(&felt.angular_velocity))?;
        Ok((time_s, felt))
    }

    fn wrench(
        &mut self,
        sensor: usize,
        message: &RawMessage,
        events: &mut Vec<Event>,
    ) -> Result<(), Fault> {
        let decoded = message.decode_into(&mut self.wrench);
        decoded.map_err(|_| UNDECODABLE)?;
        let time_s = self.time_s(message, self.wrench.header.stamp)?;
        self.follow(message, 0, time_s)?;
        let wrench = Wrench {
            force: vector(self.wrench.wrench.force) * self.sign,
            moment: vector(self.wrench.wrench.torque) * self.sign,
        };
        check(wrench.force.iter().chain(&wrench.moment))?;
        events.push(Event {
            time_s,
            what: Measured::Wrench(sensor, wrench),
        });
        Ok(())
    }

    /// The message's time since the first one, s.
    fn time_s(&mut self, message: &RawMessage, stamp: Time) -> Result<f64, Fault> {
        let log_s = self.log_time_s(message);
        if stamp == Time::default() {
            if self.clock.offset_ns.is_some() {
                let what = "message without a stamp, the time of logging is taken";
                self.faults.add(&message.topic.name, what, log_s);
            }
            return Ok(log_s);
        }
        let time_s = stamp.as_ns().saturating_sub(self.clock.origin_ns) as f64 * 1e-9;
        if (time_s - log_s).abs() > FAR_S {
            return Err("message with a stamp far from the time of logging, left out".into());
        }
        Ok(time_s)
    }

    /// The time of logging on the stamps' clock, s.
    pub(crate) fn log_time_s(&self, message: &RawMessage) -> f64 {
        let log_ns = i64::try_from(message.log_time_ns).unwrap_or(i64::MAX);
        let on_clock = log_ns.saturating_add(self.clock.offset_ns.unwrap_or(0));
        on_clock.saturating_sub(self.clock.origin_ns) as f64 * 1e-9
    }
}

/// That numbers can be used.
fn check<'a>(values: impl IntoIterator<Item = &'a f64>) -> Result<(), Fault> {
    fault(values).map_or(Ok(()), |what| Err(what.into()))
}

/// Why a message is not used.
type Fault = Cow<'static, str>;

const UNDECODABLE: Fault = Cow::Borrowed("message that cannot be decoded, left out");

fn vector(v: messages::Vector3) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

/// The stamp with which every message with a header begins.
fn stamp(message: &RawMessage) -> Option<Time> {
    let bytes: &[u8] = message.data();
    let word = |at: usize| -> Option<[u8; 4]> { bytes.get(at..at + 4)?.try_into().ok() };
    let (sec, nanosec) = (word(4)?, word(8)?);
    let little = bytes.get(1)? & 1 == 1;
    Some(if little {
        Time {
            sec: i32::from_le_bytes(sec),
            nanosec: u32::from_le_bytes(nanosec),
        }
    } else {
        Time {
            sec: i32::from_be_bytes(sec),
            nanosec: u32::from_be_bytes(nanosec),
        }
    })
}
