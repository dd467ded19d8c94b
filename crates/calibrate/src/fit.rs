//! Fit of an arm's model to recordings: unknowns, noise and scales of the prior, by friction terms.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use tactid_dynamics::words::three_digits;

use super::arm::{Arm, PLAIN, WIDTHS};
use super::delay::LONGEST;
use super::interruption::{InterruptionCheck, check_interruption};
use super::layout::{Group, Layout};
use super::model::Calibration;
use super::noise::EffortNoise;
use super::noise_fit::{Residuals, noise_windows, penalty};
use super::payload::KnownPayload;
use super::recording::EffortRecording;
use super::reference::{Reference, link_sizes};
use super::rows::{EffortModel, Unknowns};
use super::scale::{KnownScale, scale_direction};
use super::settings::CalibrationSettings;
use super::solver::{Block, NormalEquations, Prior, Problem};
use crate::CalibrateError;

/// Number of passes. Noise and prior change by less than a percent in the last.
const PASSES: usize = 8;

/// Least velocity of a joint that moves, rad/s or m/s, as in the plain Coulomb term.
pub(crate) const MOVES: f64 = WIDTHS[PLAIN];

/// First prior standard deviation of link parameters, as a fraction of their size; [`rescale`]
/// adapts it to the data.
const LINK_STD_DEV: f64 = 0.5;

/// First prior standard deviation of the load-dependent friction, a fraction of the torque;
/// [`rescale`] adapts it to the data.
const LOAD_STD_DEV: f64 = 0.05;

/// Prior standard deviation of the delay of the efforts, s: a few periods of usual drives, or of
/// the filters of their currents.
const DELAY_STD_DEV_S: f64 = 0.02;

/// Standard deviation of the delay that no residual shows, s: in simulations without delay, with
/// friction that jumps at each reversal, unlike the model's, it is found with errors of 0.4 ms, and
/// its covariance says 0.2 ms.
const DELAY_ERROR_S: f64 = 5e-4;

/// Units of the parameters of a payload: kg, kg m and kg m². They scale columns and are no prior.
pub(crate) const PAYLOAD_SCALES: [f64; 10] =
    [3.0, 0.3, 0.3, 0.3, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05];

/// A fit of the model with one choice of friction terms.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub(crate) model: EffortModel,
    pub(crate) unknowns: Unknowns,
    pub(crate) noise: Vec<EffortNoise>,
    pub(crate) prior: Prior,
    /// Precision of all unknowns, divided by their units.
    precision: DMatrix<f64>,
    /// Variance of the scale of all torques, which the fit holds.
    scale_variance: f64,
    pub(crate) log_evidence: f64,
}

/// Returns the problem of fitting a model to recordings; every payload has what is known of it.
pub(crate) fn problem<'a>(
    recordings: &[(&'a EffortRecording, Option<KnownPayload>)],
    model: &'a EffortModel,
    prior: Prior,
) -> Problem<'a> {
    let mut payload_rows = Vec::new();
    let mut blocks = Vec::new();
    for (recording, held) in recordings {
        let payload = held.map(|held| {
            payload_rows.push(held.rows());
            payload_rows.len() - 1
        });
        blocks.push(Block {
            recording,
            payload,
            windows: (0..recording.windows()).collect(),
        });
    }
    let held = recordings.iter().filter_map(|(_, held)| *held);
    Problem {
        model,
        blocks,
        scale: KnownScale::new(&model.layout, &prior.scales, held),
        prior,
        payload_scales: vec![PAYLOAD_SCALES; payload_rows.len()],
        payload_rows,
    }
}

/// A solution of the equations that are linearised about some unknowns.
struct Solved {
    normal: NormalEquations,
    step: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
}

/// Solves the linearised equations.
fn solve(
    problem: &Problem<'_>,
    at: &Unknowns,
    noise: &[EffortNoise],
) -> Result<Solved, CalibrateError> {
    let normal = problem.normal_equations(at, noise);
    let factor = normal.matrix.clone().cholesky();
    let factor = factor.ok_or_else(CalibrateError::unsolvable)?;
    Ok(Solved {
        step: factor.solve(&normal.rhs),
        normal,
        factor,
    })
}

/// Returns the names of joints as a sentence has them.
fn listed(joints: &[String]) -> String {
    let named: Vec<String> = joints.iter().map(|joint| format!("`{joint}`")).collect();
    match named.split_last() {
        None => String::new(),
        Some((only, [])) => format!("the joint {only}"),
        Some((last, most)) => format!("the joints {} and {last}", most.join(", ")),
    }
}

/// Checks that the gains are positive, and that the delay is not longer than the windows can
/// correct, s.
fn check_unknowns(
    layout: &Layout,
    at: &Unknowns,
    (joints, window_s): (&[String], f64),
) -> Result<(), CalibrateError> {
    let is_wrong = |joint: &usize| at.arm[layout.index(Group::InverseGain, *joint)] <= 0.0;
    let wrong = (0..layout.joints).filter(is_wrong);
    let joints: Vec<String> = wrong.map(|joint| joints[joint].clone()).collect();
    if !joints.is_empty() {
        return Err(CalibrateError::Data(format!(
            "the efforts of {} do not fit the motion, because their gains come out negative: check their signs and units, \
             the units of positions, the order of the joints, the direction of gravity, the mass and the centre of mass (m) \
             of each payload, and that no recordings are exchanged",
            listed(&joints)
        )));
    }
    let delay_s = at.arm[layout.index(Group::Delay, 0)];
    let longest_s = LONGEST * window_s;
    if delay_s.abs() > longest_s {
        return Err(CalibrateError::Data(format!(
            "the efforts {} the motion by {} ms, but windows of {} s allow for {} ms at most: correct the stamps of the \
             efforts",
            if delay_s < 0.0 { "lead" } else { "lag" },
            three_digits(1e3 * delay_s.abs()),
            three_digits(window_s),
            three_digits(1e3 * longest_s)
        )));
    }
    Ok(())
}

/// Fits unknowns, noise and scales of the prior with these friction terms.
pub(crate) fn fit(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
    reference: &Reference,
    widths: Vec<usize>,
    settings: &CalibrationSettings,
    check: &mut InterruptionCheck<'_>,
) -> Result<Fitted, CalibrateError> {
    let arm = &recordings[0].0.arm;
    let model = EffortModel {
        layout: Layout {
            links: arm.links.len(),
            joints: arm.joints.len(),
            widths,
        },
        reference_torques: reference.torques.clone(),
    };
    let prior = prior(&model.layout, &arm.described, reference, settings);
    let first_scales = prior.scales.clone();
    let mut problem = problem(recordings, &model, prior);
    let noise_blocks = noise_windows(&problem.blocks);
    let friction = &reference.friction;
    let mut noise: Vec<_> = friction.iter().map(|f| EffortNoise::typical(*f)).collect();
    let mut at = problem.start();
    let held = recordings.iter().filter_map(|(_, held)| *held);
    for (payload, held) in at.payloads.iter_mut().zip(held) {
        *payload = *held.parameters().as_vector();
    }
    for pass in 0..PASSES - 1 {
        check_interruption(check)?;
        let Solved { step, factor, .. } = solve(&problem, &at, &noise)?;
        let covariance = factor.inverse();
        for (joint, noise) in noise.iter_mut().enumerate() {
            check_interruption(check)?;
            let residuals =
                Residuals::new(&problem, &noise_blocks, joint, (&at, &step, &covariance));
            *noise = residuals.fit_noise(friction[joint], noise, pass == 0);
        }
        problem.add(&mut at, &step);
        rescale(&mut problem, &at, &covariance, &first_scales);
    }
    let last = solve(&problem, &at, &noise)?;
    problem.add(&mut at, &last.step);
    let about = (arm.joints.as_slice(), recordings[0].0.window_s());
    check_unknowns(&model.layout, &at, about)?;
    let log_evidence = evidence(&last, &noise, friction);
    let scale_variance = problem.scale.map_or(0.0, |scale| scale.variance);
    let prior = problem.prior;
    Ok(Fitted {
        scale_variance,
        precision: last.normal.matrix,
        unknowns: at,
        model,
        noise,
        prior,
        log_evidence,
    })
}

/// Returns the logarithm of the evidence of the last, linear fit.
fn evidence(last: &Solved, noise: &[EffortNoise], friction: &[f64]) -> f64 {
    let log_det = 2.0 * last.factor.l_dirty().diagonal().map(f64::ln).sum();
    let least_squares = last.normal.squares - last.normal.rhs.dot(&last.step);
    let penalties = noise.iter().zip(friction);
    let penalties: f64 = penalties.map(|(noise, f)| penalty(&noise.logs(), *f)).sum();
    -0.5 * (last.normal.log_det + least_squares + log_det) - penalties
}

/// Returns what is known before any recording: the robot's description, and friction of the size
/// that the first fit has.
fn prior(
    layout: &Layout,
    described: &[f64],
    reference: &Reference,
    settings: &CalibrationSettings,
) -> Prior {
    let mut mean = described.to_vec();
    let mut scales = link_sizes(described);
    scales.iter_mut().for_each(|size| *size *= LINK_STD_DEV);
    for group in layout.groups() {
        for friction in &reference.friction[..layout.range(group).len()] {
            let (value, scale) = match group {
                Group::Offset | Group::Viscous | Group::Friction(_) => (0.0, *friction),
                Group::Load | Group::PayloadLoad => (0.0, LOAD_STD_DEV),
                Group::Rotor => (0.0, 0.03 * friction + 0.1),
                Group::InverseGain => (1.0, settings.gain_std_dev),
                Group::Delay => (0.0, DELAY_STD_DEV_S),
            };
            mean.push(value);
            scales.push(scale);
        }
    }
    Prior {
        precision: DMatrix::identity(mean.len(), mean.len()),
        mean,
        scales,
    }
}

/// Scales the prior of each group but the gains and the delay by what the group shows of its own
/// size: MacKay's fixed point (1992, doi 10.1162/neco.1992.4.3.415), with two prior degrees of
/// freedom at one.
fn rescale(
    problem: &mut Problem<'_>,
    at: &Unknowns,
    covariance: &DMatrix<f64>,
    first_scales: &[f64],
) {
    let layout = &problem.model.layout;
    let groups = layout
        .groups()
        .filter(|group| !matches!(group, Group::InverseGain | Group::Delay));
    let groups = groups.map(|group| layout.range(group));
    let prior = &mut problem.prior;
    for range in std::iter::once(layout.link_range()).chain(groups) {
        let (mut squares, mut determined) = (2.0, 2.0);
        for k in range.clone() {
            squares += ((at.arm[k] - prior.mean[k]) / first_scales[k]).powi(2);
            determined += 1.0 - covariance[(k, k)];
        }
        let factor = (squares / determined).sqrt();
        for k in range {
            prior.scales[k] = factor * first_scales[k];
        }
    }
}

impl Fitted {
    /// Returns the precision of the arm's unknowns, whatever the payloads are.
    pub(crate) fn arm_precision(&self) -> Result<DMatrix<f64>, CalibrateError> {
        let (arm, all) = (self.prior.mean.len(), self.precision.nrows());
        let of_arm = self.precision.view((0, 0), (arm, arm)).into_owned();
        if all == arm {
            return Ok(self.with_delay_error(self.with_scale_error(of_arm)));
        }
        let payloads = self.precision.view((arm, arm), (all - arm, all - arm));
        let coupling = self.precision.view((arm, 0), (all - arm, arm)).into_owned();
        let factor = payloads.into_owned().cholesky();
        let factor = factor.ok_or_else(CalibrateError::unsolvable)?;
        let of_arm = of_arm - coupling.tr_mul(&factor.solve(&coupling));
        Ok(self.with_delay_error(self.with_scale_error(of_arm)))
    }

    /// Returns the precision of all unknowns, divided by their units.
    pub(crate) fn precision(&self) -> &DMatrix<f64> {
        &self.precision
    }

    /// Adds the variance of the scale of all torques, which the fit holds, to a covariance with a
    /// given inverse.
    fn with_scale_error(&self, precision: DMatrix<f64>) -> DMatrix<f64> {
        let (unknowns, scales) = (&self.unknowns.arm, &self.prior.scales);
        match scale_direction(&self.model.layout, unknowns, scales) {
            Some(direction) => with_variance(precision, self.scale_variance, &direction),
            None => precision,
        }
    }

    /// Adds the variance of the delay that no residual shows to a covariance with a given inverse.
    fn with_delay_error(&self, precision: DMatrix<f64>) -> DMatrix<f64> {
        let delay = self.model.layout.index(Group::Delay, 0);
        let variance = (DELAY_ERROR_S / self.prior.scales[delay]).powi(2);
        let mut direction = DVector::zeros(precision.nrows());
        direction[delay] = 1.0;
        with_variance(precision, variance, &direction)
    }

    /// Returns the fit as plain data.
    pub(crate) fn calibration(&self, arm: &Arm) -> Result<Calibration, CalibrateError> {
        let precision = self.arm_precision()?;
        let rows = (0..precision.nrows()).flat_map(|i| (0..=i).map(move |k| (i, k)));
        let widths = self.model.layout.widths.iter();
        Ok(Calibration {
            tool: arm.tool.clone(),
            joints: arm.joints.clone(),
            links: arm.links.clone(),
            descriptions: arm.descriptions.clone(),
            gravity: arm.gravity,
            cutoff_hz: arm.cutoff_hz,
            friction_widths: widths.map(|&width| WIDTHS[width]).collect(),
            parameters: self.unknowns.arm.clone(),
            scales: self.prior.scales.clone(),
            precision: rows.map(|at| precision[at]).collect(),
            noise: self.noise.clone(),
            reference_torques: self.model.reference_torques.clone(),
            log_evidence: self.log_evidence,
        })
    }
}

/// Adds a variance along a direction to a covariance with a given inverse, by the formula of
/// Sherman and Morrison.
fn with_variance(precision: DMatrix<f64>, variance: f64, direction: &DVector<f64>) -> DMatrix<f64> {
    let product = &precision * direction;
    let factor = variance / (1.0 + variance * direction.dot(&product));
    precision - factor * &product * product.transpose()
}
