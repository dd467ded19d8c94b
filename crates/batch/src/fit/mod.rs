//! The parameters that explain a recording best, and what a fit may use.

pub(crate) mod elimination;
pub(crate) mod further;
pub(crate) mod least_squares;
pub(crate) mod normal_equations;
pub(crate) mod products;
mod rows;
mod sandwich;
mod vector_unit;

use nalgebra::{Dyn, OMatrix, RowSVector, SMatrix, SVector, U10};
use schemars::JsonSchema;
use serde::Serialize;
use tactid_identify::equations::{Channels, Equation, OffsetFrame, Row};
use tactid_identify::solve::Noise;
use tactid_identify::solve::NullSpace;
use tactid_identify::solve::OUTLIER;
use tactid_identify::solve::Offsets;
use tactid_identify::solve::{std_dev, value_jacobian};
use tactid_identify::{KnownMass, WrenchOffset};

use self::normal_equations::NormalEquations;
use crate::solve::Excitation;

/// Step of a pass, in standard deviations, below which parameters that are reported have converged.
const CONVERGED: f64 = 1e-5;

/// Step of a pass, in standard deviations, that no interval shows. It ends fits of which only the
/// size of the residuals is needed, which change with its square, and passes around whole fits,
/// whose parameters are reported.
pub(crate) const CONVERGED_ENOUGH: f64 = 1e-3;

/// What a fit may use, and what it estimates besides the parameters.
#[derive(Clone, Copy)]
pub(crate) struct FitOptions<'a> {
    /// The channels, their grouping, their offsets and their known noise.
    pub(crate) channels: &'a Channels,
    /// Whether a delay of the load is estimated, too.
    pub(crate) delay: bool,
    /// Whether each window is used; `None` for all.
    pub(crate) used: Option<&'a [bool]>,
    /// A fit whose robust weights and noise are used unchanged.
    pub(crate) weights_of: Option<&'a Fit>,
    /// A fit to almost the same equations, from which this one starts: it then needs fewer passes.
    pub(crate) start: Option<&'a Fit>,
    /// Step of a pass, in standard deviations, below which the parameters have converged:
    /// [`CONVERGED`] or [`CONVERGED_ENOUGH`].
    pub(crate) converged: f64,
    /// Whether the covariance is computed, which takes about as long as a pass.
    pub(crate) covariance: bool,
    /// Scale applied to gravity: 1 as configured, 0 for weightlessness, -1 for the opposite sign.
    pub(crate) gravity_scale: f64,
    /// Known mass of the whole load.
    pub(crate) known_mass: Option<KnownMass>,
    /// Number of unknowns that were eliminated from the equations.
    pub(crate) eliminated: usize,
}

impl<'a> FitOptions<'a> {
    /// All windows, weighted by their own residuals, with covariance.
    pub(crate) fn new(channels: &'a Channels) -> Self {
        Self {
            channels,
            delay: false,
            used: None,
            weights_of: None,
            start: None,
            converged: CONVERGED,
            covariance: true,
            gravity_scale: 1.0,
            known_mass: None,
            eliminated: 0,
        }
    }
}

/// Changes of the ten parameters, a column for each unknown that causes them.
pub type GainErrors = OMatrix<f64, U10, Dyn>;

/// A delay of the load relative to the motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Delay {
    /// Delay, s; positive where the load is stamped later than the motion.
    pub delay_s: f64,
    /// Standard deviation of the delay, s.
    pub std_dev_s: f64,
}

/// The parameters that explain a recording best, with their uncertainty.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// Parameters of the whole load, in the order of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters).
    pub(crate) parameters: SVector<f64, 10>,
    /// Covariance of the parameters, zero in unobservable directions.
    pub(crate) covariance: SMatrix<f64, 10, 10>,
    /// Covariance in whose metric the parameters are projected onto consistent ones. It takes the
    /// noise to be the same in all windows: variances that are too small by chance would distort a
    /// projection.
    pub(crate) metric: SMatrix<f64, 10, 10>,
    /// Covariance that the parameters would have if the whitened noise of all windows were
    /// independent, zero in unobservable directions. It depends on the noise only through the
    /// channels' sizes and correlations.
    pub(crate) bread: SMatrix<f64, 10, 10>,
    /// What an error of each channel's gain of one standard deviation changes in the parameters;
    /// empty where gains are exact. It is part of the covariance.
    pub(crate) gain_errors: GainErrors,
    /// Delay of the load that is left in the windows, where it was estimated and the motion
    /// determines it.
    pub(crate) delay: Option<Delay>,
    /// Noise of the channels.
    pub(crate) noise: Noise,
    /// Number of independent windows, or of degrees of freedom, from which the covariance was
    /// estimated.
    pub(crate) independent: f64,
    /// Robust weight of each window: 1, or less for a rare one.
    pub(crate) weights: Vec<f64>,
    /// How strongly the rows excite each direction of the scaled parameters.
    pub(crate) excitation: Excitation,
    /// The unobservable directions.
    pub(crate) null_space: NullSpace,
    /// How far parts of the payload may be from the origin of the tool frame, m: as the known part
    /// of its centre of mass, and as the size of a sensor, the lever arm at which the noise of a
    /// force has the moment of the noise of a moment.
    pub(crate) reach_m: f64,
    /// Mass of the whole load, where it was known.
    pub(crate) known_mass: Option<KnownMass>,
    /// Offsets of the six channels of the wrench in the tool frame, where they are unknown.
    pub(crate) offsets: Option<Offsets>,
    /// Scale applied to gravity: 1 as configured.
    pub(crate) gravity_scale: f64,
}

impl Fit {
    /// Unit of each scaled parameter, in the parameter's unit.
    pub(crate) fn scales(&self) -> &SVector<f64, 10> {
        self.null_space.scales()
    }

    /// Adds what the errors of the gains cause to the covariance, given the equations of the fit
    /// and which of them it uses.
    fn add_gain_errors(&mut self, equations: &[Equation], used: Option<&[bool]>) {
        let of_rows = |equation: &Equation| equation.rows.iter().any(|row| row.gain_error != 0.0);
        if !equations.iter().any(of_rows) {
            return;
        }
        let mut sums = NormalEquations::with_known_mass(self);
        for (window, equation) in equations.iter().enumerate() {
            if used.is_none_or(|used| used[window]) {
                sums.add(equation, window);
            }
        }
        let mut errors = sums.gain_errors(&sums.spectrum());
        for mut error in errors.column_iter_mut() {
            error.component_mul_assign(self.scales());
        }
        self.gain_errors = errors;
        self.covariance += self.gain_covariance();
    }

    /// Returns the part of the covariance that errors of the gains cause; the rest is noise.
    pub(crate) fn gain_covariance(&self) -> SMatrix<f64, 10, 10> {
        &self.gain_errors * self.gain_errors.transpose()
    }

    /// Returns the fraction of the variance of each of the ten values that is noise, at the
    /// `parameters` of the payload: 1 where the gains and the known bodies are exact. The rest is
    /// caused by errors of the gains, and by those of the known bodies, whose covariance is
    /// `of_known`.
    pub(crate) fn noise_fraction(
        &self,
        parameters: &SVector<f64, 10>,
        of_known: &SMatrix<f64, 10, 10>,
    ) -> [f64; 10] {
        let Some(slopes) = value_jacobian(parameters) else {
            return [1.0; 10];
        };
        let variances = |of: &SMatrix<f64, 10, 10>| (slopes * of * slopes.transpose()).diagonal();
        let (constant, all) = (
            variances(&(self.gain_covariance() + of_known)),
            variances(&(self.covariance + of_known)),
        );
        std::array::from_fn(|k| {
            if all[k] > 0.0 {
                (1.0 - constant[k] / all[k]).clamp(0.0, 1.0)
            } else {
                1.0
            }
        })
    }

    /// Returns the standard deviation of the mass of the whole load, kg; infinite where the motion
    /// does not determine the mass. Unlike [`std_devs`](Self::std_devs), it is known for a mass of
    /// zero, too.
    pub(crate) fn mass_std_dev_kg(&self) -> f64 {
        let mut gradient = RowSVector::zeros();
        gradient[0] = 1.0;
        std_dev(&gradient, &self.covariance, &self.null_space)
    }

    /// Returns what the parameters and the offset leave of a channel's mean over a window, in the
    /// channel's unit.
    pub(crate) fn residual(&self, equation: &Equation, channel: usize) -> f64 {
        let entry = |offsets: Offsets| offsets.values.get(channel).copied();
        let offset = self.offsets.and_then(entry).unwrap_or(0.0);
        self.remainder(&equation.rows[channel]) - offset
    }

    /// Returns what the parameters leave of a row. The offset of the channel is in it.
    pub(crate) fn remainder(&self, row: &Row) -> f64 {
        let gravity = row.gravity.dot(&self.parameters.fixed_rows::<4>(0));
        row.target - row.regressor.dot(&self.parameters) - (1.0 - self.gravity_scale) * gravity
    }

    /// Returns the offset of the wrenches with its standard deviations in a frame, where it was
    /// unknown.
    pub(crate) fn wrench_offset(&self, frame: &OffsetFrame) -> Option<WrenchOffset> {
        let offsets = self.offsets?.mapped(frame.map());
        let std_devs = offsets.std_devs(&self.covariance, &self.null_space);
        Some(frame.offset(&offsets.values, Some(std_devs)))
    }

    /// Returns whether a window is an outlier.
    pub(crate) fn is_outlier(&self, window: usize) -> bool {
        self.weights[window] < 1.0 / (OUTLIER * OUTLIER)
    }
}
