//! A log as a recording.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use tactid_identify::checks::TwistAxes;
use tactid_logs::LogReader;

use crate::alignment::Event;
use crate::cut::Cut;
use crate::decode::{Decoder, Decoding};
use crate::feed::{Feed, Unloaded};
use crate::progress::{check_interruption, open_log};
use crate::recording::{Reading, Recording, Selection, Sources};
use crate::sources::{LogSources, times_ns};
use crate::unloaded::find_unloaded;
use crate::{Clock, Finding, Observer, RecordingError, Request};

/// A log whose topics, robot and clock are known.
pub(crate) struct LogRecording {
    log: LogReader,
    found: LogSources,
    decoding: Arc<Decoding>,
    unloaded: Option<Unloaded>,
    sources: Sources,
    cut: Cut,
}

impl LogRecording {
    /// Opens a log and finds what a request asks for in it.
    pub(crate) fn open(
        path: &Path,
        request: &Request,
        observer: &mut Observer<'_>,
    ) -> Result<Self, RecordingError> {
        Self::opened(open_log(path, observer)?, request, observer)
    }

    /// Finds what a request asks for in a log that is open.
    pub(crate) fn opened(
        log: LogReader,
        request: &Request,
        observer: &mut Observer<'_>,
    ) -> Result<Self, RecordingError> {
        if log.topics().iter().all(|topic| topic.count == 0) {
            let damage = log.damage().iter().map(|damage| format!(": {damage}"));
            return Err(RecordingError::data(format!(
                "there is no message in {}{}",
                log.path().display(),
                damage.collect::<String>()
            )));
        }
        let mut recording = Self::of(log, request)?;
        if let Some(unloaded) = &request.unloaded {
            recording.unloaded = Some(find_unloaded(
                [recording.log.path(), unloaded],
                (&recording.log, &recording.found, &recording.decoding),
                request,
                observer,
            )?);
        }
        Ok(recording)
    }

    /// Finds what a request asks for in a log, without its unloaded recording.
    pub(crate) fn of(log: LogReader, request: &Request) -> Result<Self, RecordingError> {
        let found = LogSources::find(&log, request)?;
        let decoding = Arc::new(Decoding::new(&log, &found, request)?);
        Ok(Self {
            sources: sources(&log, &found, &decoding, request),
            found,
            log,
            decoding,
            unloaded: None,
            cut: Cut::of(request),
        })
    }

    /// Returns the log.
    pub(crate) fn log(&self) -> &LogReader {
        &self.log
    }

    /// Returns a decoder of messages that follow at once on those of this log, which holds none of
    /// them back.
    pub(crate) fn live_decoder(&self, max_gap_s: f64) -> Decoder {
        Decoder::in_order(self.decoding.clone(), max_gap_s)
    }

    /// Returns the topics that are read, with or without that of the accelerations.
    fn topics(&self, acceleration: bool) -> Vec<String> {
        let mut topics = self.found.topics.without_acceleration();
        topics.extend(
            self.found
                .topics
                .acceleration()
                .filter(|_| acceleration)
                .cloned(),
        );
        topics
    }
}

fn sources(log: &LogReader, found: &LogSources, decoding: &Decoding, request: &Request) -> Sources {
    let mut findings = found.findings.clone();
    findings.extend(decoding.findings());
    let clock = decoding.clock();
    if clock.kind() == Clock::LogTimes {
        findings.push(Finding::NoStamps);
    }
    let mut names = found.topics.without_acceleration();
    names.extend(found.topics.acceleration().cloned());
    let is_requested = request.acceleration_topic.is_some();
    Sources {
        robot: found.robot.clone(),
        sensors: found.sensors.clone(),
        wrench_names: found.topics.wrenches.clone(),
        contents: found.contents.clone(),
        options: found.options.clone(),
        streams: decoding.streams(found, request.unloaded.is_some()),
        optional_acceleration: found
            .topics
            .acceleration()
            .filter(|_| !is_requested)
            .cloned(),
        measured_twist: found
            .topics
            .odometry()
            .map(|topic| (topic.clone(), TwistAxes::Body)),
        joints_name: found.topics.joints().join(" and "),
        end_s: clock.log_time_s(times_ns(log, &names).1),
        names,
        findings,
        clock: clock.kind(),
        start_ns: clock.origin_ns(),
    }
}

impl Recording for LogRecording {
    fn sources(&self) -> &Sources {
        &self.sources
    }

    fn names_joints(&self) -> bool {
        true
    }

    fn measures_poses(&self) -> bool {
        self.sources.streams.base
    }

    fn without_numbers(&self) -> &[[bool; 6]] {
        self.decoding.without_numbers()
    }

    /// The events of the unloaded recording are not among those of the beginning.
    fn beginning(&self, observer: &mut Observer<'_>) -> Result<Vec<Event>, RecordingError> {
        let topics = self.topics(true);
        let max_gap_s = self.sources.options.equations.max_gap_s;
        let (log, decoding) = (&self.log, &self.decoding);
        let mut feed = Feed::new(log, &topics, decoding, max_gap_s, None, self.cut)?;
        let mut events = Vec::new();
        while feed.read(&mut events)?.is_some() {
            check_interruption(observer)?;
            if self.cut.has_beginning(&events) {
                break;
            }
        }
        Ok(events)
    }

    fn read(
        &self,
        selection: Selection,
        take: &mut dyn FnMut(Event) -> Result<(), RecordingError>,
        progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Reading, RecordingError> {
        let topics = self.topics(selection.acceleration);
        let unloaded = self.unloaded.as_ref();
        let (log, decoding, max_gap_s) = (&self.log, &self.decoding, selection.max_gap_s);
        let feed = Feed::new(log, &topics, decoding, max_gap_s, unloaded, self.cut)?;
        feed.run(take, progress)
    }
}
