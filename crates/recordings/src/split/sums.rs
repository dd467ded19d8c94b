//! Least squares over some windows, for a body and an offset of each channel.

use nalgebra::{SMatrix, SVector};

/// Number of channels of a wrench.
pub(super) const CHANNELS: usize = 6;

/// Number of values of a body.
const BODY: usize = 10;

/// Number of unknowns: a body, and an offset of each channel.
pub(super) const UNKNOWNS: usize = BODY + CHANNELS;

/// Information on each unknown beside the windows, in SI units: of a standard deviation of 1000, as
/// no payload and no offset has. It keeps what a rest does not show from being singular.
const PRIOR: f64 = 1e-6;

/// The regressor of a channel in one window, and its target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) regressor: SVector<f64, BODY>,
    pub(super) target: f64,
}

/// The lines of one window.
pub(super) type Lines = [Line; CHANNELS];

/// Variance of the noise of each channel.
pub(super) type Variances = SVector<f64, CHANNELS>;

/// Normal equations of some windows.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    side: SVector<f64, UNKNOWNS>,
    square: f64,
}

impl Sums {
    pub(super) fn new() -> Self {
        Self {
            matrix: SMatrix::identity() * PRIOR,
            side: SVector::zeros(),
            square: 0.0,
        }
    }

    /// Returns the sums of some windows.
    pub(super) fn of<'a>(
        windows: impl IntoIterator<Item = &'a Lines>,
        variances: &Variances,
    ) -> Self {
        let mut sums = Self::new();
        for lines in windows {
            sums.add(lines, variances);
        }
        sums
    }

    /// Adds a window.
    pub(super) fn add(&mut self, lines: &Lines, variances: &Variances) {
        for (channel, line) in lines.iter().enumerate() {
            let weight = 1.0 / variances[channel];
            let place = BODY + channel;
            let weighted = line.regressor * weight;
            let mut of_body = self.matrix.fixed_view_mut::<BODY, BODY>(0, 0);
            of_body.ger(1.0, &weighted, &line.regressor, 1.0);
            let mut column = self.matrix.fixed_view_mut::<BODY, 1>(0, place);
            column += weighted;
            let mut row = self.matrix.fixed_view_mut::<1, BODY>(place, 0);
            row += weighted.transpose();
            self.matrix[(place, place)] += weight;
            let mut side = self.side.fixed_rows_mut::<BODY>(0);
            side += weighted * line.target;
            self.side[place] += weight * line.target;
            self.square += weight * line.target * line.target;
        }
    }

    /// Returns the sum of the squared residuals, in variances, of the best body and offset.
    pub(super) fn cost(&self) -> f64 {
        match self.solution() {
            Some(solution) => (self.square - self.side.dot(&solution)).max(0.0),
            None => f64::INFINITY,
        }
    }

    /// Returns the best body and offset; `None` where numbers are too large.
    pub(super) fn solution(&self) -> Option<SVector<f64, UNKNOWNS>> {
        Some(self.matrix.cholesky()?.solve(&self.side))
    }
}

/// Returns the residuals of a window for a body and an offset.
pub(super) fn residuals(
    lines: &Lines,
    solution: &SVector<f64, UNKNOWNS>,
) -> SVector<f64, CHANNELS> {
    let body = solution.fixed_rows::<BODY>(0);
    SVector::from_fn(|channel, _| {
        let line = &lines[channel];
        line.target - line.regressor.dot(&body) - solution[BODY + channel]
    })
}
