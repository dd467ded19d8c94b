//! The information of the rows without the motion's noise, and the directions that it leaves unknown.

use nalgebra::{SMatrix, SVector};

pub(crate) type Matrix = SMatrix<f64, 10, 10>;
pub(crate) type Vector = SVector<f64, 10>;

/// A direction is unknown where all but this part of the rows' information is noise of the motion.
const SIGNAL: f64 = 0.1;

/// The same where it is this part of what the rows say of the parameter alone, the others known:
/// rounding.
const ROUNDING: f64 = 1e-10;

/// The same where rows of unit noise say no more than this: what an estimator starts with.
const NOTHING: f64 = 1e-10;

/// `A - N` as `L D Lᵀ`, `A` being the rows' information and `N` the part of it that is noise.
///
/// Directions are taken one after another, each what is left of a parameter once those before it
/// are known; where the data say nothing of one, it stands still in [`solve`](Self::solve).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Information {
    /// `L`, with a diagonal of ones.
    lower: Matrix,
    /// `D⁻¹`; zero for a direction that is unknown.
    inverse: Vector,
}

impl Information {
    /// From the triangle of all rows, `A = RᵀR`, and `N`. Cost: some 400 multiplications.
    pub(crate) fn new(root: &Matrix, noise: &Matrix) -> Self {
        let rows = root.tr_mul(root);
        let mut lower = rows - noise;
        let mut inverse = Vector::zeros();
        for j in 0..10 {
            // What the elimination of A itself has left here is the square of R's diagonal.
            let all = root[(j, j)] * root[(j, j)];
            let least = (SIGNAL * all).max(ROUNDING * rows[(j, j)]).max(NOTHING);
            let pivot = lower[(j, j)];
            if pivot > least {
                inverse[j] = pivot.recip();
            }
            for i in j + 1..10 {
                let part = lower[(i, j)] * inverse[j];
                for k in i..10 {
                    lower[(k, i)] -= part * lower[(k, j)];
                }
            }
            for i in j + 1..10 {
                lower[(i, j)] *= inverse[j];
            }
        }
        for j in 0..10 {
            lower[(j, j)] = 1.0;
            for i in 0..j {
                lower[(i, j)] = 0.0;
            }
        }
        Self { lower, inverse }
    }

    /// Nothing known.
    pub(crate) fn none() -> Self {
        Self {
            lower: Matrix::identity(),
            inverse: Vector::zeros(),
        }
    }

    /// `(A - N)⁻¹ v` in the known directions.
    pub(crate) fn solve(&self, vector: &Vector) -> Vector {
        let mut solved = *vector;
        self.lower
            .solve_lower_triangular_with_diag_mut(&mut solved, 1.0);
        solved.component_mul_assign(&self.inverse);
        self.lower.tr_solve_lower_triangular_mut(&mut solved);
        solved
    }

    /// `(A - N)⁻¹ S (A - N)⁻¹` of a symmetric `S`, in the known directions.
    pub(crate) fn sandwich(&self, middle: &Matrix) -> Matrix {
        let inverse = self.inverse();
        inverse * middle * inverse
    }

    fn inverse(&self) -> Matrix {
        let mut root = Matrix::identity();
        self.lower
            .solve_lower_triangular_with_diag_mut(&mut root, 1.0);
        let mut scaled = root;
        for (mut row, inverse) in scaled.row_iter_mut().zip(&self.inverse) {
            row *= *inverse;
        }
        root.tr_mul(&scaled)
    }

    /// The directions that are unknown, of any length.
    pub(crate) fn unknown(&self) -> impl Iterator<Item = Vector> + '_ {
        let unknown = (0..10).filter(|&j| self.inverse[j] == 0.0);
        unknown.map(|j| {
            let mut direction = Vector::ith(j, 1.0);
            self.lower.tr_solve_lower_triangular_mut(&mut direction);
            direction
        })
    }
}
