//! What marginalised measurements say of the motion that follows.

use nalgebra::{DMatrix, DVector, SVector};

use super::bordered::Bordered;
use super::spline::order;

/// Returns the number of columns of the border: the parameters and the targets.
fn border() -> usize {
    SVector::<f64, 11>::zeros().len()
}

/// What rows whose splines were marginalised out say of the splines that overlap with them, of the
/// parameters, and of the targets: their information, for changes from present values.
#[derive(Clone, Debug)]
pub(super) struct MarginalPrior {
    /// Number of coordinates.
    coordinates: usize,
    /// Information on the coefficients of the splines, the parameters, and last the targets, of
    /// which only the column counts.
    information: DMatrix<f64>,
    /// Values of the coefficients and the parameters, from which changes count.
    present: DVector<f64>,
}

impl MarginalPrior {
    /// Creates the prior before the first measurement of so many coordinates: nothing is known.
    pub(super) fn new(coordinates: usize) -> Self {
        let splines = (order() - 1) * coordinates;
        Self {
            coordinates,
            information: DMatrix::zeros(splines + border(), splines + border()),
            present: DVector::zeros(splines + border() - 1),
        }
    }

    /// Number of coefficients.
    pub(super) fn coefficients(&self) -> usize {
        self.information.nrows() - border()
    }

    /// Moves the point from which changes count. `coefficients` begin with those of the prior.
    pub(super) fn move_to(&mut self, coefficients: &[f64], parameters: &SVector<f64, 10>) {
        let count = self.coefficients();
        let coefficients = coefficients.iter().take(count);
        let present = coefficients.chain(parameters.iter()).copied();
        let present = DVector::from_iterator(count + border() - 1, present);
        let last = self.information.nrows() - 1;
        let moved = self.information.view((0, 0), (last, last)) * (&present - &self.present);
        let mut targets = self.information.view_mut((0, last), (last, 1));
        targets -= moved;
        self.present = present;
    }

    /// Adds the information to normal equations: that on splines to the matrix where `with_matrix`
    /// says so, and to its border, and that on parameters alone to `direct`.
    pub(super) fn add_to(
        &self,
        system: &mut Bordered,
        direct: &mut DMatrix<f64>,
        with_matrix: bool,
    ) {
        let count = self.coefficients();
        if with_matrix {
            let of_splines = self.information.view((0, 0), (count, count));
            system.add(0, &of_splines.into_owned());
        }
        let of_border = self.information.view((0, count), (count, border()));
        system.add_to_border(0, &of_border.into_owned());
        *direct += self.information.view((count, count), (border(), border()));
    }

    /// Adds rows of the interval of which the splines are the first, by its splines and the border,
    /// and marginalises out the first spline. `next` are the coefficients of its last spline. `None`
    /// where the rows do not determine the first one.
    pub(super) fn advance(&mut self, rows: &[DMatrix<f64>], next: &[f64]) -> Option<()> {
        let count = self.coefficients();
        let present = self.present.as_slice();
        let (splines, parameters) = present.split_at(count);
        let later = splines[self.coordinates..].iter().chain(next);
        let present = DVector::from_iterator(present.len(), later.chain(parameters).copied());
        let information = std::mem::take(&mut self.information);
        let mut sum = information.insert_rows(count, self.coordinates, 0.0);
        sum = sum.insert_columns(count, self.coordinates, 0.0);
        for rows in rows {
            sum.gemm_tr(1.0, rows, rows, 1.0);
        }
        self.information = marginalise_first(&sum, self.coordinates)?;
        self.present = present;
        Some(())
    }

    /// Marginalises out all splines: a gap follows. `None` where the rows do not determine them.
    pub(super) fn end_stretch(&mut self) -> Option<()> {
        let count = self.coefficients();
        let left = marginalise_first(&self.information, count)?;
        self.information.fill(0.0);
        let mut place = self
            .information
            .view_mut((count, count), (border(), border()));
        place.copy_from(&left);
        Some(())
    }
}

/// Returns what an information says of all unknowns but the first ones; `None` where it does not
/// determine these.
fn marginalise_first(information: &DMatrix<f64>, count: usize) -> Option<DMatrix<f64>> {
    let others = information.nrows() - count;
    let factor = information.view((0, 0), (count, count)).cholesky()?;
    let mut half = information.view((0, count), (count, others)).into_owned();
    factor.l_dirty().solve_lower_triangular_mut(&mut half);
    let mut left = information
        .view((count, count), (others, others))
        .into_owned();
    left.gemm_tr(-1.0, &half, &half, 1.0);
    Some(left)
}
