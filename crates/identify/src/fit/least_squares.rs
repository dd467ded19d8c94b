//! Iteratively reweighted least squares over all windows of a recording, without the bias of noise in the
//! motion.

use nalgebra::{DMatrix, DVector, Dyn, SMatrix};

use super::sandwich::{self, Entries, NoiseMeat, ScoredRow};
use super::{Delay, Fit, FitOptions, GainErrors};
use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::equations::{Channels, Equation, Row};
use crate::solve::noise::{Noise, ROUNDING};
use crate::solve::offsets::{MeanRow, Offsets};
use crate::solve::spectrum::Spectrum;
use crate::solve::weights::{rare_distance, robust_weight};

/// Most passes of reweighting. The noise estimated from the residuals settles in a few.
const MAX_PASSES: usize = 20;

/// First passes, in which the noise is estimated from medians because outliers are not identified yet.
const MEDIAN_PASSES: usize = 5;

/// Passes before convergence is tested where weights and noise are those of another fit.
const FIXED_WEIGHT_PASSES: usize = 2;

/// The parameters have converged when a pass moves them by less than this many standard deviations.
const CONVERGED: f64 = 1e-5;

/// Fewest rows of a fit.
const MIN_ROWS: usize = 20;

/// Columns smaller than this, relative to the squared length of the largest, are rounding and stay small.
const MIN_SQUARE: f64 = 1e-16;

/// Fits the parameters to equations; `None` where there are fewer than 20 rows.
///
/// Cost: up to 20 passes over all equations, and one or two more for the covariance.
pub(crate) fn fit(equations: &[Equation], options: FitOptions<'_>) -> Option<Fit> {
    let channels = equations.first()?.rows.len();
    let is_used = |k: usize| options.used.is_none_or(|used| used[k]);
    let count = (0..equations.len()).filter(|&k| is_used(k)).count();
    if count * channels < MIN_ROWS {
        return None;
    }
    let mut state = ReweightedLeastSquares::new(equations, options, channels);
    for pass in 0..MAX_PASSES {
        if options.known_mass.is_some() {
            // The weight of the mass is fixed, so the scales of the rows must follow their noise.
            state.update_scales();
        }
        let moved = state.solve();
        let min_passes = if options.weights_of.is_none() {
            state.update_weights(pass);
            state.update_means();
            MEDIAN_PASSES
        } else {
            FIXED_WEIGHT_PASSES
        };
        if pass > min_passes && moved < CONVERGED {
            break;
        }
    }
    let mut fit = state.into_fit(count);
    if options.covariance {
        fit.add_gain_errors(equations, options.used);
    }
    Some(fit)
}

/// Returns noise as large as the measurements. Sensors that measure nothing at all determine nothing.
fn size_of_targets(equations: &[Equation], channels: &Channels) -> Noise {
    let mut noise = Noise::from_targets(equations, channels, ROUNDING);
    if noise.has_measurements() {
        noise.set_zero_channels_to_unit();
    }
    noise
}

/// The state of a fit between two passes.
struct ReweightedLeastSquares<'a> {
    equations: &'a [Equation],
    options: FitOptions<'a>,
    /// Number of unknowns: the ten parameters, and the delay where it is estimated.
    columns: usize,
    solution: DVector<f64>,
    /// Unit of each scaled unknown.
    scales: DVector<f64>,
    /// Mean rows of the channels whose offset is unknown.
    means: Vec<MeanRow<11>>,
    /// Residuals of all windows, window by window, in the channels' units.
    residuals: Vec<f64>,
    noise: Noise,
    weights: Vec<f64>,
    /// Information of the last pass, in scaled unknowns.
    spectrum: Spectrum<Dyn>,
    /// What the noise of the motion has added to the products of the unknowns, which is subtracted from the information.
    noise_products: DMatrix<f64>,
}

impl<'a> ReweightedLeastSquares<'a> {
    fn new(equations: &'a [Equation], options: FitOptions<'a>, channels: usize) -> Self {
        let columns = 10 + usize::from(options.delay);
        let (noise, weights) = match options.weights_of {
            Some(fit) => (fit.noise.clone(), fit.weights.clone()),
            None => (
                size_of_targets(equations, options.channels),
                vec![1.0; equations.len()],
            ),
        };
        let mut state = Self {
            equations,
            options,
            columns,
            solution: DVector::zeros(columns),
            scales: DVector::repeat(columns, 1.0),
            means: vec![MeanRow::zero(); options.channels.offsets],
            residuals: vec![0.0; equations.len() * channels],
            noise,
            weights,
            spectrum: Spectrum::new(DMatrix::zeros(columns, columns)),
            noise_products: DMatrix::zeros(columns, columns),
        };
        state.compute_means();
        state.update_scales();
        state.update_residuals();
        state
    }

    /// Returns a row's entries with the scaled gravity, and zero for the delay.
    fn without_delay(&self, row: &Row) -> Entries {
        let mut entries = [0.0; 11];
        entries[..10].copy_from_slice(row.regressor.as_slice());
        for (entry, gravity) in entries.iter_mut().zip(&row.gravity) {
            *entry += (1.0 - self.options.gravity_scale) * gravity;
        }
        entries
    }

    /// Returns the entries and the target of a window's row.
    fn row(&self, window: usize, channel: usize) -> (Entries, f64) {
        let equation = &self.equations[window];
        let row = &equation.rows[channel];
        let mut entries = self.without_delay(row);
        // target(t + delay) = target(t) + delay · rate belongs to the motion at t.
        entries[10] = -equation.rates[channel];
        (entries, row.target)
    }

    /// Returns the entries and the target of a window's row less the mean of its channel, where the channel
    /// has an unknown offset.
    fn centred_row(&self, window: usize, channel: usize) -> (Entries, f64) {
        let (mut entries, mut target) = self.row(window, channel);
        if let Some(mean) = self.means.get(channel) {
            mean.subtract_from(&mut entries, &mut target);
        }
        (entries, target)
    }

    /// Computes the means, and the residuals without them, for the present weights.
    fn update_means(&mut self) {
        if !self.means.is_empty() {
            self.compute_means();
            self.update_residuals();
        }
    }

    fn compute_means(&mut self) {
        let mean = |channel| {
            MeanRow::new(self.windows().map(|window| {
                let (entries, target) = self.row(window, channel);
                (self.weights[window], entries, target)
            }))
        };
        self.means = (0..self.means.len()).map(mean).collect();
    }

    fn predicted(&self, entries: &Entries) -> f64 {
        entries.iter().zip(&self.solution).map(|(a, x)| a * x).sum()
    }

    /// Computes the residuals of every window, whether it is used or not.
    fn update_residuals(&mut self) {
        let channels = self.noise.channels();
        for window in 0..self.equations.len() {
            for channel in 0..channels {
                let (entries, target) = self.centred_row(window, channel);
                self.residuals[window * channels + channel] = target - self.predicted(&entries);
            }
        }
    }

    /// Computes a window's whitened rows with scaled columns. The last column is the residual.
    fn whiten_rows(&self, window: usize, block: &mut DMatrix<f64>) {
        let channels = self.noise.channels();
        for channel in 0..channels {
            let (entries, _) = self.centred_row(window, channel);
            for (k, scale) in self.scales.iter().enumerate() {
                block[(channel, k)] = scale * entries[k];
            }
            block[(channel, self.columns)] = self.residuals[window * channels + channel];
        }
        self.noise.whiten(block);
    }

    /// Computes a window's whitened half-differences with scaled columns: noise alone, on both sides. The last
    /// column is the residual.
    fn whiten_differences(&self, window: usize, block: &mut DMatrix<f64>) {
        for (channel, row) in self.equations[window].differences.iter().enumerate() {
            let entries = self.without_delay(row);
            for (k, scale) in self.scales.iter().enumerate() {
                block[(channel, k)] = scale * entries[k];
            }
            block[(channel, self.columns)] = row.target - self.predicted(&entries);
        }
        self.noise.whiten(block);
    }

    /// Returns a matrix with a row for each channel, and a column for each unknown and the residual.
    fn block(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.noise.channels(), self.columns + 1)
    }

    /// Indices of the windows that are used.
    fn windows(&self) -> impl Iterator<Item = usize> + use<'a> {
        let used = self.options.used;
        (0..self.equations.len()).filter(move |&k| used.is_none_or(|used| used[k]))
    }

    /// Chooses the scales so that all columns have the same length in units of the noise.
    fn update_scales(&mut self) {
        let mut squares = [0.0; 11];
        for window in self.windows() {
            for (channel, std_dev) in self.noise.std_devs.iter().enumerate() {
                let (entries, _) = self.centred_row(window, channel);
                for (square, entry) in squares.iter_mut().zip(entries) {
                    *square += (entry / std_dev).powi(2);
                }
            }
        }
        let largest = squares[..10].iter().fold(0.0f64, |a, &b| a.max(b));
        let least = (largest * MIN_SQUARE).max(f64::MIN_POSITIVE);
        let known_mass = self.options.known_mass;
        let of_mass = known_mass.map_or(0.0, |mass| mass.information());
        squares[0] = squares[0].max(least) + of_mass;
        for (scale, square) in self.scales.iter_mut().zip(squares) {
            *scale = 1.0 / square.max(least).sqrt();
        }
    }

    /// Moves the solution by one step of weighted least squares with errors-in-variables bias correction, and
    /// returns the length of the step in standard deviations.
    ///
    /// The correction subtracts what the noise of the motion adds to the products of all rows, as the
    /// half-differences show it (Fuller 1987, Measurement Error Models, (3.1.9) with replicates). The step
    /// starts at the present solution, which removes the rounding errors of previous normal equations.
    fn solve(&mut self) -> f64 {
        let columns = self.columns;
        let (mut gram, noise) = self.corrected_gram();
        self.noise_products = noise;
        if let Some(mass) = self.options.known_mass {
            let information = self.mass_information();
            gram[(0, 0)] += information;
            gram[(columns, 0)] += information * (mass.mass_kg - self.solution[0]) / self.scales[0];
        }
        gram.fill_upper_triangle_with_lower_triangle();
        let target = gram.view((0, columns), (columns, 1)).column(0).into_owned();
        let information = gram.view((0, 0), (columns, columns)).into_owned();
        self.spectrum = Spectrum::new(information);
        let mut step = DVector::<f64>::zeros(columns);
        for (information, direction) in self.spectrum.observable() {
            step += &direction * (direction.dot(&target) / information);
        }
        self.solution += step.component_mul(&self.scales);
        self.update_residuals();
        // Squared length of the step in the metric of the information.
        step.dot(&target).max(0.0).sqrt()
    }

    /// Returns the lower triangle of the products of all whitened columns, less those of the noise of the
    /// motion, whose last row belongs to the residuals; and the products of the unknowns' noise.
    fn corrected_gram(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let columns = self.columns;
        let mut gram = DMatrix::<f64>::zeros(columns + 1, columns + 1);
        let mut of_noise = gram.clone();
        let (mut rows, mut differences) = (self.block(), self.block());
        for window in self.windows() {
            let weight = self.weights[window];
            if weight == 0.0 {
                continue;
            }
            self.whiten_rows(window, &mut rows);
            self.whiten_differences(window, &mut differences);
            for i in 0..=columns {
                for j in 0..=i {
                    let product = rows.column(i).dot(&rows.column(j));
                    let noise = differences.column(i).dot(&differences.column(j));
                    gram[(i, j)] += weight * (product - noise);
                    of_noise[(i, j)] += weight * noise;
                }
            }
        }
        of_noise.fill_upper_triangle_with_lower_triangle();
        (gram, of_noise.view((0, 0), (columns, columns)).into_owned())
    }

    /// Information of a known mass, in scaled parameters.
    fn mass_information(&self) -> f64 {
        let mass = self.options.known_mass;
        mass.map_or(0.0, |mass| mass.information() * self.scales[0].powi(2))
    }

    /// Estimates the noise from the residuals, and from both the robust weight of every window.
    fn update_weights(&mut self, pass: usize) {
        let channels = self.noise.channels();
        let windows: Vec<usize> = self.windows().collect();
        let residuals = windows.iter().map(|&window| {
            let first = window * channels;
            (
                &self.residuals[first..first + channels],
                self.weights[window],
            )
        });
        if pass < MEDIAN_PASSES {
            self.noise.estimate_from_medians(residuals);
        } else {
            self.noise.estimate(residuals);
        }
        let rare = rare_distance(channels);
        let mut residual = DMatrix::zeros(channels, 1);
        for window in 0..self.equations.len() {
            let first = window * channels;
            residual.copy_from_slice(&self.residuals[first..first + channels]);
            self.noise.whiten(&mut residual);
            self.weights[window] = robust_weight(residual.norm_squared(), rare);
        }
    }

    /// Computes the uncertainty after the last pass, given the number of windows that are used.
    fn into_fit(self, count: usize) -> Fit {
        let rows = self.scored_rows();
        let bread = self.spectrum.inverse();
        let [covariance, metric] = if self.options.covariance {
            [sandwich::noise_meat, sandwich::stationary_meat]
                .map(|meat| self.covariance(&rows, count, &bread, meat))
        } else {
            [0, 1].map(|_| DMatrix::zeros(self.columns, self.columns))
        };
        let delay = self.options.delay.then(|| Delay {
            delay_s: self.solution[10],
            std_dev_s: covariance[(10, 10)].max(0.0).sqrt(),
        });
        let scales = self.scales.fixed_rows::<10>(0).into_owned();
        Fit {
            parameters: self.solution.fixed_rows::<10>(0).into_owned(),
            covariance: covariance.fixed_view::<10, 10>(0, 0).into_owned(),
            metric: metric.fixed_view::<10, 10>(0, 0).into_owned(),
            bread: SMatrix::from_fn(|i, j| bread[(i, j)] * scales[i] * scales[j]),
            gain_errors: GainErrors::zeros(0),
            delay,
            excitation: self.spectrum.excitation(),
            null_space: self.spectrum.null_space(scales),
            not_excited: self
                .spectrum
                .not_excited(scales, &self.noise_products, count),
            offsets: Offsets::new(&self.means, self.solution.as_slice(), &self.noise, count),
            noise: self.noise,
            weights: self.weights,
            known_mass: self.options.known_mass,
            gravity_scale: self.options.gravity_scale,
        }
    }

    /// Returns the sandwich covariance of the unknowns from so many windows (see [`sandwich`]).
    fn covariance(
        &self,
        rows: &[ScoredRow],
        count: usize,
        bread: &DMatrix<f64>,
        meat_of: impl Fn(&[ScoredRow], usize, &DMatrix<f64>) -> NoiseMeat,
    ) -> DMatrix<f64> {
        let channels = self.noise.channels();
        let independent = (count * channels) as f64 / NOISE_CORRELATION;
        let unknowns = self.columns + self.means.len();
        let freedom = (independent - unknowns as f64).max(1.0);
        let scores =
            sandwich::newey_west_meat(rows, channels, self.columns) * independent / freedom;
        let of_noise = meat_of(rows, channels, bread);
        // Errors that last longer than the filter show in the scores, if there are enough of them.
        let size = |meat: &DMatrix<f64>| (bread * meat).trace();
        let NoiseMeat {
            meat,
            t_factors,
            from_residuals,
        } = if size(&scores) > size(&of_noise.meat) {
            NoiseMeat {
                meat: scores,
                t_factors: DVector::repeat(self.columns, 1.0),
                from_residuals: 1.0,
            }
        } else {
            of_noise
        };
        let independent = count as f64 / PRODUCT_CORRELATION;
        let mut meat = meat * self.noise.inflation(independent, from_residuals);
        // Variance of the weighing: its information is enlarged for the correlation of neighbouring windows.
        meat[(0, 0)] += self.mass_information() * NOISE_CORRELATION;
        let scaled = bread * meat * bread;
        let mut scales = self.scales.component_mul(&t_factors);
        if self.mass_information() > 0.0 {
            // The variance of a known mass is not estimated from the residuals.
            scales[0] = self.scales[0];
        }
        DMatrix::from_fn(self.columns, self.columns, |i, j| {
            scaled[(i, j)] * scales[i] * scales[j]
        })
    }

    /// Returns the whitened rows of the windows that are used with their scores, each times the root of its
    /// weight.
    fn scored_rows(&self) -> Vec<ScoredRow> {
        let mut scored = Vec::new();
        let (mut rows, mut differences) = (self.block(), self.block());
        for window in self.windows() {
            let weight = self.weights[window];
            self.whiten_rows(window, &mut rows);
            self.whiten_differences(window, &mut differences);
            rows *= weight.sqrt();
            differences *= weight.sqrt();
            for (row, noise) in rows.row_iter().zip(differences.row_iter()) {
                let (residual, difference) = (row[self.columns], noise[self.columns]);
                let mut scored_row = ScoredRow {
                    entries: [0.0; 11],
                    residual,
                    difference,
                    score: [0.0; 11],
                    weight,
                };
                for k in 0..self.columns {
                    scored_row.entries[k] = row[k];
                    scored_row.score[k] = row[k] * residual - noise[k] * difference;
                }
                scored.push(scored_row);
            }
        }
        scored
    }
}

#[cfg(test)]
mod tests;
