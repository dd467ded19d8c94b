//! What the shape of a payload adds to what recordings say.

use nalgebra::{SMatrix, SVector, SymmetricEigen};
use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::GainErrors;
use tactid_batch::distributions::f_p;
use tactid_batch::solve::{PseudoInverse, pseudo_inverse, with_variance};
use tactid_identify::serial::TenValues;
use tactid_identify::solve::{Matrix, Vector};
use tactid_identify::solve::{is_mass_known, value_jacobian};
use tactid_shapes::ShapePrior;

use super::term::{Pooled, Term};

/// Probability of the distance between measurements and shape below which they contradict each
/// other.
const RARE: f64 = 0.01;

/// Passes over the mass, by which the information of a shape is divided: each reduces its error by
/// the fraction of the information on the mass that is the shape's.
const PASSES: usize = 3;

/// Smallest variance of a direction of a shape, relative to the largest in units of the standard
/// deviations: rounding.
const ROUNDING: f64 = 1e-10;

/// What the shape of the payload contributed to an estimate.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ShapeFit {
    /// Fraction of the information on each of the [ten values](crate::VALUE_NAMES) that is the
    /// shape's, without a unit: 0 where the measurements alone determine the value, 1 where they
    /// say nothing of it, and 0 where the shape is not used.
    #[schemars(with = "TenValues<f64>")]
    pub fraction: [f64; 10],
    /// Whether the estimate uses the shape: not where the measurements contradict it, or do not
    /// determine the mass.
    pub is_used: bool,
    /// Squared distance of the measurements from the shape, weighted by the information of the
    /// measurements and the inverse covariance of the shape, without a unit. Its mean is the degrees of
    /// freedom if the shape is that of the payload.
    pub chi_square: f64,
    /// Degrees of freedom of the distance: the number of directions that both determine.
    pub degrees_of_freedom: f64,
    /// Probability of at least this distance if the shape is that of the payload, without a unit.
    /// Below 1 %, the measurements contradict the shape.
    pub p_value: f64,
    /// What the shape says of the centre of mass and the inertia.
    #[schemars(extend("kept" = "memory"))]
    pub prior: ShapePrior,
}

impl ShapeFit {
    /// Returns whether the measurements contradict the shape.
    pub(crate) fn is_contradicted(&self) -> bool {
        self.p_value < RARE
    }
}

/// Returns the mean of what recordings say and of a shape, as far as the shape is used, and what it
/// contributes. `constant` is the part of the covariance of `data` that is not in its weight.
///
/// A shape says nothing of the mass: its nine rows `A π = 0`, `A = [-φ, 1]`, have the covariance
/// `m² Σ`, where `φ` and `Σ` are the mean and the covariance of the prior.
pub(super) fn with_shape(
    data: &Pooled,
    constant: &Matrix,
    prior: &ShapePrior,
) -> (Pooled, ShapeFit) {
    let mut fit = ShapeFit {
        fraction: [0.0; 10],
        is_used: false,
        chi_square: 0.0,
        degrees_of_freedom: 0.0,
        p_value: 1.0,
        prior: *prior,
    };
    let of_data = of_data(data, constant);
    let alone = pseudo_inverse(&of_data.weight);
    let mut mass_kg = of_data.at[0];
    let gradient = Vector::ith(0, 1.0).transpose();
    let std_dev_kg = of_data.covariance[(0, 0)].sqrt();
    let is_determined = alone.null_space.determines(&gradient);
    if !is_determined || mass_kg <= 0.0 || !is_mass_known(mass_kg, std_dev_kg) {
        return (data.clone(), fit);
    }
    let mut of_shape = of_shape(prior, mass_kg);
    let mut both = Pooled::new([&of_data, &of_shape].into_iter());
    for _ in 1..PASSES {
        mass_kg = both.term.at[0];
        of_shape = self::of_shape(prior, mass_kg);
        both = Pooled::new([&of_data, &of_shape].into_iter());
    }
    let distance = |term: &Term| {
        let difference = term.at - both.term.at;
        (difference.transpose() * term.weight * difference)[0]
    };
    let rank = |inverse: &PseudoInverse| 10.0 - inverse.null_space.directions().len() as f64;
    fit.chi_square = distance(&of_data) + distance(&of_shape);
    fit.degrees_of_freedom = rank(&alone) + 9.0 - rank(&both.inverse);
    let of_noise = of_data.degrees_of_freedom;
    fit.p_value = f_p(fit.chi_square, fit.degrees_of_freedom, of_noise);
    if fit.is_contradicted() {
        return (data.clone(), fit);
    }
    fit.is_used = true;
    fit.fraction = fractions(&alone, &both);
    (both, fit)
}

/// Returns what recordings say as one term, whose weight knows all of its errors.
fn of_data(data: &Pooled, constant: &Matrix) -> Term {
    let weight = match *constant == Matrix::zeros() {
        true => data.term.weight,
        false => with_variance(&data.term.weight, constant),
    };
    Term {
        weight,
        covariance: data.covariance(),
        changes: GainErrors::zeros(0),
        ..data.term.clone()
    }
}

/// Returns what a shape says of a body with this mass.
fn of_shape(prior: &ShapePrior, mass_kg: f64) -> Term {
    let mean = SVector::from(prior.mean);
    let variance = SMatrix::<f64, 9, 9>::from(prior.covariance) * mass_kg.powi(2);
    let inverse = inverse(&variance);
    let mut rows = SMatrix::<f64, 9, 10>::zeros();
    rows.set_column(0, &-mean);
    rows.fixed_columns_mut::<9>(1).fill_with_identity();
    // Its rows have the variance of the shape, whatever it is along the others.
    let mut covariance = Matrix::zeros();
    covariance.fixed_view_mut::<9, 9>(1, 1).copy_from(&variance);
    Term {
        at: mean.insert_row(0, 1.0) * mass_kg,
        weight: rows.transpose() * inverse * rows,
        covariance,
        changes: GainErrors::zeros(0),
        degrees_of_freedom: 0.0,
    }
}

/// Returns the inverse of a covariance.
fn inverse(covariance: &SMatrix<f64, 9, 9>) -> SMatrix<f64, 9, 9> {
    let scales = covariance.diagonal().map(f64::sqrt);
    let products = scales * scales.transpose();
    let mut eigen = SymmetricEigen::new(covariance.component_div(&products));
    let least = ROUNDING * eigen.eigenvalues.max();
    eigen
        .eigenvalues
        .apply(|variance| *variance = variance.max(least).recip());
    eigen.recompose().component_div(&products)
}

/// Returns the fraction of the information on each of the ten values that the measurements `alone`
/// do not have.
fn fractions(alone: &PseudoInverse, both: &Pooled) -> [f64; 10] {
    let Some(slopes) = value_jacobian(&both.term.at) else {
        return [0.0; 10];
    };
    std::array::from_fn(|k| {
        let gradient = slopes.row(k).into_owned();
        let variance = |of: &PseudoInverse| {
            let is_determined = of.null_space.determines(&gradient);
            let variance = (gradient * of.covariance * gradient.transpose())[0];
            if is_determined {
                variance
            } else {
                f64::INFINITY
            }
        };
        let (before, after) = (variance(alone), variance(&both.inverse));
        match before > 0.0 && after.is_finite() {
            true => (1.0 - after / before).clamp(0.0, 1.0),
            false => 0.0,
        }
    })
}
