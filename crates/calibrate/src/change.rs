//! What may have changed in the arm since its calibration.
//!
//! Friction changes by tens of percent with temperature and wear, and the efforts of a warm motor
//! are some percent off, while links, rotors and the delay stay. The prior of an identification is
//! therefore the calibration's with the covariance of the change added: `(P⁻¹ + D)⁻¹` with the
//! precision `P` of the calibration. `D` has a variance for the friction of each joint, one for
//! each gain, and one for a factor that all gains share, also where the calibration took the gains
//! for exact: torques that a controller reports are such a factor off after its next update. The
//! size of the change is the one that maximises the evidence of the recordings of the day. Gains
//! change a little every day, and, where an unloaded recording of the day shows both, with the
//! friction, because both follow the temperature.
//!
//! The estimate differs from the calibration by the change and by the error of the calibration. The
//! share of the change is its posterior mean `D (P⁻¹ + D)⁻¹ (x - x₀)`.
//!
//! Where all gains are uncertain, recordings of an unknown payload do not determine their scale:
//! links and payload times a factor, and inverse gains divided by it, give the same efforts. Along
//! this direction `s` the calibration's distribution is curved, which a normal distribution of
//! links and gains is not: it would contradict every other scale, and pull the payload. The scale
//! is therefore fixed with the rest conditional on it, and its variance `1 / (sᵀ P s)` is added to
//! the variance of the payload.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use tactid_batch::GainErrors;
use tactid_identify::solve::Vector;

use super::layout::{Group, Layout};
use super::rows::Unknowns;
use super::scale::scale_direction;
use super::solver::{NormalEquations, Prior, Problem};
use crate::CalibrateError;

/// Standard deviations of the change of friction that are compared, in units of the friction that
/// joints of the arm typically have.
const FRICTION: [f64; 8] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0];

/// Standard deviations of the change of each gain by itself and of the factor that all gains share
/// which are compared, fractions. The first pair is of every day: a larger one would widen the
/// interval of the mass on the measured arms by more than a tenth. The least change of single gains
/// is not smaller, because a payload hides much of a change of the gains of an arm that carries
/// more than the payload.
const GAINS: [[f64; 2]; 6] = [
    EVERY_DAY,
    [EVERY_DAY[0], 0.01],
    [EVERY_DAY[0], 0.03],
    [EVERY_DAY[0], 0.1],
    [0.02, EVERY_DAY[1]],
    [0.05, EVERY_DAY[1]],
];
const EVERY_DAY: [f64; 2] = [5e-4, 5e-4];

/// Standard deviation of the change of each gain that comes with a change of friction, relative to
/// it, where an unloaded recording of the day shows both. Magnets lose some 0.1 % of their field
/// with each kelvin, and friction 0.5 to 1 %.
const GAIN_RATIO: f64 = 0.2;

/// Largest standard deviation of such a change of a gain. On a UR10e whose friction has changed by
/// 5 to 11 %, one of six intervals misses with 0.0025, and none from 0.005 on. Simulated arms keep
/// errors below 15 g after friction alone has changed by 40 %, as they do not with 0.01.
const WARM_GAIN: f64 = 0.007;

/// Unit of a gain that was taken for exact, a fraction.
const EXACT_GAIN_UNIT: f64 = 0.05;

/// Precision of a payload in its units, weak and positive: a payload that the motion does not
/// determine has evidence, too.
const PAYLOAD_PRECISION: f64 = 1e-4;

/// Logarithm of the odds against a change of the gains before a recording shows it. Without odds,
/// payloads of unchanged simulated arms are off by 2 % where the payload is heavier than the arm's
/// last links; with `e³`, a change by 5 % is missed.
const GAIN_ODDS: f64 = 2.0;

/// Precision of the scale of all gains while it is fixed, relative to its prior's.
const HELD_PRECISION_RATIO: f64 = 1e4;

/// How probable recordings make it that an arm has changed since its calibration, and by how much.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Change {
    /// Standard deviations of the change.
    size: Size,
    /// Log evidence of this change less the best one's without a change of the friction.
    pub(crate) friction_evidence: f64,
    /// Log evidence of this change less the best one's without a change of the gains, less
    /// [`GAIN_ODDS`].
    pub(crate) gain_evidence: f64,
}

/// Standard deviations of a change.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Size {
    /// Change of friction and offset, as a fraction of the prior standard deviation of each.
    friction: f64,
    /// Change of each gain by itself, beyond what comes with the friction, and of the factor that
    /// all gains share, fractions.
    gains: [f64; 2],
    /// Change of each gain that comes with the friction, relative to its change.
    gain_ratio: f64,
}

impl Size {
    /// Whether gains change by more than they do every day.
    fn changes_gains(&self) -> bool {
        self.gains != EVERY_DAY
    }

    /// Returns the root `R` of the covariance `R Rᵀ` of the change of the arm's unknowns in their
    /// units. Its columns belong to the same independent changes whatever their size is: one for
    /// each unknown, and last the factor that all gains share.
    fn root(&self, layout: &Layout, prior: &Prior) -> DMatrix<f64> {
        let [own, shared] = self.gains;
        let with_friction = (self.gain_ratio * self.friction).min(WARM_GAIN);
        let own = own.hypot(with_friction);
        let count = prior.mean.len();
        let mut root = DMatrix::zeros(count, count + 1);
        for group in layout.groups() {
            let range = layout.range(group);
            match group {
                Group::Offset | Group::Viscous | Group::Friction(_) | Group::Load => {
                    for k in range {
                        root[(k, k)] = self.friction;
                    }
                }
                Group::InverseGain => {
                    for k in range {
                        let unit = prior.mean[k] / prior.scales[k];
                        root[(k, k)] = own * unit;
                        root[(k, count)] = shared * unit;
                    }
                }
                Group::PayloadLoad | Group::Rotor | Group::Delay => {}
            }
        }
        root
    }
}

/// A change that is compared with others, and the precision of the arm's unknowns with it.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    size: Size,
    precision: DMatrix<f64>,
    log_det: f64,
    scale_variance: f64,
}

/// Solution of the linearised equations with one of the changes that are compared.
pub(crate) struct ChangeSolution {
    /// Logarithm of the evidence times the prior probability of the change, but for a constant.
    pub(crate) log_evidence: f64,
    /// Step of all unknowns, in their units.
    pub(crate) step: DVector<f64>,
    /// Factor of the precision of all unknowns.
    pub(crate) factor: Cholesky<f64, Dyn>,
}

/// All changes that are compared.
#[derive(Clone, Debug)]
pub(crate) struct Changes {
    layout: Layout,
    /// What the calibration knows, with a unit of every gain.
    prior: Prior,
    /// Root of the calibration's covariance in these units, the same for all recordings.
    calibration_root: DMatrix<f64>,
    /// Direction of the scale of all torques, where it is fixed.
    scale: Option<DVector<f64>>,
    candidates: Vec<Candidate>,
}

/// What an error of one standard deviation of each independent unknown of the arm changes in the
/// parameters of a payload.
#[derive(Clone, Debug)]
pub(crate) struct ArmErrors {
    /// Errors of the calibration.
    pub(crate) calibration: GainErrors,
    /// Changes since the calibration.
    pub(crate) change: GainErrors,
}

impl Changes {
    /// Computes the prior of a problem with each change. The scale of gains that were uncertain at
    /// the calibration is fixed unless a known mass determines it, and gains change with the
    /// friction if the recordings have one of the day without a payload.
    pub(crate) fn new(problem: &Problem<'_>) -> Result<Self, CalibrateError> {
        let (layout, prior) = (&problem.model.layout, &problem.prior);
        let fixes_scale = problem.payload_rows[0].is_empty();
        let has_unloaded = problem.blocks.iter().any(|block| block.payload.is_none());
        let scale = if fixes_scale {
            scale_direction(layout, &prior.mean, &prior.scales)
        } else {
            None
        };
        let failed = CalibrateError::unsolvable;
        let factor = prior.precision.clone().cholesky().ok_or_else(failed)?;
        let lower = factor.l();
        let inverse =
            lower.solve_lower_triangular(&DMatrix::identity(lower.nrows(), lower.nrows()));
        let mut calibration_root = inverse.ok_or_else(failed)?.transpose();
        let mut prior = prior.clone();
        for k in layout.range(Group::InverseGain) {
            if prior.scales[k] == 0.0 {
                prior.scales[k] = EXACT_GAIN_UNIT * prior.mean[k];
                calibration_root.row_mut(k).fill(0.0);
            }
        }
        let covariance = &calibration_root * calibration_root.transpose();
        let gain_ratio = if has_unloaded { GAIN_RATIO } else { 0.0 };
        let sizes = GAINS.into_iter().flat_map(|gains| {
            FRICTION.map(|friction| Size {
                friction,
                gains,
                gain_ratio,
            })
        });
        let candidate = |size: Size| -> Result<Candidate, CalibrateError> {
            let root = size.root(layout, &prior);
            let changed = &covariance + &root * root.transpose();
            let factor = changed.cholesky().ok_or_else(failed)?;
            let mut precision = factor.inverse();
            let scale_variance = scale
                .as_ref()
                .map_or(0.0, |s| fix_direction(&mut precision, s));
            Ok(Candidate {
                size,
                log_det: -2.0 * factor.l_dirty().diagonal().map(f64::ln).sum(),
                precision,
                scale_variance,
            })
        };
        Ok(Self {
            candidates: sizes.map(candidate).collect::<Result<_, _>>()?,
            layout: layout.clone(),
            prior,
            calibration_root,
            scale,
        })
    }

    /// Returns what the calibration knows, with the changes of the gains of every day.
    pub(crate) fn start(&self) -> Prior {
        Prior {
            precision: self.candidates[0].precision.clone(),
            ..self.prior.clone()
        }
    }

    /// Returns the unknowns of the arm at its calibration with the mean of the change that a
    /// problem's solution shows.
    pub(crate) fn changed(&self, change: &Change, problem: &Problem<'_>, arm: &[f64]) -> Vec<f64> {
        let Prior { mean, scales, .. } = &self.prior;
        let step = DVector::from_fn(arm.len(), |k, _| (arm[k] - mean[k]) / scales[k]);
        let root = change.size.root(&self.layout, &self.prior);
        let of_change = &root * root.tr_mul(&(&problem.prior.precision * step));
        let pairs = mean.iter().zip(scales).zip(&of_change);
        pairs
            .map(|((mean, scale), step)| mean + scale * step)
            .collect()
    }

    /// Returns what the errors of the calibration and its change change in the parameters of a
    /// `payload`, given the change `of_gradient` of the parameters by the gradient of the prior
    /// with the precision of a problem.
    pub(crate) fn errors(
        &self,
        change: &Change,
        (precision, of_gradient): (&DMatrix<f64>, &GainErrors),
        payload: &Vector,
    ) -> ArmErrors {
        let mut of_arm = of_gradient * precision;
        if let Some(scale) = &self.scale {
            // The fixed scale `t = wᵀ e` of an error `e` scales the payload; the rest acts by the
            // fit.
            let product = precision * scale;
            let weights = &product / scale.dot(&product);
            of_arm += (payload - &of_arm * scale) * weights.transpose();
        }
        ArmErrors {
            calibration: &of_arm * &self.calibration_root,
            change: of_arm * change.size.root(&self.layout, &self.prior),
        }
    }

    /// Returns the linearised solution with each change, about some unknowns at which `data` are
    /// the normal equations of a problem, without those that cannot be solved.
    pub(crate) fn solutions<'a>(
        &'a self,
        problem: &Problem<'a>,
        at: &'a Unknowns,
        data: &'a NormalEquations,
    ) -> impl Iterator<Item = (ChangeSolution, &'a Candidate)> + use<'a> {
        let mut problem = problem.clone();
        let solved = self.candidates.iter().map(move |candidate| {
            problem.prior.precision.copy_from(&candidate.precision);
            Some((candidate.solve(&problem, at, data)?, candidate))
        });
        let solved = solved.flatten();
        solved.filter(|(solution, _)| solution.log_evidence.is_finite())
    }

    /// Gives a problem the prior with the change that the recordings make most probable, about some
    /// unknowns at which `data` are their normal equations, and returns it with the variance of the
    /// scale that is fixed.
    pub(crate) fn choose(
        &self,
        problem: &mut Problem<'_>,
        at: &Unknowns,
        data: &NormalEquations,
    ) -> Result<(Change, f64), CalibrateError> {
        let compared: Vec<(f64, &Candidate)> = self
            .solutions(problem, at, data)
            .map(|(solution, candidate)| (solution.log_evidence, candidate))
            .collect();
        let best_of = |is_compared: fn(&Candidate) -> bool| {
            let of = compared
                .iter()
                .filter(|(_, candidate)| is_compared(candidate));
            of.max_by(|a, b| a.0.total_cmp(&b.0)).copied()
        };
        let failed = CalibrateError::unsolvable;
        let (log_evidence, best) = best_of(|_| true).ok_or_else(failed)?;
        let log_evidence = |without: Option<(f64, &Candidate)>| {
            without.map_or(f64::INFINITY, |(other, _)| log_evidence - other)
        };
        problem.prior.precision.copy_from(&best.precision);
        let change = Change {
            size: best.size,
            friction_evidence: log_evidence(best_of(|candidate| candidate.size.friction == 0.0)),
            gain_evidence: log_evidence(best_of(|candidate| !candidate.size.changes_gains())),
        };
        Ok((change, best.scale_variance))
    }
}

/// Fixes a direction of a normal distribution with a precision, and returns its variance.
fn fix_direction(precision: &mut DMatrix<f64>, direction: &DVector<f64>) -> f64 {
    let product = &*precision * direction;
    let of_direction = direction.dot(&product);
    *precision += HELD_PRECISION_RATIO / of_direction * &product * product.transpose();
    1.0 / of_direction
}

impl Candidate {
    /// Solves the linearised equations; `None` where they cannot be solved.
    fn solve(
        &self,
        problem: &Problem<'_>,
        at: &Unknowns,
        data: &NormalEquations,
    ) -> Option<ChangeSolution> {
        let mut normal = data.clone().plus(problem.prior_equations(at));
        for k in problem.arm_len()..problem.len() {
            normal.matrix[(k, k)] += PAYLOAD_PRECISION;
        }
        let factor = normal.matrix.cholesky()?;
        let log_det = 2.0 * factor.l_dirty().diagonal().map(f64::ln).sum();
        let step = factor.solve(&normal.rhs);
        let least_squares = normal.squares - normal.rhs.dot(&step);
        let odds = if self.size.changes_gains() {
            GAIN_ODDS
        } else {
            0.0
        };
        Some(ChangeSolution {
            log_evidence: -0.5 * (least_squares + log_det - self.log_det) - odds,
            step,
            factor,
        })
    }
}
