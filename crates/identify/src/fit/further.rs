//! Unknowns of a wrench beside the parameters and its offset: the weight of a body that was subtracted, and the direction
//! of gravity.
//!
//! Each window has a few more columns for them. Weighted least squares in all unknowns gives the same parameters as least
//! squares in the equations from which these columns are eliminated (Frisch and Waugh 1933; Lovell 1963): regressor and
//! target less the columns times what these explain of both, in the metric of the noise. Everything that follows a fit (the
//! covariance, the history, the validation) then works with ten unknowns, and contains the uncertainty of the further ones.
//! The metric follows from the residuals, and the columns of gravity from the parameters, so that fit and elimination
//! alternate until neither moves.

use std::borrow::Cow;

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector4, Vector6};
use tactid_dynamics::cross;

use super::least_squares::{self, MAX_PASSES};
use super::rows::{DELAY, TARGET};
use super::{CONVERGED_ENOUGH, Fit, FitOptions};
use crate::equations::window::NOISE_CORRELATION;
use crate::equations::{Channels, Equation, Geometry, Row, Unknowns, WRENCH};
use crate::result::{GravityEstimate, WeightEstimate};
use crate::solve::subspace::{EIGENVALUE_RATIO, QUANTITY_FRACTION};

/// The rows of a window: the regressor, the rate of the target in the place of the delay, and the target.
type TableOfRows = SMatrix<f64, 6, 12>;

/// The further unknowns, a row for each: four of a weight, then two of gravity. They are functions of the parameters, with a
/// column for each of a table.
type Explained = SMatrix<f64, 6, 12>;

/// A fit with further unknowns.
pub(crate) struct FurtherFit<'a> {
    /// The fit of the parameters.
    pub(crate) fit: Fit,
    /// The equations of the fit, from which the further unknowns are eliminated; those of the recording where there are none.
    pub(crate) equations: Cow<'a, [Equation]>,
    /// Values of the further unknowns.
    pub(crate) values: FurtherValues,
    /// The last elimination; `None` where there are no further unknowns.
    elimination: Option<Elimination>,
}

impl FurtherFit<'_> {
    /// Returns the options of another fit to the same equations.
    pub(crate) fn options<'a>(&self, channels: &'a Channels) -> FitOptions<'a> {
        FitOptions {
            eliminated: self.values.unknowns.count(),
            ..FitOptions::new(channels)
        }
    }

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
    /// Mass, kg, and first moments, kg m, in the tool frame, of the body whose weight was subtracted.
    pub(crate) weight: Vector4<f64>,
    /// Gravity in the inertial frame, m/s².
    pub(crate) gravity: Vector3<f64>,
    /// Covariance of mass and first moments, infinite on the diagonal of what is not determined.
    pub(crate) weight_covariance: SMatrix<f64, 4, 4>,
    /// Standard deviations of the entries of gravity, m/s²; infinite where the motion does not determine its direction.
    pub(crate) gravity_std_devs: Vector3<f64>,
}

/// Fits the parameters with further unknowns of the wrench, which must be the only source of the equations. `gravity` is the
/// given one. `None` where the equations are too few.
pub(crate) fn fit<'a>(
    equations: &'a [Equation],
    options: FitOptions<'_>,
    gravity: &Vector3<f64>,
    unknowns: Unknowns,
) -> Option<FurtherFit<'a>> {
    let mut values = FurtherValues::new(unknowns, gravity);
    if !unknowns.any() {
        return Some(FurtherFit {
            fit: least_squares::fit(equations, options)?,
            equations: Cow::Borrowed(equations),
            values,
            elimination: None,
        });
    }
    if unknowns.gravity {
        values.gravity = static_gravity(equations, gravity, options.channels);
    }
    let turned =
        |gravity_now: &Vector3<f64>| turned(equations, &(gravity_now - gravity), options.channels);
    let mut found = least_squares::fit(&turned(&values.gravity), options)?;
    let (mut reduced, mut last) = (Vec::new(), None);
    // Residuals of a wrong model can be correlated so closely that whitening by them leaves only rounding errors.
    found.noise = found.noise.without_correlation();
    for pass in 0..MAX_PASSES {
        let turned = turned(&values.gravity);
        let elimination = Elimination::new(&turned, &found, &values, options.channels);
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
    /// Returns the values before anything is known of them, at a given gravity.
    fn new(unknowns: Unknowns, gravity: &Vector3<f64>) -> Self {
        Self {
            unknowns,
            weight: Vector4::zeros(),
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
        })
    }

    /// Sets the values to those that belong to a fit, and returns the step of gravity in standard deviations.
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
            let entry = entries[(k, k)];
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

/// What explains the columns of the further unknowns in a table of all windows.
struct Elimination {
    unknowns: Unknowns,
    gravity: Vector3<f64>,
    /// Projection of a wrench in the tool frame onto what is measured; `None` where all is.
    projection: Option<Matrix6<f64>>,
    explained: Explained,
    /// Inverse of the information of the further unknowns, zero in directions that are not determined.
    inverse: Matrix6<f64>,
    /// Whether the motion determines each unknown at known parameters.
    is_determined: [bool; 6],
    /// Mean columns where the wrenches have an offset, else zero.
    mean_columns: Matrix6<f64>,
}

impl Elimination {
    fn new(equations: &[Equation], fit: &Fit, values: &FurtherValues, channels: &Channels) -> Self {
        let mut elimination = Self {
            unknowns: values.unknowns,
            gravity: values.gravity,
            projection: channels.projection,
            explained: Explained::zeros(),
            inverse: Matrix6::zeros(),
            is_determined: [false; 6],
            mean_columns: Matrix6::zeros(),
        };
        let mean_table = elimination.centre(equations, fit);
        let root = fit.noise.covariance_root();
        let covariance: Matrix6<f64> = (&root * root.transpose()).fixed_view::<6, 6>(0, 0).into();
        let precision = covariance.try_inverse().unwrap_or_else(Matrix6::identity);
        let (mut information, mut products) = (Matrix6::zeros(), Explained::zeros());
        for (equation, weight) in equations.iter().zip(&fit.weights) {
            let columns = elimination.columns(equation, fit) - elimination.mean_columns;
            let table = table(&equation.rows, &equation.rates) - mean_table;
            let weighted = columns.transpose() * precision * *weight;
            information += weighted * columns;
            products += weighted * table;
            // What the noise of the motion adds (Fuller 1987).
            let columns = elimination.noise_columns(equation);
            let weighted = columns.transpose() * precision * *weight;
            information -= weighted * columns;
            products -= weighted * self::table(&equation.differences, &[]);
        }
        (elimination.inverse, elimination.is_determined) = pseudo_inverse(&information);
        elimination.explained = elimination.inverse * products;
        elimination
    }

    /// Computes the mean columns and returns the mean table where the wrenches have an offset.
    fn centre(&mut self, equations: &[Equation], fit: &Fit) -> TableOfRows {
        let mut mean_table = TableOfRows::zeros();
        if fit.offsets.is_none() {
            return mean_table;
        }
        let total = fit.weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        for (equation, weight) in equations.iter().zip(&fit.weights) {
            let fraction = weight / total;
            mean_table += table(&equation.rows, &equation.rates) * fraction;
            self.mean_columns += self.columns(equation, fit) * fraction;
        }
        mean_table
    }

    /// Returns the columns of a window, zero for what is not unknown.
    fn columns(&self, equation: &Equation, fit: &Fit) -> Matrix6<f64> {
        let mut columns = Matrix6::zeros();
        if self.unknowns.weight {
            set_weight(&mut columns, &equation.rows);
        }
        if self.unknowns.gravity
            && let Some(geometry) = Geometry::new(&equation.geometry)
        {
            let in_tool = geometry.tool_from_world() * tangents(&self.gravity);
            for (k, change) in in_tool.column_iter().enumerate() {
                let of_weight = weight_columns(&change.into(), self.projection.as_ref());
                let weight = of_weight * fit.parameters.fixed_rows::<4>(0);
                columns.set_column(4 + k, &-weight);
            }
        }
        columns
    }

    /// Returns the noise of the columns of a window.
    fn noise_columns(&self, equation: &Equation) -> Matrix6<f64> {
        let mut columns = Matrix6::zeros();
        if self.unknowns.weight {
            set_weight(&mut columns, &equation.differences);
        }
        columns
    }

    /// Returns equations without what the further unknowns explain of them. They show no other gravity any more.
    fn reduced(&self, mut equations: Vec<Equation>, fit: &Fit) -> Vec<Equation> {
        for equation in &mut equations {
            let (columns, noise) = (self.columns(equation, fit), self.noise_columns(equation));
            let left = table(&equation.rows, &equation.rates) - columns * self.explained;
            let noise_left = table(&equation.differences, &[]) - noise * self.explained;
            set_rows(&mut equation.rows, &left);
            set_rows(&mut equation.differences, &noise_left);
            equation
                .rates
                .copy_from_slice(left.column(DELAY).as_slice());
        }
        equations
    }

    /// Returns the further unknowns for some parameters.
    fn values(&self, parameters: &SVector<f64, 10>) -> Vector6<f64> {
        self.explained.column(TARGET) - self.explained.fixed_columns::<10>(0) * parameters
    }

    /// Returns the covariance of the further unknowns, infinite on the diagonal of what is not determined.
    fn covariance(&self, fit: &Fit) -> Matrix6<f64> {
        let slopes = self.explained.fixed_columns::<10>(0);
        let mut covariance =
            slopes * fit.covariance * slopes.transpose() + self.inverse * NOISE_CORRELATION;
        for (k, is_determined) in self.is_determined.iter().enumerate() {
            if !is_determined || !fit.null_space.determines(&slopes.row(k).into()) {
                covariance[(k, k)] = f64::INFINITY;
            }
        }
        covariance
    }

    /// Returns the covariance that the further unknowns add to an offset at known parameters.
    fn of_means(&self) -> Matrix6<f64> {
        self.mean_columns * self.inverse * self.mean_columns.transpose() * NOISE_CORRELATION
    }
}

/// Returns the direction in which the weight of the payload acts where accelerations are neglected, with the size of the given
/// gravity: forces are linear in the weight and an offset.
fn static_gravity(
    equations: &[Equation],
    gravity: &Vector3<f64>,
    channels: &Channels,
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
        if let Some(projection) = &channels.projection {
            rows = projection.fixed_view::<3, 3>(0, 0) * rows;
        }
        let force = Vector3::from_fn(|k, _| equation.rows[k].target);
        information += rows.transpose() * rows;
        products += rows.transpose() * force;
    }
    let weight = pseudo_inverse(&information).0 * products;
    let direction = weight.fixed_rows::<3>(0).try_normalize(0.0);
    direction.map_or(*gravity, |direction| direction * gravity.norm())
}

/// Returns two vectors at right angles to gravity and to each other, of its size: the derivatives of gravity with respect to
/// two small angles.
fn tangents(gravity: &Vector3<f64>) -> SMatrix<f64, 3, 2> {
    let other = Vector3::ith(gravity.iamin(), 1.0);
    let first = gravity.cross(&other).normalize() * gravity.norm();
    let second = gravity.cross(&first) / gravity.norm().max(f64::MIN_POSITIVE);
    SMatrix::from_columns(&[first, second])
}

/// Returns what is measured of the wrench that an acceleration, in the tool frame, needs for each kg and each kg m.
fn weight_columns(
    acceleration: &Vector3<f64>,
    projection: Option<&Matrix6<f64>>,
) -> SMatrix<f64, 6, 4> {
    let mut columns = SMatrix::<f64, 6, 4>::zeros();
    columns.fixed_view_mut::<3, 1>(0, 0).copy_from(acceleration);
    columns
        .fixed_view_mut::<3, 3>(3, 1)
        .copy_from(&-cross(acceleration));
    projection.map_or(columns, |projection| projection * columns)
}

/// Returns equations whose gravity differs by a vector in the inertial frame, m/s².
fn turned(equations: &[Equation], change: &Vector3<f64>, channels: &Channels) -> Vec<Equation> {
    let mut equations = equations.to_vec();
    for equation in &mut equations {
        let Some(geometry) = Geometry::new(&equation.geometry) else {
            continue;
        };
        let columns = weight_columns(
            &(geometry.tool_from_world() * change),
            channels.projection.as_ref(),
        );
        for (row, change) in equation.rows.iter_mut().zip(columns.row_iter()) {
            let mut of_weight = row.regressor.fixed_rows_mut::<4>(0);
            of_weight -= change.transpose();
            row.gravity += change.transpose();
        }
    }
    equations
}

/// Copies the columns of a weight from the rows of a window.
fn set_weight(columns: &mut Matrix6<f64>, rows: &[Row]) {
    for (k, row) in rows.iter().enumerate().take(WRENCH) {
        columns
            .fixed_view_mut::<1, 4>(k, 0)
            .copy_from(&row.gravity.transpose());
    }
}

fn table(rows: &[Row], rates: &[f64]) -> TableOfRows {
    TableOfRows::from_fn(|k, column| match column {
        DELAY => rates.get(k).copied().unwrap_or(0.0),
        TARGET => rows[k].target,
        column => rows[k].regressor[column],
    })
}

fn set_rows(rows: &mut [Row], table: &TableOfRows) {
    for (k, row) in rows.iter_mut().enumerate() {
        row.regressor = table.fixed_view::<1, 10>(k, 0).transpose();
        row.target = table[(k, TARGET)];
        row.gravity = Vector4::zeros();
    }
}

/// Returns the inverse of an information matrix, zero in directions that are not determined, and whether each unknown is
/// determined.
fn pseudo_inverse(information: &Matrix6<f64>) -> (Matrix6<f64>, [bool; 6]) {
    let scales = information.diagonal().map(|entry| {
        if entry.is_normal() && entry > 0.0 {
            entry.sqrt().recip()
        } else {
            0.0
        }
    });
    let scaled = Matrix6::from_fn(|i, j| information[(i, j)] * scales[i] * scales[j]);
    let eigen = scaled.symmetric_eigen();
    let (mut inverse, mut undetermined) = (Matrix6::zeros(), Vector6::zeros());
    for (value, direction) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if *value > EIGENVALUE_RATIO {
            inverse += direction * direction.transpose() / *value;
        } else {
            undetermined += direction.component_mul(&direction);
        }
    }
    let is_determined =
        std::array::from_fn(|k| scales[k] > 0.0 && undetermined[k] < QUANTITY_FRACTION);
    let inverse = Matrix6::from_fn(|i, j| inverse[(i, j)] * scales[i] * scales[j]);
    (inverse, is_determined)
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
