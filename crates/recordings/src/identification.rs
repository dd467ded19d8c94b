//! What a recording says of the payload.

use nalgebra::{SVector, Vector3};
use tactid_dynamics::InertialParameters;

use super::advice::advice;
use super::decode::Decoder;
use super::faults::DataFault;
use super::history::history;
use super::request::Request;
use super::run::Run;
use super::suspicion::{suspect_offset, suspicions};
use crate::fit::{Fit, Options};
use crate::forecast::Forecast;
use crate::physical::nearest_possible;
use crate::uncertainty::{HALF_WIDTH_95, identifiable};
use crate::{
    BoundingBox, IdentifyError, KnownMass, Offset, PayloadEstimate, PrincipalMoments, Settings, Method,
};

/// The check on what a fit has not seen leaves out every so many parts of the recording.
const HELD_OUT_PARTS: usize = 25;
/// A possible body that is so many deviations from what the data say is worth a word.
const FAR: f64 = 5.0;
/// One part in so many is left out.
const HELD_OUT_EVERY: usize = 5;

/// The estimate at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HistoryPoint {
    /// Which presentation of the recording it belongs to, from zero.
    pub epoch: u32,
    /// On the recording's clock, whose zero is its first message, s.
    pub time_s: f64,
    /// In the order of [`VALUE_NAMES`](crate::VALUE_NAMES); not averaged.
    pub values: [f64; 10],
    /// Their standard deviations, where the estimator knows them.
    pub std_devs: Option<[f64; 10]>,
}

/// Which times a log's messages were taken to be measured at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// The stamps of their headers.
    #[default]
    Stamps,
    /// The times at which they were logged: they have no stamps.
    LogTimes,
}

/// How well the payload explains what was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct FitReport {
    /// What was measured, and its unit: six of a wrench, or one a joint.
    pub channels: Vec<(String, &'static str)>,
    /// The middle of each window, on the recording's clock, s.
    pub times_s: Vec<f64>,
    /// The load, filtered: windows in order, all channels of each.
    pub measured: Vec<f64>,
    /// What the parameters make of the motion, likewise.
    pub predicted: Vec<f64>,
    /// Of each window: 1, or less where it is an outlier.
    pub weights: Vec<f64>,
    /// Which windows the check below did not see.
    pub held_out: Vec<bool>,
    /// Weighted rms of measured less predicted, a channel each.
    pub residual_rms: Vec<f64>,
    /// The same on the part that another fit, on the rest alone, did not see.
    pub held_out_rms: Vec<f64>,
    /// How strongly directions of the parameters were excited, descending, 1 for the strongest.
    pub strengths: Vec<f64>,
    /// These directions: unit vectors in the parameters, each divided by its scale.
    pub directions: Vec<[f64; 10]>,
    /// What motion would make known what is not, a sentence each.
    pub advice: Vec<String>,
    /// Of the first channels, where the settings let them be off by a constant.
    pub offsets: Vec<Offset>,
    /// Between two windows, s.
    pub stride_s: f64,
    /// Of the filter, Hz.
    pub cutoff_hz: f64,
}

/// What a recording says of the payload.
#[derive(Clone, Debug)]
pub struct Identification {
    /// At the end of the recording.
    pub estimate: PayloadEstimate,
    /// Of the payload; `None` where its mass is zero.
    pub principal_moments: Option<PrincipalMoments>,
    /// The estimate over time.
    pub history: Vec<HistoryPoint>,
    /// For least squares: how well it fits.
    pub fit: Option<FitReport>,
    /// From the first sample to the last, s.
    pub duration_s: f64,
    /// Stamp of time zero, ns since the epoch.
    pub start_ns: i64,
    /// As they were used.
    pub settings: Settings,
    /// Gravitational acceleration that was assumed, m/s².
    pub gravity: Vector3<f64>,
    /// The link in whose frame the estimate is.
    pub tool: String,
    /// By how much later than the motion the wrenches were taken to be stamped, s.
    pub delay_s: f64,
    /// The delay as it was estimated, and its standard deviation, s.
    pub estimated_delay: Option<(f64, f64)>,
    /// The payload's mass as it was given.
    pub known_mass: Option<KnownMass>,
    /// The box as it was given.
    pub bounding_box: Option<BoundingBox>,
    /// Where times came from.
    pub clock: Clock,
    /// Messages that could not be used.
    pub faults: Vec<DataFault>,
    /// What a reader must know of how the recording was read, a sentence each.
    pub remarks: Vec<String>,
    /// Whether the observer stopped the reading.
    pub interrupted: bool,
    /// Where the log could not be read further, and why.
    pub damage: Vec<String>,
    pub(crate) forecast: Option<Forecast>,
}

impl Identification {
    /// How much longer the motion must go on until half of each value's 95 % interval is `within` (0.01
    /// for 1 %) times the largest value of its kind (mass, centre of mass, inertia), in the order of
    /// [`VALUE_NAMES`](crate::VALUE_NAMES), s. Zero where it is so already, infinite where the motion
    /// does not determine the value; `None` for the paper's filter, which knows of no intervals.
    ///
    /// Information grows in proportion to the time of a motion: it is taken to grow on as it did in the
    /// second half of the windows. What the model has wrong (a sign, a frame, friction) is a bias,
    /// which no time takes away.
    #[must_use]
    pub fn remaining_s(&self, within: f64) -> Option<[f64; 10]> {
        let std_devs = self.estimate.std_devs?;
        let forecast = self.forecast.as_ref()?;
        Some(forecast.remaining_s(&self.estimate.values(), &std_devs, within))
    }
}

/// How far the reading has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Part of the whole work, 0 to 1.
    pub fraction: f64,
}

/// Where a recording comes from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origin {
    pub(crate) start_ns: i64,
    pub(crate) clock: Clock,
    pub(crate) remarks: Vec<String>,
}

/// The result of a run through a log.
pub(crate) fn finish(
    run: Run,
    decoder: &Decoder,
    request: &Request,
    interrupted: bool,
) -> Result<Identification, IdentifyError> {
    let sources = decoder.sources();
    let mut remarks = sources.remarks.clone();
    let groups = decoder.groups();
    if !groups.strangers.is_empty() {
        let names: Vec<_> = groups.strangers.iter().map(String::as_str).collect();
        remarks.push(format!(
            "Joints that the URDF does not have were left out: {}.",
            names.join(", ")
        ));
    }
    if !groups.absent.is_empty() {
        remarks.push(format!(
            "Joints that the log does not have, and that do not move the tool, were taken to stand at \
             zero: {}.",
            groups.absent.join(", ")
        ));
    }
    remarks.extend(run.remarks.iter().cloned());
    let clock = if decoder.has_stamps() {
        Clock::Stamps
    } else {
        remarks.push("The messages have no stamps: times are those of logging.".to_owned());
        Clock::LogTimes
    };
    let origin = Origin {
        start_ns: decoder.origin_ns(),
        clock,
        remarks,
    };
    if run.records.equations.is_empty() && run.identifier.estimate().intervals == 0 && !interrupted
    {
        let faults = run.faults.to_vec();
        let faults = faults
            .iter()
            .map(|d| format!("; {}: {} × {}", d.topic, d.count, d.what));
        let topics = sources.measured().join(", ");
        return Err(IdentifyError::NoOverlap(topics + &faults.collect::<String>()));
    }
    if request.unloaded.is_some() {
        run.check_unloaded()?;
    }
    conclude(run, request, interrupted, origin)
}

/// The result of a run.
pub(crate) fn conclude(
    run: Run,
    request: &Request,
    interrupted: bool,
    origin: Origin,
) -> Result<Identification, IdentifyError> {
    let mut found = Identification {
        estimate: run.identifier.estimate(),
        principal_moments: None,
        history: Vec::new(),
        fit: None,
        forecast: None,
        duration_s: run.duration_s(),
        start_ns: origin.start_ns,
        gravity: run.gravity(),
        tool: run.plan.tool.clone(),
        delay_s: run.plan.delay_s,
        estimated_delay: run.plan.found_delay,
        known_mass: request.known_mass,
        bounding_box: request.bounding_box,
        clock: origin.clock,
        faults: run.faults.to_vec(),
        remarks: origin.remarks,
        interrupted,
        damage: run.damage.clone(),
        settings: run.plan.settings.clone(),
    };
    found.estimate.singular_values = Some(run.identifier.singular_values());
    if run.plan.least_squares {
        match fit(&mut found, &run, request) {
            // Of so little nothing is known.
            Err(IdentifyError::TooShort { .. }) if interrupted => {}
            other => other?,
        }
    } else {
        found.history.clone_from(&run.history);
        if let Some(tool) = request.known_tool {
            found.estimate.body = crate::estimate::without(&found.estimate.body, &tool.into());
        }
        found.principal_moments = PrincipalMoments::of(&found.estimate.body.into());
    }
    Ok(found)
}

/// Replaces the online estimate by the fit over all equations.
fn fit(found: &mut Identification, run: &Run, request: &Request) -> Result<(), IdentifyError> {
    let equations = &run.records.equations;
    let too_few = || IdentifyError::TooShort {
        windows: equations.len(),
        window_s: crate::window::length_s(run.plan.settings.cutoff_hz),
    };
    let channels = run.identifier.grouping();
    let alone = Fit::new(equations, Options::new(&channels)).ok_or_else(too_few)?;
    tell_delay(found, run, &alone);
    let known = known_bodies(run, request);
    let weighed = match request.known_mass {
        Some(mass) => {
            tell_contradiction(found, &alone, known[0], &mass);
            let options = Options {
                mass: Some(mass.with(known[0])),
                ..Options::new(&channels)
            };
            Some(Fit::new(equations, options).ok_or_else(too_few)?)
        }
        None => None,
    };
    let fit = weighed.as_ref().unwrap_or(&alone);
    let parameters = possible(found, fit, &known, request.bounding_box.as_ref());
    tell_payload(found, fit, &parameters, &known);
    found.history = history(equations, fit, &known, request.bounding_box.as_ref());
    // A sign shows in what the data say alone.
    let suspect = suspicions(
        equations,
        (&alone, &channels),
        &found.gravity,
        run.plan.settings.method,
    );
    found.remarks.extend(suspect);
    let feels_wrenches = !run.plan.sensors.is_empty() && run.plan.settings.method.uses_wrench();
    if feels_wrenches && channels.offsets == 0 {
        let names = run.identifier.channels();
        found
            .remarks
            .extend(suspect_offset(equations, fit, &channels, &names));
    }
    let outliers = (0..equations.len()).filter(|&k| fit.is_outlier(k)).count();
    if outliers > 0 {
        found.remarks.push(format!(
            "{outliers} of {} windows are outliers, such as an impact leaves, and hardly count.",
            equations.len()
        ));
    }
    let told = FitReport {
        advice: advice(&found.estimate.identifiable),
        ..report(run, fit)
    };
    found.forecast = Forecast::new(equations, fit, &parameters, told.stride_s);
    found.fit = Some(told);
    Ok(())
}

/// The delay that is left, and what was done about it.
fn tell_delay(found: &mut Identification, run: &Run, fit: &Fit) {
    if run.plan.found_delay.is_some() {
        let channels = run.identifier.grouping();
        let options = Options {
            delay: true,
            weights: Some(fit),
            ..Options::new(&channels)
        };
        let rest = Fit::new(&run.records.equations, options).and_then(|fit| fit.delay);
        if let Some((rest_s, std_dev_s)) = rest.filter(|(rest_s, _)| rest_s.is_finite()) {
            found.estimated_delay = Some((run.plan.delay_s + rest_s, std_dev_s));
        }
    }
    if found.delay_s != 0.0
        && let Some((delay_s, std_dev_s)) = found.estimated_delay
    {
        found.remarks.push(format!(
            "The wrenches are stamped {:.2} ms later than the motion (a delay of {:.2} ± {:.2} ms was \
             found): corrected.",
            1e3 * found.delay_s,
            1e3 * delay_s,
            1e3 * HALF_WIDTH_95 * std_dev_s
        ));
    }
}

/// What the measured load holds besides the payload.
fn known_bodies(run: &Run, request: &Request) -> SVector<f64, 10> {
    let mut known = SVector::<f64, 10>::zeros();
    if run.plan.settings.method == Method::JointSensing {
        known += run.identifier.gripper().as_vector();
    }
    if let Some(tool) = request.known_tool {
        known += InertialParameters::from(tool).as_vector();
    }
    known
}

/// That the data alone say another mass than the one that is known; `others_kg` of the load are not
/// the payload's.
fn tell_contradiction(found: &mut Identification, alone: &Fit, others_kg: f64, mass: &KnownMass) {
    let std_dev_kg = alone.std_devs(&alone.parameters)[0];
    let found_kg = alone.parameters[0] - others_kg;
    let apart = (found_kg - mass.mass_kg).abs() / std_dev_kg.hypot(mass.std_dev_kg);
    if apart > FAR {
        let half_width_kg = HALF_WIDTH_95 * std_dev_kg;
        // To two figures of the interval.
        let digits = (1.0 - half_width_kg.log10().floor()).clamp(0.0, 9.0) as usize;
        found.remarks.push(format!(
            "The mass is given as {} kg, but the data alone say {found_kg:.digits$} ± \
             {half_width_kg:.digits$} kg, {apart:.1} standard deviations away: check gravity, and the \
             sensors' gains and offsets.",
            mass.mass_kg,
        ));
    }
}

/// The possible payload that is nearest to what the data say.
fn possible(
    found: &mut Identification,
    fit: &Fit,
    known: &SVector<f64, 10>,
    bounding_box: Option<&BoundingBox>,
) -> SVector<f64, 10> {
    let parameters = fit.parameters - known;
    let scales = &fit.excitation.scales;
    let Some(nearest) = nearest_possible(&parameters, &fit.covariance, scales, bounding_box) else {
        return parameters;
    };
    if nearest.distance > FAR {
        let (within, and) = match bounding_box {
            Some(_) => (" within the box", ", the box"),
            None => ("", ""),
        };
        found.remarks.push(format!(
            "No possible body{within} explains the data within their noise; the nearest is {:.1} standard \
             std_devs away, and is given: check frames{and}, gravity and the sensors' offsets.",
            nearest.distance
        ));
    }
    nearest.parameters
}

/// The estimate with its uncertainty; `known` bodies were felt with it.
fn tell_payload(
    found: &mut Identification,
    fit: &Fit,
    parameters: &SVector<f64, 10>,
    known: &SVector<f64, 10>,
) {
    let mut std_devs = fit.std_devs(parameters);
    if found
        .known_mass
        .is_some_and(|mass| mass.std_dev_kg == 0.0)
    {
        std_devs[0] = 0.0;
    }
    let estimate = &mut found.estimate;
    if let Some(body) = InertialParameters::from_vector(*parameters).mass_properties() {
        estimate.body = body;
    }
    if estimate.composite.is_some() {
        estimate.composite = InertialParameters::from_vector(parameters + known).mass_properties();
    }
    estimate.identifiable = identifiable(&estimate.values(), &std_devs);
    estimate.std_devs = Some(std_devs);
    estimate.is_physical = crate::latest::is_physical(&estimate.body);
    found.principal_moments =
        PrincipalMoments::with_std_devs(parameters, &fit.covariance, &fit.excitation);
}

fn report(run: &Run, fit: &Fit) -> FitReport {
    let equations = &run.records.equations;
    let part = equations.len().div_ceil(HELD_OUT_PARTS).max(1);
    let held_out: Vec<bool> = (0..equations.len())
        .map(|k| (k / part) % HELD_OUT_EVERY == HELD_OUT_EVERY / 2)
        .collect();
    let seen: Vec<bool> = held_out.iter().map(|held| !held).collect();
    let channels = run.identifier.grouping();
    let options = Options {
        only: Some(&seen),
        mass: fit.mass,
        covariance: false,
        ..Options::new(&channels)
    };
    let blind = Fit::new(equations, options);
    let channels = run.identifier.channels();
    let merged = f64::from(run.records.merged.max(1));
    let cutoff_hz = run.plan.settings.cutoff_hz;
    let predict = |fit: &Fit| -> Vec<f64> {
        let offset = |channel: usize| fit.offsets.get(channel).map_or(0.0, |offset| offset.value);
        let rows = equations
            .iter()
            .flat_map(|equation| equation.rows.iter().enumerate());
        rows.map(|(channel, row)| row.regressor.dot(&fit.parameters) + offset(channel))
            .collect()
    };
    let measured: Vec<f64> = equations
        .iter()
        .flat_map(|equation| equation.rows.iter().map(|row| row.target))
        .collect();
    let predicted = predict(fit);
    let rms = |predicted: &[f64], windows: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let count = channels.len();
        let sum = |channel: usize| {
            let (mut squares, mut weights) = (0.0, 0.0);
            for window in 0..equations.len() {
                let k = window * count + channel;
                squares += windows(window) * (measured[k] - predicted[k]).powi(2);
                weights += windows(window);
            }
            (squares / f64::max(weights, f64::MIN_POSITIVE)).sqrt()
        };
        (0..count).map(sum).collect()
    };
    let held_out_rms = blind.map_or(vec![f64::NAN; channels.len()], |blind| {
        rms(&predict(&blind), &|k| {
            if held_out[k] { fit.weights[k] } else { 0.0 }
        })
    });
    FitReport {
        times_s: equations.iter().map(|equation| equation.time_s).collect(),
        residual_rms: rms(&predicted, &|k| fit.weights[k]),
        held_out_rms,
        weights: fit.weights.clone(),
        strengths: fit.excitation.strengths.clone(),
        directions: fit.excitation.vectors.iter().map(|v| (*v).into()).collect(),
        stride_s: crate::window::stride_s(cutoff_hz) * merged,
        cutoff_hz: cutoff_hz / merged,
        advice: Vec::new(),
        offsets: fit.offsets.clone(),
        channels,
        measured,
        predicted,
        held_out,
    }
}
