//! From a recording to the payload, through the same equations that run online.

mod advice;
mod unloaded;
mod decode;
mod faults;
mod estimates;
mod feed;
mod history;
mod joints;
mod outcome;
mod probe;
mod records;
mod request;
mod run;
mod samples;
mod sources;
mod streams;
mod suspicion;

use std::ops::ControlFlow;
use std::path::Path;

use nalgebra::Vector3;
use tactid_logs::LogReader;

pub use faults::DataFault;
pub use estimates::write_estimates;
pub use outcome::{Clock, FitReport, HistoryPoint, Identification, Progress};
pub use request::{ActsOn, Request, Topics};
pub use samples::identify_samples;

use crate::{IdentifyError, Settings, Method};
use decode::Decoder;
use feed::Feed;
use probe::{Chain, LENGTH_S, is_significant};
use run::{Plan, Run};
use sources::{Motion, Sources};
use streams::{Event, Layout};

/// Is told the progress, and may stop the work.
type Observer<'a> = dyn FnMut(Progress) -> ControlFlow<()> + 'a;

/// Gaps of more periods than this are not bridged.
const GAP_PERIODS: f64 = 5.0;

/// Derived accelerations take the place of measured ones when they leave, or have, less than this
/// part of their residual or power.
const CLEARLY_LESS: f64 = 0.9;

/// Identifies the payload from a log: an `.mcap` file, or the directory of a bag.
///
/// Topics are found by type, unless the request names them. The motion is that of joints and a URDF
/// (from the request or the log), on a base that odometry moves if there is any; or, without joints,
/// that of the sensor itself by odometry (and its accelerations, if that explains the load better) or
/// by an inertial unit. Times are those of the headers, or of the log where stamps are zero.
///
/// Memory is bounded, whatever the log's length.
///
/// # Errors
/// Where the log cannot be opened, or lacks what the way needs, or contradicts its own URDF. What is
/// wrong with single messages is counted in [`Identification::dirt`]; a log that ends early is used up
/// to its end, which [`Identification::damage`] tells. Where the observer stops the reading, what was
/// read so far counts; where it stops the looking before it, that is [`IdentifyError::Interrupted`].
pub fn identify_log(
    path: &Path,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identification, IdentifyError> {
    request.check_knowledge()?;
    let log = LogReader::open(path)?;
    if log.topics().iter().all(|topic| topic.count == 0) {
        let damage = log.damage().iter().map(|damage| format!(": {damage}"));
        return Err(IdentifyError::Empty {
            path: path.display().to_string(),
            damage: damage.collect(),
        });
    }
    let mut sources = Sources::find(&log, request)?;
    let settings = settings(&log, &sources, request);
    if sources.acceleration.is_some() && request.topics.acceleration.is_none() {
        choose_acceleration(&log, &mut sources, request, &settings, observer)?;
    }
    let mut decoder = Decoder::new(&log, sources, request)?;
    let mut plan = Plan::new(&decoder, settings, request);
    let beginning = beginning(&log, &decoder, observer)?;
    plan.look_at(
        &beginning,
        decoder.sources().slowest_period_s(&log),
        request,
    )?;
    let unloaded = match &request.unloaded {
        Some(path) => Some(unloaded::Unloaded::find(path, &log, &decoder, request, observer)?),
        None => None,
    };
    drop(beginning);
    plan.settings.effort_is_net = unloaded.is_some();
    plan.layout.unloaded = unloaded.is_some();
    decoder.faults = faults::FaultCounts::default();
    decoder.set_max_gap_s(plan.settings.max_gap_s);

    let mut run = Run::new(plan)?;
    let mut interrupted = false;
    for epoch in 0..run.epochs() {
        run.begin(epoch);
        let mut feed = Feed::new(&log, decoder.clone())?;
        if let Some(unloaded) = &unloaded {
            feed = feed.with_unloaded(&unloaded.log, unloaded.decoder.clone(), unloaded.shift_s)?;
        }
        let epochs = f64::from(run.epochs());
        let (feed, stopped) = feed.run(&mut |event| run.take(event), &mut |fraction| {
            let fraction = (f64::from(epoch) + fraction) / epochs;
            observer(Progress { fraction })
        })?;
        run.end(&feed);
        interrupted = stopped;
        if interrupted {
            break;
        }
    }
    outcome::finish(run, &decoder, request, interrupted)
}

/// The settings that hold for this log.
fn settings(log: &LogReader, sources: &Sources, request: &Request) -> Settings {
    let mut settings = Settings {
        method: sources.method,
        ..request.settings.clone()
    };
    match sources.motion {
        Motion::Joints(_) => {}
        // A sensor that is carried about is on the ground.
        Motion::Odometry(_) => {
            let down = Vector3::new(0.0, 0.0, -crate::settings::STANDARD_GRAVITY);
            settings.gravity.get_or_insert(down);
        }
        // What an inertial unit feels has gravity in it already.
        Motion::Imu(_) => settings.gravity = Some(Vector3::zeros()),
    }
    let gap_s = GAP_PERIODS * sources.slowest_period_s(log);
    settings.max_gap_s = request.max_gap_s.unwrap_or(gap_s);
    settings
}

/// Lets the observer stop what comes before the recording is run through, and leaves no result.
fn look_up(observer: &mut Observer<'_>) -> Result<(), IdentifyError> {
    match observer(Progress { fraction: 0.0 }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(IdentifyError::Interrupted),
    }
}

/// The events of the first part of a log.
fn beginning(
    log: &LogReader,
    decoder: &Decoder,
    observer: &mut Observer<'_>,
) -> Result<Vec<Event>, IdentifyError> {
    let mut feed = Feed::new(log, decoder.clone())?;
    let mut events = Vec::new();
    while feed.read(&mut events)?.is_some() {
        look_up(observer)?;
        if events.last().is_some_and(|event| event.time_s > LENGTH_S) {
            break;
        }
    }
    Ok(events)
}

/// Whether measured accelerations or those derived from the velocities explain the load better.
fn choose_acceleration(
    log: &LogReader,
    sources: &mut Sources,
    request: &Request,
    settings: &Settings,
    observer: &mut Observer<'_>,
) -> Result<(), IdentifyError> {
    let decoder = Decoder::new(log, sources.clone(), request)?;
    let events = beginning(log, &decoder, observer)?;
    let period_s = sources.slowest_period_s(log);
    let names: Vec<&str> = sources.sensors.iter().map(String::as_str).collect();
    let mut candidates = Vec::new();
    for acceleration in [true, false] {
        let layout = Layout {
            acceleration,
            ..decoder.layout()
        };
        let chain = Chain {
            robot: &sources.robot,
            tool: &sources.tool,
            sensors: &names,
            settings,
            layout: &layout,
        };
        candidates.push((chain.cutoff_hz(&events, period_s)?, layout));
    }
    let cutoff_hz = candidates
        .iter()
        .fold(f64::INFINITY, |low, (hz, _)| low.min(*hz));
    let mut misfits = Vec::new();
    for (_, layout) in &candidates {
        let chain = Chain {
            robot: &sources.robot,
            tool: &sources.tool,
            sensors: &names,
            settings,
            layout,
        };
        misfits.push(chain.misfit(&events, cutoff_hz)?);
    }
    let (Some(measured), Some(derived)) = (misfits[0], misfits[1]) else {
        return Ok(());
    };
    // The motion is the same in both: what has less power has less noise.
    let quieter = derived.1 < CLEARLY_LESS * measured.1 && derived.0 * CLEARLY_LESS < measured.0;
    let why = if derived.0 < CLEARLY_LESS * measured.0 {
        "explain the wrench better"
    } else if quieter {
        "have less noise"
    } else {
        return Ok(());
    };
    let topic = sources.acceleration.take().unwrap_or_default();
    sources.remarks.push(format!(
        "{topic} is not used: accelerations derived from the velocities {why} (residual {:.2}, power \
         {:.2} of what they are with the measured ones); --accel {topic} uses it.",
        derived.0 / measured.0,
        derived.1 / measured.1
    ));
    Ok(())
}

impl Plan {
    /// Chooses from the beginning of a recording what the request leaves open.
    pub(crate) fn look_at(
        &mut self,
        events: &[Event],
        period_s: f64,
        request: &Request,
    ) -> Result<(), IdentifyError> {
        let sensors: Vec<&str> = self.sensors.iter().map(String::as_str).collect();
        let chain = Chain {
            robot: &self.robot,
            tool: &self.tool,
            sensors: &sensors,
            settings: &self.settings,
            layout: &self.layout,
        };
        let cutoff_hz = match request.cutoff_hz {
            Some(cutoff_hz) => cutoff_hz,
            None => chain.cutoff_hz(events, period_s)?,
        };
        match request.delay_s {
            Some(delay_s) => self.delay_s = delay_s,
            None if self.settings.method == Method::Tactile => {
                self.found_delay = chain.delay_s(events, cutoff_hz)?;
                self.delay_s = match self.found_delay {
                    Some(found) if is_significant(found) => found.0,
                    _ => 0.0,
                };
            }
            None => {}
        }
        self.settings.cutoff_hz = cutoff_hz;
        Ok(())
    }
}
