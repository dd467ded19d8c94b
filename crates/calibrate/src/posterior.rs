//! The payload of recordings and its uncertainty, with a calibration as the prior of the arm.

use nalgebra::{DMatrix, DVector, SMatrix, SymmetricEigen};
use tactid_batch::GainErrors;
use tactid_batch::solve::{Excitation, Spectrum};
use tactid_identify::KnownMass;
use tactid_identify::solve::{Matrix, NullSpace, Vector};

use super::change::{ArmErrors, Change, Changes};
use super::contradiction::Contradiction;
use super::fit::PAYLOAD_SCALES;
use super::moved_zero::moved_zero;
use super::noise::EffortNoise;
use super::payload::PayloadRow;
use super::recording::EffortRecording;
use super::rows::{EffortModel, Unknowns};
use super::solver::{Block, NormalEquations, Prior, Problem};
use super::student::WIDENING;
use crate::CalibrateError;

/// Numbers of passes: the load-dependent friction and the gains are linearised about the last
/// payload, which the first passes find with the arm as it was at the calibration and enlarged
/// noise. The next ones choose how much the arm has changed, with the noise of the calibration:
/// residuals are explained by a change before they count as noise. The last ones find how much
/// noise remains.
const START_PASSES: usize = 3;
const CHANGE_PASSES: usize = 3;
const LAST_PASSES: usize = 2;

/// A payload, given recordings and what is known of the arm.
#[derive(Clone, Debug)]
pub(crate) struct Posterior {
    /// Parameters of the whole load.
    pub(crate) parameters: Vector,
    /// Covariance of the parameters, zero in unobservable directions.
    pub(crate) covariance: Matrix,
    /// Covariance that would remain if the arm were known exactly.
    pub(crate) noise_covariance: Matrix,
    /// What the errors of the calibration and the change of the arm since change in the parameters.
    /// It is part of the covariance.
    pub(crate) arm_errors: ArmErrors,
    /// What an error of one standard deviation of each independent combination of the unloaded
    /// recordings' noise changes in the parameters; without columns where there are none. It is
    /// part of the covariance.
    pub(crate) unloaded_errors: GainErrors,
    pub(crate) null_space: NullSpace,
    pub(crate) excitation: Excitation,
    /// Mean square of the whitened residual of each joint, with the noise of the calibration.
    pub(crate) misfit: Vec<f64>,
    /// Change of the arm since its calibration.
    pub(crate) change: Change,
    /// Unknowns of the arm.
    pub(crate) arm: Vec<f64>,
    /// The zero of a joint that has moved since, if the recordings show one.
    pub(crate) moved_zero: Option<Contradiction>,
    /// Unknowns of the arm at its calibration with the change since, as far as it is no error of
    /// the calibration.
    pub(crate) changed: Vec<f64>,
}

impl Posterior {
    /// Returns the widened standard deviation of the load's mass, kg; infinite if unobservable.
    pub(super) fn mass_std_dev(&self) -> f64 {
        let gradient = Vector::ith(0, 1.0).transpose();
        if self.null_space.determines(&gradient) {
            WIDENING * self.covariance[(0, 0)].max(0.0).sqrt()
        } else {
            f64::INFINITY
        }
    }
}

/// One step of the unknowns, and the information on the payload.
struct Step {
    step: DVector<f64>,
    spectrum: Spectrum<nalgebra::Const<10>>,
    /// Information on the payload if the arm were known exactly.
    alone: Matrix,
    /// What a unit of each parameter changes in the unknowns of the arm, of the opposite sign;
    /// their step fits the rest.
    coupling: DMatrix<f64>,
}

/// Estimates the payload of the loaded recordings together with the arm. `mass` is the mass of the
/// whole load, where it is known.
pub(crate) fn posterior(
    model: &EffortModel,
    prior: &Prior,
    noise: &[EffortNoise],
    (loaded, unloaded): (&[EffortRecording], &[EffortRecording]),
    mass: Option<KnownMass>,
) -> Result<Posterior, CalibrateError> {
    let block = |recording, payload| Block {
        recording,
        payload,
        windows: (0..EffortRecording::windows(recording)).collect(),
    };
    let loaded = loaded.iter().map(|recording| block(recording, Some(0)));
    let unloaded = unloaded.iter().map(|recording| block(recording, None));
    let mut scales = PAYLOAD_SCALES;
    // An exact mass would otherwise have so much information that the rest would look unobservable.
    scales[0] = mass.map_or(scales[0], |mass| mass.std_dev_kg.min(scales[0]));
    let row = |mass: KnownMass| PayloadRow {
        gradient: Vector::ith(0, 1.0),
        target: mass.mass_kg,
        std_dev: mass.std_dev_kg,
    };
    let mut problem = Problem {
        model,
        blocks: loaded.chain(unloaded).collect(),
        prior: prior.clone(),
        payload_scales: vec![scales],
        payload_rows: vec![mass.map(row).into_iter().collect()],
        scale: None,
    };
    solve(&mut problem, noise, scales)
}

fn solve(
    problem: &mut Problem<'_>,
    noise: &[EffortNoise],
    scales: [f64; 10],
) -> Result<Posterior, CalibrateError> {
    let changes = Changes::new(problem)?;
    problem.prior = changes.start();
    let mut chosen = None;
    let mut at = problem.start();
    let mut misfit = vec![1.0; noise.len()];
    let mut last = None;
    for pass in 0..START_PASSES + CHANGE_PASSES + LAST_PASSES {
        let chooses = (START_PASSES..START_PASSES + CHANGE_PASSES).contains(&pass);
        let factor = |misfit: &f64| if chooses { 1.0 } else { misfit.max(1.0) };
        let factors: Vec<f64> = misfit.iter().map(factor).collect();
        let enlarged = enlarged(noise, &factors);
        let data = problem.data_equations(&at, &enlarged);
        if chooses {
            chosen = Some(changes.choose(problem, &at, &data)?);
        }
        let step = step(problem, &data.plus(problem.prior_equations(&at)))?;
        misfit = problem.misfit(&at, &step.step, &enlarged);
        misfit
            .iter_mut()
            .zip(factors)
            .for_each(|(misfit, factor)| *misfit *= factor);
        problem.add(&mut at, &step.step);
        last = Some((step, enlarged));
    }
    let failed = CalibrateError::unsolvable;
    let (last, enlarged) = last.ok_or_else(failed)?;
    let (change, scale_variance) = chosen.ok_or_else(failed)?;
    if !at.payloads[0].iter().all(|entry| entry.is_finite()) {
        return Err(CalibrateError::unsolvable());
    }
    let scales = Vector::from(scales);
    let of_arm = covariance(&last.spectrum, &scales);
    let of_gradient = of_gradient(&last.coupling, &of_arm, &scales);
    let unloaded_errors = unloaded_errors(problem, &at, &enlarged, &of_gradient);
    let moved_zero = moved_zero(problem, &at, &enlarged, &changes);
    let Unknowns { arm, payloads } = at;
    let of_scale = scale_variance.sqrt() * payloads[0];
    let precision = &problem.prior.precision;
    Ok(Posterior {
        parameters: payloads[0],
        covariance: of_arm + of_scale * of_scale.transpose(),
        arm_errors: changes.errors(&change, (precision, &of_gradient), &payloads[0]),
        unloaded_errors,
        noise_covariance: covariance(&Spectrum::new(last.alone), &scales),
        null_space: last.spectrum.null_space(scales),
        excitation: last.spectrum.excitation(),
        misfit,
        changed: changes.changed(&change, problem, &arm),
        change,
        arm,
        moved_zero,
    })
}

/// Returns the change of the parameters by a unit of each entry of the right-hand side of the arm's
/// normal equations, given the covariance of the parameters.
fn of_gradient(coupling: &DMatrix<f64>, covariance: &Matrix, scales: &Vector) -> GainErrors {
    let in_units = Matrix::from_diagonal(&scales.map(f64::recip));
    let coupling = GainErrors::from_fn(coupling.nrows(), |k, unknown| coupling[(unknown, k)]);
    -(covariance * in_units * coupling)
}

/// Returns the noise of each joint, enlarged by a factor.
fn enlarged(noise: &[EffortNoise], factors: &[f64]) -> Vec<EffortNoise> {
    let pairs = noise.iter().zip(factors);
    pairs
        .map(|(noise, factor)| noise.enlarged(*factor))
        .collect()
}

/// Returns what an error of one standard deviation of each independent combination of the unloaded
/// recordings' noise changes in the parameters, given the change `of_gradient` of [`of_gradient`];
/// no columns without such recordings.
fn unloaded_errors(
    problem: &Problem<'_>,
    at: &Unknowns,
    noise: &[EffortNoise],
    of_gradient: &GainErrors,
) -> GainErrors {
    let blocks = problem.blocks.iter().cloned();
    let blocks: Vec<_> = blocks.filter(|block| block.payload.is_none()).collect();
    if blocks.is_empty() {
        return GainErrors::zeros(0);
    }
    let without_payload = Problem {
        model: problem.model,
        blocks,
        prior: problem.prior.clone(),
        payload_scales: Vec::new(),
        payload_rows: Vec::new(),
        scale: None,
    };
    let at = Unknowns {
        arm: at.arm.clone(),
        payloads: Vec::new(),
    };
    of_gradient * symmetric_root(without_payload.data_equations(&at, noise).matrix)
}

/// Returns the symmetric root of a positive semidefinite matrix. It changes little where the matrix
/// does, so that its columns belong to the same unknowns in solutions with similar noise.
fn symmetric_root(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let mut eigen = SymmetricEigen::new(matrix);
    eigen
        .eigenvalues
        .apply(|value| *value = value.max(0.0).sqrt());
    eigen.recompose()
}

/// Solves the normal equations: the arm, of which something is known, is eliminated, and the
/// payload moves in observable directions.
fn step(problem: &Problem<'_>, normal: &NormalEquations) -> Result<Step, CalibrateError> {
    let count = problem.arm_len();
    let of_arm = normal.matrix.view((0, 0), (count, count)).into_owned();
    let factor = of_arm.cholesky().ok_or_else(CalibrateError::unsolvable)?;
    let coupling: DMatrix<f64> = normal.matrix.view((0, count), (count, 10)).into_owned();
    let solved = factor.solve(&coupling);
    let arm_alone = factor.solve(&normal.rhs.rows(0, count).into_owned());
    let alone: Matrix = SMatrix::from_fn(|i, k| normal.matrix[(count + i, count + k)]);
    let eliminated = coupling.tr_mul(&solved);
    let information = alone - Matrix::from_fn(|i, k| eliminated[(i, k)]);
    let target = coupling.tr_mul(&arm_alone);
    let target = Vector::from_fn(|k, _| normal.rhs[count + k] - target[k]);
    let spectrum = Spectrum::new(0.5 * (information + information.transpose()));
    let payload: Vector = spectrum
        .observable()
        .map(|(information, direction)| direction * (direction.dot(&target) / information))
        .sum();
    let arm = arm_alone - &solved * DVector::from_column_slice(payload.as_slice());
    let step = arm.iter().chain(payload.iter()).copied();
    Ok(Step {
        step: DVector::from_iterator(count + 10, step),
        spectrum,
        alone,
        coupling: solved,
    })
}

/// Returns the covariance of an information of scaled parameters, zero in unobservable directions.
fn covariance(spectrum: &Spectrum<nalgebra::Const<10>>, scales: &Vector) -> Matrix {
    let terms = spectrum.observable().map(|(information, direction)| {
        let direction = direction.component_mul(scales);
        direction * direction.transpose() / information
    });
    terms.sum()
}
