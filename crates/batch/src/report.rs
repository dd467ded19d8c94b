//! How well a fit explains what was measured.

use schemars::JsonSchema;
use serde::Serialize;
use tactid_identify::WrenchOffset;
use tactid_identify::equations::{Channel, Channels, Equation, OffsetFrame, window};
use tactid_identify::serial::TenValues;

use crate::equation_batch::EquationBatch;
use crate::fit::further::FurtherValues;
use crate::fit::{CONVERGED_ENOUGH, Fit, FitOptions, least_squares};
use crate::serial::Table;
use crate::trajectory::MotionEstimate;
use crate::{GravityEstimate, WeightEstimate};

/// Number of sections of a recording, of which some are held out for validation.
pub(super) const VALIDATION_SECTIONS: usize = 25;
/// One section in so many is held out.
pub(super) const HELD_OUT_EVERY: usize = 5;

/// How well the payload explains what was measured.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FitReport {
    /// Names and units of the C channels of the measured load.
    pub channels: Vec<Channel>,
    /// Middle of each of W windows, on the clock of the samples, s, (W,); of poses at rest, which
    /// have no times, their numbers, counted from zero.
    #[schemars(extend("kept" = "file"))]
    pub times_s: Vec<f64>,
    /// Measured load of each window after the low-pass, in the unit of each channel, (W, C).
    #[schemars(extend("kept" = "file"))]
    pub measured: Table,
    /// Load predicted from the motion and the identified parameters, in the unit of each channel,
    /// (W, C).
    #[schemars(extend("kept" = "file"))]
    pub predicted: Table,
    /// Robust weight of each window, without a unit, (W,): 1, or less for an outlier.
    #[schemars(extend("kept" = "file"))]
    pub weights: Vec<f64>,
    /// Whether each window was held out from the validation fit, (W,).
    #[schemars(extend("kept" = "file"))]
    pub held_out: Vec<bool>,
    /// Weighted rms of measured less predicted, in the unit of each channel, (C,).
    pub residual_rms: Vec<f64>,
    /// Weighted rms of measured less predicted on the held-out windows, in the unit of each
    /// channel, (C,). A fit to all other windows predicts them. Unknown where these are too few.
    pub held_out_rms: Vec<f64>,
    /// Rms of measured less predicted on the held-out windows as `held_out_rms`, but with the full
    /// weight of every window, in the unit of each channel, (C,): far larger than that where
    /// contact or another disturbance is in windows that count little.
    pub held_out_plain_rms: Vec<f64>,
    /// Fraction of the variance of each of the [ten values](tactid_identify::VALUE_NAMES) that is noise of
    /// the recording: 1 where the gains and the known tool are exact. The rest is the uncertainty
    /// of the gains of the joint efforts
    /// ([`effort_gain_std_dev`](tactid_identify::EquationSettings::effort_gain_std_dev)), of a calibration,
    /// or of a known tool: no longer recording reduces it.
    #[schemars(with = "TenValues<f64>")]
    pub noise_fraction: [f64; 10],
    /// Strength with which the motion excites ten directions of the scaled parameters, relative to
    /// the strongest, descending, without a unit, (10,).
    pub excitation: Vec<f64>,
    /// Directions of the parameters that `excitation` refers to, as rows, (10, 10): unit vectors in
    /// mass, first moments and inertia about the frame's origin, each divided by its scale.
    #[schemars(extend("kept" = "memory"))]
    pub excitation_directions: Vec<[f64; 10]>,
    /// Offset of the wrenches, where it was among the unknowns. `predicted` contains it.
    pub wrench_offset: Option<WrenchOffset>,
    /// Gravity, where its direction was unknown.
    pub gravity: Option<GravityEstimate>,
    /// The body whose weight was subtracted from the wrenches, where it was unknown. `predicted`
    /// contains its weight.
    pub subtracted_weight: Option<WeightEstimate>,
    /// How the measured motion entered the estimate.
    pub motion: MotionEstimate,
    /// Time until which motion and payload were estimated at once, on the clock of the samples, s,
    /// where that is only the beginning of the recording.
    pub motion_until_s: Option<f64>,
    /// Time between two windows, s.
    pub stride_s: f64,
    /// Cutoff of the filter, Hz: that of the settings, divided by the number of windows that were
    /// merged.
    pub cutoff_hz: f64,
}

impl FitReport {
    /// Reports on a fit of the `equations`, those of a batch without what further unknowns with
    /// these `values` explain. The filter of the batch has the cutoff `cutoff_hz`, and `frame` is
    /// that of a wrench offset.
    pub(crate) fn new(
        batch: &EquationBatch,
        equations: &[Equation],
        (fit, values): (&Fit, &FurtherValues),
        noise_fraction: [f64; 10],
        channels: &Channels,
        cutoff_hz: f64,
        frame: &OffsetFrame,
    ) -> Self {
        let section = equations.len().div_ceil(VALIDATION_SECTIONS).max(1);
        let held_out: Vec<bool> = (0..equations.len())
            .map(|k| (k / section) % HELD_OUT_EVERY == HELD_OUT_EVERY / 2)
            .collect();
        let targets = batch.equations().iter().flat_map(|equation| &equation.rows);
        let measured: Vec<f64> = targets.map(|row| row.target).collect();
        let residuals = residuals(equations, fit);
        let explained = measured
            .iter()
            .zip(&residuals)
            .map(|(all, rest)| all - rest);
        let predicted = explained.collect();
        let options = values.options(channels);
        let [held_out_rms, held_out_plain_rms] = validate(equations, fit, options, &held_out);
        let table = |values| Table {
            columns: channels.count(),
            values,
        };
        let merged = f64::from(batch.merged().max(1));
        Self {
            times_s: equations.iter().map(|equation| equation.time_s).collect(),
            residual_rms: rms(&residuals, &fit.weights, channels.count()),
            held_out_rms,
            held_out_plain_rms,
            weights: fit.weights.clone(),
            noise_fraction,
            excitation: fit.excitation.strengths.clone(),
            excitation_directions: fit
                .excitation
                .directions
                .iter()
                .map(|v| (*v).into())
                .collect(),
            stride_s: window::stride_s(cutoff_hz) * merged,
            cutoff_hz: cutoff_hz / merged,
            wrench_offset: fit.wrench_offset(frame),
            gravity: values.gravity_estimate(),
            subtracted_weight: values.weight_estimate(),
            motion: MotionEstimate::Smoothed,
            motion_until_s: None,
            channels: channels.channels.clone(),
            measured: table(measured),
            predicted: table(predicted),
            held_out,
        }
    }
}

/// Held-out validation: returns the rms residual of each channel on windows that a second fit does
/// not use, with their robust weights in the fit to the `whole` recording, and with full weights.
fn validate(
    equations: &[Equation],
    whole: &Fit,
    options: FitOptions<'_>,
    held_out: &[bool],
) -> [Vec<f64>; 2] {
    let weighted = held_out.iter().zip(&whole.weights);
    let seen: Vec<bool> = weighted
        .map(|(held, weight)| !held && *weight > 0.0)
        .collect();
    let options = FitOptions {
        used: Some(&seen),
        known_mass: whole.known_mass,
        converged: CONVERGED_ENOUGH,
        covariance: false,
        start: Some(whole),
        ..options
    };
    let columns = options.channels.count();
    let Some(blind) = least_squares::fit(equations, options) else {
        return [0, 1].map(|_| vec![f64::NAN; columns]);
    };
    let residuals = residuals(equations, &blind);
    let with_weights = |weight: fn(f64) -> f64| {
        let pairs = whole.weights.iter().zip(held_out);
        let weights: Vec<f64> = pairs
            .map(|(w, held)| if *held { weight(*w) } else { 0.0 })
            .collect();
        rms(&residuals, &weights, columns)
    };
    [with_weights(|weight| weight), with_weights(|_| 1.0)]
}

/// Returns what a fit leaves of the load, window by window.
fn residuals(equations: &[Equation], fit: &Fit) -> Vec<f64> {
    let left = |equation| {
        let channels = 0..fit.noise.channels();
        channels.map(move |channel| fit.residual(equation, channel))
    };
    equations.iter().flat_map(left).collect()
}

/// Returns the weighted rms residual of each channel; `weights` has an entry for each window.
fn rms(residuals: &[f64], weights: &[f64], channels: usize) -> Vec<f64> {
    let total = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let of_channel = |channel: usize| {
        let windows = weights.iter().zip(residuals.chunks_exact(channels));
        let squares = windows.map(|(weight, residuals)| weight * residuals[channel].powi(2));
        (squares.sum::<f64>() / total).sqrt()
    };
    (0..channels).map(of_channel).collect()
}
