//! The sandwich covariance of a least-squares fit whose neighbouring rows have correlated noise.
//!
//! The covariance of the parameters is `B M Bᵀ`, the sandwich estimator (White 1980, doi 10.2307/1912934): the
//! bread `B` is the inverse of the information, and the meat `M` is the covariance of the sum of all rows'
//! scores. The score of a row is the row times its residual. Three estimates of the meat are here:
//!
//! | estimate | from | holds for |
//! |---|---|---|
//! | [`newey_west_meat`] | scores over many lags | errors of any kind, also of the model, from many windows |
//! | [`local_meat`] | residuals and half-differences of each window | white noise of sensors whose effect changes with the motion |
//! | [`stationary_meat`] | mean products of all residuals | stationary noise of any colour |

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
    /// Half-difference of the residual between even and odd instants: noise alone, in the same unit.
    pub(crate) difference: f64,
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

/// Most passes of [`with_fitted_part`]. Each multiplies the error of the covariance by the ratio of parameters
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

/// The meat of noise that is correlated between windows that share samples, and no others.
pub(crate) struct NoiseMeat {
    /// Covariance of the sum of all rows' scores.
    pub(crate) meat: DMatrix<f64>,
    /// Factor on the standard deviation of each unknown, one or more, because the noise is itself an estimate:
    /// the standard deviation of Student's t.
    pub(crate) t_factors: DVector<f64>,
    /// Fraction of the estimate that comes from residuals, which the fit makes smaller; the rest comes from
    /// half-differences.
    pub(crate) from_residuals: f64,
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
) -> NoiseMeat {
    let windows = windows_of(rows, channels, bread);
    let freedom_fraction = (1.0 - fitted_fraction(rows, bread)).max(VARIANCE_FLOOR);
    NoiseMeat {
        meat: with_fitted_part(rows, bread, |parameters| {
            stationary_products(&windows, parameters)
        }),
        t_factors: t_factors(&windows, freedom_fraction),
        from_residuals: 1.0,
    }
}

/// Estimates the meat window by window where the noise [is white](is_white), and for stationary noise elsewhere.
pub(crate) fn noise_meat(rows: &[ScoredRow], channels: usize, bread: &DMatrix<f64>) -> NoiseMeat {
    if is_white(rows, bread) {
        local_meat(rows, channels, bread)
    } else {
        stationary_meat(rows, channels, bread)
    }
}

/// Estimates the meat window by window, for white noise of the sensors whose effect on the rows changes with the
/// motion.
///
/// Noise of a joint's position enters the arm's own torques through their derivative, which gravity changes with the
/// posture; so a mean over all windows ([`stationary_meat`]) is too small for parameters that depend on the windows
/// with the most noise. The half-differences have the noise of their own window. Their products and those of the
/// residuals, to which the part that was fitted is added, are two estimates of the same covariance, and their mean
/// has the scatter of twice as many windows. The estimate is White's (1980) with the lags of the filter.
///
/// It holds where [`is_white`] does: half-differences contain neither an error of the model nor noise that
/// neighbouring samples share.
fn local_meat(rows: &[ScoredRow], channels: usize, bread: &DMatrix<f64>) -> NoiseMeat {
    let windows = windows_of(rows, channels, bread);
    NoiseMeat {
        meat: with_fitted_part(rows, bread, |parameters| {
            local_products(&windows, parameters)
        }),
        t_factors: local_t_factors(&windows),
        from_residuals: 0.5,
    }
}

/// Returns whether the residuals are as large as the half-differences, within a factor of two in their variance: the
/// noise is that of the sensors, and neighbouring samples do not share it. `bread` is the inverse of the rows'
/// information.
fn is_white(rows: &[ScoredRow], bread: &DMatrix<f64>) -> bool {
    let sum = |of: fn(&ScoredRow) -> f64| rows.iter().map(|row| of(row).powi(2)).sum::<f64>();
    // The residuals lack the part that was fitted.
    let unfitted = (1.0 - fitted_fraction(rows, bread)).max(VARIANCE_FLOOR);
    let ratio = sum(|row| row.difference) * unfitted / sum(|row| row.residual);
    (0.5..=2.0).contains(&ratio)
}

/// Returns the fraction of the residuals' variance that the parameters fit.
fn fitted_fraction(rows: &[ScoredRow], bread: &DMatrix<f64>) -> f64 {
    bread.nrows() as f64 * NOISE_CORRELATION / rows.len() as f64
}

/// Returns the meat that `meat_of` estimates from the residuals and the covariance of the parameters, which depends
/// on the meat and is iterated. Without a covariance `meat_of` ignores the part of the noise that was fitted.
fn with_fitted_part(
    rows: &[ScoredRow],
    bread: &DMatrix<f64>,
    meat_of: impl Fn(Option<&DMatrix<f64>>) -> DMatrix<f64>,
) -> DMatrix<f64> {
    let fitted = fitted_fraction(rows, bread);
    let mut meat = meat_of(None);
    let mut error = fitted;
    for _ in 1..MAX_PASSES {
        if error < CONVERGED {
            break;
        }
        meat = meat_of(Some(&(bread * &meat * bread)));
        error *= fitted;
    }
    meat
}

/// Groups rows by their windows.
fn windows_of(rows: &[ScoredRow], channels: usize, bread: &DMatrix<f64>) -> Vec<Window> {
    let windows = rows.chunks_exact(channels);
    windows.map(|rows| Window::new(rows, bread)).collect()
}

/// Estimates the meat from the products of each pair of windows that share samples: the mean of the products of
/// their half-differences and of their residuals. To the latter the part that was fitted is added where the
/// covariance of the parameters is given.
fn local_products(windows: &[Window], parameters: Option<&DMatrix<f64>>) -> DMatrix<f64> {
    let columns = windows[0].entries.ncols();
    let mut same_window = DMatrix::<f64>::zeros(columns, columns);
    let mut neighbours = DMatrix::<f64>::zeros(columns, columns);
    let score = |window: &Window, of: &DVector<f64>| window.entries.tr_mul(of);
    let scores: Vec<[DVector<f64>; 2]> = windows
        .iter()
        .map(|window| [&window.residuals, &window.differences].map(|of| score(window, of)))
        .collect();
    for lag in 0..=FILTER_REACH.min(windows.len() - 1) {
        let sum = if lag == 0 {
            &mut same_window
        } else {
            &mut neighbours
        };
        for (k, later) in scores[lag..].iter().enumerate() {
            for (score, later) in scores[k].iter().zip(later) {
                sum.ger(0.5, score, later, 1.0);
            }
            if let Some(parameters) = parameters {
                let [first, second] = [k, k + lag].map(|k| windows[k].information());
                *sum += first * parameters * second * 0.5;
            }
        }
    }
    let whole = &same_window + &neighbours + neighbours.transpose();
    with_variance_floor(&same_window, whole)
}

/// Estimates the meat from mean products of the residuals, to which the part that was fitted is added where
/// the covariance of the parameters is given.
fn stationary_products(windows: &[Window], parameters: Option<&DMatrix<f64>>) -> DMatrix<f64> {
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
    /// Half-difference of each channel's residual.
    differences: DVector<f64>,
    weight: f64,
}

impl Window {
    fn new(rows: &[ScoredRow], bread: &DMatrix<f64>) -> Self {
        let entries = DMatrix::from_fn(rows.len(), bread.nrows(), |i, k| rows[i].entries[k]);
        let of_rows = |value: fn(&ScoredRow) -> f64| {
            DVector::from_iterator(rows.len(), rows.iter().map(value))
        };
        Self {
            gains: &entries * bread,
            entries,
            residuals: of_rows(|row| row.residual),
            differences: of_rows(|row| row.difference),
            weight: rows[0].weight,
        }
    }

    /// Returns the information of the window's rows.
    fn information(&self) -> DMatrix<f64> {
        self.entries.tr_mul(&self.entries)
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
        t_factor(freedom * effective_channels)
    })
}

/// Returns what [`t_factors`] does, for [`local_meat`].
///
/// The products of residuals in windows `i` and `j`, in the sum for one unknown, scatter by its variances `v` there: the
/// sum of all has the variance `2 Σ v² + 4 Σ v_i v_j`. Half-differences, which are independent of the residuals, halve
/// it. The degrees of freedom are those of a chi-squared variable with the same scatter (Satterthwaite 1946).
fn local_t_factors(windows: &[Window]) -> DVector<f64> {
    DVector::from_fn(windows[0].gains.ncols(), |unknown, _| {
        let variance = |w: &Window| w.gains.column(unknown).norm_squared();
        let variances: Vec<f64> = windows.iter().map(variance).collect();
        let products = |lag: usize| -> f64 {
            let pairs = variances.iter().zip(variances.iter().skip(lag));
            pairs.map(|(v, later)| v * later).sum()
        };
        let scatter = products(0) + 2.0 * (1..=FILTER_REACH).map(products).sum::<f64>();
        let whole: f64 = variances.iter().sum();
        t_factor(2.0 * whole * whole / scatter.max(f64::MIN_POSITIVE))
    })
}

/// Returns the standard deviation of Student's t with these degrees of freedom.
fn t_factor(freedom: f64) -> f64 {
    let freedom = freedom.max(MIN_FREEDOM);
    (freedom / (freedom - 2.0)).sqrt()
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use rand_distr::StandardNormal;

    use super::*;

    /// Returns 4000 windows of one channel. Every second one excites the first unknown and has noise of variance 9, the
    /// others the second unknown with noise of variance 1; half-differences are so many times as large.
    fn uneven_rows(difference: f64) -> Vec<ScoredRow> {
        let mut random = SmallRng::seed_from_u64(1);
        let mut draw = || -> f64 { random.sample(StandardNormal) };
        let row = |k: usize| {
            let mut entries = [0.0; 11];
            entries[k % 2] = 1.0;
            let std_dev = if k.is_multiple_of(2) { 3.0 } else { 1.0 };
            ScoredRow {
                entries,
                residual: std_dev * draw(),
                difference: std_dev * difference * draw(),
                score: [0.0; 11],
                weight: 1.0,
            }
        };
        (0..4000).map(row).collect()
    }

    /// The local estimate has the variance of the windows that determine an unknown, where the stationary one has the
    /// mean of all. With 2000 windows each they scatter by some 5 %.
    #[test]
    fn local_noise_counts_for_its_unknown() {
        let rows = uneven_rows(1.0);
        let bread = DMatrix::identity(2, 2) / 2000.0;
        assert!(is_white(&rows, &bread));
        let local = local_meat(&rows, 1, &bread).meat / 2000.0;
        let stationary = stationary_meat(&rows, 1, &bread).meat / 2000.0;
        for (unknown, variance) in [(0, 9.0), (1, 1.0)] {
            let ratio = local[(unknown, unknown)] / variance;
            assert!((ratio - 1.0).abs() < 0.15, "{local}");
            assert!(
                (stationary[(unknown, unknown)] - 5.0).abs() < 0.75,
                "{stationary}"
            );
        }
    }

    /// Noise that neighbouring samples share, and an error of the model, are not in the half-differences.
    #[test]
    fn residuals_that_differences_do_not_explain_are_not_white() {
        let bread = DMatrix::identity(2, 2) / 2000.0;
        for (difference, white) in [
            (0.0, false),
            (0.5, false),
            (0.8, true),
            (1.3, true),
            (2.0, false),
        ] {
            let rows = uneven_rows(difference);
            assert_eq!(is_white(&rows, &bread), white, "{difference}");
        }
    }
}
