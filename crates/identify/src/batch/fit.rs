//! Robust weighted least squares over all equations of a recording, with its covariance.

use nalgebra::{DMatrix, DVector, SMatrix, SVector, SymmetricEigen};

use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::equations::{Channels, Equation, Row};
use crate::solve::covariance::{self, Entries, ScaledRow};
use crate::solve::noise::{Noise, ROUNDING};
use crate::solve::offsets::Offset;
use crate::solve::prior::KnownMass;
use crate::solve::subspace::{Directions, known};
use crate::solve::uncertainty::std_devs;
use crate::solve::weights::{OUTLIER, rare, weight};

/// Passes of reweighting; the residuals of noise settle in a few.
const MAX_PASSES: usize = 20;

/// In so many of them the noise is that of medians, while outliers are not told yet.
const MEDIANS: usize = 5;

/// The parameters have settled when a pass moves them by less than this part of their deviations.
const SETTLED: f64 = 1e-5;

/// What a fit may use.
#[derive(Clone, Copy)]
pub(crate) struct Options<'a> {
    /// How the channels belong together.
    pub(crate) channels: &'a Channels,
    /// Whether a delay of the load is fitted, too.
    pub(crate) delay: bool,
    /// Windows to be used; all where it says nothing.
    pub(crate) only: Option<&'a [bool]>,
    /// Weights of windows and deviations of channels from another fit, kept as they are.
    pub(crate) weights: Option<&'a Fit>,
    /// Whether the covariance is asked for, which takes about as long as a pass.
    pub(crate) covariance: bool,
    /// Scale applied to gravity: 1 as configured, 0 for weightlessness, -1 for the opposite sign.
    pub(crate) gravity_scale: f64,
    /// Of the whole load.
    pub(crate) mass: Option<KnownMass>,
}

impl<'a> Options<'a> {
    /// All windows, weighted by their own residuals.
    pub(crate) fn new(channels: &'a Channels) -> Self {
        Self {
            channels,
            delay: false,
            only: None,
            weights: None,
            covariance: true,
            gravity_scale: 1.0,
            mass: None,
        }
    }
}

/// A delay of the load relative to the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    /// Delay, s; positive where the load is stamped later than the motion.
    pub delay_s: f64,
    /// Its standard deviation, s.
    pub std_dev_s: f64,
}

/// The parameters that explain a recording best.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// In the order of [`InertialParameters`](tactid_dynamics::InertialParameters).
    pub(crate) parameters: SVector<f64, 10>,
    /// Of the parameters, in directions that are known.
    pub(crate) covariance: SMatrix<f64, 10, 10>,
    /// Residual delay of the load, s, and its standard deviation.
    pub(crate) delay: Option<Delay>,
    /// Of the channels.
    pub(crate) noise: Noise,
    /// Of each window, 1 for a good one.
    pub(crate) weights: Vec<f64>,
    /// Weighted rms residual in units of the channels' deviations.
    pub(crate) misfit: f64,
    pub(crate) excitation: Directions,
    /// Of the whole load, where it was known.
    pub(crate) mass: Option<KnownMass>,
    /// Of the first channels, where they may be off by a constant.
    pub(crate) offsets: Vec<Offset>,
}

impl Fit {
    /// Fits; `None` where there are too few equations.
    pub(crate) fn new(equations: &[Equation], options: Options<'_>) -> Option<Self> {
        let channels = equations.first()?.rows.len();
        let used = |k: usize| options.only.is_none_or(|only| only[k]);
        let count = (0..equations.len()).filter(|&k| used(k)).count();
        if count * channels < 20 {
            return None;
        }
        let mut state = Solver::new(equations, options, channels);
        for pass in 0..MAX_PASSES {
            if options.mass.is_some() {
                // Beside a row of its own weight, the sizes of the others follow their noise.
                state.scale();
            }
            let moved = state.solve();
            if options.weights.is_none() {
                state.reweigh(pass);
                state.centre();
            }
            // Weights that are kept have settled already.
            let learning = if options.weights.is_none() {
                MEDIANS
            } else {
                2
            };
            if pass > learning && moved < SETTLED {
                break;
            }
        }
        Some(state.finish(count))
    }

    /// Of the ten values of parameters that are near the fit's.
    pub(crate) fn std_devs(&self, parameters: &SVector<f64, 10>) -> [f64; 10] {
        let Directions { scales, .. } = &self.excitation;
        std_devs(
            parameters,
            &self.covariance,
            scales,
            self.excitation.unknown(),
        )
    }

    /// Whether a window is an outlier.
    pub(crate) fn is_outlier(&self, window: usize) -> bool {
        self.weights[window] < 1.0 / (OUTLIER * OUTLIER)
    }
}

/// The state of a fit.
struct Solver<'a> {
    equations: &'a [Equation],
    options: Options<'a>,
    columns: usize,
    /// The ten parameters, then the delay.
    solution: DVector<f64>,
    scales: DVector<f64>,
    /// Of the rows of the channels that may be off by a constant: it is eliminated as their mean.
    means: Vec<(Entries, f64)>,
    /// Of all windows, the channels of each in a row.
    residuals: Vec<f64>,
    noise: Noise,
    weights: Vec<f64>,
    eigen: SymmetricEigen<f64, nalgebra::Dyn>,
}

impl<'a> Solver<'a> {
    fn new(equations: &'a [Equation], options: Options<'a>, channels: usize) -> Self {
        let columns = 10 + usize::from(options.delay);
        let (noise, weights) = match options.weights {
            Some(fit) => (fit.noise.clone(), fit.weights.clone()),
            None => (
                Noise::before_residuals(equations, options.channels, ROUNDING),
                vec![1.0; equations.len()],
            ),
        };
        let mut solver = Self {
            equations,
            options,
            columns,
            solution: DVector::zeros(columns),
            scales: DVector::repeat(columns, 1.0),
            means: vec![([0.0; 11], 0.0); options.channels.offsets],
            residuals: vec![0.0; equations.len() * channels],
            noise,
            weights,
            eigen: SymmetricEigen::new(DMatrix::zeros(columns, columns)),
        };
        solver.find_means();
        solver.scale();
        solver.find_residuals();
        solver
    }

    /// The ten entries of a row, in the gravity that is asked for, and none for a delay.
    fn without_delay(&self, row: &Row) -> Entries {
        let mut entries = [0.0; 11];
        entries[..10].copy_from_slice(row.regressor.as_slice());
        for (entry, gravity) in entries.iter_mut().zip(&row.gravity) {
            *entry += (1.0 - self.options.gravity_scale) * gravity;
        }
        entries
    }

    /// Entries, and what is wanted.
    fn row(&self, window: usize, channel: usize) -> (Entries, f64) {
        let equation = &self.equations[window];
        let row = &equation.rows[channel];
        let mut entries = self.without_delay(row);
        // wanted(t + delay) = wanted(t) + delay · rate is what belongs to the motion at t.
        entries[10] = -equation.rates[channel];
        (entries, row.target)
    }

    /// The same less the mean, where the channel may be off by a constant.
    fn centred(&self, window: usize, channel: usize) -> (Entries, f64) {
        let (mut entries, mut target) = self.row(window, channel);
        if let Some((mean, mean_target)) = self.means.get(channel) {
            for (entry, mean) in entries.iter_mut().zip(mean) {
                *entry -= mean;
            }
            target -= mean_target;
        }
        (entries, target)
    }

    /// With the weights as they are now.
    fn centre(&mut self) {
        if !self.means.is_empty() {
            self.find_means();
            self.find_residuals();
        }
    }

    fn find_means(&mut self) {
        for channel in 0..self.means.len() {
            let (mut sum, mut sum_of_targets, mut weights) = ([0.0; 11], 0.0, f64::MIN_POSITIVE);
            for window in self.windows() {
                let weight = self.weights[window];
                let (entries, target) = self.row(window, channel);
                for (sum, entry) in sum.iter_mut().zip(entries) {
                    *sum += weight * entry;
                }
                sum_of_targets += weight * target;
                weights += weight;
            }
            self.means[channel] = (sum.map(|sum| sum / weights), sum_of_targets / weights);
        }
    }

    fn predicted(&self, entries: &Entries) -> f64 {
        entries.iter().zip(&self.solution).map(|(a, x)| a * x).sum()
    }

    /// What the solution leaves of every window, used or not.
    fn find_residuals(&mut self) {
        let channels = self.noise.channels();
        for window in 0..self.equations.len() {
            for channel in 0..channels {
                let (entries, target) = self.centred(window, channel);
                self.residuals[window * channels + channel] = target - self.predicted(&entries);
            }
        }
    }

    /// A window's rows in units of their noise, uncorrelated, its columns scaled; the residual is the
    /// last column.
    fn whiten(&self, window: usize, block: &mut DMatrix<f64>) {
        let channels = self.noise.channels();
        for channel in 0..channels {
            let (entries, _) = self.centred(window, channel);
            for (k, scale) in self.scales.iter().enumerate() {
                block[(channel, k)] = scale * entries[k];
            }
            block[(channel, self.columns)] = self.residuals[window * channels + channel];
        }
        self.noise.whiten(block);
    }

    /// The same of a window's differences: noise alone, on both sides.
    fn whiten_noise(&self, window: usize, block: &mut DMatrix<f64>) {
        for (channel, row) in self.equations[window].differences.iter().enumerate() {
            let entries = self.without_delay(row);
            for (k, scale) in self.scales.iter().enumerate() {
                block[(channel, k)] = scale * entries[k];
            }
            block[(channel, self.columns)] = row.target - self.predicted(&entries);
        }
        self.noise.whiten(block);
    }

    fn block(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.noise.channels(), self.columns + 1)
    }

    fn windows(&self) -> impl Iterator<Item = usize> + use<'a> {
        let only = self.options.only;
        (0..self.equations.len()).filter(move |&k| only.is_none_or(|only| only[k]))
    }

    /// Makes columns of like size.
    fn scale(&mut self) {
        let mut squares = [0.0; 11];
        for window in self.windows() {
            for (channel, std_dev) in self.noise.std_devs.iter().enumerate() {
                let (entries, _) = self.centred(window, channel);
                for (square, entry) in squares.iter_mut().zip(entries) {
                    *square += (entry / std_dev).powi(2);
                }
            }
        }
        let largest = squares[..10].iter().fold(0.0f64, |a, &b| a.max(b));
        // A column of rounding stays as small as it is.
        let least = (largest * 1e-16).max(f64::MIN_POSITIVE);
        let of_mass = self.options.mass.map_or(0.0, |mass| mass.information());
        squares[0] = squares[0].max(least) + of_mass;
        for (scale, square) in self.scales.iter_mut().zip(squares) {
            *scale = 1.0 / square.max(least).sqrt();
        }
    }

    /// One step of weighted least squares without bias: what the motion's noise adds to the products
    /// of all rows is taken off, as the differences between two halves of the samples show it
    /// (Fuller 1987, Measurement Error Models, (3.1.9) with replicates). It starts where the solution
    /// stands, which takes off what the normal equations lost to rounding before, and gives how far
    /// it moved, in standard deviations.
    fn solve(&mut self) -> f64 {
        let columns = self.columns;
        let mut gram = DMatrix::<f64>::zeros(columns + 1, columns + 1);
        let (mut block, mut noise) = (self.block(), self.block());
        for window in self.windows() {
            let weight = self.weights[window];
            if weight == 0.0 {
                continue;
            }
            self.whiten(window, &mut block);
            self.whiten_noise(window, &mut noise);
            for i in 0..=columns {
                for j in 0..=i {
                    let whole = block.column(i).dot(&block.column(j));
                    let part = noise.column(i).dot(&noise.column(j));
                    gram[(i, j)] += weight * (whole - part);
                }
            }
        }
        if let Some(mass) = self.options.mass {
            let information = self.mass_information();
            gram[(0, 0)] += information;
            gram[(columns, 0)] += information * (mass.mass_kg - self.solution[0]) / self.scales[0];
        }
        gram.fill_upper_triangle_with_lower_triangle();
        let target = gram.view((0, columns), (columns, 1)).column(0).into_owned();
        self.eigen = SymmetricEigen::new(gram.view((0, 0), (columns, columns)).into_owned());
        let mut step = DVector::<f64>::zeros(columns);
        for (value, vector) in known(&self.eigen) {
            step += &vector * (vector.dot(&target) / value);
        }
        self.solution += step.component_mul(&self.scales);
        self.find_residuals();
        // The squared length of the step in the metric of the information.
        step.dot(&target).max(0.0).sqrt()
    }

    /// Of a known mass, in scaled parameters.
    fn mass_information(&self) -> f64 {
        let mass = self.options.mass;
        mass.map_or(0.0, |mass| mass.information() * self.scales[0].powi(2))
    }

    /// What the residuals say of the noise, and weights that let no window pull for more than a rare
    /// one would.
    fn reweigh(&mut self, pass: usize) {
        let channels = self.noise.channels();
        let windows: Vec<usize> = self.windows().collect();
        let residuals = windows.iter().map(|&window| {
            let first = window * channels;
            (
                &self.residuals[first..first + channels],
                self.weights[window],
            )
        });
        if pass < MEDIANS {
            self.noise.measure_medians(residuals);
        } else {
            self.noise.measure(residuals);
        }
        let rare = rare(channels);
        let mut residual = DMatrix::zeros(channels, 1);
        for window in 0..self.equations.len() {
            let first = window * channels;
            residual.copy_from_slice(&self.residuals[first..first + channels]);
            self.noise.whiten(&mut residual);
            self.weights[window] = weight(residual.norm_squared(), rare);
        }
    }

    fn finish(self, count: usize) -> Fit {
        let rows = self.scaled_rows();
        let squares: f64 = rows.iter().map(|row| row.residual * row.residual).sum();
        let weights: f64 = rows.iter().map(|row| row.weight).sum();
        let covariance = if self.options.covariance {
            self.covariance(&rows, count)
        } else {
            DMatrix::zeros(self.columns, self.columns)
        };
        let offsets = self.offsets(&covariance, count);
        let delay = self.options.delay.then(|| Delay {
            delay_s: self.solution[10],
            std_dev_s: covariance[(10, 10)].max(0.0).sqrt(),
        });
        Fit {
            parameters: self.solution.fixed_rows::<10>(0).into_owned(),
            covariance: covariance.fixed_view::<10, 10>(0, 0).into_owned(),
            delay,
            misfit: (squares / weights.max(f64::MIN_POSITIVE)).sqrt(),
            excitation: Directions::new(&self.eigen, self.scales.fixed_rows::<10>(0).into_owned()),
            noise: self.noise,
            weights: self.weights,
            mass: self.options.mass,
            offsets,
        }
    }

    /// Of the parameters, from so many windows.
    fn covariance(&self, rows: &[ScaledRow], count: usize) -> DMatrix<f64> {
        let channels = self.noise.channels();
        let mut bread = DMatrix::<f64>::zeros(self.columns, self.columns);
        for (value, vector) in known(&self.eigen) {
            bread.ger(1.0 / value, &vector, &vector, 1.0);
        }
        let independent = (count * channels) as f64 / NOISE_CORRELATION;
        let unknowns = self.columns + self.means.len();
        let freedom = (independent - unknowns as f64).max(1.0);
        let scores = covariance::of_scores(rows, channels, self.columns) * independent / freedom;
        let noise = covariance::of_noise(rows, channels, &bread);
        // What lasts longer than the filter shows in the scores, if there are enough of them.
        let size = |meat: &DMatrix<f64>| (&bread * meat).trace();
        let (meat, widening) = if size(&scores) > size(&noise.meat) {
            (scores, DVector::repeat(self.columns, 1.0))
        } else {
            (noise.meat, noise.widening)
        };
        let inflation = self.noise.inflation(count as f64 / PRODUCT_CORRELATION);
        let mut meat = meat * inflation;
        // The weighing's own variance: its weight makes up for what neighbouring windows share.
        meat[(0, 0)] += self.mass_information() * NOISE_CORRELATION;
        let scaled = &bread * meat * &bread;
        let mut scales = self.scales.component_mul(&widening);
        if self.mass_information() > 0.0 {
            // A mass that was weighed was not learnt from the residuals.
            scales[0] = self.scales[0];
        }
        DMatrix::from_fn(self.columns, self.columns, |i, j| {
            scaled[(i, j)] * scales[i] * scales[j]
        })
    }

    /// What the solution leaves of the means.
    fn offsets(&self, covariance: &DMatrix<f64>, count: usize) -> Vec<Offset> {
        let noise = self.noise.std_devs.iter();
        let offset = |((mean, target), noise): (&(Entries, f64), &f64)| {
            let mean_row = DVector::from_column_slice(&mean[..self.columns]);
            let of_parameters = mean_row.dot(&(covariance * &mean_row));
            let of_mean = noise * noise * NOISE_CORRELATION / count as f64;
            Offset {
                value: target - self.predicted(mean),
                std_dev: (of_parameters + of_mean).max(0.0).sqrt(),
            }
        };
        self.means.iter().zip(noise).map(offset).collect()
    }

    /// The rows of the windows that are used, each times the root of its weight.
    fn scaled_rows(&self) -> Vec<ScaledRow> {
        let mut rows = Vec::new();
        let (mut block, mut noise) = (self.block(), self.block());
        for window in self.windows() {
            let weight = self.weights[window];
            self.whiten(window, &mut block);
            self.whiten_noise(window, &mut noise);
            block *= weight.sqrt();
            noise *= weight.sqrt();
            for (row, noise) in block.row_iter().zip(noise.row_iter()) {
                let (residual, difference) = (row[self.columns], noise[self.columns]);
                let mut scaled = ScaledRow {
                    entries: [0.0; 11],
                    residual,
                    score: [0.0; 11],
                    weight,
                };
                for k in 0..self.columns {
                    scaled.entries[k] = row[k];
                    scaled.score[k] = row[k] * residual - noise[k] * difference;
                }
                rows.push(scaled);
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests;
