//! What may have changed in the arm since its calibration.
//!
//! Friction changes by tens of percent with temperature and wear, and the efforts of a warm motor are some percent off,
//! while links, rotors and the delay stay. The prior of an identification is therefore that of the calibration with a
//! variance of the change added to the friction and to the inverse gains: `(P⁻¹ + D)⁻¹` with the precision `P` of the
//! calibration and a diagonal `D`. The size of the change is the one that maximises the evidence of the recordings of the day.
//!
//! Where all gains are uncertain, recordings of an unknown payload do not determine their scale: links and payload times a
//! factor, and inverse gains divided by it, give the same efforts. Along this direction `s` the calibration's distribution
//! is curved, which a normal distribution of links and gains is not: it would contradict every other scale, and pull the
//! payload. The scale is therefore fixed with the rest conditional on it, and its variance `1 / (sᵀ P s)` is added to that
//! of the payload.

use nalgebra::{DMatrix, DVector};

use super::layout::{Group, Layout};
use super::rows::Unknowns;
use super::scale::scale_direction;
use super::solver::{NormalEquations, Prior, Problem};
use crate::IdentifyError;

/// Standard deviations of the change of friction that are compared, in units of the friction that joints of the arm
/// typically have.
const FRICTION: [f64; 8] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0];

/// Standard deviations of the change of gains that are compared, fractions. The least is not smaller, because a payload
/// hides much of a change of the gains of an arm that carries more than the payload.
const GAIN: [f64; 4] = [0.0, 0.02, 0.05, 0.15];

/// Precision of a payload in its units, weak and positive: a payload that the motion does not determine has evidence, too.
const PAYLOAD_PRECISION: f64 = 1e-4;

/// Logarithm of the odds against a change of the gains before a recording shows it.
const GAIN_ODDS: f64 = 3.0;

/// Precision of the scale of all gains while it is fixed, relative to that of its prior.
const HELD_PRECISION_RATIO: f64 = 1e4;

/// How much an arm has changed since its calibration: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Change {
    /// Change of friction and offset, in units of the friction that joints of the arm typically have.
    pub(crate) friction: f64,
    /// Change of the gains, a fraction.
    pub(crate) gain: f64,
    /// Log evidence of this change less that of the best one without a change of the friction.
    pub(crate) friction_evidence: f64,
    /// Log evidence of this change less that of the best one without a change of the gains.
    pub(crate) gain_evidence: f64,
}

impl Change {
    pub(crate) const NONE: Self = Self {
        friction: 0.0,
        gain: 0.0,
        friction_evidence: 0.0,
        gain_evidence: 0.0,
    };
}

/// A change that is compared with others, and the precision of the arm's unknowns with it.
#[derive(Clone, Debug)]
struct Candidate {
    /// Standard deviations of the change, see [`Change`].
    friction: f64,
    gain: f64,
    precision: DMatrix<f64>,
    log_det: f64,
    scale_variance: f64,
}

/// All changes that are compared.
#[derive(Clone, Debug)]
pub(crate) struct Changes(Vec<Candidate>);

impl Changes {
    /// Computes the prior with each change. Gains that are known exactly do not change. The scale of gains that are
    /// uncertain is fixed if `fixes_scale`.
    pub(crate) fn new(
        layout: &Layout,
        prior: &Prior,
        fixes_scale: bool,
    ) -> Result<Self, IdentifyError> {
        let scale = if fixes_scale {
            scale_direction(layout, &prior.mean, &prior.scales)
        } else {
            None
        };
        let failed = || IdentifyError::CalibrationFailed;
        let factor = prior.precision.clone().cholesky().ok_or_else(failed)?;
        let covariance = factor.inverse();
        let gains = layout.range(Group::InverseGain);
        let may_change = prior.scales[gains.clone()].iter().any(|scale| *scale > 0.0);
        let gain_changes = if may_change { &GAIN[..] } else { &GAIN[..1] };
        let mut candidates = Vec::new();
        for &gain in gain_changes {
            for friction in FRICTION {
                let mut changed = covariance.clone();
                for group in layout.groups() {
                    let is_friction = matches!(
                        group,
                        Group::Offset | Group::Viscous | Group::Friction(_) | Group::Load
                    );
                    for k in layout.range(group) {
                        changed[(k, k)] += match group {
                            Group::InverseGain if prior.scales[k] > 0.0 => {
                                (gain * prior.mean[k] / prior.scales[k]).powi(2)
                            }
                            _ if is_friction => friction * friction,
                            _ => 0.0,
                        };
                    }
                }
                let factor = changed.cholesky().ok_or_else(failed)?;
                let mut precision = factor.inverse();
                let scale_variance = scale
                    .as_ref()
                    .map_or(0.0, |s| fix_direction(&mut precision, s));
                candidates.push(Candidate {
                    friction,
                    gain,
                    log_det: -2.0 * factor.l_dirty().diagonal().map(f64::ln).sum(),
                    precision,
                    scale_variance,
                });
            }
        }
        Ok(Self(candidates))
    }

    /// Gives a problem the prior with the change that the recordings make most probable, about some unknowns at which
    /// `data` are their normal equations, and returns it with the variance of the scale that is fixed.
    pub(crate) fn choose(
        &self,
        problem: &mut Problem<'_>,
        at: &Unknowns,
        data: &NormalEquations,
    ) -> Result<(Change, f64), IdentifyError> {
        let mut compared: Vec<(f64, &Candidate)> = Vec::with_capacity(self.0.len());
        for candidate in &self.0 {
            problem.prior.precision.copy_from(&candidate.precision);
            let log_evidence = candidate.log_evidence(problem, at, data);
            if log_evidence.is_finite() {
                compared.push((log_evidence, candidate));
            }
        }
        let best_of = |is_compared: fn(&Candidate) -> bool| {
            let of = compared
                .iter()
                .filter(|(_, candidate)| is_compared(candidate));
            of.max_by(|a, b| a.0.total_cmp(&b.0)).copied()
        };
        let failed = || IdentifyError::CalibrationFailed;
        let (log_evidence, best) = best_of(|_| true).ok_or_else(failed)?;
        let log_evidence = |without: Option<(f64, &Candidate)>| {
            without.map_or(f64::INFINITY, |(other, _)| log_evidence - other)
        };
        problem.prior.precision.copy_from(&best.precision);
        let change = Change {
            friction: best.friction,
            gain: best.gain,
            friction_evidence: log_evidence(best_of(|candidate| candidate.friction == 0.0)),
            gain_evidence: log_evidence(best_of(|candidate| candidate.gain == 0.0)),
        };
        Ok((change, best.scale_variance))
    }
}

/// Fixes a direction of a normal distribution with a precision, and returns the variance that it had.
fn fix_direction(precision: &mut DMatrix<f64>, direction: &DVector<f64>) -> f64 {
    let product = &*precision * direction;
    let of_direction = direction.dot(&product);
    *precision += HELD_PRECISION_RATIO / of_direction * &product * product.transpose();
    1.0 / of_direction
}

impl Candidate {
    /// Returns the logarithm of the evidence of the linearised equations, but for a constant; NaN where they cannot be
    /// solved.
    fn log_evidence(&self, problem: &Problem<'_>, at: &Unknowns, data: &NormalEquations) -> f64 {
        let mut normal = data.clone().plus(problem.prior_equations(at));
        for k in problem.arm_len()..problem.len() {
            normal.matrix[(k, k)] += PAYLOAD_PRECISION;
        }
        let Some(factor) = normal.matrix.cholesky() else {
            return f64::NAN;
        };
        let log_det = 2.0 * factor.l_dirty().diagonal().map(f64::ln).sum();
        let least_squares = normal.squares - normal.rhs.dot(&factor.solve(&normal.rhs));
        let odds = if self.gain > 0.0 { GAIN_ODDS } else { 0.0 };
        -0.5 * (least_squares + log_det - self.log_det) - odds
    }
}
