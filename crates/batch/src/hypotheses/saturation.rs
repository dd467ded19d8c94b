//! Channels that are cut off at a limit. Near an end of the range of a channel, what is predicted
//! beyond it counts for nothing, as in a censored regression (Tobin 1958). Unlike the ends of the
//! ranges of samples, this also shows limits after which values were rounded, filtered, or noisy.

use nalgebra::Vector6;

use super::model::Model;
use super::windows::{SLIGHT, Window, Windows};
use crate::finding::CHANNELS;

impl Windows {
    /// Returns the end of the range of a channel, by its place in [`ends`](Self::ends), that the
    /// measured value is near and beyond which it is predicted, given the measured less the
    /// predicted value.
    fn cut_end(&self, window: &Window, channel: usize, residual: f64) -> Option<usize> {
        let near = SLIGHT * (self.ends[0][channel] + self.ends[1][channel]);
        (0..2).find(|&end| {
            let sign = [1.0, -1.0][end];
            sign * window.target[channel] > self.ends[end][channel] - near && sign * residual < 0.0
        })
    }

    /// Sets the factors of the channels to zero that are cut off in a window, given measured less
    /// predicted values.
    pub(super) fn leave_out_cut(
        &self,
        window: &Window,
        residual: Option<&Vector6<f64>>,
        factors: &mut Vector6<f64>,
    ) {
        let pairs = factors.iter_mut().zip(residual.into_iter().flatten());
        for (channel, (factor, residual)) in pairs.enumerate() {
            if self.cut_end(window, channel, *residual).is_some() {
                *factor = 0.0;
            }
        }
    }
}

impl Model {
    /// Returns the names of the channels that are cut off, and the values at which they are. Ends
    /// beyond which next to nothing is predicted are none.
    pub(super) fn cut_ends(&self, windows: &Windows) -> (Vec<String>, Vec<f64>) {
        let chain = self.chain(windows);
        let mut squares = [0.0; 12];
        for window in &windows.windows {
            let residual = self.residual(window, &chain, &self.of_load(window));
            let whitened = residual.component_div(&windows.std_devs) * window.root;
            for channel in 0..6 {
                if let Some(end) = windows.cut_end(window, channel, residual[channel]) {
                    squares[2 * channel + end] += whitened[channel].powi(2);
                }
            }
        }
        let least = SLIGHT * squares.iter().sum::<f64>();
        let ends = squares.iter().enumerate().filter(|end| *end.1 > least);
        let value = |end: usize| [1.0, -1.0][end % 2] * windows.ends[end % 2][end / 2];
        ends.map(|(end, _)| (CHANNELS[end / 2].to_owned(), value(end)))
            .unzip()
    }
}
