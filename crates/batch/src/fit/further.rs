//! Unknowns of a wrench beside the parameters and its offset: the weight of a body that was
//! subtracted, and the direction of gravity. Where both are unknown, the weight was subtracted
//! along gravity or, by a controller that does not know how its base is mounted, along the given
//! one: the better of two fits is right.
//!
//! Each window has a few more columns for them. Weighted least squares in all unknowns gives the
//! same parameters as least squares in the equations from which these columns are eliminated
//! (Frisch and Waugh 1933; Lovell 1963): regressor and target less the columns times what these
//! explain of both, in the metric of the noise. Everything that follows a fit (the covariance, the
//! history, the validation) then works with ten unknowns, and contains the uncertainty of the
//! further ones. The metric follows from the residuals, and the columns of gravity from the
//! parameters, so that fit and elimination alternate until neither moves.

use std::borrow::Cow;

use nalgebra::{Matrix6, SMatrix, Vector3, Vector4, Vector6};
use tactid_identify::equations::{Channels, Equation, Geometry, Unknowns};

use super::elimination::{Elimination, inverse_of_determined, tangents, weight_columns};
use super::least_squares::{self, MAX_PASSES};
use super::{CONVERGED_ENOUGH, Fit, FitOptions};
use crate::{GravityEstimate, WeightEstimate};

/// A fit with further unknowns.
pub(crate) struct FurtherFit<'a> {
    /// The fit of the parameters.
    pub(crate) fit: Fit,
    /// The equations of the fit, from which the further unknowns are eliminated; those of the
    /// recording where there are none.
    pub(crate) equations: Cow<'a, [Equation]>,
    /// Values of the further unknowns.
    pub(crate) values: FurtherValues,
    /// The last elimination; `None` where there are no further unknowns.
    elimination: Option<Elimination>,
}

impl FurtherFit<'_> {
    /// Returns the further unknowns that belong to another fit to the same equations.
    pub(crate) fn values_of(&self, fit: &Fit) -> FurtherValues {
        let mut values = self.values.clone();
        if let Some(elimination) = &self.elimination {
            values.gravity = elimination.gravity;
            values.follow(elimination, fit);
        }
        values
    }
}

/// Values of the further unknowns. What is none has the given value.
#[derive(Clone, Debug)]
pub(crate) struct FurtherValues {
    pub(crate) unknowns: Unknowns,
    /// Mass, kg, and first moments, kg m, in the tool frame, of the body whose weight was
    /// subtracted.
    pub(crate) weight: Vector4<f64>,
    /// The given gravity, m/s², if the weight was subtracted along it instead of along gravity.
    pub(crate) along: Option<Vector3<f64>>,
    /// Gravity in the inertial frame, m/s².
    pub(crate) gravity: Vector3<f64>,
    /// Covariance of mass and first moments, infinite on the diagonal of what is not determined.
    pub(crate) weight_covariance: SMatrix<f64, 4, 4>,
    /// Standard deviations of the entries of gravity, m/s²; infinite where the motion does not
    /// determine its direction.
    pub(crate) gravity_std_devs: Vector3<f64>,
}

/// Fits the parameters with further unknowns of the wrench, which must be the only source of the
/// equations. `gravity` is the given one. `None` where the equations are too few.
pub(crate) fn fit<'a>(
    equations: &'a [Equation],
    options: FitOptions<'_>,
    gravity: &Vector3<f64>,
    unknowns: Unknowns,
) -> Option<FurtherFit<'a>> {
    if !unknowns.any() {
        return Some(FurtherFit {
            fit: least_squares::fit(equations, options)?,
            equations: Cow::Borrowed(equations),
            values: FurtherValues::new(unknowns, gravity),
            elimination: None,
        });
    }
    let along_gravity = fit_along(equations, options, gravity, unknowns, None)?;
    if !(unknowns.weight && unknowns.gravity) {
        return Some(along_gravity);
    }
    let size = |found: &FurtherFit| found.fit.noise.covariance_root().diagonal().product();
    let along_given = fit_along(equations, options, gravity, unknowns, Some(*gravity));
    let better = along_given.filter(|found| size(found) < size(&along_gravity));
    better.or(Some(along_gravity))
}

/// Fits with a weight that acts along the given gravity, if there is one, else along gravity, and
/// with an unknown beside the parameters at least.
fn fit_along<'a>(
    equations: &'a [Equation],
    options: FitOptions<'_>,
    gravity: &Vector3<f64>,
    unknowns: Unknowns,
    along: Option<Vector3<f64>>,
) -> Option<FurtherFit<'a>> {
    let mut values = FurtherValues::new(unknowns, gravity);
    values.along = along;
    let projection = options.channels.projection.as_ref();
    // A weight along the given gravity would hide that of the payload.
    if unknowns.gravity && along.is_none() {
        values.gravity = static_gravity(equations, gravity, projection);
    }
    let turned =
        |now: &Vector3<f64>| turned(equations, &(now - gravity), projection, along.is_none());
    let mut found = least_squares::fit(&turned(&values.gravity), options)?;
    let (mut reduced, mut last) = (Vec::new(), None);
    // Residuals of a wrong model can be correlated so closely that whitening by them leaves only
    // rounding errors.
    found.noise = found.noise.without_correlation();
    for pass in 0..MAX_PASSES {
        let turned = turned(&values.gravity);
        let elimination = Elimination::new(
            &turned,
            &found,
            (unknowns, &values.gravity),
            options.channels,
        );
        reduced = elimination.reduced(turned, &found);
        // The noise of the first fit is mostly what the further unknowns explain.
        let options = FitOptions {
            start: (pass > 0).then_some(&found),
            eliminated: unknowns.count(),
            ..options
        };
        let mut next = least_squares::fit(&reduced, options)?;
        let step = values
            .follow(&elimination, &next)
            .max(distance(&found, &next));
        if let Some(offsets) = &mut next.offsets {
            offsets.add_covariance(&elimination.of_means());
        }
        found = next;
        last = Some(elimination);
        if pass > 0 && step < CONVERGED_ENOUGH {
            break;
        }
    }
    Some(FurtherFit {
        fit: found,
        equations: Cow::Owned(reduced),
        values,
        elimination: last,
    })
}

impl FurtherValues {
    /// Returns the options of another fit to the equations without these unknowns.
    pub(crate) fn options<'a>(&self, channels: &'a Channels) -> FitOptions<'a> {
        FitOptions {
            eliminated: self.unknowns.count(),
            ..FitOptions::new(channels)
        }
    }

    /// Returns the values before anything is known of them, at a given gravity.
    fn new(unknowns: Unknowns, gravity: &Vector3<f64>) -> Self {
        Self {
            unknowns,
            weight: Vector4::zeros(),
            along: None,
            gravity: *gravity,
            weight_covariance: SMatrix::zeros(),
            gravity_std_devs: Vector3::zeros(),
        }
    }

    /// Returns gravity, where its direction was unknown.
    pub(crate) fn gravity_estimate(&self) -> Option<GravityEstimate> {
        self.unknowns.gravity.then(|| GravityEstimate {
            values: self.gravity.into(),
            std_devs: self.gravity_std_devs.into(),
        })
    }

    /// Returns the body whose weight was subtracted, where it was unknown.
    pub(crate) fn weight_estimate(&self) -> Option<WeightEstimate> {
        let (mass_kg, covariance) = (self.weight[0], &self.weight_covariance);
        let center = self.weight.fixed_rows::<3>(1) / mass_kg;
        let variance = |k: usize| {
            let mut slopes = SMatrix::<f64, 1, 4>::zeros();
            (slopes[0], slopes[k]) = (-center[k - 1] / mass_kg, mass_kg.recip());
            (slopes * covariance * slopes.transpose())[0]
        };
        let std_dev = |variance: f64| {
            if variance.is_finite() {
                variance.max(0.0).sqrt()
            } else {
                f64::INFINITY
            }
        };
        self.unknowns.weight.then(|| WeightEstimate {
            values: [mass_kg, center[0], center[1], center[2]],
            std_devs: [covariance[(0, 0)], variance(1), variance(2), variance(3)].map(std_dev),
            along_m_s2: self.along.map(Into::into),
        })
    }

    /// Sets the values to those that belong to a fit, and returns the step of gravity in standard
    /// deviations.
    fn follow(&mut self, elimination: &Elimination, fit: &Fit) -> f64 {
        let values = elimination.values(&fit.parameters);
        let covariance = elimination.covariance(fit);
        self.weight = values.fixed_rows::<4>(0).into();
        self.weight_covariance = covariance.fixed_view::<4, 4>(0, 0).into();
        let angles = values.fixed_rows::<2>(4);
        let of_angles = covariance.fixed_view::<2, 2>(4, 4);
        let size = self.gravity.norm();
        let tangents = tangents(&self.gravity);
        self.gravity = (self.gravity + tangents * angles).normalize() * size;
        let entries = tangents * of_angles * tangents.transpose();
        // An infinite variance of an angle times a zero entry of a tangent is none.
        let variance = |k: usize| {
            let entry = entries[(k, k)] + of_second_order(self.gravity[k], of_angles.trace());
            if entry.is_nan() { f64::INFINITY } else { entry }
        };
        self.gravity_std_devs = Vector3::from_fn(|k, _| variance(k).max(0.0).sqrt());
        let squares = (0..2).map(|k| {
            let variance = of_angles[(k, k)];
            if variance > 0.0 {
                angles[k].powi(2) / variance
            } else {
                0.0
            }
        });
        squares.sum::<f64>().sqrt()
    }
}

/// Returns the variance of an entry of gravity, m²/s⁴, of second order in two angles with this sum
/// of variances, rad²: gravity turns away from where it is, by half of their square.
pub(crate) fn of_second_order(entry: f64, variance: f64) -> f64 {
    0.75 * (entry * variance).powi(2)
}

/// Returns the direction in which the weight of the payload acts where accelerations are neglected,
/// with the size of the given gravity: forces are linear in the weight and an offset.
pub(crate) fn static_gravity(
    equations: &[Equation],
    gravity: &Vector3<f64>,
    projection: Option<&Matrix6<f64>>,
) -> Vector3<f64> {
    let (mut information, mut products) = (Matrix6::zeros(), Vector6::zeros());
    for equation in equations {
        let Some(geometry) = Geometry::new(&equation.geometry) else {
            continue;
        };
        let mut rows = SMatrix::<f64, 3, 6>::identity();
        rows.fixed_columns_mut::<3>(0)
            .copy_from(&-geometry.tool_from_world());
        rows.fixed_columns_mut::<3>(3).fill_with_identity();
        if let Some(projection) = projection {
            rows = projection.fixed_view::<3, 3>(0, 0) * rows;
        }
        let force = Vector3::from_fn(|k, _| equation.rows[k].target);
        information += rows.transpose() * rows;
        products += rows.transpose() * force;
    }
    let weight = inverse_of_determined(&information).0 * products;
    let direction = weight.fixed_rows::<3>(0).try_normalize(0.0);
    direction.map_or(*gravity, |direction| direction * gravity.norm())
}

/// Returns equations whose gravity differs by a vector in the inertial frame, m/s², and with it, if
/// it `turns_weight`, that of a weight that was subtracted.
pub(crate) fn turned(
    equations: &[Equation],
    change: &Vector3<f64>,
    projection: Option<&Matrix6<f64>>,
    turns_weight: bool,
) -> Vec<Equation> {
    let mut equations = equations.to_vec();
    for equation in &mut equations {
        let Some(geometry) = Geometry::new(&equation.geometry) else {
            continue;
        };
        let columns = weight_columns(&(geometry.tool_from_world() * change), projection);
        for (row, change) in equation.rows.iter_mut().zip(columns.row_iter()) {
            let mut of_weight = row.regressor.fixed_rows_mut::<4>(0);
            of_weight -= change.transpose();
            if turns_weight {
                row.gravity += change.transpose();
            }
        }
    }
    equations
}

/// Returns the largest difference of a parameter of two fits, in standard deviations.
fn distance(before: &Fit, after: &Fit) -> f64 {
    let steps = (0..10).map(|k| {
        let variance = after.covariance[(k, k)];
        let step = after.parameters[k] - before.parameters[k];
        if variance > 0.0 {
            step.abs() / variance.sqrt()
        } else {
            0.0
        }
    });
    steps.fold(0.0, f64::max)
}
