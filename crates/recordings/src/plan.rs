//! The plan of an identification: all options, chosen from the request and the beginning of the
//! recording.

use tactid_batch::{BatchIdentifier, BatchSettings, Delay, MotionEstimate};
use tactid_identify::{EquationSettings, IdentifyError};

use crate::alignment::{Averaging, Event, Streams};
use crate::beginning::identifying;
use crate::defaults::Options;
use crate::preview::{DelayEstimate, Preview, is_significant};
use crate::rates::{are_unmeasured, contradicted_rates};
use crate::recording::{Recording, Selection, Sources};
use crate::steps::{Steps, are_mixed};
use crate::wrench_channels::{unmeasured_channels, without_channels};
use crate::{EstimatorKind, Finding, Observer, OffsetChoice, RecordingError, Request, WrenchIs};

/// How a recording is identified.
#[derive(Clone, Debug)]
pub(crate) struct Plan<'a> {
    pub(crate) request: &'a Request,
    pub(crate) sources: &'a Sources,
    pub(crate) estimator: EstimatorKind,
    pub(crate) tip: String,
    /// The streams that are used.
    pub(crate) streams: Streams,
    pub(crate) equations: EquationSettings,
    /// Channels that each sensor does not measure in the beginning.
    pub(crate) unmeasured: Vec<[bool; 6]>,
    /// Period of the slowest stream that is used, s.
    pub(crate) period_s: f64,
    /// Delay to subtract from the times of the wrenches, s.
    pub(crate) delay_s: f64,
    /// Delay as estimated from the beginning.
    pub(crate) estimated_delay: Option<Delay>,
    pub(crate) findings: Vec<Finding>,
    /// Whether positions of two sources are mixed: nothing is concluded from what they contradict.
    pub(crate) is_mixed: bool,
    /// Number that identifies the first events.
    pub(crate) beginning: String,
}

impl<'a> Plan<'a> {
    /// Chooses all that the request leaves open.
    pub(crate) fn new(
        recording: &'a impl Recording,
        request: &'a Request,
        observer: &mut Observer<'_>,
    ) -> Result<Self, RecordingError> {
        let sources = recording.sources();
        let events = recording.beginning(observer)?;
        check_part(request, &events, sources)?;
        let (mut streams, mut options, mut findings) = choose_streams(sources, &events, request)?;
        findings.extend(checked(request, &options, sources)?);
        let is_mixed = are_mixed(&Steps::findings_of(sources, &events));
        if !is_mixed {
            findings.extend(contradicted_rates(sources, &events, &options));
        }
        streams.without_velocities = are_unmeasured(&findings);
        let unmeasured = set_channels(&mut options, &streams, recording, &events);
        let preview = Preview {
            sources,
            options: &options,
            events: &events,
        };
        let chosen = options
            .chooses_cutoff
            .then(|| preview.choose_cutoff(&streams));
        let chosen = chosen.transpose()?;
        let cutoff_hz = match &chosen {
            Some(beginning) => beginning.cutoff_hz,
            None => options.equations.cutoff_hz,
        };
        let delay = match (options.delay_s, chosen) {
            (Some(_), _) => DelayEstimate::Unknown,
            _ if is_mixed => DelayEstimate::Unknown,
            (None, Some(beginning)) => preview.delay(&streams, beginning)?,
            (None, None) => preview.delay(&streams, preview.at_cutoff(&streams, cutoff_hz)?)?,
        };
        let estimated_delay = delay.found();
        findings.extend(delay.doubt());
        options.equations.cutoff_hz = cutoff_hz;
        let significant = estimated_delay.filter(|delay| is_significant(*delay));
        Ok(Self {
            request,
            sources,
            delay_s: options
                .delay_s
                .unwrap_or(significant.map_or(0.0, |delay| delay.delay_s)),
            streams: Streams {
                unloaded: sources.streams.unloaded,
                ..streams
            },
            equations: options.equations,
            unmeasured,
            estimator: options.estimator,
            period_s: options.period_s,
            tip: options.tip,
            estimated_delay,
            findings,
            is_mixed,
            beginning: identifying(&events),
        })
    }

    /// Returns the settings of least squares: a delay is estimated once more where the beginning
    /// has one.
    pub(crate) fn batch_settings(&self) -> BatchSettings {
        BatchSettings {
            known_tool: self.request.known_tool(),
            known_mass: self.request.known_mass(),
            bounding_box: self.request.bounding_box,
            delay: self.estimated_delay.is_some(),
            shown_offset: !self.is_mixed
                && self.request.wrench_offset.unwrap_or_default() == OffsetChoice::Auto,
            smoothed: self.smoothed(),
        }
    }

    /// Returns why motion and payload are not estimated at once, as far as the samples do not show
    /// it.
    fn smoothed(&self) -> Option<MotionEstimate> {
        if self.streams.base && self.sources.measured_twist.is_none() {
            Some(MotionEstimate::NoVelocities)
        } else {
            let cutoff_hz = self.request.cutoff_hz;
            cutoff_hz.map(|_| MotionEstimate::GivenCutoff)
        }
    }

    /// Creates the identifier by least squares.
    ///
    /// # Errors
    /// Returns the errors of [`BatchIdentifier::new`].
    pub(crate) fn batch_identifier(&self) -> Result<BatchIdentifier, IdentifyError> {
        let (equations, settings) = (self.equations.clone(), self.batch_settings());
        let (robot, sensors) = (&self.sources.robot, self.sensors());
        BatchIdentifier::new(robot, &self.tip, &sensors, equations, settings)
    }

    /// Returns the links of the sensors.
    pub(crate) fn sensors(&self) -> Vec<&str> {
        self.sources.sensors.iter().map(String::as_str).collect()
    }

    /// Returns the link in whose frame a wrench is, where no other one is asked for: that of the only
    /// sensor; the tip where there are several, or where the sensor moves relative to the tip.
    pub(crate) fn wrench_link(&self) -> &str {
        let robot = &self.sources.robot;
        let is_fixed = |sensor: &str| {
            let frames = robot.frame(sensor).ok().zip(robot.frame(&self.tip).ok());
            frames.is_some_and(|(sensor, tip)| robot.fixed_transform(sensor, tip).is_some())
        };
        match &self.sources.sensors[..] {
            [sensor] if is_fixed(sensor) => sensor,
            _ => &self.tip,
        }
    }

    /// Returns which events are read.
    pub(crate) fn selection(&self) -> Selection {
        Selection {
            max_gap_s: self.equations.max_gap_s,
            acceleration: self.streams.acceleration,
        }
    }
}

/// Checks that the part of a recording that is asked for, whose beginning has these events, is not
/// outside of it.
fn check_part(
    request: &Request,
    events: &[Event],
    sources: &Sources,
) -> Result<(), RecordingError> {
    let is_late = |begin_s: &f64| *begin_s > sources.end_s;
    let begin_s = request.begin_s.filter(is_late);
    let end_s = request.end_s.filter(|end_s| *end_s < 0.0);
    let (option, time_s) = match (begin_s, end_s) {
        (Some(begin_s), _) if events.is_empty() => ("begin_s", begin_s),
        (_, Some(end_s)) if events.is_empty() => ("end_s", end_s),
        _ => return Ok(()),
    };
    Err(RecordingError::Option {
        option,
        what: format!(
            "`{option}` is {time_s} s, but the recording is {:.1} s long: times count from the first message or sample \
             that is used",
            sources.end_s
        ),
    })
}

/// Checks that gravity is known where the wrenches lack a weight: it is not where it is zero, or
/// part of the measured accelerations.
fn check_weight(
    request: &Request,
    options: &Options,
    sources: &Sources,
) -> Result<(), RecordingError> {
    let gravity = options.equations.gravity_for(sources.robot.base_kind());
    let lacks_weight = request.wrench_is == Some(WrenchIs::WithoutWeight);
    if lacks_weight && options.method().uses_wrench() && gravity.norm() == 0.0 {
        return Err(RecordingError::Option {
            option: "wrench_is",
            what: "`wrench_is` says that the wrenches lack a weight, but gravity is zero, or not known apart from the \
                   accelerations of an inertial unit: `gravity` gives it"
                .to_owned(),
        });
    }
    Ok(())
}

/// Checks that the options fit the recording, and reports which of them are not used or assumed.
fn checked(
    request: &Request,
    options: &Options,
    sources: &Sources,
) -> Result<Vec<Finding>, RecordingError> {
    check_weight(request, options, sources)?;
    let mut findings = options.not_used(request, &sources.contents);
    findings.extend(request.tool_at(&options.tip, options.estimator)?);
    Ok(findings)
}

/// Sets what the beginning shows of the channels of the wrenches: the noise of averages and of
/// interpolations, and which of them measure nothing. Returns the latter of each sensor.
fn set_channels(
    options: &mut Options,
    streams: &Streams,
    recording: &impl Recording,
    events: &[Event],
) -> Vec<[bool; 6]> {
    let equations = &mut options.equations;
    equations.wrench_noise = streams.averaging.of_averages(&equations.wrench_noise);
    equations.shared_noise_s = streams.averaging.shared_noise_s();
    let unmeasured = unmeasured_channels(recording.without_numbers(), events);
    equations.unmeasured =
        without_channels(recording.sources(), &options.tip, equations, &unmeasured);
    unmeasured
}

/// Chooses whether measured accelerations are used, and resolves the options accordingly. The
/// streams are those of the beginning, which has no unloaded recording.
fn choose_streams(
    sources: &Sources,
    events: &[Event],
    request: &Request,
) -> Result<(Streams, Options, Vec<Finding>), RecordingError> {
    let options = sources.options.clone();
    let streams = Streams {
        unloaded: false,
        averaging: Averaging::of(&sources.streams, events),
        ..sources.streams.clone()
    };
    let Some(topic) = &sources.optional_acceleration else {
        return Ok((streams, options, Vec::new()));
    };
    let preview = Preview {
        sources,
        options: &options,
        events,
    };
    let Some(finding) = preview.compare_accelerations(&streams, topic)? else {
        return Ok((streams, options, Vec::new()));
    };
    let streams = Streams {
        acceleration: false,
        ..streams
    };
    let options = options.without_acceleration(request, &sources.contents);
    Ok((streams, options, vec![finding]))
}
