//! A live session from its first message on.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use schemars::JsonSchema;
use serde::Serialize;
use tactid_identify::{PayloadEstimate, WrenchOffset};
use tactid_logs::{RawMessage, Topic};

use super::beginning::Beginning;
use super::running::{LiveContact, Running};
use crate::{RecordingError, Request};

/// Length of the beginning from which the last plan is made, s: that of a recording.
const LONGEST_BEGINNING_S: f64 = 30.0;

/// A plan that succeeded is made once more from a beginning that is so many times as long.
const BEGINNING_GROWTH: f64 = 2.5;

/// Problem where the thread that plans has panicked; a later beginning may do without it.
const PLAN_FAILED: &str =
    "an error of tactid itself, which standard error describes: please report it";

/// Time to the next attempt after one that failed, s.
const RETRY_S: f64 = 2.0;

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
    /// Whether the payload is held: nothing updates the estimate, and what the load does not explain is a contact.
    pub is_payload_held: bool,
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

/// A topic that has been announced or had messages.
#[derive(Debug)]
pub(super) struct KnownTopic {
    pub(super) topic: Arc<Topic>,
    /// Time at which the latest message came, ns; `None` before there is one.
    pub(super) last_ns: Option<u64>,
}

/// A plan in another thread, with the number of messages that it has.
type Planning = (u64, JoinHandle<Result<Running, RecordingError>>);

/// Identifies a payload from messages while they come.
///
/// Nothing has to be known of them: what a request leaves open (topics, robot, frames, delay, offset, cutoff) is chosen
/// from the first seconds, as [`identify_log`](crate::identify_log) does, and again from longer beginnings, the last of
/// 30 s. The estimate then is that of all messages since the beginning. Memory is bounded.
pub struct LiveSession {
    pub(super) request: Arc<Request>,
    settings: LiveSettings,
    pub(super) topics: BTreeMap<String, KnownTopic>,
    beginning: Beginning,
    /// Length of the beginning at which the next plan is made, s; `None` where no further one is needed.
    due_s: Option<f64>,
    /// Whether the identification that runs is to be replaced, because messages no longer give samples.
    must_replace: bool,
    /// Whether the identification that runs was begun with the messages of the beginning that is kept.
    has_same_beginning: bool,
    planning: Option<Planning>,
    pub(super) running: Option<Running>,
    problem: Option<RecordingError>,
    messages: u64,
    pub(super) restarts: u64,
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
            must_replace: false,
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
        self.known_topic(name, type_name);
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
        let topic = self.known_topic(name, type_name);
        topic.last_ns = Some(received_ns);
        let message = RawMessage::new(topic.topic.clone(), received_ns, data);
        self.messages += 1;
        if let Some(running) = &mut self.running {
            running.take(&message)?;
        }
        self.check_samples();
        let is_begun = self.due_s.is_some() || self.planning.is_some();
        let keeps_measured = is_begun && (!self.is_payload_held() || self.must_replace);
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
        if self.due_s.is_some() && is_short && !self.must_replace {
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

    /// Returns the wrench of a contact as of the last sample: see [`Identifier::contact_wrench`](tactid_identify::Identifier::contact_wrench). `None` before the motion
    /// has [determined](tactid_identify::Identifier::knows_weight) payload and offset.
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

    /// Sets the zero of the wrench sensor: see [`Identifier::tare`](tactid_identify::Identifier::tare). No plan is made any more from messages before it.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] before the payload is known and while it is held, and [`RecordingError::Option`]
    /// where the offset of the wrenches is not an unknown.
    pub fn tare(&mut self) -> Result<(), RecordingError> {
        let running = self.running.as_mut().ok_or_else(not_known_yet)?;
        if !running.has_offset {
            return Err(RecordingError::Option {
                option: "wrench_offset",
                what: "there is no zero to set, because the offset of the wrenches is not identified: give `wrench_offset` \
                       as yes"
                    .to_owned(),
            });
        }
        if running.identifier().is_payload_held() {
            let what =
                "the payload is held, so that nothing is identified: call again once it is not";
            return Err(RecordingError::data(what));
        }
        if !running.tare() {
            return Err(not_known_yet());
        }
        self.end_beginning();
        Ok(())
    }

    /// Holds the payload or ends that: see [`Identifier::hold_payload`](tactid_identify::Identifier::hold_payload). No plan is made any more from messages before it.
    /// A session that starts again, by itself or by [`reset`](Self::reset), holds nothing.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] for a payload that is not known yet.
    pub fn hold_payload(&mut self, is_held: bool) -> Result<(), RecordingError> {
        let running = self.running.as_mut();
        if !running.map_or(!is_held, |running| running.hold_payload(is_held)) {
            return Err(not_known_yet());
        }
        if is_held {
            self.end_beginning();
        }
        Ok(())
    }

    /// Returns whether the payload is [held](Self::hold_payload).
    #[must_use]
    pub fn is_payload_held(&self) -> bool {
        let running = self.running.as_ref();
        running.is_some_and(|running| running.identifier().is_payload_held())
    }

    /// Returns what the session does at the moment.
    #[must_use]
    pub fn status(&self) -> LiveStatus {
        let running = self.running.as_ref();
        LiveStatus {
            is_running: running.is_some(),
            is_payload_held: self.is_payload_held(),
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

    fn known_topic(&mut self, name: &str, type_name: &str) -> &mut KnownTopic {
        let new = || KnownTopic {
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
            0 if self.must_replace => {
                self.start_again();
                (self.must_replace, self.due_s, self.problem) = (false, None, None);
            }
            MOST_WITHOUT_SAMPLE.. if !self.must_replace => {
                self.start_again();
                self.must_replace = true;
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
        match planned.unwrap_or_else(|_| Err(RecordingError::data(PLAN_FAILED))) {
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
        let is_first = self.running.is_none() || self.must_replace;
        if is_first || running.is_final || self.has_same_beginning {
            self.running = Some(running);
        }
        self.restarts += u64::from(self.must_replace);
        self.must_replace = false;
        self.problem = None;
        if elapsed_s >= LONGEST_BEGINNING_S {
            self.end_beginning();
        } else {
            self.has_same_beginning = true;
            self.due_s = Some((BEGINNING_GROWTH * elapsed_s).min(LONGEST_BEGINNING_S));
        }
    }

    /// Goes on with the identification that runs, unless it is to be replaced. Where it has not determined what it was to
    /// choose, a later half minute of messages may.
    fn end_beginning(&mut self) {
        if self.must_replace {
            return;
        }
        let is_final = self
            .running
            .as_ref()
            .is_some_and(|running| running.is_final);
        self.beginning.restart();
        self.has_same_beginning = false;
        self.planning = None;
        self.due_s = (!is_final).then_some(LONGEST_BEGINNING_S);
    }
}

fn not_known_yet() -> RecordingError {
    RecordingError::data("the payload is not known yet: call again once it is")
}
