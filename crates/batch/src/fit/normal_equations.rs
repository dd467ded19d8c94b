//! Normal equations that grow window by window, with the weights and the noise of a fit.

use nalgebra::{SMatrix, SVector, U10};
use tactid_identify::KnownMass;
use tactid_identify::equations::window::NOISE_CORRELATION;
use tactid_identify::equations::{Equation, Row};
use tactid_identify::solve::Centering;
use tactid_identify::solve::Whitening;

use super::products::{Products, WIDTH, WideRow};
use super::rows::TARGET;
use super::{Fit, GainErrors};
use crate::solve::Spectrum;

/// Returns the weight of a row whose target is a known mass among the whitened rows of windows,
/// 1/kg². It is enlarged, because the rows of neighbouring windows share samples and are
/// overweighted by the same factor.
pub(crate) fn mass_information(mass: KnownMass) -> f64 {
    NOISE_CORRELATION / mass.std_dev_kg.powi(2)
}

/// Normal equations in scaled parameters, with errors-in-variables bias correction.
pub(crate) struct NormalEquations<'a> {
    fit: &'a Fit,
    whitening: Whitening,
    /// Products of the columns of all rows so far, and of what the noise of the motion adds to
    /// them.
    of_rows: Products,
    of_noise: Products,
    /// Number of windows so far.
    windows: usize,
    /// Information of the known mass, and its product with the scaled mass.
    of_mass: [f64; 2],
    /// What an error of each channel's gain of one standard deviation adds to the right-hand side,
    /// a column for each channel.
    gain_errors: GainErrors,
    centering: Centering,
    rows: Vec<Row>,
    /// Rows of a window before and after whitening.
    wide: Vec<WideRow>,
    white: Vec<WideRow>,
}

impl<'a> NormalEquations<'a> {
    /// Creates the equations of no windows, with the known mass of the fit if it has one.
    pub(crate) fn with_known_mass(fit: &'a Fit) -> Self {
        let mut equations = Self::new(fit);
        if let Some(mass) = fit.known_mass {
            let scale = fit.scales()[0];
            equations.of_mass =
                [scale.powi(2), scale * mass.mass_kg].map(|factor| mass_information(mass) * factor);
        }
        equations
    }

    /// Creates the equations of no windows.
    pub(crate) fn new(fit: &'a Fit) -> Self {
        let channels = fit.noise.channels();
        Self {
            fit,
            whitening: Whitening::new(&fit.noise),
            of_rows: Products::zero(),
            of_noise: Products::zero(),
            windows: 0,
            of_mass: [0.0; 2],
            centering: Centering::new(if fit.offsets.is_some() { 6 } else { 0 }),
            rows: Vec::new(),
            gain_errors: GainErrors::zeros(channels),
            wide: vec![[0.0; WIDTH]; channels],
            white: vec![[0.0; WIDTH]; channels],
        }
    }

    /// Returns the information of the windows so far.
    pub(crate) fn information(&self) -> SMatrix<f64, 10, 10> {
        self.of_rows() - self.of_noise.square::<10>()
    }

    /// Returns the observable directions of the windows so far.
    pub(crate) fn spectrum(&self) -> Spectrum<U10> {
        Spectrum::with_noise(&self.of_rows(), &self.of_noise.square(), self.windows)
    }

    /// Returns the information of the windows so far and of the known mass, with what the noise of
    /// the motion adds.
    fn of_rows(&self) -> SMatrix<f64, 10, 10> {
        let mut of_rows = self.of_rows.square();
        of_rows[(0, 0)] += self.of_mass[0];
        of_rows
    }

    /// Returns the right-hand side.
    pub(crate) fn target(&self) -> SVector<f64, 10> {
        let [rows, noise] = [&self.of_rows, &self.of_noise];
        let mut target =
            SVector::<f64, 10>::from_fn(|k, _| rows.entry(TARGET, k) - noise.entry(TARGET, k));
        target[0] += self.of_mass[1];
        target
    }

    /// Adds the window of the fit with this index.
    pub(crate) fn add(&mut self, equation: &Equation, window: usize) {
        let weight = self.fit.weights[window];
        self.windows += 1;
        self.rows.clone_from(&equation.rows);
        if self.centering.is_needed() {
            let is_first = self.centering.is_empty();
            self.centering.centre(&mut self.rows, weight);
            self.centering.add(&equation.rows, weight);
            if is_first {
                return;
            }
        }
        let rows = std::mem::take(&mut self.rows);
        self.whiten(&rows);
        self.of_rows.add_lower(&self.white, weight);
        self.add_gain_errors(&rows, weight);
        self.rows = rows;
        self.whiten(&equation.differences);
        self.of_noise.add_lower(&self.white, weight);
        self.add_gain_errors(&equation.differences, -weight);
    }

    /// Computes the whitened rows with scaled columns and the target at [`TARGET`].
    fn whiten(&mut self, rows: &[Row]) {
        for (wide, row) in self.wide.iter_mut().zip(rows) {
            let entries = row.regressor.iter().zip(self.fit.scales());
            for (wide, (entry, scale)) in wide.iter_mut().zip(entries) {
                *wide = entry * scale;
            }
            wide[TARGET] = row.target;
        }
        self.whitening.apply(&self.wide, &mut self.white);
    }

    /// Adds what the errors of the gains of a window's rows, of which the whitened ones are at
    /// hand, add to the right-hand side.
    fn add_gain_errors(&mut self, rows: &[Row], weight: f64) {
        for (channel, row) in rows.iter().enumerate() {
            if row.gain_error == 0.0 {
                continue;
            }
            let mut sums = self.gain_errors.column_mut(channel);
            for (k, white) in self.white.iter().enumerate().skip(channel) {
                let factor = weight * row.gain_error * self.whitening.factor(k, channel);
                for (sum, entry) in sums.iter_mut().zip(white) {
                    *sum += factor * entry;
                }
            }
        }
    }

    /// Returns what an error of each channel's gain of one standard deviation changes in the scaled
    /// parameters, zero in unobservable directions, given the spectrum of the information.
    ///
    /// An error of a gain moves the parameters as the same change of its channel's targets moves
    /// them, with the weights and the noise of the fit.
    pub(crate) fn gain_errors(&self, spectrum: &Spectrum<U10>) -> GainErrors {
        let mut steps = GainErrors::zeros(self.gain_errors.ncols());
        for (error, mut step) in self.gain_errors.column_iter().zip(steps.column_iter_mut()) {
            let moved: SVector<f64, 10> = spectrum
                .observable()
                .map(|(information, direction)| direction * (direction.dot(&error) / information))
                .sum();
            step.copy_from(&spectrum.vector_across_unobservable(moved));
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector4;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::fit::{FitOptions, least_squares};
    use tactid_identify::equations::{Channel, Channels};

    /// Returns equations of three joints with random rows and half-differences, whose gains have
    /// different errors.
    fn equations(random: &mut SmallRng) -> Vec<Equation> {
        let mut row = |size: f64, gain: f64| {
            let regressor = SVector::<f64, 10>::from_fn(|_, _| random.random_range(-size..size));
            let effort = regressor.sum() + random.random_range(-size..size);
            Row {
                regressor,
                target: effort - 0.3 * size,
                gravity: Vector4::zeros(),
                gain_error: gain * effort,
            }
        };
        let gains = [0.02, 0.05, 0.0];
        let mut of_window = |_| {
            let mut equation = Equation::new(3);
            equation.rows = gains.map(|gain| row(1.0, gain)).to_vec();
            equation.differences = gains.map(|gain| row(0.1, gain)).to_vec();
            equation
        };
        (0..60).map(&mut of_window).collect()
    }

    fn channels() -> Channels {
        let named = |name: &str| Channel {
            name: name.to_owned(),
            unit: "N m",
        };
        Channels {
            channels: ["a", "b", "c"].map(named).to_vec(),
            kinds: vec![3],
            sources: vec![3],
            offsets: 0,
            known_noise: Vec::new(),
            projection: None,
        }
    }

    /// Returns equations with every row changed, which may depend on its channel.
    fn changed(equations: &[Equation], change: impl Fn(usize, &mut Row)) -> Vec<Equation> {
        let mut changed = equations.to_vec();
        for equation in &mut changed {
            for rows in [&mut equation.rows, &mut equation.differences] {
                for (channel, row) in rows.iter_mut().enumerate() {
                    change(channel, row);
                }
            }
        }
        changed
    }

    /// The covariance of the gains is that of the changes of a fit with the same weights when the
    /// targets of one channel after another change by an error of its gain of one standard
    /// deviation; also where the mass is known. The whole covariance is larger than that of exact
    /// gains by as much.
    #[test]
    fn covariance_of_gains_is_that_of_refits() {
        let equations = equations(&mut SmallRng::seed_from_u64(5));
        let channels = channels();
        let weighed = KnownMass {
            mass_kg: 0.9,
            std_dev_kg: 0.05,
        };
        for known_mass in [None, Some(weighed)] {
            let options = FitOptions {
                known_mass,
                ..FitOptions::new(&channels)
            };
            let found = least_squares::fit(&equations, options).unwrap();
            let refit = |equations: &[Equation]| {
                let options = FitOptions {
                    weights_of: Some(&found),
                    ..options
                };
                least_squares::fit(equations, options).unwrap().parameters
            };
            let mut expected = SMatrix::<f64, 10, 10>::zeros();
            for wrong in 0..3 {
                let moved = changed(&equations, |channel, row| {
                    row.target += if channel == wrong {
                        row.gain_error
                    } else {
                        0.0
                    };
                });
                let step = refit(&moved) - refit(&equations);
                expected += step * step.transpose();
            }
            assert!(expected.amax() > 1e-6, "{expected}");
            let difference = (found.gain_covariance() - expected).amax();
            assert!(difference < 1e-6 * expected.amax(), "{difference}");
            let exact = changed(&equations, |_, row| row.gain_error = 0.0);
            let exact = least_squares::fit(&exact, options).unwrap();
            assert_eq!(
                exact.noise_fraction(&exact.parameters, &SMatrix::zeros()),
                [1.0; 10]
            );
            let added = (found.covariance - exact.covariance - expected).amax();
            assert!(added < 1e-6 * expected.amax(), "{added}");
        }
    }
}
