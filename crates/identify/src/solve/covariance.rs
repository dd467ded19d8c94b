//! What noise does to a least-squares fit, where neighbouring rows have noise in common.
//!
//! Both give the covariance of the sum of all rows' scores (a score is a row times its residual), the
//! middle of the sandwich that is the parameters' covariance.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::equations::window::NOISE_CORRELATION;

/// One row with the delay's column.
pub(crate) type Entries = [f64; 11];

/// A row in units of its noise, its columns scaled, times the root of its weight.
pub(crate) struct ScaledRow {
    pub(crate) entries: Entries,
    pub(crate) residual: f64,
    /// The row's part in the equation that the parameters solve: entries times residual, less what
    /// the motion's noise adds to them.
    pub(crate) score: Entries,
    pub(crate) weight: f64,
}

/// Windows that are further apart than this share no samples.
const FILTER_REACH: usize = 2;

/// The least variance that common samples, or a fit, can leave; relative to what it is without.
const LEAST: f64 = 0.05;

/// Each pass leaves of the covariance's error what the parameters are of the rows: a tenth or so where
/// these are few. No more are needed, and fewer once so small a part is left.
const PASSES: usize = 3;
const SETTLED: f64 = 2e-3;

/// With fewer degrees of freedom Student's t has hardly a deviation.
const LEAST_FREEDOM: f64 = 3.0;

/// From the scores themselves (Newey and West 1987, Econometrica 55, 703-708): holds whatever the
/// errors are, also those of the model, but is itself a rough estimate where windows are few.
pub(crate) fn of_scores(rows: &[ScaledRow], channels: usize, columns: usize) -> DMatrix<f64> {
    let score = |window: &[ScaledRow]| {
        DVector::from_fn(columns, |k, _| window.iter().map(|row| row.score[k]).sum())
    };
    let scores: Vec<DVector<f64>> = rows.chunks_exact(channels).map(score).collect();
    let count = scores.len();
    let reach = ((1.5 * (count as f64).cbrt()) as usize).clamp(3, count.max(4) - 1);
    let mut sum = DMatrix::<f64>::zeros(columns, columns);
    for lag in 0..=reach.min(count - 1) {
        let taper = 1.0 - lag as f64 / (reach + 1) as f64;
        let share = if lag == 0 { 0.5 * taper } else { taper };
        for (now, later) in scores.iter().zip(&scores[lag..]) {
            sum.ger(share, now, later, 1.0);
        }
    }
    &sum + sum.transpose()
}

/// What the channels' noise alone does.
pub(crate) struct OfNoise {
    /// Covariance of the sum of all rows' scores.
    pub(crate) meat: DMatrix<f64>,
    /// By how much each parameter's deviation is larger, as the noise is itself an estimate.
    pub(crate) widening: DVector<f64>,
}

/// From the channels' noise, taken to be stationary: its covariance between windows that share samples
/// comes from all residuals, so it is better known than scores are where windows are few.
///
/// Channels may still have noise in common, as the rows' correlation was believed in part. And
/// residuals are less than the noise by what the parameters fit of it, `X Σ Xᵀ`: where the motion is
/// slow neighbours lose the same, and their noise seems less correlated than it is; and three moments
/// may tell nine of ten parameters. Σ being what is looked for, it is found in passes. `bread` is the
/// inverse of the rows' information.
pub(crate) fn of_noise(rows: &[ScaledRow], channels: usize, bread: &DMatrix<f64>) -> OfNoise {
    let windows: Vec<Window> = rows
        .chunks_exact(channels)
        .map(|rows| Window::new(rows, bread))
        .collect();
    let columns = bread.nrows();
    let independent = rows.len() as f64 / NOISE_CORRELATION;
    let fitted = columns as f64 / independent;
    let mut meat = meat_of(&windows, None);
    let mut error = fitted;
    for _ in 1..PASSES {
        if error < SETTLED {
            break;
        }
        meat = meat_of(&windows, Some(&(bread * &meat * bread)));
        error *= fitted;
    }
    let left = (1.0 - fitted).max(LEAST);
    OfNoise {
        meat,
        widening: widening(&windows, left),
    }
}

/// The scores' covariance, that of the parameters given, which they took from the residuals.
fn meat_of(windows: &[Window], taken: Option<&DMatrix<f64>>) -> DMatrix<f64> {
    let (channels, columns) = windows[0].entries.shape();
    let mut alone = DMatrix::<f64>::zeros(columns, columns);
    let mut shared = DMatrix::<f64>::zeros(columns, columns);
    for lag in 0..=FILTER_REACH.min(windows.len() - 1) {
        let pairs = || windows.iter().zip(&windows[lag..]);
        let mut products = DMatrix::<f64>::zeros(channels, channels);
        let mut weights = f64::MIN_POSITIVE;
        for (now, later) in pairs() {
            products.ger(1.0, &now.residuals, &later.residuals, 1.0);
            if let Some(taken) = taken {
                products += &now.entries * (taken * later.entries.transpose());
            }
            weights += (now.weight * later.weight).sqrt();
        }
        let covariance = products / weights;
        let sum = if lag == 0 { &mut alone } else { &mut shared };
        for (now, later) in pairs() {
            *sum += now.entries.transpose() * (&covariance * &later.entries);
        }
    }
    let whole = &alone + &shared + shared.transpose();
    at_least(LEAST, &alone, whole)
}

/// A window's rows.
struct Window {
    /// A row for each channel.
    entries: DMatrix<f64>,
    /// The same times the inverse of the information: by how much each parameter follows a residual.
    gains: DMatrix<f64>,
    residuals: DVector<f64>,
    weight: f64,
}

impl Window {
    fn new(rows: &[ScaledRow], bread: &DMatrix<f64>) -> Self {
        let entries = DMatrix::from_fn(rows.len(), bread.nrows(), |i, k| rows[i].entries[k]);
        Self {
            gains: &entries * bread,
            entries,
            residuals: DVector::from_iterator(rows.len(), rows.iter().map(|row| row.residual)),
            weight: rows[0].weight,
        }
    }
}

/// The deviation of Student's t over that of a normal variable, for each parameter.
///
/// A sum of correlations over lags, both ways, from so many windows has `windows / (reach + ½)` degrees
/// of freedom (Priestley 1981, Spectral Analysis and Time Series, 6.2.5), and more where a parameter
/// follows now one channel, now another (Satterthwaite 1946, doi 10.2307/3002019, for covariances).
fn widening(windows: &[Window], left: f64) -> DVector<f64> {
    let freedom = left * windows.len() as f64 / (FILTER_REACH as f64 + 0.5);
    DVector::from_fn(windows[0].gains.ncols(), |parameter, _| {
        let channels = windows[0].residuals.len();
        let mut spread = DMatrix::<f64>::zeros(channels, channels);
        for window in windows {
            let gain = window.gains.column(parameter);
            spread.ger(1.0, &gain, &gain, 1.0);
        }
        let many = spread.trace().powi(2) / spread.norm_squared().max(f64::MIN_POSITIVE);
        let freedom = (freedom * many).max(LEAST_FREEDOM);
        (freedom / (freedom - 2.0)).sqrt()
    })
}

/// Estimated correlations may leave a direction no variance, or less than none: here each has at
/// least a part of what windows without common samples would leave it.
fn at_least(part: f64, alone: &DMatrix<f64>, whole: DMatrix<f64>) -> DMatrix<f64> {
    let Some(root) = alone.clone().cholesky().map(|cholesky| cholesky.unpack()) else {
        return whole;
    };
    // R⁻¹ W R⁻ᵀ, in which `alone` is the identity.
    let mut relative = whole;
    root.solve_lower_triangular_mut(&mut relative);
    let mut relative = relative.transpose();
    root.solve_lower_triangular_mut(&mut relative);
    let mut eigen = SymmetricEigen::new(relative);
    eigen.eigenvalues.apply(|value| *value = value.max(part));
    &root * eigen.recompose() * root.transpose()
}
