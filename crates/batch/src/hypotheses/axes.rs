//! Signs and places of the axes of a wrench: a search over signed permutations of its channels.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SVector, Vector4, Vector6};

use super::fitted::Fitted;
use super::model::Model;
use super::windows::Windows;
use crate::finding::Hypothesis;

/// The products from which the residual of every signed permutation beside other causes follows.
pub(super) struct AxesSearch {
    /// The model of the other causes, without what the wrench is linear in.
    model: Model,
    /// The other causes that the wrench is linear in, which are fitted anew with the parameters.
    linear: Vec<Hypothesis>,
    /// Inverse of the information.
    inverse: DMatrix<f64>,
    /// Products of the rows of each channel with the measurements of each.
    products: [[DVector<f64>; 6]; 6],
}

impl AxesSearch {
    /// Sums over all windows. The axes of a force have the same noise, and so have those of a
    /// moment. `None` where the motion determines hardly anything.
    pub(super) fn new(windows: &Windows, present: &Fitted) -> Option<Self> {
        let size = |first: usize| windows.std_devs.fixed_rows::<3>(first).norm_squared() / 3.0;
        let precisions = [size(0), size(3)].map(f64::recip);
        let mut linear = present.active.clone();
        linear.retain(|each| matches!(each, Hypothesis::Offset | Hypothesis::Weight));
        let model = Model {
            parameters: SVector::zeros(),
            offset: Vector6::zeros(),
            weight: Vector4::zeros(),
            ..present.model.clone()
        };
        let chain = model.chain(windows);
        let count = model.columns(&linear);
        let mut information = DMatrix::zeros(count, count);
        let empty = || DVector::zeros(count);
        let mut products = std::array::from_fn(|_| std::array::from_fn(|_| empty()));
        let mut columns = Vec::with_capacity(count + 1);
        for window in &windows.windows {
            columns.clear();
            model.fill(window, &chain, &linear, &mut columns);
            let measured = model.measured(window);
            for (channel, of_channel) in products.iter_mut().enumerate() {
                let weight = window.root.powi(2) * precisions[channel / 3];
                let row = DVector::from_fn(count, |k, _| columns[k][channel]);
                information.ger(weight, &row, &row, 1.0);
                for (sum, target) in of_channel.iter_mut().zip(&measured) {
                    sum.axpy(weight * target, &row, 1.0);
                }
            }
        }
        // A ridge keeps what is not determined from being fitted.
        let ridge = (information.diagonal() * 1e-9).map(|entry| entry.max(f64::MIN_POSITIVE));
        let inverse = (information + DMatrix::from_diagonal(&ridge))
            .cholesky()?
            .inverse();
        Some(Self {
            model,
            linear,
            inverse,
            products,
        })
    }

    /// Returns the permutation among `candidates` with the least residual.
    pub(super) fn best(
        &self,
        candidates: impl Iterator<Item = Matrix6<f64>>,
    ) -> Option<Matrix6<f64>> {
        candidates.max_by(|a, b| self.explained(a).total_cmp(&self.explained(b)))
    }

    /// Returns the squares that the payload and the other causes explain of wrenches whose channels
    /// are brought to their places.
    fn explained(&self, axes: &Matrix6<f64>) -> f64 {
        let target = self.target(axes);
        target.dot(&(&self.inverse * &target))
    }

    fn target(&self, axes: &Matrix6<f64>) -> DVector<f64> {
        let mut target = DVector::zeros(self.inverse.nrows());
        for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
            target.axpy(axes[(i, j)], &self.products[i][j], 1.0);
        }
        target
    }

    /// Returns the model with these axes, whose sign is that of a positive mass.
    pub(super) fn model(&self, axes: &Matrix6<f64>) -> Model {
        let unknowns = &self.inverse * self.target(axes);
        let sign = if unknowns[0] < 0.0 { -1.0 } else { 1.0 };
        Model {
            axes: axes * sign,
            ..self.model.moved(&(unknowns * sign), &self.linear)
        }
    }
}

/// Places of three axes in every order.
const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// Returns the matrix that brings three axes to their places, with a sign for each bit.
fn ordered(order: [usize; 3], bits: usize) -> Matrix3<f64> {
    let sign = |k: usize| if bits >> k & 1 == 1 { -1.0 } else { 1.0 };
    Matrix3::from_fn(|i, j| if order[i] == j { sign(i) } else { 0.0 })
}

/// Returns all signed permutations that turn force and moment by the same multiple of a right angle
/// about each axis.
pub(super) fn turns() -> impl Iterator<Item = Matrix3<f64>> {
    let of_order = |order| (0..8).map(move |bits| ordered(order, bits));
    let all = ORDERS.into_iter().flat_map(of_order);
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
/// alike or with the opposite sign, or are exchanged columns of forces or moments, and signs of
/// channels.
pub(super) fn candidates() -> impl Iterator<Item = Matrix6<f64>> {
    let exchanged = turns().flat_map(|turn| [of_both(&turn, &turn), of_both(&turn, &-turn)]);
    let signs = (1..32u32).map(|bits| {
        let sign = |k: usize| if bits >> k & 1 == 1 { -1.0 } else { 1.0 };
        Matrix6::from_diagonal(&nalgebra::Vector6::from_fn(|k, _| sign(k)))
    });
    let orders = ORDERS.map(|order| ordered(order, 0));
    let pairs = orders
        .into_iter()
        .flat_map(move |force| orders.map(|moment| (force, moment)));
    // Those of an even order that turn force and moment alike are among the exchanged ones.
    let is_turn =
        |(force, moment): &(Matrix3<f64>, _)| force == moment && force.determinant() > 0.0;
    let columns = pairs
        .filter(move |pair| !is_turn(pair))
        .map(|(force, moment)| of_both(&force, &moment));
    exchanged
        .chain(columns)
        .chain(signs)
        .filter(|axes| *axes != Matrix6::identity())
}
