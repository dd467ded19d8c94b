//! Elimination of the further unknowns of a wrench from the equations of its windows.

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector4, Vector6};
use tactid_identify::equations::window::NOISE_CORRELATION;
use tactid_identify::equations::{
    Channels, Equation, Geometry, Row, Unknowns, WRENCH, acceleration_columns,
};
use tactid_identify::solve::{EIGENVALUE_RATIO, QUANTITY_FRACTION};

use super::Fit;
use super::rows::{DELAY, TARGET};

/// The rows of a window: the regressor, the rate of the target in the place of the delay, and the
/// target.
type TableOfRows = SMatrix<f64, 6, 12>;

/// The further unknowns, a row for each: four of a weight, then two of gravity. They are functions
/// of the parameters, with a column for each of a table.
type Explained = SMatrix<f64, 6, 12>;

/// What explains the columns of the further unknowns in a table of all windows.
pub(super) struct Elimination {
    unknowns: Unknowns,
    pub(super) gravity: Vector3<f64>,
    /// Projection of a wrench in the tool frame onto what is measured; `None` where all is.
    projection: Option<Matrix6<f64>>,
    explained: Explained,
    /// Inverse of the information of the further unknowns, zero in directions that are not
    /// determined.
    inverse: Matrix6<f64>,
    /// Whether the motion determines each unknown at known parameters.
    is_determined: [bool; 6],
    /// Mean columns where the wrenches have an offset, else zero.
    mean_columns: Matrix6<f64>,
}

impl Elimination {
    pub(super) fn new(
        equations: &[Equation],
        fit: &Fit,
        (unknowns, gravity): (Unknowns, &Vector3<f64>),
        channels: &Channels,
    ) -> Self {
        let mut elimination = Self {
            unknowns,
            gravity: *gravity,
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
        (elimination.inverse, elimination.is_determined) = inverse_of_determined(&information);
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

    /// Returns equations without what the further unknowns explain of them. They show no other
    /// gravity any more.
    pub(super) fn reduced(&self, mut equations: Vec<Equation>, fit: &Fit) -> Vec<Equation> {
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
    pub(super) fn values(&self, parameters: &SVector<f64, 10>) -> Vector6<f64> {
        self.explained.column(TARGET) - self.explained.fixed_columns::<10>(0) * parameters
    }

    /// Returns the covariance of the further unknowns, infinite on the diagonal of what is not
    /// determined.
    pub(super) fn covariance(&self, fit: &Fit) -> Matrix6<f64> {
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
    pub(super) fn of_means(&self) -> Matrix6<f64> {
        self.mean_columns * self.inverse * self.mean_columns.transpose() * NOISE_CORRELATION
    }
}

/// Returns two vectors at right angles to gravity and to each other, of its size: the derivatives
/// of gravity with respect to two small angles.
pub(crate) fn tangents(gravity: &Vector3<f64>) -> SMatrix<f64, 3, 2> {
    let other = Vector3::ith(gravity.iamin(), 1.0);
    let first = gravity.cross(&other).normalize() * gravity.norm();
    let second = gravity.cross(&first) / gravity.norm().max(f64::MIN_POSITIVE);
    SMatrix::from_columns(&[first, second])
}

/// Returns what is measured of the wrench that an acceleration, in the tool frame, needs for each
/// kg and each kg m.
pub(super) fn weight_columns(
    acceleration: &Vector3<f64>,
    projection: Option<&Matrix6<f64>>,
) -> SMatrix<f64, 6, 4> {
    let columns = acceleration_columns(acceleration);
    projection.map_or(columns, |projection| projection * columns)
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

/// Returns the inverse of an information matrix, zero in directions that are not determined, and
/// whether each unknown is determined.
pub(super) fn inverse_of_determined(information: &Matrix6<f64>) -> (Matrix6<f64>, [bool; 6]) {
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
