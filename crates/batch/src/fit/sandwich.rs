//! The sandwich covariance of a least-squares fit whose neighbouring rows have correlated noise.
//!
//! The covariance of the parameters is `B M Bᵀ`, the sandwich estimator (White 1980, doi
//! 10.2307/1912934): the bread `B` is the inverse of the information, and the meat `M` is the
//! covariance of the sum of all rows' scores. The score of a row is the row times its residual.
//! Three estimates of the meat are here:
//!
//! | estimate | from | holds for |
//! |---|---|---|
//! | [`MeatEstimator::newey_west_meat`] | scores over many lags | errors of any kind, also of the model, from many windows |
//! | [`MeatEstimator::local_meat`] | residuals and half-differences of each window | white noise of sensors whose effect changes with the motion |
//! | [`MeatEstimator::stationary_meat`] | mean products of all residuals | stationary noise of any colour |
//!
//! [`MeatEstimator::cluster_robust`] estimates the covariance `B M Bᵀ` itself, for errors that are
//! correlated over seconds.

mod neighbours;
mod sections;

use nalgebra::{DMatrix, DVector};
use neighbours::ProductsOfNeighbours;
use tactid_identify::equations::window::NOISE_CORRELATION;
use tactid_identify::solve::VARIANCE_FLOOR;

use super::products::{Products, WIDTH, WideRow};
use super::vector_unit::Computation;
use crate::solve::with_variance_floor;

/// A whitened row with scaled columns, times the root of its weight.
#[derive(Default)]
pub(crate) struct ScoredRow {
    /// Entries of the unknowns; zero beyond their number.
    pub(crate) entries: WideRow,
    /// Residual, in standard deviations of the noise.
    pub(crate) residual: f64,
    /// Half-difference of the residual between even and odd instants: noise alone, in the same
    /// unit.
    pub(crate) difference: f64,
    /// Contribution to the equation that the parameters solve: entries times residual, less the
    /// part that the noise of the motion adds.
    pub(crate) score: WideRow,
    /// Robust weight of the row's window.
    pub(crate) weight: f64,
}

/// Windows that are further apart than this share no samples.
const FILTER_REACH: usize = 2;

/// Most passes of [`with_fitted_part`]. Each multiplies the error of the covariance by the ratio of
/// parameters to rows, a tenth or so where rows are few.
const FITTED_PART_PASSES: usize = 3;

/// Relative error of the covariance below which no further pass is needed.
const COVARIANCE_CONVERGED: f64 = 2e-3;

/// Least degrees of freedom: with two or fewer, Student's t has no finite variance.
const MIN_FREEDOM: f64 = 3.0;

/// The meat of noise that is correlated between windows that share samples, and no others.
#[derive(Clone)]
pub(crate) struct NoiseMeat {
    /// Covariance of the sum of all rows' scores.
    pub(crate) meat: DMatrix<f64>,
    /// Factor on the standard deviation of each unknown, one or more, because the noise is itself
    /// an estimate: the standard deviation of Student's t.
    pub(crate) t_factors: DVector<f64>,
    /// Fraction of the estimate that comes from residuals, which the fit makes smaller; the rest
    /// comes from half-differences.
    pub(crate) from_residuals: f64,
}

/// The rows of all windows of a fit, from which the meat is estimated.
pub(crate) struct MeatEstimator<'a> {
    rows: &'a [ScoredRow],
    /// Number of rows of a window.
    channels: usize,
    /// Inverse of the rows' information.
    bread: &'a DMatrix<f64>,
    /// Entries of all rows.
    entries: Vec<WideRow>,
    /// Entries of all rows times the bread: by how much each unknown moves with a residual.
    gains: Vec<WideRow>,
}

impl<'a> MeatEstimator<'a> {
    /// Takes rows of so many channels, window by window, with the inverse of their information,
    /// which is as large as there are unknowns.
    pub(crate) fn new(rows: &'a [ScoredRow], channels: usize, bread: &'a DMatrix<f64>) -> Self {
        let mut wide = [[0.0; WIDTH]; WIDTH];
        for (k, row) in wide.iter_mut().enumerate().take(bread.nrows()) {
            let of_bread = bread.row(k);
            row.iter_mut()
                .zip(&of_bread)
                .for_each(|(entry, b)| *entry = *b);
        }
        Self {
            rows,
            channels,
            bread,
            entries: rows.iter().map(|row| row.entries).collect(),
            gains: rows
                .iter()
                .map(|row| product(&row.entries, &wide))
                .collect(),
        }
    }

    fn unknowns(&self) -> usize {
        self.bread.nrows()
    }

    fn count(&self) -> usize {
        self.rows.len() / self.channels
    }

    /// Iterates over the rows of the windows from one on.
    fn windows_from(&self, first: usize) -> impl ExactSizeIterator<Item = &[ScoredRow]> {
        self.rows[first * self.channels..].chunks_exact(self.channels)
    }

    /// Returns the entries of a window's rows.
    fn entries(&self, window: usize) -> &[WideRow] {
        &self.entries[window * self.channels..(window + 1) * self.channels]
    }

    /// Returns a sum of products over the unknowns.
    fn over_unknowns(&self, entry: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
        DMatrix::from_fn(self.unknowns(), self.unknowns(), entry)
    }

    /// Estimates the meat from the scores (Newey and West 1987, Econometrica 55, 703-708).
    ///
    /// It holds for errors of any kind, also of the model, but is itself a rough estimate where
    /// windows are few. The products of scores that are `lag` windows apart have the weight `1 -
    /// lag / length`, which is how often both are in one of the sums over `length` neighbouring
    /// windows: the estimate is the mean product of these sums, a pass for all lags.
    pub(crate) fn newey_west_meat(&self) -> DMatrix<f64> {
        let scores: Vec<WideRow> = self.windows_from(0).map(score).collect();
        let length = newey_west_reach(scores.len()) + 1;
        let mut products = Products::zero();
        let mut sum = [0.0; WIDTH];
        for end in 0..scores.len() + length - 1 {
            // The sum is formed anew from time to time, so that rounding does not accumulate.
            if end % length == 0 {
                sum = [0.0; WIDTH];
                let first = (end + 1).saturating_sub(length).min(scores.len());
                for score in &scores[first..scores.len().min(end + 1)] {
                    add(&mut sum, score, 1.0);
                }
            } else {
                if let Some(score) = scores.get(end) {
                    add(&mut sum, score, 1.0);
                }
                if let Some(before) = end.checked_sub(length) {
                    add(&mut sum, &scores[before], -1.0);
                }
            }
            products.add_lower(&[sum], 1.0);
        }
        self.over_unknowns(|i, j| products.symmetric(i, j) / length as f64)
    }

    /// Estimates the meat of the noise as it is: window by window where the noise [is
    /// white](Self::is_white), and that of stationary noise elsewhere. The second one is that of
    /// stationary noise in either case.
    pub(crate) fn noise_meats(&self) -> [NoiseMeat; 2] {
        let stationary = self.stationary_meat();
        let of_noise = if self.is_white() {
            self.local_meat()
        } else {
            stationary.clone()
        };
        [of_noise, stationary]
    }

    /// Estimates the meat from the covariance of the channels' noise, taken to be stationary.
    ///
    /// The covariance between windows that share samples comes from all residuals, so it is better
    /// known than scores are where windows are few. Channels may still be correlated, since
    /// whitening uses shrunk correlations.
    ///
    /// Residuals are smaller than the noise by what the parameters fit of it, `X Σ Xᵀ`. Where the
    /// motion is slow, neighbouring windows lose the same part, and their noise seems less
    /// correlated than it is; and three moments may determine nine of ten parameters. Since `Σ` is
    /// what is estimated, this is iterated.
    fn stationary_meat(&self) -> NoiseMeat {
        let freedom_fraction = (1.0 - self.fitted_fraction()).max(VARIANCE_FLOOR);
        NoiseMeat {
            meat: self.with_fitted_part(|parameters| self.stationary_products(parameters)),
            t_factors: self.t_factors(freedom_fraction),
            from_residuals: 1.0,
        }
    }

    /// Estimates the meat window by window, for white noise of the sensors whose effect on the rows
    /// changes with the motion.
    ///
    /// Noise of a joint's position enters the arm's own torques through their derivative, which
    /// gravity changes with the posture; so a mean over all windows
    /// ([`stationary_meat`](Self::stationary_meat)) is too small for parameters that depend on the
    /// windows with the most noise. The half-differences have the noise of their own window. Their
    /// products and those of the residuals, to which the part that was fitted is added, are two
    /// estimates of the same covariance, and their mean has the scatter of twice as many windows.
    /// The estimate is White's (1980) with the lags of the filter.
    ///
    /// It holds where [`is_white`](Self::is_white) does: half-differences contain neither an error
    /// of the model nor noise that neighbouring samples share.
    fn local_meat(&self) -> NoiseMeat {
        NoiseMeat {
            meat: self.with_fitted_part(|parameters| self.local_products(parameters)),
            t_factors: self.local_t_factors(),
            from_residuals: 0.5,
        }
    }

    /// Returns whether the residuals are as large as the half-differences, within a factor of two
    /// in their variance: the noise is that of the sensors, and neighbouring samples do not share
    /// it.
    fn is_white(&self) -> bool {
        let sum = |of: fn(&ScoredRow) -> f64| -> f64 {
            self.rows.iter().map(|row| of(row).powi(2)).sum()
        };
        // The residuals lack the part that was fitted.
        let unfitted = (1.0 - self.fitted_fraction()).max(VARIANCE_FLOOR);
        let ratio = sum(|row| row.difference) * unfitted / sum(|row| row.residual);
        (0.5..=2.0).contains(&ratio)
    }

    /// Returns the fraction of the residuals' variance that the parameters fit.
    fn fitted_fraction(&self) -> f64 {
        self.unknowns() as f64 * NOISE_CORRELATION / self.rows.len() as f64
    }

    /// Returns the meat that `meat_of` estimates from the residuals and the covariance of the
    /// parameters, which depends on the meat and is iterated. Without a covariance `meat_of`
    /// ignores the part of the noise that was fitted.
    fn with_fitted_part(
        &self,
        meat_of: impl Fn(Option<&DMatrix<f64>>) -> DMatrix<f64>,
    ) -> DMatrix<f64> {
        let fitted = self.fitted_fraction();
        let mut meat = meat_of(None);
        let mut error = fitted;
        for _ in 1..FITTED_PART_PASSES {
            if error < COVARIANCE_CONVERGED {
                break;
            }
            meat = meat_of(Some(&(self.bread * &meat * self.bread)));
            error *= fitted;
        }
        meat
    }

    /// Returns the entries of a window's rows as a matrix, for the products with the covariance of
    /// the parameters.
    fn matrix(&self, window: usize) -> DMatrix<f64> {
        let entries = self.entries(window);
        DMatrix::from_fn(self.channels, self.unknowns(), |i, k| entries[i][k])
    }

    /// Estimates the meat from the products of each pair of windows that share samples: the mean of
    /// the products of their half-differences and of their residuals. To the latter the part that
    /// was fitted is added where the covariance of the parameters is given.
    fn local_products(&self, parameters: Option<&DMatrix<f64>>) -> DMatrix<f64> {
        let scores: Vec<[WideRow; 2]> = self
            .windows_from(0)
            .map(|rows| {
                let of = |value: fn(&ScoredRow) -> f64| {
                    let mut sum = [0.0; WIDTH];
                    for row in rows {
                        add(&mut sum, &row.entries, value(row));
                    }
                    sum
                };
                [of(|row| row.residual), of(|row| row.difference)]
            })
            .collect();
        let (mut same_window, mut neighbours) = (Products::zero(), Products::zero());
        for (k, score) in scores.iter().enumerate() {
            same_window.add(score, score, 0.5);
            for later in scores.iter().take(k + FILTER_REACH + 1).skip(k + 1) {
                neighbours.add(score, later, 0.5);
            }
        }
        let mut same_window = self.over_unknowns(|i, j| same_window.entry(i, j));
        let mut neighbours = self.over_unknowns(|i, j| neighbours.entry(i, j));
        if let Some(parameters) = parameters {
            let matrices = (0..self.count()).map(|window| self.matrix(window));
            let informations: Vec<_> = matrices.map(|matrix| matrix.tr_mul(&matrix)).collect();
            for (k, information) in informations.iter().enumerate() {
                let first = information * parameters * 0.5;
                same_window += &first * information;
                for later in informations.iter().take(k + FILTER_REACH + 1).skip(k + 1) {
                    neighbours += &first * later;
                }
            }
        }
        let whole = &same_window + &neighbours + neighbours.transpose();
        with_variance_floor(&same_window, whole, VARIANCE_FLOOR)
    }

    /// Estimates the meat from mean products of the residuals, to which the part that was fitted is
    /// added where the covariance of the parameters is given.
    fn stationary_products(&self, parameters: Option<&DMatrix<f64>>) -> DMatrix<f64> {
        let covariances = self.residual_covariances(parameters);
        let products = ProductsOfNeighbours {
            estimator: self,
            covariances: &covariances,
        };
        let [same_window, neighbours] = products.on_widest_unit();
        let same_window = self.over_unknowns(|i, j| same_window.entry(i, j));
        let neighbours = self.over_unknowns(|i, j| neighbours.entry(i, j));
        let whole = &same_window + &neighbours + neighbours.transpose();
        with_variance_floor(&same_window, whole, VARIANCE_FLOOR)
    }

    /// Returns the covariance of the residuals of two windows for each lag.
    fn residual_covariances(&self, parameters: Option<&DMatrix<f64>>) -> Vec<DMatrix<f64>> {
        (0..=FILTER_REACH.min(self.count() - 1))
            .map(|lag| self.residual_covariance(lag, parameters))
            .collect()
    }

    /// Returns the mean products of the residuals of windows that are `lag` apart, with the part
    /// that was fitted.
    fn residual_covariance(&self, lag: usize, parameters: Option<&DMatrix<f64>>) -> DMatrix<f64> {
        let mut products = DMatrix::<f64>::zeros(self.channels, self.channels);
        let mut weights = f64::MIN_POSITIVE;
        let pairs = self.windows_from(0).zip(self.windows_from(lag));
        for (k, (window, later)) in pairs.enumerate() {
            for (mut column, later) in products.column_iter_mut().zip(later) {
                for (product, row) in column.iter_mut().zip(window) {
                    *product += row.residual * later.residual;
                }
            }
            if let Some(parameters) = parameters {
                products += self.matrix(k) * (parameters * self.matrix(k + lag).transpose());
            }
            weights += (window[0].weight * later[0].weight).sqrt();
        }
        products / weights
    }

    /// Returns the standard deviation of Student's t over that of a normal variable, for each
    /// unknown.
    ///
    /// A sum of correlations over lags, both ways, from so many windows has `windows / (reach + ½)`
    /// degrees of freedom (Priestley 1981, Spectral Analysis and Time Series, 6.2.5), and more
    /// where an unknown depends on several channels (Satterthwaite 1946, doi 10.2307/3002019, for
    /// covariances). The fit leaves a fraction of them.
    fn t_factors(&self, freedom_fraction: f64) -> DVector<f64> {
        let freedom = freedom_fraction * self.count() as f64 / (FILTER_REACH as f64 + 0.5);
        // Products of the gains of two channels, for each unknown.
        let mut products = vec![[0.0; WIDTH]; self.channels * self.channels];
        for gains in self.gains.chunks_exact(self.channels) {
            let pairs = gains.iter().flat_map(|a| gains.iter().map(move |b| (a, b)));
            for (sums, (a, b)) in products.iter_mut().zip(pairs) {
                for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
                    *sum += a * b;
                }
            }
        }
        DVector::from_fn(self.unknowns(), |unknown, _| {
            let diagonal = products.iter().step_by(self.channels + 1);
            let trace: f64 = diagonal.map(|sums| sums[unknown]).sum();
            let squares: f64 = products.iter().map(|sums| sums[unknown].powi(2)).sum();
            t_factor(freedom * (trace.powi(2) / squares.max(f64::MIN_POSITIVE)))
        })
    }

    /// Returns what [`t_factors`](Self::t_factors) does, for [`local_meat`](Self::local_meat).
    ///
    /// The products of residuals in windows `i` and `j`, in the sum for one unknown, scatter by its
    /// variances `v` there: the sum of all has the variance `2 Σ v² + 4 Σ v_i v_j`.
    /// Half-differences, which are independent of the residuals, halve it. The degrees of freedom
    /// are those of a chi-squared variable with the same scatter (Satterthwaite 1946).
    fn local_t_factors(&self) -> DVector<f64> {
        let windows = self.gains.chunks_exact(self.channels);
        let variances: Vec<WideRow> = windows
            .map(|gains| {
                let square = |unknown: usize| gains.iter().map(|gain| gain[unknown].powi(2)).sum();
                std::array::from_fn(square)
            })
            .collect();
        DVector::from_fn(self.unknowns(), |unknown, _| {
            let products = |lag: usize| -> f64 {
                let pairs = variances.iter().zip(variances.iter().skip(lag));
                pairs.map(|(v, later)| v[unknown] * later[unknown]).sum()
            };
            let scatter = products(0) + 2.0 * (1..=FILTER_REACH).map(products).sum::<f64>();
            let whole: f64 = variances.iter().map(|variances| variances[unknown]).sum();
            t_factor(2.0 * whole * whole / scatter.max(f64::MIN_POSITIVE))
        })
    }
}

/// Returns the number of lags over which scores of so many windows are summed.
fn newey_west_reach(count: usize) -> usize {
    ((1.5 * (count as f64).cbrt()) as usize).clamp(3, count.max(4) - 1)
}

/// Returns the sum of the scores of a window's rows.
fn score(rows: &[ScoredRow]) -> WideRow {
    let mut sum = [0.0; WIDTH];
    for row in rows {
        add(&mut sum, &row.score, 1.0);
    }
    sum
}

/// Adds `weight` times a row to a sum.
#[inline(always)]
fn add(sum: &mut WideRow, row: &WideRow, weight: f64) {
    for (sum, entry) in sum.iter_mut().zip(row) {
        *sum += weight * entry;
    }
}

/// Returns a row times a matrix.
fn product(row: &WideRow, matrix: &[WideRow; WIDTH]) -> WideRow {
    let mut sum = [0.0; WIDTH];
    for (entry, of_matrix) in row.iter().zip(matrix) {
        add(&mut sum, of_matrix, *entry);
    }
    sum
}

/// Returns the standard deviation of Student's t with these degrees of freedom.
fn t_factor(freedom: f64) -> f64 {
    let freedom = freedom.max(MIN_FREEDOM);
    (freedom / (freedom - 2.0)).sqrt()
}

#[cfg(test)]
mod tests;
