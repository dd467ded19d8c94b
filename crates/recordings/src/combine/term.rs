//! Points with weights and errors, and their weighted mean.

use std::collections::BTreeMap;

use tactid_batch::solve::{PseudoInverse, pseudo_inverse};
use tactid_batch::{GainErrors, LinearEstimate};
use tactid_identify::solve::{Matrix, Vector};

/// A point in the ten parameters with its weight and its errors: what one run says, or several
/// together.
#[derive(Clone, Debug)]
pub(crate) struct Term {
    pub(crate) at: Vector,
    /// Information, which is its weight among others.
    pub(crate) weight: Matrix,
    /// Covariance of the errors that no other term shares.
    pub(crate) covariance: Matrix,
    /// Changes by unknowns that terms share, a column for each; all terms have the same columns.
    pub(crate) changes: GainErrors,
    /// Degrees of freedom from which the covariance was estimated.
    pub(crate) degrees_of_freedom: f64,
}

impl Term {
    /// Returns the terms of runs. Unknowns that no two runs share become part of the covariance.
    pub(crate) fn of_runs(runs: &[LinearEstimate]) -> Vec<Self> {
        let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
        for unknown in runs.iter().flat_map(|run| &run.shared.unknowns) {
            *counts.entry(*unknown).or_default() += 1;
        }
        let shared = counts.iter().filter(|(_, count)| **count > 1);
        let places: BTreeMap<u64, usize> = shared
            .enumerate()
            .map(|(k, (&unknown, _))| (unknown, k))
            .collect();
        let term = |run: &LinearEstimate| {
            let mut term = Self {
                at: run.parameters,
                weight: run.information,
                covariance: run.covariance,
                changes: GainErrors::zeros(places.len()),
                degrees_of_freedom: run.degrees_of_freedom,
            };
            let columns = run.shared.changes.column_iter();
            for (unknown, change) in run.shared.unknowns.iter().zip(columns) {
                match places.get(unknown) {
                    Some(&place) => term.changes.set_column(place, &change),
                    None => term.covariance += change * change.transpose(),
                }
            }
            term
        };
        runs.iter().map(term).collect()
    }

    /// Returns what a term says about one quantity with this `gradient` in the parameters, as the
    /// first parameter: its change from the parameters `from`, given the `inverse` of the weight.
    /// `None` where the term does not determine it.
    pub(crate) fn of_quantity(
        &self,
        inverse: &PseudoInverse,
        gradient: &nalgebra::RowSVector<f64, 10>,
        from: &Vector,
    ) -> Option<Self> {
        if !inverse.null_space.determines(gradient) {
            return None;
        }
        let model = (gradient * inverse.covariance * gradient.transpose())[0];
        let variance = (gradient * self.covariance * gradient.transpose())[0];
        let first = |entry: f64| {
            let mut matrix = Matrix::zeros();
            matrix[(0, 0)] = entry;
            matrix
        };
        let mut changes = GainErrors::zeros(self.changes.ncols());
        changes.row_mut(0).copy_from(&(gradient * &self.changes));
        Some(Self {
            at: Vector::ith(0, (gradient * (self.at - from))[0]),
            weight: first(model.max(f64::MIN_POSITIVE).recip()),
            covariance: first(variance),
            changes,
            degrees_of_freedom: self.degrees_of_freedom,
        })
    }
}

/// The weighted mean of terms.
#[derive(Clone, Debug)]
pub(crate) struct Pooled {
    /// The mean: a term of its own, whose covariance is zero in unobservable directions.
    pub(crate) term: Term,
    /// Inverse of the weight.
    pub(crate) inverse: PseudoInverse,
}

impl Pooled {
    /// Returns the parameters that minimise the sum of `(π - πᵢ)ᵀ Aᵢ (π - πᵢ)` over points with
    /// weights `Aᵢ`, with the covariance `Σ Wᵢ Nᵢ Wᵢᵀ` of the mean with shares `Wᵢ = (Σ A)⁻¹ Aᵢ` of
    /// terms with covariances `Nᵢ`.
    pub(crate) fn new<'a>(terms: impl Iterator<Item = &'a Term> + Clone) -> Self {
        let weight: Matrix = terms.clone().map(|term| term.weight).sum();
        let inverse = pseudo_inverse(&weight);
        let bread = inverse.covariance;
        // The second pass corrects what cancellation in the first one leaves.
        let mut at = Vector::zeros();
        for _ in 0..2 {
            let gradients = terms.clone().map(|term| term.weight * (term.at - at));
            let gradient: Vector = gradients.sum();
            at += bread * gradient;
        }
        let columns = terms.clone().next().map_or(0, |term| term.changes.ncols());
        let (mut meat, mut changes) = (Matrix::zeros(), GainErrors::zeros(columns));
        let mut degrees_of_freedom = 0.0;
        for term in terms {
            meat += term.weight * term.covariance * term.weight;
            changes += term.weight * &term.changes;
            degrees_of_freedom += term.degrees_of_freedom;
        }
        Self {
            term: Term {
                at,
                weight,
                covariance: bread * meat * bread,
                changes: bread * changes,
                degrees_of_freedom,
            },
            inverse,
        }
    }

    /// Returns the covariance of the parameters, with the errors that the terms share.
    pub(crate) fn covariance(&self) -> Matrix {
        self.term.covariance + &self.term.changes * self.term.changes.transpose()
    }
}
