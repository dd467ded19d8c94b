//! Decoding: from the messages of a log to events, with units, signs and clocks; what cannot be used is
//! counted.

mod clock;
mod joints;
mod messages;
mod publishers;
mod renaming;

use std::sync::Arc;

use tactid_logs::messages::{JointState, Odometry, Time, WrenchStamped};
use tactid_logs::{LogReader, RawMessage, Topic};

use crate::alignment::{Event, Streams};
use crate::defaults::{Motion, effort_gains};
use crate::fault::{FaultCounts, FaultKind};
use crate::sources::{LogSources, MotionTopics};
use crate::{Finding, RecordingError, Request};
pub(crate) use clock::LogClock;
use joints::{JointGroups, Mapping};
use publishers::Publishers;

/// What the messages of a topic measure.
#[derive(Clone, Copy, Debug)]
enum Route {
    Joints,
    Odometry,
    Acceleration,
    /// Inertial unit on the sensor.
    Imu,
    /// Inertial unit on the base of a robot.
    BaseImu,
    /// Wrench of the sensor of this index.
    Wrench(usize),
}

/// How the messages of one log are decoded.
#[derive(Clone, Debug)]
pub(crate) struct Decoding {
    routes: Vec<(String, Route)>,
    joints: JointGroups,
    clock: LogClock,
    /// 1, or -1 where wrenches act on the sensor.
    wrench_sign: f64,
    uses_effort: bool,
    effort_gains: Vec<f64>,
    /// Whether the body that odometry or an inertial unit moves is the sensor: its times are those to which
    /// the wrenches are aligned.
    is_carried: bool,
}

impl Decoding {
    /// Reads the beginning of a log to find its clock and the publishers of its joints.
    pub(crate) fn new(
        log: &LogReader,
        sources: &LogSources,
        request: &Request,
    ) -> Result<Self, RecordingError> {
        let topics = &sources.topics;
        Ok(Self {
            routes: routes(sources),
            effort_gains: effort_gains(request, sources.robot.joint_names()),
            joints: JointGroups::find(log, sources, request.rename_joints.as_ref())?,
            clock: LogClock::find(log, &topics.without_acceleration())?,
            wrench_sign: sources.options.wrench_sign,
            uses_effort: sources.options.method().uses_effort(),
            is_carried: sources.contents.motion != Motion::Joints,
        })
    }

    pub(crate) fn clock(&self) -> &LogClock {
        &self.clock
    }

    /// Number of publishers of joint states.
    pub(crate) fn joint_publishers(&self) -> usize {
        self.joints.count()
    }

    /// Returns the streams of events that the messages make. `unloaded`: with those of an unloaded recording.
    pub(crate) fn streams(&self, sources: &LogSources, unloaded: bool) -> Streams {
        let gravity = sources
            .options
            .equations
            .gravity_for(sources.robot.base_kind());
        Streams {
            more_joints: self.joints.others(),
            base: sources.topics.has_base(),
            acceleration: sources.topics.acceleration().is_some(),
            base_imu: sources.topics.base_imu().map(|_| gravity),
            wrenches: sources.topics.wrenches.len(),
            unloaded,
        }
    }

    /// Reports joints of only one of log and robot.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        self.joints.findings()
    }
}

fn routes(sources: &LogSources) -> Vec<(String, Route)> {
    let topics = &sources.topics;
    let mut routes = Vec::new();
    match &topics.motion {
        MotionTopics::Joints {
            joints,
            base_odometry,
            base_imu,
        } => {
            routes.extend(joints.iter().map(|topic| (topic, Route::Joints)));
            routes.extend(base_odometry.iter().map(|topic| (topic, Route::Odometry)));
            routes.extend(base_imu.iter().map(|topic| (topic, Route::BaseImu)));
        }
        MotionTopics::Odometry {
            odometry,
            acceleration,
        } => {
            routes.push((odometry, Route::Odometry));
            routes.extend(
                acceleration
                    .iter()
                    .map(|topic| (topic, Route::Acceleration)),
            );
        }
        MotionTopics::Imu(topic) => routes.push((topic, Route::Imu)),
    }
    let wrenches = topics.wrenches.iter().enumerate();
    routes.extend(wrenches.map(|(sensor, topic)| (topic, Route::Wrench(sensor))));
    let routes = routes.into_iter();
    routes
        .map(|(topic, route)| (topic.clone(), route))
        .collect()
}

/// Turns the messages of one log, in the order of their times of logging, into events.
#[derive(Clone, Debug)]
pub(crate) struct Decoder {
    decoding: Arc<Decoding>,
    publishers: Publishers,
    /// Topics that were met, with what their messages measure. A log has one object for each topic, which is found faster
    /// than its name.
    routes: Vec<(Arc<Topic>, Option<Route>)>,
    /// Lists of joint names that were met, with their meaning.
    mappings: Vec<(Vec<String>, Option<Arc<Mapping>>)>,
    /// The last message of each kind, whose memory the next one reuses.
    joint_state: JointState,
    odometry: Odometry,
    wrench: WrenchStamped,
    faults: FaultCounts,
}

impl Decoder {
    /// Creates a decoder that counts longer times than `max_gap_s` between two messages of a publisher as gaps.
    pub(crate) fn new(decoding: Arc<Decoding>, max_gap_s: f64) -> Self {
        Self {
            decoding,
            publishers: Publishers::new(max_gap_s),
            routes: Vec::new(),
            mappings: Vec::new(),
            joint_state: JointState::default(),
            odometry: Odometry::default(),
            wrench: WrenchStamped::default(),
            faults: FaultCounts::default(),
        }
    }

    /// Adds the events of a message to `events`, or counts why it cannot be used.
    pub(crate) fn decode(&mut self, message: &RawMessage, events: &mut Vec<Event>) {
        let Some(route) = self.route(&message.topic) else {
            return;
        };
        let result = match route {
            Route::Joints => self.joints(message, events),
            Route::Odometry => self.odometry(message, events),
            Route::Acceleration => self.acceleration(message, events),
            Route::Imu => self.imu(message, events),
            Route::BaseImu => self.base_imu(message, events),
            Route::Wrench(sensor) => self.wrench(sensor, message, events),
        };
        if let Err(kind) = result {
            let time_s = self.log_time_s(message);
            self.faults.add(&message.topic.name, kind, time_s);
        }
    }

    /// Returns what the messages of a topic measure; `None` for a topic that is not used.
    fn route(&mut self, topic: &Arc<Topic>) -> Option<Route> {
        let known = self.routes.iter().find(|(met, _)| Arc::ptr_eq(met, topic));
        if let Some((_, route)) = known {
            return *route;
        }
        let mut routes = self.decoding.routes.iter();
        let found = routes.find(|(name, _)| *name == topic.name);
        let route = found.map(|(_, route)| *route);
        self.routes.push((topic.clone(), route));
        route
    }

    /// Returns the time of logging of a message on the stamps' clock, s.
    pub(crate) fn log_time_s(&self, message: &RawMessage) -> f64 {
        self.decoding.clock.log_time_s(message)
    }

    /// Faults of the messages so far.
    pub(crate) fn faults(&self) -> &FaultCounts {
        &self.faults
    }

    /// Reports publishers that begin long after the others, or end long before them.
    pub(crate) fn unequal_ends(&self) -> Vec<Finding> {
        self.publishers.unequal_ends()
    }

    /// Returns the time of a message with a stamp on the log's clock, s.
    fn time_s(&mut self, message: &RawMessage, stamp: Time) -> Result<f64, FaultKind> {
        let (time_s, fault) = self.decoding.clock.time_s(message, stamp)?;
        if let Some(kind) = fault {
            self.faults.add(&message.topic.name, kind, time_s);
        }
        Ok(time_s)
    }

    /// Checks that a message comes after the one before of its publisher.
    fn check_order(
        &mut self,
        message: &RawMessage,
        publisher: usize,
        time_s: f64,
    ) -> Result<(), FaultKind> {
        let topic = message.topic.name.as_str();
        let faults = &mut self.faults;
        self.publishers.push(topic, publisher, time_s, faults)
    }
}
