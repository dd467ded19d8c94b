//! Decoding: from the messages of a log to events, with units, signs and clocks; what cannot be
//! used is counted.

mod clock;
mod held;
mod joints;
mod messages;
mod publishers;
mod renaming;

use std::sync::Arc;

use tactid_logs::messages::{JointState, Odometry, Time};
use tactid_logs::{LogReader, RawMessage, Topic};

use crate::alignment::{Averaging, Event, JointValues, Measured, Streams};
use crate::clock::LONGEST_LATENESS_S;
use crate::contacts::WrenchMessages;
use crate::cut::Cut;
use crate::defaults::{Motion, effort_gains};
use crate::fault::{FaultCounts, FaultKind};
use crate::sources::{LogSources, MotionTopics};
use crate::wrench_channels::ChannelAxes;
use crate::{Finding, RecordingError, Request};
pub(crate) use clock::LogClock;
use held::HeldMessages;
use joints::{JointGroups, Mapping};
use publishers::Publishers;

/// Number of wrenches that are read to find channels without numbers.
const FIRST_WRENCHES: usize = 100;

/// Fewest wrenches that show a channel of a log to have no number.
const FEWEST_WRENCHES: usize = 10;

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
    of_clock: Option<Finding>,
    /// 1, or -1 where wrenches act on the sensor.
    wrench_sign: f64,
    /// Channels of each sensor that have no number: they are set to zero.
    unmeasured: Vec<[bool; 6]>,
    uses_effort: bool,
    effort_gains: Vec<f64>,
    /// Whether the body that odometry or an inertial unit moves is the sensor: its times are those
    /// to which the wrenches are aligned.
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
        let (clock, of_clock) = LogClock::find(log, &topics.without_acceleration())?;
        let (options, wrenches) = (&sources.options, topics.wrenches.iter());
        let axes = ChannelAxes::new(
            &sources.robot,
            &sources.sensors,
            &options.tip,
            &options.equations,
        );
        Ok(Self {
            routes: routes(sources),
            effort_gains: effort_gains(request, sources.robot.joint_names()),
            joints: JointGroups::find(log, sources, request.rename_joints.as_ref())?,
            clock,
            of_clock,
            wrench_sign: sources.options.wrench_sign,
            unmeasured: wrenches
                .map(|topic| unmeasured(log, topic, axes))
                .collect::<Result<_, _>>()?,
            uses_effort: sources.options.method().uses_effort(),
            is_carried: sources.contents.motion != Motion::Joints,
        })
    }

    /// Channels of each sensor that have no number.
    pub(crate) fn without_numbers(&self) -> &[[bool; 6]] {
        &self.unmeasured
    }

    pub(crate) fn clock(&self) -> &LogClock {
        &self.clock
    }

    /// Number of publishers of joint states.
    pub(crate) fn joint_publishers(&self) -> usize {
        self.joints.count()
    }

    /// Returns the streams of events that the messages make. `unloaded`: with those of an unloaded
    /// recording.
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
            without_velocities: false,
            averaging: Averaging::default(),
        }
    }

    /// Reports joints of only one of log and robot, and topics without stamps.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        let of_clock = self.of_clock.iter().cloned();
        self.joints.findings().into_iter().chain(of_clock).collect()
    }
}

/// Returns the channels of a wrench topic that have no number in its first messages.
fn unmeasured(
    log: &LogReader,
    topic: &String,
    axes: ChannelAxes,
) -> Result<[bool; 6], RecordingError> {
    let (mut wrenches, mut six) = (WrenchMessages::default(), Vec::new());
    for message in log.messages_on([topic])?.take(FIRST_WRENCHES) {
        // One that cannot be decoded is counted as a fault when the log is read.
        if let Ok((_, wrench, _)) = wrenches.read(&message?) {
            let (f, n) = (wrench.force, wrench.moment);
            six.push([f.x, f.y, f.z, n.x, n.y, n.z]);
        }
    }
    if six.len() < FEWEST_WRENCHES {
        return Ok([false; 6]);
    }
    Ok(axes.without_numbers(six.into_iter()))
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
    clock: LogClock,
    /// The part of the log that is used.
    cut: Cut,
    publishers: Publishers,
    held: HeldMessages,
    /// Publisher, by its place, and time, s, of the message that is decoded; `None` where they are
    /// not known.
    origin: Option<(usize, f64)>,
    /// Topics that were met, with what their messages measure. A log has one object for each topic,
    /// which is found faster than its name.
    routes: Vec<(Arc<Topic>, Option<Route>)>,
    /// Lists of joint names that were met, with their meaning.
    mappings: Vec<(Vec<String>, Option<Arc<Mapping>>)>,
    /// The last message of each kind, whose memory the next one reuses.
    joint_state: JointState,
    odometry: Odometry,
    wrenches: WrenchMessages,
    faults: FaultCounts,
}

impl Decoder {
    /// Creates a decoder of a part of a log that counts longer times than `max_gap_s` between two
    /// messages of a publisher as gaps. Messages that come within [`LONGEST_LATENESS_S`] after later
    /// ones are put in order.
    pub(crate) fn new(decoding: Arc<Decoding>, max_gap_s: f64, cut: Cut) -> Self {
        Self::holding(LONGEST_LATENESS_S, decoding, max_gap_s, cut)
    }

    /// Creates a decoder that holds no message back, and leaves out those that are not later than
    /// the one before of their publisher. Longer times than `max_gap_s` are gaps.
    pub(crate) fn in_order(decoding: Arc<Decoding>, max_gap_s: f64) -> Self {
        Self::holding(0.0, decoding, max_gap_s, Cut::WHOLE)
    }

    fn holding(held_s: f64, decoding: Arc<Decoding>, max_gap_s: f64, cut: Cut) -> Self {
        Self {
            clock: decoding.clock,
            decoding,
            publishers: Publishers::new(max_gap_s),
            held: HeldMessages::new(held_s),
            origin: None,
            routes: Vec::new(),
            mappings: Vec::new(),
            joint_state: JointState::default(),
            odometry: Odometry::default(),
            wrenches: WrenchMessages::default(),
            faults: FaultCounts::within(cut),
            cut,
        }
    }

    /// Decodes a message, or counts why it cannot be used, and adds the events of messages before
    /// which none can come any more to `events`.
    pub(crate) fn decode(&mut self, message: &RawMessage, events: &mut Vec<Event>) {
        let Some(route) = self.route(&message.topic) else {
            return;
        };
        self.origin = None;
        let decoded = match route {
            Route::Joints => self.joints(message),
            Route::Odometry => self.odometry(message),
            Route::Acceleration => self.acceleration(message),
            Route::Imu => self.imu(message),
            Route::BaseImu => self.base_imu(message),
            Route::Wrench(sensor) => self.wrench(sensor, message),
        };
        let logged_s = self.log_time_s(message);
        let measured = match decoded {
            Ok(measured) => Some(measured),
            Err(kind) => {
                self.faults.add(&message.topic.name, kind, logged_s);
                None
            }
        };
        if let Some((publisher, time_s)) = self.origin {
            let event = measured.map(|measured| Event { time_s, measured });
            self.held.push(publisher, logged_s, time_s, event);
            self.release(false, usize::MAX, events);
        }
    }

    /// Adds the events of messages that are held at the end of the log to `events`, until these are
    /// `enough`.
    pub(crate) fn finish(&mut self, enough: usize, events: &mut Vec<Event>) {
        self.release(true, enough, events);
    }

    /// Adds the events of messages that are due, until these are `enough`.
    fn release(&mut self, is_at_end: bool, enough: usize, events: &mut Vec<Event>) {
        while events.len() < enough
            && let Some((publisher, message)) = self.held.pop(is_at_end)
        {
            if self.cut.leaves_out(message.time_s) {
                continue;
            }
            let is_in_order = self.publishers.push(publisher, &message, &mut self.faults);
            let Some(event) = message.event.filter(|_| is_in_order) else {
                continue;
            };
            let time_s = event.time_s;
            let moves_sensor =
                self.decoding.is_carried && matches!(event.measured, Measured::Base(_));
            events.push(event);
            if moves_sensor {
                // Without joints, that is the body to whose times the wrenches are aligned.
                let measured = Measured::Joints(JointValues::default());
                events.push(Event { time_s, measured });
            }
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
        self.clock.log_time_s(message.log_time_ns)
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
        let (time_s, fault) = self.clock.time_s(message, stamp)?;
        if let Some(kind) = fault {
            self.faults.add(&message.topic.name, kind, time_s);
        }
        Ok(time_s)
    }

    /// Notes the publisher, by its index on the topic, and the time of the message that is decoded,
    /// s.
    fn set_origin(&mut self, message: &RawMessage, publisher: usize, time_s: f64) {
        let place = self.publishers.place(&message.topic.name, publisher);
        self.origin = Some((place, time_s));
    }
}
