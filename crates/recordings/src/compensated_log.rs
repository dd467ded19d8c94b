//! A copy of a log with the wrenches of its load and of the contact.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use tactid_logs::messages::{self, Header, Time, WrenchStamped};
use tactid_logs::{Channel, Durability, LogError, LogReader, LogWriter, merge_logs};

use crate::compensation::{
    CompensationReport, IdentifiedLoad, WrenchPlace, WrenchReceiver, compensate,
    compensation_request,
};
use crate::log::LogRecording;
use crate::progress::part_of;
use crate::sources::OWN_WRENCHES;
use crate::{
    ActsOn, Clock, ContactSample, Observer, Progress, RecordedWrenches, RecordingError, Request,
};

/// Namespace of the topics where several wrench topics are summed.
const SUM: &str = "/tactid";
/// File of the wrenches until they are merged with the log.
const WRENCHES: &str = "wrenches.part";
/// Number of points of a series at which neighbours are merged.
const MOST_POINTS: usize = 4096;

/// Force, N, and moment, N m, of a wrench.
type Six = [f64; 6];

/// Wrenches at a time, as a picture shows them.
#[derive(Clone, Copy, Debug)]
pub struct WrittenWrench {
    /// Time since that of [`CompensationReport::start_ns`], s.
    pub time_s: f64,
    /// Measured wrench through the filter, N and N m.
    pub measured: Six,
    /// Wrench of the contact, N and N m.
    pub contact: Six,
    /// Standard deviations of the contact, N and N m.
    pub std_devs: Six,
}

/// What the wrenches of a recording are like.
#[derive(Clone, Debug, Default)]
pub struct WrenchSummary {
    /// Number of samples, and of those that have wrenches.
    pub samples: [u64; 2],
    /// Rms of the measured wrench through the filter, N and N m; NaN where a channel is not measured.
    pub measured_rms: Six,
    /// Rms of the wrench of the contact, N and N m; NaN where a channel is not measured.
    pub contact_rms: Six,
    /// Sample with the largest force of a contact, and that with the largest moment.
    pub greatest: Option<[WrittenWrench; 2]>,
    /// At most 4096 points in the order of time: of each stretch of samples, the one with the
    /// largest force of a contact.
    pub series: Vec<WrittenWrench>,
    /// Number of samples of each point of the series.
    stride: u64,
}

/// A log that was written.
#[derive(Clone, Debug)]
pub struct CompensatedLog {
    /// What was assumed, and noticed about the recording.
    pub report: CompensationReport,
    /// Topics of the wrenches of load and contact.
    pub topics: [String; 2],
    /// What the wrenches are like.
    pub summary: WrenchSummary,
    /// Content of `metadata.yaml` for a bag whose only file is the log.
    pub bag_metadata: String,
}

/// Writes a copy of a log to the file `file` of a folder, with the wrenches of [`compensate_log`](crate::compensate_log)
/// as `geometry_msgs/msg/WrenchStamped` on `load_wrench` and `contact_wrench` in the namespace of
/// the wrench topic, or in `/tactid` where several are summed.
///
/// The copy is one MCAP log with all messages as they are, in the order of their log times. The
/// wrenches have the stamps of the samples, and log times that differ from their stamps as those of
/// the wrench topic do. The folder must be new or empty. Memory is bounded.
///
/// # Errors
/// Returns the errors of [`compensate_log`](crate::compensate_log), [`RecordingError::Log`] if the log cannot be written,
/// and [`RecordingError::Data`] if the log has one of the topics already.
pub fn compensate_into(
    [log, folder]: [&Path; 2],
    file: &str,
    request: &Request,
    load: &IdentifiedLoad,
    place: &WrenchPlace,
    observer: &mut Observer<'_>,
) -> Result<CompensatedLog, RecordingError> {
    let (request, added) = (compensation_request(request, load), folder.join(WRENCHES));
    request.check()?;
    let recording = LogRecording::open(log, &request, observer)?;
    let mut writer = WrenchWriter::new(recording.log(), &added)?;
    let mut report = compensate(
        &recording,
        &request,
        load,
        place,
        &mut writer,
        &mut part_of(observer, 0, 2),
    )?;
    let (topics, summary) = writer.finish()?;
    let wrenches = LogReader::open(&added)?;
    let mut copying = part_of(observer, 1, 2);
    let progress = &mut |fraction| copying(Progress { fraction });
    let merged = merge_logs(
        &[recording.log(), &wrenches],
        &folder.join(file),
        file,
        progress,
    );
    let merged = merged.map_err(|error| match error {
        LogError::Interrupted => RecordingError::Interrupted,
        error => error.into(),
    })?;
    std::fs::remove_file(&added).map_err(|source| LogError::Io {
        action: "remove",
        path: added.clone(),
        source,
    })?;
    // The copy has all topics, of which the compensation reads some.
    report.damage = merged.damage;
    Ok(CompensatedLog {
        report,
        topics,
        summary,
        bag_metadata: merged.bag_metadata,
    })
}

/// Writes wrenches as messages.
struct WrenchWriter<'a> {
    original: &'a LogReader,
    log: LogWriter<BufWriter<File>>,
    topics: Option<WrenchTopics>,
    summary: WrenchSummary,
}

/// What is known once the recording is planned.
struct WrenchTopics {
    topics: [String; 2],
    channels: [Channel<WrenchStamped>; 2],
    frame: String,
    start_ns: i64,
    /// Log time less stamp, ns.
    after_stamp_ns: i64,
}

impl<'a> WrenchWriter<'a> {
    fn new(original: &'a LogReader, path: &Path) -> Result<Self, RecordingError> {
        Ok(Self {
            original,
            log: LogWriter::create(path)?,
            topics: None,
            summary: WrenchSummary::default(),
        })
    }

    fn finish(self) -> Result<([String; 2], WrenchSummary), RecordingError> {
        self.log.finish()?;
        let topics = self.topics.map(|chosen| chosen.topics).unwrap_or_default();
        Ok((topics, self.summary.finished()))
    }
}

impl WrenchReceiver for WrenchWriter<'_> {
    fn begin(&mut self, report: &CompensationReport) -> Result<(), RecordingError> {
        let namespace = match &report.wrench_topics[..] {
            [topic] => topic.as_str(),
            _ => SUM,
        };
        let topics = OWN_WRENCHES.map(|name| format!("{namespace}/{name}"));
        if let Some(known) = topics
            .iter()
            .find(|name| self.original.topic(name).is_some())
        {
            return Err(RecordingError::data(format!(
                "the log has the topic {known} already: compensate the original recording"
            )));
        }
        let acts_on = match report.acts_on {
            ActsOn::Payload => "payload",
            ActsOn::Sensor => "sensor",
        };
        let settings = [
            ("point", report.point.clone()),
            ("axes", report.axes.clone()),
            ("wrench_acts_on", acts_on.to_owned()),
            ("cutoff_hz", report.cutoff_hz.to_string()),
            ("delay_s", report.delay_s.to_string()),
        ];
        let settings = settings.map(|(name, value)| (name.to_owned(), value));
        self.log
            .metadata("tactid_compensation", BTreeMap::from(settings))?;
        let add = |log: &mut LogWriter<_>, topic: &str| log.channel(topic, Durability::Volatile);
        self.topics = Some(WrenchTopics {
            channels: [
                add(&mut self.log, &topics[0])?,
                add(&mut self.log, &topics[1])?,
            ],
            topics,
            frame: report.axes.clone(),
            start_ns: report.start_ns,
            after_stamp_ns: match report.clock {
                Clock::LogTimes => 0,
                _ => after_stamp_ns(self.original, &report.wrench_topics)?,
            },
        });
        Ok(())
    }

    fn take(&mut self, sample: ContactSample) -> Result<(), RecordingError> {
        self.summary.add(&sample);
        let Some((topics, wrenches)) = self.topics.as_ref().zip(sample.wrenches) else {
            return Ok(());
        };
        let stamp_ns = topics
            .start_ns
            .saturating_add((sample.time_s * 1e9).round() as i64);
        let time_ns = stamp_ns.saturating_add(topics.after_stamp_ns);
        let estimates = [wrenches.parts.load, wrenches.parts.contact];
        for (channel, estimate) in topics.channels.iter().zip(estimates) {
            let message = WrenchStamped {
                header: Header {
                    stamp: Time::from_ns(u64::try_from(stamp_ns).unwrap_or(0)),
                    frame_id: topics.frame.clone(),
                },
                wrench: messages::Wrench {
                    force: <[f64; 3]>::from(estimate.wrench.force).into(),
                    torque: <[f64; 3]>::from(estimate.wrench.moment).into(),
                },
            };
            let time_ns = u64::try_from(time_ns).unwrap_or(0);
            self.log.write(channel, time_ns, &message)?;
        }
        Ok(())
    }
}

/// Returns by how much the log time of the first wrench exceeds its stamp, ns; zero where its type
/// has no stamp.
fn after_stamp_ns(log: &LogReader, topics: &[String]) -> Result<i64, RecordingError> {
    let Some(first) = log.messages_on(topics)?.next().transpose()? else {
        return Ok(0);
    };
    let stamp_ns = first
        .decode::<WrenchStamped>()
        .ok()
        .map(|wrench| wrench.header.stamp.as_ns());
    let stamp_ns = stamp_ns.filter(|stamp_ns| *stamp_ns > 0);
    let log_time_ns = i64::try_from(first.log_time_ns).unwrap_or(i64::MAX);
    Ok(stamp_ns.map_or(0, |stamp_ns| log_time_ns.saturating_sub(stamp_ns)))
}

impl WrittenWrench {
    /// Size of the force of the contact, N; a channel that is not measured counts as zero.
    fn force_n(&self) -> f64 {
        size(&self.contact[..3])
    }

    /// Size of the moment of the contact, N m; a channel that is not measured counts as zero.
    fn moment_nm(&self) -> f64 {
        size(&self.contact[3..])
    }

    /// Returns this one or another, whichever is larger.
    fn max_by(self, other: Self, size: fn(&Self) -> f64) -> Self {
        if size(&other) > size(&self) {
            other
        } else {
            self
        }
    }
}

/// Returns the length of a vector without the entries that are NaN.
fn size(vector: &[f64]) -> f64 {
    let measured = vector.iter().filter(|entry| !entry.is_nan());
    measured.map(|entry| entry * entry).sum::<f64>().sqrt()
}

impl WrenchSummary {
    fn add(&mut self, sample: &ContactSample) {
        self.samples[0] += 1;
        let Some(RecordedWrenches { measured, parts }) = &sample.wrenches else {
            return;
        };
        let found = WrittenWrench {
            time_s: sample.time_s,
            measured: measured.entries(),
            contact: parts.contact.wrench.entries(),
            std_devs: parts.contact.std_devs(),
        };
        for k in 0..6 {
            self.measured_rms[k] += found.measured[k].powi(2);
            self.contact_rms[k] += found.contact[k].powi(2);
        }
        let [force, moment] = self.greatest.unwrap_or([found; 2]);
        self.greatest = Some([
            force.max_by(found, WrittenWrench::force_n),
            moment.max_by(found, WrittenWrench::moment_nm),
        ]);
        self.stride = self.stride.max(1);
        let is_first = self.samples[1].is_multiple_of(self.stride);
        self.samples[1] += 1;
        match self.series.last_mut() {
            Some(last) if !is_first => *last = last.max_by(found, WrittenWrench::force_n),
            _ => self.series.push(found),
        }
        if self.series.len() == MOST_POINTS && self.samples[1].is_multiple_of(self.stride) {
            let larger = |pair: &[WrittenWrench]| pair[0].max_by(pair[1], WrittenWrench::force_n);
            self.series = self
                .series
                .as_chunks::<2>()
                .0
                .iter()
                .map(|pair| larger(pair))
                .collect();
            self.stride *= 2;
        }
    }

    /// Turns the sums of squares into means.
    fn finished(mut self) -> Self {
        let count = self.samples[1].max(1) as f64;
        for rms in [&mut self.measured_rms, &mut self.contact_rms] {
            *rms = rms.map(|sum| (sum / count).sqrt());
        }
        self
    }
}
