//! Iteratively reweighted least squares over all windows of a recording, without the bias of noise
//! in the motion.

mod covariance;
mod whitened;

use nalgebra::{DMatrix, DVector, Dyn, SMatrix, SVector, Vector3};
use tactid_identify::equations::window::NOISE_CORRELATION;
use tactid_identify::equations::{Channels, Equation};
use tactid_identify::solve::{MeanRow, Offsets};
use tactid_identify::solve::{Noise, RESIDUAL_ROUNDING, Whitening};
use tactid_identify::solve::{Vector, bounded_lengths};
use tactid_identify::solve::{rare_distance, robust_weight};
use whitened::ProductsOfRows;

use super::normal_equations::mass_information;
use super::products::{Products, WIDTH, WideRow};
use super::rows::{DELAY, FitRows, TARGET, UNKNOWNS, remainder};
use super::vector_unit::Computation;
use super::{Delay, Fit, FitOptions, GainErrors};
use crate::solve::Spectrum;

/// Most passes of reweighting. The noise estimated from the residuals settles in a few.
pub(crate) const MAX_PASSES: usize = 20;

/// First passes, in which the noise is estimated from medians because outliers are not identified
/// yet.
const MEDIAN_PASSES: usize = 5;

/// Fewest rows of a fit.
const MIN_ROWS: usize = 20;

/// Columns shorter than this, relative to what is usual for their kind, are rounding and stay
/// short.
const MIN_LENGTH: f64 = 1e-8;

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
    let min_passes = match (options.weights_of, options.start) {
        // With weights and noise of another fit the problem is linear.
        (Some(_), _) => 0,
        // The fit from which this one starts has identified the outliers.
        (None, Some(_)) => 1,
        (None, None) => MEDIAN_PASSES,
    };
    let mut state = ReweightedLeastSquares::new(equations, options, channels);
    for pass in 0..MAX_PASSES {
        if options.known_mass.is_some() {
            // The weight of the mass is fixed, so the scales of the rows must follow their noise.
            state.update_scales();
        }
        let moved = state.solve();
        if options.weights_of.is_none() {
            state.update_weights(options.start.is_none() && pass < MEDIAN_PASSES);
            state.update_means();
        }
        if pass > min_passes && moved < options.converged {
            break;
        }
    }
    let mut fit = state.into_fit(count);
    if options.covariance {
        fit.add_gain_errors(equations, options.used);
    }
    Some(fit)
}

/// Returns the delay of the load relative to the motion, as one more unknown of a fit with the
/// weights and the noise of a fit without it; `None` where no row determines it.
///
/// Weights and noise that follow the residuals with the delay converge slowly, and to a delay that
/// may be wrong by tens of standard deviations.
pub(crate) fn delay(
    equations: &[Equation],
    without: &Fit,
    options: FitOptions<'_>,
) -> Option<Delay> {
    let options = FitOptions {
        delay: true,
        weights_of: Some(without),
        ..options
    };
    fit(equations, options)?.delay
}

/// Returns noise as large as the measurements. Sensors that measure nothing at all determine
/// nothing.
fn size_of_targets(equations: &[Equation], channels: &Channels) -> Noise {
    let mut noise = Noise::from_targets(equations, channels, RESIDUAL_ROUNDING);
    if noise.has_measurements() {
        noise.set_zero_channels_to_unit();
    }
    noise
}

/// The state of a fit between two passes.
struct ReweightedLeastSquares<'a> {
    rows: FitRows,
    options: FitOptions<'a>,
    /// Number of unknowns: the ten parameters, and the delay where it is estimated.
    columns: usize,
    solution: [f64; UNKNOWNS],
    /// Unit of each scaled unknown.
    scales: SVector<f64, UNKNOWNS>,
    /// Lever arm at which the noise of a force has the moment of the noise of a moment, m.
    lever_arm_m: f64,
    /// Mean rows of the channels whose offset is unknown.
    means: Vec<MeanRow<UNKNOWNS>>,
    /// Residuals of all windows, window by window, in the channels' units.
    residuals: Vec<f64>,
    noise: Noise,
    weights: Vec<f64>,
    /// Information of the last pass, in scaled unknowns.
    spectrum: Spectrum<Dyn>,
}

impl<'a> ReweightedLeastSquares<'a> {
    fn new(equations: &'a [Equation], options: FitOptions<'a>, channels: usize) -> Self {
        let columns = UNKNOWNS - usize::from(!options.delay);
        let (noise, weights) = match options.weights_of.or(options.start) {
            Some(fit) => (fit.noise.clone(), fit.weights.clone()),
            None => (
                size_of_targets(equations, options.channels),
                vec![1.0; equations.len()],
            ),
        };
        let mut state = Self {
            rows: FitRows::new(equations, &options, channels),
            options,
            columns,
            solution: [0.0; UNKNOWNS],
            scales: SVector::repeat(1.0),
            lever_arm_m: 0.0,
            means: vec![MeanRow::zero(); options.channels.offsets],
            residuals: vec![0.0; equations.len() * channels],
            noise,
            weights,
            spectrum: Spectrum::new(DMatrix::zeros(columns, columns)),
        };
        state.compute_means();
        state.update_scales();
        state.update_residuals();
        state
    }

    /// Computes the means, and the residuals without them, for the present weights.
    fn update_means(&mut self) {
        if !self.means.is_empty() {
            self.compute_means();
            self.update_residuals();
        }
    }

    fn compute_means(&mut self) {
        let mean = |channel: usize| {
            MeanRow::new(self.windows().map(|window| {
                let row = &self.rows.of_window(window)[channel];
                let entries = std::array::from_fn(|k| row[k]);
                (self.weights[window], entries, row[TARGET])
            }))
        };
        self.means = (0..self.means.len()).map(mean).collect();
    }

    /// Computes the residuals of every window, whether it is used or not.
    fn update_residuals(&mut self) {
        let solution = &self.solution;
        let offsets: Vec<f64> = (0..self.noise.channels())
            .map(|channel| {
                self.means
                    .get(channel)
                    .map_or(0.0, |mean| mean.remainder(solution))
            })
            .collect();
        let residuals = self.residuals.iter_mut().zip(self.rows.all());
        for ((residual, row), offset) in residuals.zip(offsets.iter().cycle()) {
            *residual = remainder(row, solution) - offset;
        }
    }

    /// Returns the mean rows of all channels; zero where the channel has no unknown offset.
    fn mean_rows(&self) -> Vec<WideRow> {
        let mean = |channel: usize| {
            let mut wide = [0.0; WIDTH];
            if let Some(mean) = self.means.get(channel) {
                let (entries, target) = mean.parts();
                wide[..UNKNOWNS].copy_from_slice(entries);
                wide[TARGET] = target;
            }
            wide
        };
        (0..self.noise.channels()).map(mean).collect()
    }

    /// Indices of the windows that are used.
    fn windows(&self) -> impl Iterator<Item = usize> + use<'a> {
        let used = self.options.used;
        (0..self.rows.windows()).filter(move |&k| used.is_none_or(|used| used[k]))
    }

    /// Chooses the scales so that all columns have the same length in units of the noise.
    fn update_scales(&mut self) {
        let mut squares = [0.0; UNKNOWNS];
        let precisions: Vec<f64> = self.noise.std_devs.iter().map(|s| s.recip()).collect();
        let means = self.mean_rows();
        for window in self.windows() {
            let rows = self.rows.of_window(window).iter().zip(&means);
            for ((row, mean), precision) in rows.zip(&precisions) {
                for ((square, entry), mean) in squares.iter_mut().zip(row).zip(mean) {
                    *square += ((entry - mean) * precision).powi(2);
                }
            }
        }
        let lengths = bounded_lengths(&Vector::from_fn(|k, _| squares[k].sqrt()), MIN_LENGTH);
        let of_first_moments = lengths.fixed_rows::<3>(1).max();
        self.lever_arm_m = lengths[0] / of_first_moments;
        let known_mass = self.options.known_mass;
        let of_mass = known_mass.map_or(0.0, mass_information);
        let of_delay = squares[DELAY].sqrt().max(f64::MIN_POSITIVE);
        self.scales[0] = 1.0 / lengths[0].hypot(of_mass.sqrt());
        for k in 1..10 {
            self.scales[k] = 1.0 / lengths[k];
        }
        self.scales[DELAY] = 1.0 / of_delay;
    }

    /// Moves the solution by one step of weighted least squares with errors-in-variables bias
    /// correction, and returns the length of the step in standard deviations.
    ///
    /// The correction subtracts what the noise of the motion adds to the products of all rows, as
    /// the half-differences show it (Fuller 1987, Measurement Error Models, (3.1.9) with
    /// replicates). The step starts at the present solution, which removes the rounding errors of
    /// previous normal equations.
    fn solve(&mut self) -> f64 {
        let columns = self.columns;
        let [rows, noise] = self.products();
        let corrected = |i, j| rows.symmetric(i, j) - noise.symmetric(i, j);
        let mut target = DVector::from_fn(columns, |i, _| corrected(TARGET, i));
        let square = |products: &Products| {
            DMatrix::from_fn(columns, columns, |i, j| products.symmetric(i, j))
        };
        let [mut of_rows, of_noise] = [&rows, &noise].map(square);
        if let Some(mass) = self.options.known_mass {
            let of_mass = self.mass_information();
            of_rows[(0, 0)] += of_mass;
            target[0] += of_mass * (mass.mass_kg - self.solution[0]) / self.scales[0];
        }
        self.spectrum = Spectrum::with_noise(&of_rows, &of_noise, self.windows().count());
        let mut step = DVector::<f64>::zeros(columns);
        for (information, direction) in self.spectrum.observable() {
            step += &direction * (direction.dot(&target) / information);
        }
        for ((unknown, step), scale) in self.solution.iter_mut().zip(&step).zip(&self.scales) {
            *unknown += step * scale;
        }
        self.update_residuals();
        // Squared length of the step in the metric of the information.
        step.dot(&target).max(0.0).sqrt()
    }

    /// Returns the products of all columns of the whitened rows, and those of the noise of the
    /// motion in them, which the half-differences show.
    fn products(&self) -> [Products; 2] {
        ProductsOfRows(self).on_widest_unit()
    }

    /// Information of a known mass, in scaled parameters.
    fn mass_information(&self) -> f64 {
        let mass = self.options.known_mass;
        mass.map_or(0.0, |mass| mass_information(mass) * self.scales[0].powi(2))
    }

    /// Estimates the noise from the residuals, by medians or by mean products, and from both the
    /// robust weight of every window.
    fn update_weights(&mut self, by_medians: bool) {
        let channels = self.noise.channels();
        let windows: Vec<usize> = self.windows().collect();
        let residuals = windows.iter().map(|&window| {
            let first = window * channels;
            (
                &self.residuals[first..first + channels],
                self.weights[window],
            )
        });
        if by_medians {
            self.noise.estimate_from_medians(residuals);
        } else {
            self.noise.estimate(residuals);
        }
        let rare = rare_distance(channels);
        let whitening = Whitening::new(&self.noise);
        let residuals = self.residuals.chunks_exact(channels);
        for (weight, residuals) in self.weights.iter_mut().zip(residuals) {
            *weight = robust_weight(whitening.squared_distance(residuals), rare);
        }
    }

    /// Computes the uncertainty after the last pass, given the number of windows that are used.
    fn into_fit(self, count: usize) -> Fit {
        let bread = self.spectrum.inverse();
        let [covariance, metric] = if self.options.covariance {
            self.covariances(count, &bread)
        } else {
            [0, 1].map(|_| DMatrix::zeros(self.columns, self.columns))
        };
        let has_delay = self.options.delay && self.spectrum.determines(DELAY);
        let delay = has_delay.then(|| Delay {
            delay_s: self.solution[DELAY],
            std_dev_s: covariance[(DELAY, DELAY)].max(0.0).sqrt(),
        });
        let bread = self.spectrum.across_unobservable(bread);
        let scales = self.scales.fixed_rows::<10>(0).into_owned();
        let (mass_kg, first_moments) = (self.solution[0], &self.solution[1..4]);
        let center_m = Vector3::from_column_slice(first_moments).norm() / mass_kg.abs();
        let reach_m = self.lever_arm_m.hypot(center_m);
        Fit {
            parameters: SVector::from_fn(|k, _| self.solution[k]),
            covariance: covariance.fixed_view::<10, 10>(0, 0).into_owned(),
            metric: metric.fixed_view::<10, 10>(0, 0).into_owned(),
            bread: SMatrix::from_fn(|i, j| bread[(i, j)] * scales[i] * scales[j]),
            gain_errors: GainErrors::zeros(0),
            delay,
            excitation: self.spectrum.excitation(),
            null_space: self.spectrum.null_space_of(scales, mass_kg, reach_m),
            reach_m,
            offsets: Offsets::new(&self.means, &self.solution, &self.noise, count),
            noise: self.noise,
            independent: self.weights.len() as f64 / NOISE_CORRELATION,
            weights: self.weights,
            known_mass: self.options.known_mass,
            gravity_scale: self.options.gravity_scale,
        }
    }
}

#[cfg(test)]
mod tests;
