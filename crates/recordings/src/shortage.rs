//! Why a recording gives too little for an estimate: stamps of another clock or unit, times that do
//! not increase, gaps, samples that come too seldom, damage.

use tactid_dynamics::words::three_digits;
use tactid_identify::equations::window;
use tactid_identify::{EquationStream, IdentifyError};

use crate::error::RecordingError;
use crate::fault::FaultKind;
use crate::plan::Plan;
use crate::run::Run;

/// Times between two samples of common recordings, s. Times whose samples would be as far apart in
/// another unit are taken to be in this unit, if they are longer than [`LONGEST_PERIOD_S`].
const COMMON_PERIODS_S: std::ops::RangeInclusive<f64> = 1e-4..=0.2;

/// Units that are taken for seconds by mistake, with their lengths in s, from the longest to the
/// shortest.
const OTHER_UNITS: [(&str, f64); 3] = [
    ("milliseconds", 1e-3),
    ("microseconds", 1e-6),
    ("nanoseconds", 1e-9),
];

/// Longest time between two samples of a slow recording whose times are in seconds, s.
const LONGEST_PERIOD_S: f64 = 1.0;

/// Checks that a recording that was run through gave the estimator any windows.
///
/// # Errors
/// Returns [`RecordingError::NoOverlap`] if the streams share no time, and otherwise the errors of
/// [`explain`].
pub(crate) fn check_windows(
    windows: u64,
    stream: &EquationStream,
    plan: &Plan<'_>,
    run: &Run,
) -> Result<(), RecordingError> {
    if windows > 0 {
        return Ok(());
    }
    let nothing = no_overlap(plan, run)
        .unwrap_or_else(|| RecordingError::Identify(stream.too_few_windows(0)));
    Err(explain(nothing, plan, run))
}

/// Returns the error that the streams of a recording share no time; `None` where they do.
pub(crate) fn no_overlap(plan: &Plan<'_>, run: &Run) -> Option<RecordingError> {
    let unused = plan.sources.optional_acceleration.as_ref();
    let unused = unused.filter(|_| !plan.streams.acceleration);
    let names = plan.sources.names.iter();
    let used = names.filter(|name| Some(*name) != unused);
    let streams: Vec<&str> = used.map(String::as_str).collect();
    (run.samples == 0).then(|| RecordingError::NoOverlap {
        what: share_no_time(&streams, plan.request.delay_s),
        faults: run.faults.to_vec(),
    })
}

/// Says that streams share no time, and what to check: also the delay that is given, s.
fn share_no_time(streams: &[&str], delay_s: Option<f64>) -> String {
    let delay = match delay_s {
        None | Some(0.0) => "and ".to_owned(),
        Some(delay_s) => format!("that the given delay of {delay_s} s is in seconds, and "),
    };
    format!(
        "there is no stretch of time in which all of these have values: {}; check that they were recorded together, \
         {delay}that their stamps are those of one clock",
        streams.join(", ")
    )
}

/// Returns the cause of an error that says that there are too few windows or samples; other errors
/// as they are.
///
/// The cause is [`RecordingError::Interrupted`] where the reading was interrupted, and otherwise
/// [`RecordingError::Data`] with what the times show; of a damaged log it is in
/// [`RecordingError::DamagedEarly`].
pub(crate) fn explain(error: RecordingError, plan: &Plan<'_>, run: &Run) -> RecordingError {
    let found = match &error {
        RecordingError::Identify(IdentifyError::TooLittle(_)) => {
            cause_in_times(plan, run).or_else(|| too_rare_samples(plan))
        }
        RecordingError::NoOverlap { .. } => {
            let found = cause_in_times(plan, run).or_else(|| no_efforts(run));
            found.or_else(|| values_not_finite(run))
        }
        _ => return error,
    };
    if run.interrupted {
        return RecordingError::Interrupted;
    }
    let explained = found.unwrap_or(error);
    if run.damage.is_empty() {
        return explained;
    }
    RecordingError::DamagedEarly {
        source: Box::new(explained),
        damage: run.damage.join("; "),
    }
}

/// Returns the cause that the times of the samples show.
fn cause_in_times(plan: &Plan<'_>, run: &Run) -> Option<RecordingError> {
    far_stamps(run)
        .or_else(|| times_not_increasing(run))
        .or_else(|| too_many_gaps(plan, run))
}

/// Returns the largest number of faults of a kind on one topic, with the topic.
fn most_faults(run: &Run, kind: &FaultKind) -> Option<(String, u64)> {
    let faults = run.faults.to_vec().into_iter();
    let of_kind = faults.filter(|fault| fault.kind == *kind);
    let most = of_kind.max_by_key(|fault| fault.count)?;
    Some((most.topic, most.count))
}

fn far_stamps(run: &Run) -> Option<RecordingError> {
    let (topic, left_out) = most_faults(run, &FaultKind::FarStamp)?;
    let used = run.samples;
    (left_out > used).then(|| {
        RecordingError::data(format!(
            "{left_out} messages on {topic} with a stamp far from the time of logging were left out, and {used} samples \
             could be used: stamps must be seconds and nanoseconds of the clock of the recorder"
        ))
    })
}

fn times_not_increasing(run: &Run) -> Option<RecordingError> {
    let (name, unordered) = most_faults(run, &FaultKind::OutOfOrder)?;
    let (used, stream) = (run.samples, stream(name));
    (unordered > used).then(|| {
        RecordingError::data(format!(
            "{unordered} times of {stream} are not later than the ones before them, and {used} could be used: times must \
             increase"
        ))
    })
}

/// Values that are not finite are the cause where they are about as many as the samples that lack
/// another stream.
fn values_not_finite(run: &Run) -> Option<RecordingError> {
    let (name, count) = most_faults(run, &FaultKind::NotFinite)?;
    let incomplete = most_faults(run, &FaultKind::Incomplete).map_or(0, |(_, count)| count);
    (2 * count > incomplete).then(|| {
        RecordingError::data(format!(
            "{count} samples of {} have a value that is not finite, and none could be used: leave out a sensor or a joint \
             that does not measure; with several sensors, a sensor may lack its moments, but not its forces",
            stream(name)
        ))
    })
}

/// Messages without efforts are the cause where they are about as many as the samples that lack
/// another stream.
fn no_efforts(run: &Run) -> Option<RecordingError> {
    let (topic, count) = most_faults(run, &FaultKind::NoEffort)?;
    let incomplete = most_faults(run, &FaultKind::Incomplete).map_or(0, |(_, count)| count);
    (2 * count > incomplete).then(|| {
        RecordingError::data(format!(
            "{count} messages on {topic} have no efforts, and none could be used: record them, or choose a method that \
             measures the load by wrenches"
        ))
    })
}

/// Returns the name of a stream in a sentence: a topic as it is, an array as code.
fn stream(name: String) -> String {
    if name.starts_with('/') {
        name
    } else {
        format!("`{name}`")
    }
}

/// Gaps are the cause where not even neighbouring samples are bridged, or where a recording that is
/// long enough as a whole is too short between them.
fn too_many_gaps(plan: &Plan<'_>, run: &Run) -> Option<RecordingError> {
    let (_, gaps) = most_faults(run, &FaultKind::Gap)?;
    let (max_gap_s, window_s) = (plan.equations.max_gap_s, window_s(plan));
    let stretch_s = run.bridged_s / (gaps + 1) as f64;
    let is_cut = run.duration_s > 2.0 * window_s && stretch_s < window_s;
    (max_gap_s < plan.period_s || is_cut).then(|| {
        RecordingError::data_of(
            "max_gap_s",
            format!(
                "too few windows: gaps between samples that are longer than {} s, the longest time that is bridged, \
                 leave no stretch long enough (number of gaps: {gaps}); samples come every {} s: bridge longer times; \
                 `max_gap_s` sets the longest time that is bridged",
                three_digits(max_gap_s),
                three_digits(plan.period_s)
            ),
        )
    })
}

fn too_rare_samples(plan: &Plan<'_>) -> Option<RecordingError> {
    let (period_s, window_s) = (plan.period_s, window_s(plan));
    let is_common = |(_, length_s): &(&str, f64)| COMMON_PERIODS_S.contains(&(period_s * length_s));
    let is_rare = period_s * f64::from(window::MIN_INSTANTS) > window_s;
    is_rare.then(|| {
        let mut units = OTHER_UNITS.into_iter();
        let unit = units.find(|unit| period_s >= LONGEST_PERIOD_S && is_common(unit));
        let needs = format!(
            "too few samples: they come every {} s, but a window of {} s needs {}",
            three_digits(period_s),
            three_digits(window_s),
            window::MIN_INSTANTS
        );
        match unit {
            Some((unit, _)) => RecordingError::data(format!(
                "{needs}; the times seem to be in {unit}, but must be in seconds"
            )),
            None => RecordingError::data_of(
                "cutoff_hz",
                format!(
                    "{needs}; lower the cutoff, or raise the sample rate; `cutoff_hz` sets the cutoff"
                ),
            ),
        }
    })
}

fn window_s(plan: &Plan<'_>) -> f64 {
    window::length_s(plan.equations.cutoff_hz)
}
