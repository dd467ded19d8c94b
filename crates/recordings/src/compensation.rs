//! Compensation of a recording: the wrench of the load and that of the contact at each of its
//! samples.

use std::path::Path;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tactid_batch::{ContactSample, LoadEstimate, RecordedContact, RecordedWrenches};
use tactid_identify::{Method, Sample, WrenchFrame};
use tactid_options::Use;

use crate::arrays::ArrayRecording;
use crate::choices::GravityChoice;
use crate::log::LogRecording;
use crate::plan::Plan;
use crate::recording::Recording;
use crate::run::{Receiver, Run};
use crate::{ActsOn, Arrays, Clock, DataFault, Finding, Observer, RecordingError, Request};

/// Standard deviations beyond which an entry of a wrench is certainly that of a contact.
const CERTAIN: f64 = 4.0;

/// Fraction of the samples above which a contact is more likely an error of the load.
const THROUGHOUT: f64 = 0.9;

/// A payload that was identified before, with what its result says about the recording: the fields
/// of the result that a compensation needs, by their names there.
#[derive(Clone, Debug, Deserialize)]
pub struct IdentifiedLoad {
    /// What the result says about all that the wrench sensors measure; `None` where it says
    /// nothing.
    pub load: Option<LoadEstimate>,
    /// Frame of the estimate.
    pub frame: String,
    /// Number that identifies the first messages or samples of its recording.
    pub beginning: String,
    /// Frame of each wrench.
    pub wrench_frames: Vec<String>,
    /// Body on which the measured wrenches act.
    pub wrench_acts_on: ActsOn,
    /// Cutoff of the low-pass of the equations, Hz.
    pub cutoff_hz: f64,
    /// Delay that was subtracted from the times of the wrenches, s.
    pub delay_s: f64,
    /// Gravitational acceleration, m/s².
    pub gravity_m_s2: [f64; 3],
}

/// Point about which the moments of the wrenches of a compensation are, and axes along which they
/// are expressed.
#[derive(Clone, Debug, Default)]
pub struct WrenchPlace {
    /// Link whose origin is the point. Default: the frame of the only sensor, or the tip where
    /// there are several or where the sensor moves relative to the tip.
    pub point: Option<String>,
    /// Link along whose axes the wrenches are, or [`WORLD`](tactid_identify::WORLD). Default: the
    /// link of the point.
    pub axes: Option<String>,
}

/// What a compensation found besides the wrenches.
#[derive(Clone, Debug, Serialize)]
pub struct CompensationReport {
    /// Topic or array of each wrench.
    pub wrench_topics: Vec<String>,
    /// Link about whose origin the moments are.
    pub point: String,
    /// Link along whose axes the wrenches are.
    pub axes: String,
    /// Body on which the wrenches act.
    pub acts_on: ActsOn,
    /// Cutoff of the filter, Hz.
    pub cutoff_hz: f64,
    /// Delay that was subtracted from the times of the wrenches, s.
    pub delay_s: f64,
    /// Where the times come from.
    pub clock: Clock,
    /// Time zero of the samples, ns since the epoch.
    pub start_ns: i64,
    /// Messages and samples that could not be used.
    #[serde(skip)]
    pub faults: Vec<DataFault>,
    /// What was noticed about the recording.
    #[serde(skip)]
    pub findings: Vec<Finding>,
    /// Where the log could not be read further.
    pub damage: Vec<String>,
}

/// What takes the wrenches of a compensation: first what does not change, then each sample.
pub trait WrenchReceiver: Send {
    /// Takes what was chosen, before the first sample.
    ///
    /// # Errors
    /// Returns the error that ends the compensation.
    fn begin(&mut self, _report: &CompensationReport) -> Result<(), RecordingError> {
        Ok(())
    }

    /// Takes the wrenches of a sample.
    ///
    /// # Errors
    /// Returns the error that ends the compensation.
    fn take(&mut self, sample: ContactSample) -> Result<(), RecordingError>;
}

/// Computes the wrench of the load and that of the contact at each aligned sample of a log, without
/// delay, from the same motion and through the same filter as
/// [`identify_log`](crate::identify_log), and in bounded memory.
///
/// The request says how the recording is read; what it says about an estimate is not used. What it
/// leaves open of the sign, of the cutoff, of a delay that the load's recording showed and of an
/// unknown gravity is that of the identified load.
///
/// # Errors
/// Returns [`RecordingError::Option`] with the option `payload` where the load is that of another
/// tip or of other sensors, or where its result says nothing about an offset and a load of wrench
/// sensors, [`RecordingError::Identify`] where the point moves relative to the tip,
/// [`RecordingError::Interrupted`] if the observer stops, and the errors of
/// [`identify_log`](crate::identify_log) where the log cannot be read or has no wrench.
pub fn compensate_log(
    path: &Path,
    request: &Request,
    load: &IdentifiedLoad,
    place: &WrenchPlace,
    receiver: &mut impl WrenchReceiver,
    observer: &mut Observer<'_>,
) -> Result<CompensationReport, RecordingError> {
    let request = compensation_request(request, load);
    request.check()?;
    let recording = LogRecording::open(path, &request, observer)?;
    compensate(&recording, &request, load, place, receiver, observer)
}

/// Computes the wrenches of load and contact of arrays, as [`compensate_log`] does for a log.
///
/// # Errors
/// Returns the errors of [`compensate_log`], and those of
/// [`identify_arrays`](crate::identify_arrays) where the arrays do not fit.
pub fn compensate_arrays(
    arrays: &Arrays<'_>,
    request: &Request,
    load: &IdentifiedLoad,
    place: &WrenchPlace,
    receiver: &mut impl WrenchReceiver,
    observer: &mut Observer<'_>,
) -> Result<CompensationReport, RecordingError> {
    let request = compensation_request(request, load);
    request.check()?;
    let arrays = Arrays {
        unloaded: None,
        ..*arrays
    };
    let recording = ArrayRecording::new(&arrays, &request)?;
    compensate(&recording, &request, load, place, receiver, observer)
}

/// Returns the request that reads a recording as the identification of a load did, without what
/// concerns an estimate.
pub(crate) fn compensation_request(request: &Request, load: &IdentifiedLoad) -> Request {
    let request = request.limited_to(Use::Compensation);
    let gravity = match request.gravity {
        Some(GravityChoice::Unknown) => {
            Some(GravityChoice::Given(Vector3::from(load.gravity_m_s2)))
        }
        given => given,
    };
    Request {
        method: Some(Method::Tactile),
        gravity,
        cutoff_hz: request.cutoff_hz.or(Some(load.cutoff_hz)),
        delay_s: request
            .delay_s
            .or((load.delay_s != 0.0).then_some(load.delay_s)),
        wrench_acts_on: request.wrench_acts_on.or(Some(load.wrench_acts_on)),
        tip: request.tip.or_else(|| Some(load.frame.clone())),
        ..request
    }
}

/// Computes the wrenches of load and contact of a recording, as [`compensate_log`] does for a log, given
/// the request of [`compensation_request`].
pub(crate) fn compensate(
    recording: &impl Recording,
    request: &Request,
    identified: &IdentifiedLoad,
    place: &WrenchPlace,
    receiver: &mut impl WrenchReceiver,
    observer: &mut Observer<'_>,
) -> Result<CompensationReport, RecordingError> {
    let plan = Plan::new(recording, request, observer)?;
    let mut load = check_load(identified, &plan)?.clone();
    if identified.beginning != plan.beginning {
        load = load.of_another_recording();
    }
    let point = place.point.as_deref();
    let point = point.unwrap_or_else(|| plan.wrench_link()).to_owned();
    let (robot, axes) = (&plan.sources.robot, place.axes.as_deref());
    let frame = WrenchFrame::new(robot, &plan.tip, &point, axes)?;
    let acts_on = request.wrench_acts_on.unwrap_or_default();
    let contact = RecordedContact::new(
        robot,
        &plan.tip,
        &plan.sensors(),
        &plan.equations,
        &load,
        frame,
        acts_on,
    )?;
    let mut report = CompensationReport {
        wrench_topics: plan.sources.wrench_names.clone(),
        axes: place.axes.clone().unwrap_or_else(|| point.clone()),
        point,
        acts_on,
        cutoff_hz: plan.equations.cutoff_hz,
        delay_s: plan.delay_s,
        clock: plan.sources.clock,
        start_ns: plan.sources.start_ns,
        faults: Vec::new(),
        findings: Vec::new(),
        damage: Vec::new(),
    };
    receiver.begin(&report)?;
    let mut compensation = CompensationRun {
        contact,
        counter: ContactCounter {
            receiver,
            samples: [0; 2],
        },
    };
    let run = Run::new(recording, &plan, &mut compensation, observer)?;
    if run.interrupted {
        return Err(RecordingError::Interrupted);
    }
    compensation.finish()?;
    report.findings = run.noticed(&plan);
    report.findings.extend(compensation.counter.finding());
    report.faults = run.faults.to_vec();
    report.damage = run.damage;
    Ok(report)
}

/// Returns the load, once it is that of the robot, the tip and the sensors of a plan.
fn check_load<'a>(
    identified: &'a IdentifiedLoad,
    plan: &Plan<'_>,
) -> Result<&'a LoadEstimate, RecordingError> {
    let error = |what: String| RecordingError::Option {
        option: "payload",
        what: format!("`payload` {what}"),
    };
    let Some(load) = &identified.load else {
        return Err(error(
            "is a result without an offset and a load of wrench sensors: identify the payload with `method` tactile by \
             least squares, from one recording, and with `configured_payload` where the wrenches lack a weight"
                .to_owned(),
        ));
    };
    if identified.frame != plan.tip {
        return Err(error(format!(
            "is in the frame {}, but the tip is {}: identify the payload of this tip",
            identified.frame, plan.tip
        )));
    }
    if identified.wrench_frames != plan.sources.sensors {
        return Err(error(format!(
            "was identified from wrenches in {}, but those of this recording are in {}: choose them by `wrench_topic` or \
             `sensor_frame`, or identify the payload with these sensors",
            identified.wrench_frames.join(" and "),
            plan.sources.sensors.join(" and ")
        )));
    }
    Ok(load)
}

/// Samples in, wrenches out.
struct CompensationRun<'a, R> {
    contact: RecordedContact,
    counter: ContactCounter<'a, R>,
}

/// Hands wrenches on, and counts those of a contact.
struct ContactCounter<'a, R> {
    receiver: &'a mut R,
    /// Number of samples with a wrench, and of those with a certain contact.
    samples: [u64; 2],
}

impl<R: WrenchReceiver> ContactCounter<'_, R> {
    fn take(&mut self, sample: ContactSample) -> Result<(), RecordingError> {
        if let Some(RecordedWrenches { parts, .. }) = &sample.wrenches {
            let contact = &parts.contact;
            let entries = contact.wrench.entries().into_iter().zip(contact.std_devs());
            let is_certain = |(entry, std_dev): (f64, f64)| entry.abs() > CERTAIN * std_dev;
            self.samples[0] += 1;
            self.samples[1] += u64::from(entries.into_iter().any(is_certain));
        }
        self.receiver.take(sample)
    }

    /// Returns the finding of a contact in almost all samples; `None` where there is none in many.
    fn finding(&self) -> Option<Finding> {
        let [all, certain] = self.samples;
        let fraction = certain as f64 / all.max(1) as f64;
        (fraction > THROUGHOUT).then_some(Finding::ContactThroughout { fraction })
    }
}

impl<R: WrenchReceiver> CompensationRun<'_, R> {
    /// Hands over the wrenches of the last samples.
    fn finish(&mut self) -> Result<(), RecordingError> {
        let mut outcome = Ok(());
        self.contact.finish(&mut |sample| {
            if outcome.is_ok() {
                outcome = self.counter.take(sample);
            }
        });
        outcome
    }
}

impl<R: WrenchReceiver> Receiver for CompensationRun<'_, R> {
    fn push(&mut self, sample: &Sample<'_>) -> Result<(), RecordingError> {
        let mut outcome = Ok(());
        let counter = &mut self.counter;
        self.contact.push(sample, &mut |sample| {
            if outcome.is_ok() {
                outcome = counter.take(sample);
            }
        })?;
        outcome
    }
}
