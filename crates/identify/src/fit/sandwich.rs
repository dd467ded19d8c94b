//! The sandwich covariance of a least-squares fit whose neighbouring rows have correlated noise.
//!
//! The covariance of the parameters is `B M Bᵀ`, the sandwich estimator (White 1980, doi 10.2307/1912934): the
//! bread `B` is the inverse of the information, and the meat `M` is the covariance of the sum of all rows'
//! scores. The score of a row is the row times its residual. Two estimates of the meat are here: one from the
//! scores themselves, and one that takes the noise to be stationary.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::equations::window::NOISE_CORRELATION;

/// Entries of a row: the ten parameters, and the delay.
pub(crate) type Entries = [f64; 11];

/// A whitened row with scaled columns, times the root of its weight.
pub(crate) struct ScoredRow {
    /// Entries of the unknowns; zero beyond their number.
    pub(crate) entries: Entries,
    /// Residual, in standard deviations of the noise.
    pub(crate) residual: f64,
    /// Contribution to the equation that the parameters solve: entries times residual, less the part that
    /// the noise of the motion adds.
    pub(crate) score: Entries,
    /// Robust weight of the row's window.
    pub(crate) weight: f64,
}

/// Windows that are further apart than this share no samples.
const FILTER_REACH: usize = 2;

/// Least variance of a direction, relative to the variance without the correlation of neighbouring windows,
/// and least fraction of the degrees of freedom that a fit leaves.
const VARIANCE_FLOOR: f64 = 0.05;

/// Most passes of [`stationary_meat`]. Each multiplies the error of the covariance by the ratio of parameters
/// to rows, a tenth or so where rows are few.
const MAX_PASSES: usize = 3;

/// Relative error of the covariance below which no further pass is needed.
const CONVERGED: f64 = 2e-3;

/// Least degrees of freedom: with two or fewer, Student's t has no finite variance.
const MIN_FREEDOM: f64 = 3.0;

/// Estimates the meat from the scores (Newey and West 1987, Econometrica 55, 703-708).
///
/// It holds for errors of any kind, also of the model, but is itself a rough estimate where windows are few.
/// `rows` has one row for each channel of each window; `columns` is the number of unknowns.
pub(crate) fn newey_west_meat(rows: &[ScoredRow], channels: usize, columns: usize) -> DMatrix<f64> {
    let score = |window: &[ScoredRow]| {
        DVector::from_fn(columns, |k, _| window.iter().map(|row| row.score[k]).sum())
    };
    let scores: Vec<DVector<f64>> = rows.chunks_exact(channels).map(score).collect();
    let count = scores.len();
    let reach = ((1.5 * (count as f64).cbrt()) as usize).clamp(3, count.max(4) - 1);
    let mut sum = DMatrix::<f64>::zeros(columns, columns);
    for lag in 0..=reach.min(count - 1) {
        let taper = 1.0 - lag as f64 / (reach + 1) as f64;
        let factor = if lag == 0 { 0.5 * taper } else { taper };
        for (score, later) in scores.iter().zip(&scores[lag..]) {
            sum.ger(factor, score, later, 1.0);
        }
    }
    &sum + sum.transpose()
}

/// The meat of stationary noise.
pub(crate) struct StationaryMeat {
    /// Covariance of the sum of all rows' scores.
    pub(crate) meat: DMatrix<f64>,
    /// Factor on the standard deviation of each unknown, one or more, because the noise is itself an estimate:
    /// the standard deviation of Student's t.
    pub(crate) t_factors: DVector<f64>,
}

/// Estimates the meat from the covariance of the channels' noise, taken to be stationary.
///
/// The covariance between windows that share samples comes from all residuals, so it is better known than
/// scores are where windows are few. Channels may still be correlated, since whitening uses shrunk
/// correlations.
///
/// Residuals are smaller than the noise by what the parameters fit of it, `X Σ Xᵀ`. Where the motion is slow,
/// neighbouring windows lose the same part, and their noise seems less correlated than it is; and three
/// moments may determine nine of ten parameters. Since `Σ` is what is estimated, this is iterated. `bread` is
/// the inverse of the rows' information.
pub(crate) fn stationary_meat(
    rows: &[ScoredRow],
    channels: usize,
    bread: &DMatrix<f64>,
) -> StationaryMeat {
    let windows: Vec<Window> = rows
        .chunks_exact(channels)
        .map(|rows| Window::new(rows, bread))
        .collect();
    let columns = bread.nrows();
    let independent = rows.len() as f64 / NOISE_CORRELATION;
    let fitted = columns as f64 / independent;
    let mut meat = meat_of(&windows, None);
    let mut error = fitted;
    for _ in 1..MAX_PASSES {
        if error < CONVERGED {
            break;
        }
        meat = meat_of(&windows, Some(&(bread * &meat * bread)));
        error *= fitted;
    }
    let freedom_fraction = (1.0 - fitted).max(VARIANCE_FLOOR);
    StationaryMeat {
        meat,
        t_factors: t_factors(&windows, freedom_fraction),
    }
}

/// Estimates the meat from mean products of the residuals, to which the part that was fitted is added where
/// the covariance of the parameters is given.
fn meat_of(windows: &[Window], parameters: Option<&DMatrix<f64>>) -> DMatrix<f64> {
    let (channels, columns) = windows[0].entries.shape();
    let mut same_window = DMatrix::<f64>::zeros(columns, columns);
    let mut neighbours = DMatrix::<f64>::zeros(columns, columns);
    for lag in 0..=FILTER_REACH.min(windows.len() - 1) {
        let pairs = || windows.iter().zip(&windows[lag..]);
        let mut products = DMatrix::<f64>::zeros(channels, channels);
        let mut weights = f64::MIN_POSITIVE;
        for (window, later) in pairs() {
            products.ger(1.0, &window.residuals, &later.residuals, 1.0);
            if let Some(parameters) = parameters {
                products += &window.entries * (parameters * later.entries.transpose());
            }
            weights += (window.weight * later.weight).sqrt();
        }
        let covariance = products / weights;
        let sum = if lag == 0 {
            &mut same_window
        } else {
            &mut neighbours
        };
        for (window, later) in pairs() {
            *sum += window.entries.transpose() * (&covariance * &later.entries);
        }
    }
    let whole = &same_window + &neighbours + neighbours.transpose();
    with_variance_floor(&same_window, whole)
}

/// The rows of one window.
struct Window {
    /// Entries, a row for each channel.
    entries: DMatrix<f64>,
    /// Entries times the bread: by how much each unknown moves with a residual.
    gains: DMatrix<f64>,
    /// Residual of each channel.
    residuals: DVector<f64>,
    weight: f64,
}

impl Window {
    fn new(rows: &[ScoredRow], bread: &DMatrix<f64>) -> Self {
        let entries = DMatrix::from_fn(rows.len(), bread.nrows(), |i, k| rows[i].entries[k]);
        Self {
            gains: &entries * bread,
            entries,
            residuals: DVector::from_iterator(rows.len(), rows.iter().map(|row| row.residual)),
            weight: rows[0].weight,
        }
    }
}

/// Returns the standard deviation of Student's t over that of a normal variable, for each unknown.
///
/// A sum of correlations over lags, both ways, from so many windows has `windows / (reach + ½)` degrees of
/// freedom (Priestley 1981, Spectral Analysis and Time Series, 6.2.5), and more where an unknown depends on
/// several channels (Satterthwaite 1946, doi 10.2307/3002019, for covariances). The fit leaves a fraction of
/// them.
fn t_factors(windows: &[Window], freedom_fraction: f64) -> DVector<f64> {
    let freedom = freedom_fraction * windows.len() as f64 / (FILTER_REACH as f64 + 0.5);
    DVector::from_fn(windows[0].gains.ncols(), |unknown, _| {
        let channels = windows[0].residuals.len();
        let mut products = DMatrix::<f64>::zeros(channels, channels);
        for window in windows {
            let gain = window.gains.column(unknown);
            products.ger(1.0, &gain, &gain, 1.0);
        }
        let effective_channels =
            products.trace().powi(2) / products.norm_squared().max(f64::MIN_POSITIVE);
        let freedom = (freedom * effective_channels).max(MIN_FREEDOM);
        (freedom / (freedom - 2.0)).sqrt()
    })
}

/// Returns `whole` with at least a [fraction](VARIANCE_FLOOR) of the variance of `same_window` in each
/// direction. Estimated correlations may leave a direction no variance, or a negative one.
fn with_variance_floor(same_window: &DMatrix<f64>, whole: DMatrix<f64>) -> DMatrix<f64> {
    let cholesky = same_window.clone().cholesky();
    let Some(root) = cholesky.map(|cholesky| cholesky.unpack()) else {
        return whole;
    };
    // R⁻¹ W R⁻ᵀ, in which `same_window` is the identity.
    let mut relative = whole;
    root.solve_lower_triangular_mut(&mut relative);
    let mut relative = relative.transpose();
    root.solve_lower_triangular_mut(&mut relative);
    let mut eigen = SymmetricEigen::new(relative);
    eigen
        .eigenvalues
        .apply(|value| *value = value.max(VARIANCE_FLOOR));
    &root * eigen.recompose() * root.transpose()
}
