//! A live session from its first message on.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use schemars::JsonSchema;
use serde::Serialize;
use tactid_identify::{Finding as DataFinding, Identifier, PayloadEstimate, WrenchOffset};
use tactid_logs::messages::{JointState, WrenchStamped};
use tactid_logs::{RawMessage, Topic};

use super::beginning::Beginning;
use super::running::{LiveContact, Running};
use crate::sources::is_of_tactid;
use crate::{DataFault, Finding, RecordingError, Request};

/// Length of the beginning from which the last plan is made, s: that of a recording.
const LONGEST_BEGINNING_S: f64 = 30.0;

/// A plan that succeeded is made once more from a beginning that is so many times as long.
const LONGER: f64 = 2.5;

/// Time to the next attempt after one that failed, s.
const RETRY_S: f64 = 2.0;

/// A topic that was silent for longer is reported, s: ten periods of the slowest sensor that is of use.
const LONGEST_SILENCE_S: f64 = 1.0;

/// Number of messages without a sample after which the session starts again: half a second of 1 kHz.
const MOST_WITHOUT_SAMPLE: u64 = 500;

/// How a live session is run.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveSettings {
    /// Length of the messages from which the first plan is made, s.
    pub first_s: f64,
    /// Whether plans are made in another thread, while [`LiveSession::push`] returns at once. Results then depend on
    /// how fast the machine is.
    pub in_background: bool,
    /// Link about whose origin and along whose axes [`LiveSession::contact_wrench`] is. It moves with the end-effector.
    /// Default: that of the sensor; the end-effector where there are several sensors.
    pub contact_frame: Option<String>,
}

impl Default for LiveSettings {
    fn default() -> Self {
        Self {
            first_s: 5.0,
            in_background: true,
            contact_frame: None,
        }
    }
}

/// What a live session does at the moment.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LiveStatus {
    /// Whether an identification runs.
    pub is_running: bool,
    /// Why the latest attempt to begin one has failed; `None` where it has not.
    pub problem: Option<String>,
    /// Topics that are used; none before an identification runs.
    pub topics: Vec<String>,
    /// Number of messages, also those of topics that are not used.
    pub messages: u64,
    /// Number of samples that the identification was given.
    pub samples: u64,
    /// Time of the last sample on the clock of the messages, ns since the epoch.
    pub last_ns: i64,
    /// Delay that is subtracted from the times of the wrenches, s.
    pub delay_s: f64,
    /// Cutoff of the filter, Hz.
    pub cutoff_hz: f64,
    /// Number of times that the session has started again, because messages no longer gave samples.
    pub restarts: u64,
}

/// A topic that was met.
#[derive(Debug)]
struct Met {
    topic: Arc<Topic>,
    /// Time at which the latest message came, ns; `None` before there is one.
    last_ns: Option<u64>,
}

/// A plan in another thread, with the number of messages that it has.
type Planning = (u64, JoinHandle<Result<Running, RecordingError>>);

/// Identifies a payload from messages while they come.
///
/// Nothing has to be known of them: what a request leaves open (topics, robot, frames, delay, offset, cutoff) is chosen
/// from the first seconds, as [`identify_log`](crate::identify_log) does, and once more from 30 s. The estimate then is
/// that of all messages since the beginning. Memory is bounded.
pub struct LiveSession {
    request: Arc<Request>,
    settings: LiveSettings,
    topics: BTreeMap<String, Met>,
    beginning: Beginning,
    /// Length of the beginning at which the next plan is made, s; `None` where no further one is needed.
    due_s: Option<f64>,
    /// Whether the identification that runs is to be replaced, because messages no longer give samples.
    is_replaced: bool,
    /// Whether the identification that runs was begun with the messages of the beginning that is kept.
    has_same_beginning: bool,
    planning: Option<Planning>,
    running: Option<Running>,
    problem: Option<RecordingError>,
    messages: u64,
    restarts: u64,
}

impl LiveSession {
    /// Begins a session.
    ///
    /// # Errors
    /// Returns the errors of a request that is out of range, and [`RecordingError::Option`] for an option that does not
    /// apply to a live session.
    pub fn new(request: Request, settings: LiveSettings) -> Result<Self, RecordingError> {
        request.check()?;
        request.check_live()?;
        Ok(Self {
            request: Arc::new(request),
            due_s: Some(settings.first_s),
            settings,
            topics: BTreeMap::new(),
            beginning: Beginning::default(),
            is_replaced: false,
            has_same_beginning: false,
            planning: None,
            running: None,
            problem: None,
            messages: 0,
            restarts: 0,
        })
    }

    /// Notes that there is a topic, with the type of its messages: one that could be used, but is not, is reported.
    pub fn announce(&mut self, name: &str, type_name: &str) {
        self.met(name, type_name);
    }

    /// Takes the next message of a topic: its `data` as CDR with its header, and when it came, ns since the epoch.
    ///
    /// # Errors
    /// Returns an error of the identification itself, which messages do not cause.
    pub fn push(
        &mut self,
        name: &str,
        type_name: &str,
        data: Vec<u8>,
        received_ns: u64,
    ) -> Result<(), RecordingError> {
        let met = self.met(name, type_name);
        met.last_ns = Some(received_ns);
        let message = RawMessage::new(met.topic.clone(), received_ns, data);
        self.messages += 1;
        if let Some(running) = &mut self.running {
            running.take(&message)?;
        }
        self.check_samples();
        let keeps_measured = self.due_s.is_some() || self.planning.is_some();
        self.beginning.push(message, keeps_measured);
        self.proceed()?;
        self.plan_where_due()
    }

    /// Takes over what another thread has chosen from the beginning, as [`push`](Self::push) does with each message.
    ///
    /// # Errors
    /// Returns an error of the identification itself, which messages do not cause.
    pub fn proceed(&mut self) -> Result<(), RecordingError> {
        self.receive_plan(false)
    }

    /// Chooses once more from all messages of a session that ends before its last plan, and does the work that the
    /// identifier has deferred.
    ///
    /// # Errors
    /// Returns the error for which no identification could begin.
    pub fn finish(&mut self) -> Result<(), RecordingError> {
        self.receive_plan(true)?;
        let is_short = self.beginning.elapsed_s < LONGEST_BEGINNING_S;
        if self.due_s.is_some() && is_short && !self.is_replaced {
            self.plan();
            self.receive_plan(true)?;
        }
        match (&mut self.running, self.problem.take()) {
            (Some(running), _) => running.finish(),
            (None, Some(problem)) => return Err(problem),
            (None, None) => {}
        }
        Ok(())
    }

    /// Forgets what was identified, and begins again with the next message.
    pub fn reset(&mut self) {
        self.running = None;
        self.start_again();
    }

    /// Returns the estimate; `None` before an identification runs.
    #[must_use]
    pub fn estimate(&self) -> Option<PayloadEstimate> {
        Some(self.running.as_ref()?.identifier().estimate())
    }

    /// Returns the offset of the wrenches as they are measured; `None` where it is not an unknown.
    #[must_use]
    pub fn wrench_offset(&self) -> Option<WrenchOffset> {
        self.running.as_ref()?.wrench_offset()
    }

    /// Returns the wrench of a contact as of the last sample: see [`Identifier::contact_wrench`]. `None` before the motion
    /// has [determined](Identifier::knows_weight) payload and offset.
    #[must_use]
    pub fn contact_wrench(&self) -> Option<LiveContact> {
        self.running.as_ref()?.contact_wrench()
    }

    /// Returns the number of payload changes that were detected since the identification began.
    #[must_use]
    pub fn payload_changes(&self) -> u64 {
        self.estimate()
            .map_or(0, |estimate| estimate.payload_changes)
    }

    /// Sets the zero of the wrench sensor and holds the payload: see [`Identifier::tare`].
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] before the payload is known, and [`RecordingError::Option`] where the offset of the
    /// wrenches is not an unknown.
    pub fn tare(&mut self) -> Result<(), RecordingError> {
        let not_yet = "the payload is not known yet: call again once it is";
        let Some(running) = &mut self.running else {
            return Err(RecordingError::data(not_yet));
        };
        if !running.has_offset {
            return Err(RecordingError::Option {
                option: "wrench_offset",
                what: "there is no zero to set, because the offset of the wrenches is not identified: give `wrench_offset` \
                       as yes"
                    .to_owned(),
            });
        }
        let is_set = running.tare().then_some(());
        is_set.ok_or_else(|| RecordingError::data(not_yet))
    }

    /// Returns what the session does at the moment.
    #[must_use]
    pub fn status(&self) -> LiveStatus {
        let running = self.running.as_ref();
        LiveStatus {
            is_running: running.is_some(),
            problem: self.problem.as_ref().map(ToString::to_string),
            topics: running.map_or_else(Vec::new, |running| running.sources.names.clone()),
            messages: self.messages,
            samples: running.map_or(0, |running| running.samples),
            last_ns: running.map_or(0, |running| running.last_ns),
            delay_s: running.map_or(0.0, |running| running.delay_s),
            cutoff_hz: running.map_or(0.0, |running| running.cutoff_hz),
            restarts: self.restarts,
        }
    }

    /// Returns what is needed for the findings at a time, ns since the epoch, which takes longer than a control loop has.
    #[must_use]
    pub fn snapshot(&self, now_ns: u64) -> LiveSnapshot {
        let mut noticed = self.silent_topics(now_ns);
        noticed.extend(self.topics_not_used());
        if self.restarts > 0 {
            noticed.push(Finding::LiveRestarted {
                count: self.restarts,
            });
        }
        let running = self.running.as_ref();
        noticed.extend(running.map(Running::noticed).unwrap_or_default());
        LiveSnapshot {
            noticed,
            faults: running.map(Running::faults).unwrap_or_default(),
            identifier: running.map(|running| running.identifier().clone()),
        }
    }

    fn met(&mut self, name: &str, type_name: &str) -> &mut Met {
        let new = || Met {
            topic: Arc::new(Topic {
                name: name.to_owned(),
                type_name: type_name.to_owned(),
                encoding: "cdr".to_owned(),
                count: 0,
                times_ns: None,
            }),
            last_ns: None,
        };
        self.topics.entry(name.to_owned()).or_insert_with(new)
    }

    /// Starts again where messages no longer give samples: a clock that jumped, or other joints. The identification goes
    /// on until another one has begun, and stays where it gives samples again before.
    fn check_samples(&mut self) {
        let Some(running) = &self.running else {
            return;
        };
        match running.without_sample {
            0 if self.is_replaced => {
                self.start_again();
                (self.is_replaced, self.due_s, self.problem) = (false, None, None);
            }
            MOST_WITHOUT_SAMPLE if !self.is_replaced => {
                self.start_again();
                self.is_replaced = true;
            }
            _ => {}
        }
    }

    fn start_again(&mut self) {
        self.beginning.restart();
        self.has_same_beginning = false;
        self.planning = None;
        self.due_s = Some(self.settings.first_s);
    }

    fn plan_where_due(&mut self) -> Result<(), RecordingError> {
        let elapsed_s = self.beginning.elapsed_s;
        let is_due = self.due_s.is_some_and(|due_s| elapsed_s >= due_s);
        if !is_due || self.planning.is_some() {
            return Ok(());
        }
        self.plan();
        self.receive_plan(!self.settings.in_background)
    }

    fn plan(&mut self) {
        let (messages, request) = (self.beginning.messages(), self.request.clone());
        let frame = self.settings.contact_frame.clone();
        let planned = thread::spawn(move || Running::start(&messages, &request, frame.as_deref()));
        self.planning = Some((self.beginning.pushed, planned));
    }

    /// Takes over an identification that has begun in another thread, if there is one; waits for it where `waits`.
    fn receive_plan(&mut self, waits: bool) -> Result<(), RecordingError> {
        let is_done = |planning: &mut Planning| waits || planning.1.is_finished();
        let Some((pushed, planned)) = self.planning.take_if(is_done) else {
            return Ok(());
        };
        let planned = planned.join();
        match planned.unwrap_or_else(|panic| std::panic::resume_unwind(panic)) {
            Ok(mut running) => {
                for message in self.beginning.since(pushed) {
                    running.take(message)?;
                }
                self.take_over(running);
            }
            Err(error) => {
                self.problem = Some(error);
                self.due_s = Some(self.beginning.elapsed_s + RETRY_S);
            }
        }
        Ok(())
    }

    /// Goes on with an identification that knows the beginning. One that knows no more than the one that runs, and only
    /// later messages, is discarded.
    fn take_over(&mut self, running: Running) {
        let elapsed_s = self.beginning.elapsed_s;
        let is_first = self.running.is_none() || self.is_replaced;
        let (is_settled, is_last) = (running.is_settled, elapsed_s >= LONGEST_BEGINNING_S);
        if is_first || is_settled || self.has_same_beginning {
            self.running = Some(running);
        }
        self.restarts += u64::from(self.is_replaced);
        self.is_replaced = false;
        self.problem = None;
        if is_last {
            self.beginning.restart();
        }
        self.has_same_beginning = !is_last;
        self.due_s = match (is_last, is_settled) {
            (true, true) => None,
            (true, false) => Some(LONGEST_BEGINNING_S),
            (false, _) => Some((LONGER * elapsed_s).min(LONGEST_BEGINNING_S)),
        };
    }

    /// Reports topics that are used and have no messages at the moment.
    fn silent_topics(&self, now_ns: u64) -> Vec<Finding> {
        let used = self
            .running
            .iter()
            .flat_map(|running| &running.sources.names);
        let silent = used.filter_map(|name| {
            let last_ns = self.topics.get(name)?.last_ns?;
            let silent_s = now_ns.saturating_sub(last_ns) as f64 * 1e-9;
            (silent_s > LONGEST_SILENCE_S).then(|| Finding::TopicSilent {
                topic: name.clone(),
                silent_s,
            })
        });
        silent.collect()
    }

    /// Reports topics of joint states or wrenches that are not used, unless the request names those that are.
    fn topics_not_used(&self) -> Option<Finding> {
        let used = &self.running.as_ref()?.sources.names;
        let is_open = |topic: &Topic| {
            (topic.is::<JointState>() && self.request.joint_topic.is_none())
                || (topic.is::<WrenchStamped>()
                    && self.request.wrench_topic.is_none()
                    && !is_of_tactid(&topic.name))
        };
        let met = self.topics.values().map(|met| &met.topic);
        let others = met.filter(|topic| is_open(topic) && !used.contains(&topic.name));
        let topics: Vec<String> = others.map(|topic| topic.name.clone()).collect();
        (!topics.is_empty()).then_some(Finding::TopicsNotUsed { topics })
    }
}

/// What a live session has noticed up to some time.
#[derive(Clone, Debug)]
pub struct LiveSnapshot {
    noticed: Vec<Finding>,
    faults: Vec<DataFault>,
    identifier: Option<Identifier>,
}

impl LiveSnapshot {
    /// Returns all findings. Cost: some 20 ms, see [`Identifier::findings`].
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        // Averages of a constant channel change by rounding: the session looks at the messages instead.
        let is_of_messages =
            |found: &DataFinding| matches!(found, DataFinding::ConstantChannels { .. });
        let found = self.identifier.iter().flat_map(Identifier::findings);
        let found = found.filter(|found| !is_of_messages(found));
        self.noticed
            .iter()
            .cloned()
            .chain(found.map(Finding::Data))
            .collect()
    }

    /// Returns what could not be used of the messages.
    #[must_use]
    pub fn faults(&self) -> &[DataFault] {
        &self.faults
    }
}
