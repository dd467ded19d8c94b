//! The whitened rows of a fit, of one window after another.

use nalgebra::SVector;
use tactid_identify::solve::Whitening;

use super::ReweightedLeastSquares;
use crate::fit::products::{Products, WIDTH, WideRow};
use crate::fit::rows::{TARGET, UNKNOWNS, remainder};
use crate::fit::vector_unit::Computation;

/// The rows of a window less the means, and its half-differences: both whitened, with scaled
/// columns, and with the residual in the place of the target.
pub(super) struct WhitenedWindow<'a> {
    state: &'a ReweightedLeastSquares<'a>,
    whitening: Whitening,
    /// Mean rows of all channels.
    means: Vec<WideRow>,
    /// Rows before whitening.
    wide: Vec<WideRow>,
    pub(super) rows: Vec<WideRow>,
    pub(super) differences: Vec<WideRow>,
}

impl<'a> WhitenedWindow<'a> {
    /// Computes what whitens the rows of all windows.
    pub(super) fn new(state: &'a ReweightedLeastSquares<'a>) -> Self {
        let zeros = vec![[0.0; WIDTH]; state.noise.channels()];
        Self {
            whitening: Whitening::new(&state.noise),
            means: state.mean_rows(),
            state,
            wide: zeros.clone(),
            rows: zeros.clone(),
            differences: zeros,
        }
    }

    /// Computes the rows of a window.
    #[inline(always)]
    pub(super) fn move_to(&mut self, window: usize) {
        let state = self.state;
        let channels = self.wide.len();
        let residuals = &state.residuals[window * channels..(window + 1) * channels];
        let rows = state.rows.of_window(window).iter().zip(&self.means);
        for (wide, ((row, mean), residual)) in self.wide.iter_mut().zip(rows.zip(residuals)) {
            *wide = scaled(row, mean, &state.scales, *residual);
        }
        self.whitening.apply(&self.wide, &mut self.rows);
        for (wide, row) in self.wide.iter_mut().zip(state.rows.differences(window)) {
            let residual = remainder(row, &state.solution);
            *wide = scaled(row, &[0.0; WIDTH], &state.scales, residual);
        }
        self.whitening.apply(&self.wide, &mut self.differences);
    }
}

/// Returns a row less a mean with scaled columns, and with a residual in the place of the target.
///
/// Rows are scaled before they are whitened: where sensors measure nothing, only scales of zero
/// keep numbers finite.
#[inline(always)]
fn scaled(
    row: &WideRow,
    mean: &WideRow,
    scales: &SVector<f64, UNKNOWNS>,
    residual: f64,
) -> WideRow {
    let mut scaled = [0.0; WIDTH];
    for (k, scale) in scales.iter().enumerate() {
        scaled[k] = (row[k] - mean[k]) * scale;
    }
    scaled[TARGET] = residual;
    scaled
}

/// The sums of [`ReweightedLeastSquares::products`], which are most of a fit.
#[derive(Clone, Copy)]
pub(super) struct ProductsOfRows<'a>(pub(super) &'a ReweightedLeastSquares<'a>);

impl Computation for ProductsOfRows<'_> {
    type Output = [Products; 2];

    #[inline(always)]
    fn compute(self) -> [Products; 2] {
        let (mut of_rows, mut of_noise) = (Products::zero(), Products::zero());
        let mut whitened = WhitenedWindow::new(self.0);
        for window in self.0.windows() {
            let weight = self.0.weights[window];
            if weight != 0.0 {
                whitened.move_to(window);
                of_rows.add_lower(&whitened.rows, weight);
                of_noise.add_lower(&whitened.differences, weight);
            }
        }
        [of_rows, of_noise]
    }
}

#[cfg(test)]
mod tests {
    use tactid_identify::equations::Channels;

    use super::super::tests::equations;
    use super::*;
    use crate::fit::FitOptions;
    use crate::fit::vector_unit::assert_same_digits;

    /// The products of a fit have the same digits on the widest vector unit as on the baseline.
    #[test]
    fn products_do_not_depend_on_the_vector_unit() {
        let mut noisy = equations(300, 6, 1.0, 0.0);
        for equation in &mut noisy {
            equation.differences.clone_from_slice(&equation.rows);
        }
        let channels = Channels::of_wrench();
        let mut state = ReweightedLeastSquares::new(&noisy, FitOptions::new(&channels), 6);
        state.solve();
        state.update_weights(true);
        assert_same_digits(ProductsOfRows(&state));
    }
}
