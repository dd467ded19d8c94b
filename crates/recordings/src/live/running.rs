//! The identification of a live session: messages in, the online identifier fed.

use std::ops::ControlFlow;

use tactid_batch::Delay;
use tactid_identify::{
    EquationSettings, Identifier, Method, OnlineSettings, PushOutcome, WrenchEstimate, WrenchFrame,
    WrenchOffset,
};
use tactid_logs::{LogReader, RawMessage};

use crate::alignment::{Aligned, Aligner, Event};
use crate::channel_ranges::ChannelRanges;
use crate::decode::Decoder;
use crate::log::LogRecording;
use crate::plan::Plan;
use crate::recording::{Recording, Sources};
use crate::run::Run;
use crate::steps::Steps;
use crate::wrench_channels::WrenchChannels;
use crate::{ActsOn, DataFault, Finding, OffsetChoice, RecordingError, Request};

/// Time for which a channel of a wrench has not changed when it is reported, s.
const CONSTANT_S: f64 = 10.0;

/// Name by which errors speak of the messages in memory.
const NAME: &str = "the live topics";

/// An identification that runs.
pub(super) struct Running {
    pub(super) sources: Sources,
    pub(super) delay_s: f64,
    pub(super) cutoff_hz: f64,
    /// Whether another beginning would choose nothing else: what it is to determine is given or
    /// found.
    pub(super) is_final: bool,
    decoder: Decoder,
    aligner: Aligner,
    /// The place into which the aligner writes samples.
    aligned: Aligned,
    identifier: Identifier,
    steps: Steps,
    events: Vec<Event>,
    channels: WrenchChannels,
    ranges: ChannelRanges,
    /// What was noticed of the topics, and what the beginning showed.
    noticed: Vec<Finding>,
    acts_on: ActsOn,
    /// Whether the offset of the wrenches is an unknown.
    pub(super) has_offset: bool,
    /// Link in whose frame the wrench of a contact is, with this frame.
    contact_frame: (String, WrenchFrame),
    pub(super) samples: u64,
    /// Time of the last sample on the clock of the messages, ns since the epoch.
    pub(super) last_ns: i64,
    /// Number of messages since the last sample.
    pub(super) without_sample: u64,
}

/// The wrench of a contact.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveContact {
    /// Time to which the wrench belongs on the clock of the messages, ns since the epoch.
    pub time_ns: i64,
    /// Link about whose origin and along whose axes the wrench is.
    pub frame: String,
    /// Time by which it lags the last sample, s: see [`Identifier::contact_latency_s`].
    pub latency_s: f64,
    /// The wrench, with the sign of the measured ones, and its uncertainty. Its time is since the
    /// start of the session.
    pub wrench: WrenchEstimate,
}

impl Running {
    /// Chooses what a request leaves open from messages, as for a recording that begins with them,
    /// and takes them.
    ///
    /// # Errors
    /// Returns the errors of [`identify_log`](crate::identify_log) for a log of these messages, and
    /// [`IdentifyError::Option`](tactid_identify::IdentifyError::Option) for an unknown that is not
    /// identified online.
    pub(super) fn start(
        messages: &[RawMessage],
        request: &Request,
        contact_frame: Option<&str>,
    ) -> Result<Self, RecordingError> {
        let observer = &mut |_| ControlFlow::Continue(());
        let log = LogReader::of_messages(NAME, messages);
        let recording = LogRecording::of(log, request)?;
        let plan = Plan::new(&recording, request, observer)?;
        let remaining = remaining_delay(&recording, &plan)?;
        let delay_s = plan.delay_s + remaining.map_or(0.0, |rest| rest.delay_s);
        // An arm that rests at first shows no offset, which would be taken for weight.
        let is_open = request.wrench_offset.unwrap_or_default() == OffsetChoice::Auto;
        let equations = EquationSettings {
            wrench_offset: plan.equations.wrench_offset
                || (is_open && plan.equations.method == Method::Tactile),
            ..plan.equations.clone()
        };
        let sources = recording.sources();
        let mut noticed = [&sources.findings[..], &plan.findings].concat();
        noticed.extend(corrected_delay(&plan, delay_s, remaining));
        let is_found = plan.estimated_delay.is_some() || request.delay_s.is_some();
        let max_gap_s = equations.max_gap_s;
        // The aligner gives wrenches on the payload, at the times of the motion.
        let online = OnlineSettings {
            known_tool: request.known_tool(),
            ..OnlineSettings::default()
        };
        let (robot, sensors) = (&sources.robot, plan.sensors());
        let identifier =
            Identifier::with_settings(robot, &plan.tip, &sensors, &equations, &online)?;
        let mut running = Self {
            has_offset: equations.wrench_offset,
            contact_frame: frame_of_contact(&identifier, contact_frame, &plan)?,
            is_final: is_found || equations.method != Method::Tactile,
            delay_s,
            cutoff_hz: equations.cutoff_hz,
            decoder: recording.live_decoder(max_gap_s),
            aligner: Aligner::new(plan.streams.clone(), &sources.robot, delay_s, max_gap_s),
            aligned: Aligned::empty(),
            identifier,
            steps: Steps::new(sources),
            events: Vec::new(),
            ranges: ChannelRanges::new(sources, &plan.tip),
            channels: WrenchChannels::new(sources, &plan.tip, &equations, &plan.unmeasured),
            noticed,
            acts_on: request.wrench_acts_on.unwrap_or_default(),
            samples: 0,
            last_ns: sources.start_ns,
            without_sample: 0,
            sources: sources.clone(),
        };
        for message in messages {
            running.take(message)?;
        }
        Ok(running)
    }

    /// Takes the next message. One of a topic that is not used is ignored.
    ///
    /// # Errors
    /// Returns the errors of [`Identifier::push`], which aligned samples do not have.
    pub(super) fn take(&mut self, message: &RawMessage) -> Result<(), RecordingError> {
        if !self.sources.names.contains(&message.topic.name) {
            return Ok(());
        }
        self.without_sample += 1;
        self.decoder.decode(message, &mut self.events);
        for event in self.events.drain(..) {
            self.steps.push(&event);
            self.channels.push(&event);
            self.ranges.push(&event);
            self.aligner.push(event);
        }
        while self.aligner.next_into(&mut self.aligned) {
            let outcome = self.identifier.push(&self.aligned.sample())?;
            if outcome != PushOutcome::Rejected {
                self.samples += 1;
                self.without_sample = 0;
                self.last_ns = self.time_ns(self.aligned.time_s);
            }
        }
        Ok(())
    }

    /// Returns a time on the clock of the messages, ns since the epoch, given that of a sample, s.
    fn time_ns(&self, sample_s: f64) -> i64 {
        let since_start_ns = (sample_s * 1e9).round() as i64;
        self.sources.start_ns.saturating_add(since_start_ns)
    }

    pub(super) fn identifier(&self) -> &Identifier {
        &self.identifier
    }

    /// Does the work that samples have deferred.
    pub(super) fn finish(&mut self) {
        self.identifier.finish();
    }

    /// Returns the offset of the wrenches as they are measured; `None` where it is not an unknown.
    pub(super) fn wrench_offset(&self) -> Option<WrenchOffset> {
        let offset = self.identifier.wrench_offset()?;
        Some(match self.acts_on {
            ActsOn::Payload => offset,
            ActsOn::Sensor => offset.negated(),
        })
    }

    /// Returns the wrench of a contact, with the sign of the measured wrenches; `None` before the
    /// motion has determined what it is measured against.
    pub(super) fn contact_wrench(&self) -> Option<LiveContact> {
        let (frame, axes) = &self.contact_frame;
        let found = self.identifier.contact_wrench(axes);
        let wrench = found.filter(|_| self.identifier.knows_weight())?;
        Some(LiveContact {
            time_ns: self.time_ns(wrench.time_s),
            frame: frame.clone(),
            latency_s: self.identifier.contact_latency_s()?,
            wrench: wrench.with_sign(self.acts_on.sign()),
        })
    }

    /// Sets the zero of the sensor, and returns whether what is known of the payload allows it.
    pub(super) fn tare(&mut self) -> bool {
        self.identifier.tare()
    }

    /// Holds the payload or ends that, and returns whether what is known of the payload allows it.
    pub(super) fn hold_payload(&mut self, is_held: bool) -> bool {
        let is_known = !is_held || self.identifier.knows_weight();
        is_known && self.identifier.hold_payload(is_held)
    }

    /// Returns what was noticed of topics and steps, without what the identifier finds.
    pub(super) fn noticed(&self) -> Vec<Finding> {
        let mut findings = self.noticed.clone();
        findings.extend(self.steps.findings(&self.sources));
        findings.extend(self.channels.findings(CONSTANT_S, &self.sources));
        findings.extend(self.ranges.findings(&self.sources));
        findings
    }

    pub(super) fn faults(&self) -> Vec<DataFault> {
        self.decoder.faults().to_vec()
    }
}

/// Returns the frame of the wrench of a contact: as requested, or that of the only sensor, or the
/// tip where there are several sensors or one that moves.
fn frame_of_contact(
    identifier: &Identifier,
    requested: Option<&str>,
    plan: &Plan<'_>,
) -> Result<(String, WrenchFrame), RecordingError> {
    let link = requested.unwrap_or_else(|| plan.wrench_link());
    let frame = identifier.wrench_frame(link, None);
    let frame = frame.map_err(|_| RecordingError::Option {
        option: "contact_frame",
        what: match plan.sources.robot.frame(link) {
            Ok(_) => format!("`contact_frame`: the link `{link}` moves relative to the tip"),
            Err(error) => format!("`contact_frame`: {error}"),
        },
    })?;
    Ok((link.to_owned(), frame))
}

/// Returns the delay that all equations of a beginning show beside the one of the plan, where the
/// request leaves it open. A beginning that is too short shows none.
fn remaining_delay(
    recording: &LogRecording,
    plan: &Plan<'_>,
) -> Result<Option<Delay>, RecordingError> {
    if plan.estimated_delay.is_none() {
        return Ok(None);
    }
    let mut batch = plan.batch_identifier()?;
    Run::new(recording, plan, &mut batch, &mut |_| {
        ControlFlow::Continue(())
    })?;
    Ok(batch.solve().ok().and_then(|found| found.delay))
}

/// Reports a delay that is corrected without being given.
fn corrected_delay(plan: &Plan<'_>, applied_s: f64, rest: Option<Delay>) -> Option<Finding> {
    let estimated = rest.or(plan.estimated_delay)?;
    (plan.delay_s != 0.0).then_some(Finding::DelayCorrected {
        applied_s,
        estimated_s: applied_s,
        std_dev_s: estimated.std_dev_s,
    })
}
