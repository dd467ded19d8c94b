//! Signs and places of the axes of a wrench: a search over signed permutations of its channels.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector};

use super::model::Model;
use super::windows::Windows;

/// The products from which the residual of every signed permutation follows.
pub(super) struct AxesSearch {
    /// Inverse of the information.
    inverse: SMatrix<f64, 10, 10>,
    /// Products of the rows of each channel with the measurements of each.
    products: [[SVector<f64, 10>; 6]; 6],
}

impl AxesSearch {
    /// Sums over all windows. The axes of a force have the same noise, and so have those of a
    /// moment. `None` where the motion determines hardly anything.
    pub(super) fn new(windows: &Windows) -> Option<Self> {
        let size = |first: usize| windows.std_devs.fixed_rows::<3>(first).norm_squared() / 3.0;
        let precisions = [size(0), size(3)].map(f64::recip);
        let mut information = SMatrix::<f64, 10, 10>::zeros();
        let mut products = [[SVector::<f64, 10>::zeros(); 6]; 6];
        for window in &windows.windows {
            let rows = windows.sensor_from_tool * window.regressor;
            for (channel, of_channel) in products.iter_mut().enumerate() {
                let weight = window.root.powi(2) * precisions[channel / 3];
                let row = rows.row(channel).transpose();
                information.ger(weight, &row, &row, 1.0);
                for (sum, target) in of_channel.iter_mut().zip(&window.target) {
                    *sum += row * (weight * target);
                }
            }
        }
        // A ridge keeps what is not determined from being fitted.
        let ridge = information.diagonal() * 1e-9;
        information += SMatrix::from_diagonal(&ridge.map(|entry| entry.max(f64::MIN_POSITIVE)));
        let inverse = information.cholesky()?.inverse();
        Some(Self { inverse, products })
    }

    /// Returns the permutation among `candidates` with the least residual.
    pub(super) fn best(
        &self,
        candidates: impl Iterator<Item = Matrix6<f64>>,
    ) -> Option<Matrix6<f64>> {
        candidates.max_by(|a, b| self.explained(a).total_cmp(&self.explained(b)))
    }

    /// Returns the squares that the payload explains of wrenches whose channels are brought to
    /// their places.
    fn explained(&self, axes: &Matrix6<f64>) -> f64 {
        self.target(axes).dot(&(self.inverse * self.target(axes)))
    }

    fn target(&self, axes: &Matrix6<f64>) -> SVector<f64, 10> {
        let channels = (0..6).flat_map(|i| (0..6).map(move |j| (i, j)));
        let used = channels.filter(|place| axes[*place] != 0.0);
        used.map(|(i, j)| self.products[i][j] * axes[(i, j)]).sum()
    }

    /// Returns the model with these axes, whose sign is that of a positive mass.
    pub(super) fn model(&self, axes: &Matrix6<f64>, joints: usize) -> Model {
        let parameters = self.inverse * self.target(axes);
        let sign = if parameters[0] < 0.0 { -1.0 } else { 1.0 };
        Model {
            axes: axes * sign,
            ..Model::new(parameters * sign, joints)
        }
    }
}

/// Returns all signed permutations that turn force and moment by the same multiple of a right angle
/// about each axis.
pub(super) fn turns() -> impl Iterator<Item = Matrix3<f64>> {
    const PERMUTATIONS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let signs = |bits: usize, k: usize| if bits >> k & 1 == 1 { -1.0 } else { 1.0 };
    let all = PERMUTATIONS.into_iter().flat_map(move |order| {
        (0..8).map(move |bits| {
            let entry = |i, j| if order[i] == j { signs(bits, i) } else { 0.0 };
            Matrix3::from_fn(entry)
        })
    });
    all.filter(|turn| turn.determinant() > 0.0)
}

/// Returns the matrix that brings force and moment to their places.
pub(super) fn of_both(force: &Matrix3<f64>, moment: &Matrix3<f64>) -> Matrix6<f64> {
    let mut axes = Matrix6::zeros();
    axes.fixed_view_mut::<3, 3>(0, 0).copy_from(force);
    axes.fixed_view_mut::<3, 3>(3, 3).copy_from(moment);
    axes
}

/// Returns all axes that are tried but those as given: exchanged ones, which turn force and moment
/// alike or with the opposite sign, and signs of channels.
pub(super) fn candidates() -> impl Iterator<Item = Matrix6<f64>> {
    let exchanged = turns().flat_map(|turn| [of_both(&turn, &turn), of_both(&turn, &-turn)]);
    let signs = (1..32u32).map(|bits| {
        let sign = |k: usize| if bits >> k & 1 == 1 { -1.0 } else { 1.0 };
        Matrix6::from_diagonal(&nalgebra::Vector6::from_fn(|k, _| sign(k)))
    });
    exchanged
        .chain(signs)
        .filter(|axes| *axes != Matrix6::identity())
}
