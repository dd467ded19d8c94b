//! Statistics of the beginning of a recording, from which its filter and its delay are chosen.

use std::borrow::Cow;

use nalgebra::{SMatrix, SVector, Vector3};
use tactid_identify::equations::{Channels, Equation, Row, Unknowns, WRENCH, window};
use tactid_identify::solve::target_sizes;

use crate::diagnosis::FAR_BETTER;
use crate::fit::products::{Products, WIDTH, WideRow};
use crate::fit::{CONVERGED_ENOUGH, Delay, Fit, FitOptions, further, least_squares};

/// Longest delay that is searched for, s.
pub const LONGEST_DELAY_S: f64 = 0.5;
/// Increase of the log-likelihood, as a difference of sums of squares in units of noise, from which
/// a coarse delay is accepted: the best of many candidates is better by chance.
const SIGNIFICANT_GAIN: f64 = 60.0;
/// Fewest pairs of windows from which a residual is computed.
const FEWEST_PAIRS: u32 = 20;

/// Returns the power of the motion: the mean square of the regressors' entries that are angular
/// accelerations and products of angular velocities, 1/s⁴; zero without equations.
#[must_use]
pub fn motion_power(equations: &[Equation]) -> f64 {
    power(equations, |equation| &equation.rows)
}

/// Mean square of the same entries that is white noise of the motion, from the half-differences of
/// neighbouring instants, 1/s⁴; zero without equations. It is to be compared with [`motion_power`].
#[must_use]
pub fn motion_noise_power(equations: &[Equation]) -> f64 {
    power(equations, |equation| &equation.differences)
}

/// Mean square of the entries of the inertia in the chosen rows.
fn power(equations: &[Equation], rows: impl Fn(&Equation) -> &Vec<Row>) -> f64 {
    let rows = equations.iter().flat_map(rows);
    let squares: f64 = rows
        .map(|row| row.regressor.fixed_rows::<6>(4).norm_squared())
        .sum();
    squares / equations.len().max(1) as f64
}

/// Returns the geometric mean over the channels of the standard deviation of the residuals of a
/// fit, in the channels' units; `None` where the equations are too few.
#[must_use]
pub fn residual_size(equations: &[Equation], channels: &Channels) -> Option<f64> {
    let fit = fit_of_residuals(equations, &without_known_noise(channels))?;
    Some(geometric_mean(&fit.noise.std_devs))
}

/// Returns the geometric mean over the channels of the root mean square of the measurements, in the
/// channels' units.
#[must_use]
pub fn target_size(equations: &[Equation]) -> f64 {
    let channels = equations.first().map_or(0, |equation| equation.rows.len());
    let mut sizes = vec![0.0; channels];
    target_sizes(equations, &vec![1; channels], &mut sizes);
    geometric_mean(&sizes)
}

fn geometric_mean(sizes: &[f64]) -> f64 {
    let logarithms: f64 = sizes.iter().map(|size| size.ln()).sum();
    (logarithms / sizes.len() as f64).exp()
}

/// Fits the parameters as far as their residuals need it, without their covariance.
fn fit_of_residuals(equations: &[Equation], channels: &Channels) -> Option<Fit> {
    let options = FitOptions {
        converged: CONVERGED_ENOUGH,
        covariance: false,
        ..FitOptions::new(channels)
    };
    least_squares::fit(equations, options)
}

/// Returns equations without what further unknowns of the wrench explain, among which an offset
/// counts; as they are where there is none, or where they are too few. `gravity` is the given one,
/// m/s².
#[must_use]
pub fn without_unknowns(
    equations: Vec<Equation>,
    channels: &Channels,
    gravity: &Vector3<f64>,
    unknowns: Unknowns,
) -> Vec<Equation> {
    if !unknowns.any() {
        return equations;
    }
    let channels = without_known_noise(channels).with_offsets(true);
    let found = further::fit(&equations, FitOptions::new(&channels), gravity, unknowns);
    match found.map(|found| found.equations) {
        Some(Cow::Owned(reduced)) => reduced,
        _ => equations,
    }
}

/// Returns the delay of the load relative to the motion; `None` where the equations are too few. It
/// is accurate for delays that are short against a window.
#[must_use]
pub fn fitted_delay(equations: &[Equation], channels: &Channels) -> Option<Delay> {
    let channels = without_known_noise(channels);
    let fit = fit_of_residuals(equations, &channels)?;
    least_squares::delay(equations, &fit, FitOptions::new(&channels))
}

/// The delay of the wrenches, as a multiple of the time between two windows, at which they fit the
/// motion best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseDelay {
    /// Delay, s; positive where the wrenches are stamped later than the motion. Zero where no other
    /// fits significantly better.
    pub delay_s: f64,
    /// Residual with the delay, relative to that without.
    pub residual_ratio: f64,
    /// Whether the delay is at the end of the search, [`LONGEST_DELAY_S`], so that a longer one may
    /// fit better still.
    pub is_at_end: bool,
}

/// Returns the coarse delay of the wrenches in windows that begin `stride_s` apart. `None` where
/// the stride is not positive, where the first channels are not those of a wrench, where the sign
/// of gravity is in doubt, or where the equations are too few.
#[must_use]
pub fn coarse_delay(
    equations: &[Equation],
    channels: &Channels,
    stride_s: f64,
) -> Option<CoarseDelay> {
    if !(stride_s > 0.0 && channels.begin_with_wrench()) {
        return None;
    }
    // A window is paired with one at another time: by more than half of the recording, an unknown
    // offset would explain the few pairs that are left.
    let reach = (LONGEST_DELAY_S / stride_s)
        .ceil()
        .min(equations.len() as f64 / 2.0) as i64;
    let mut sizes = [0.0; 6];
    target_sizes(equations, &[3, 3], &mut sizes);
    let has_offset = channels.offsets > 0;
    let pairs = |gravity_scale| Pairs::new(equations, stride_s, &sizes, gravity_scale, has_offset);
    let upside_down = pairs(-1.0).mean_square_residual(0);
    let pairs = pairs(1.0);
    let unshifted = pairs.mean_square_residual(0)?;
    if upside_down.is_some_and(|other| other < FAR_BETTER * unshifted) {
        return None;
    }
    let of_shift = |shift| Some((pairs.mean_square_residual(shift)?, shift));
    let shifts = (-reach..=reach).filter_map(of_shift);
    let (best, shift) = shifts.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let independent = equations.len() as f64 / window::NOISE_CORRELATION * 6.0;
    let gain = (unshifted - best) / best.max(f64::MIN_POSITIVE) * independent;
    Some(if gain > SIGNIFICANT_GAIN {
        CoarseDelay {
            delay_s: shift as f64 * stride_s,
            residual_ratio: (best / unshifted).sqrt(),
            is_at_end: shift.abs() >= reach - 1,
        }
    } else {
        CoarseDelay {
            delay_s: 0.0,
            residual_ratio: 1.0,
            is_at_end: false,
        }
    })
}

/// Returns the channels as if nothing were known of the sensors' noise.
fn without_known_noise(channels: &Channels) -> Channels {
    Channels {
        known_noise: Vec::new(),
        ..channels.clone()
    }
}

/// The windows of a recording, whose motions are paired with wrenches of other windows.
struct Pairs {
    windows: Vec<ScaledWindow>,
    stride_s: f64,
    /// Products of the rows of all windows.
    products: Products,
}

/// A window with its channels in units of their sizes.
struct ScaledWindow {
    time_s: f64,
    rows: [WideRow; WRENCH],
    targets: [f64; WRENCH],
}

impl ScaledWindow {
    fn new(equation: &Equation, sizes: &[f64], gravity_scale: f64) -> Self {
        let mut window = Self {
            time_s: equation.time_s,
            rows: [[0.0; WIDTH]; WRENCH],
            targets: [0.0; WRENCH],
        };
        for (channel, size) in sizes.iter().enumerate() {
            let row = &equation.rows[channel];
            let regressor = row.regressor_at(gravity_scale) / *size;
            window.rows[channel][..10].copy_from_slice(regressor.as_slice());
            window.targets[channel] = row.target / size;
        }
        window
    }
}

/// Subtracts the mean rows and the mean targets of windows from each.
fn subtract_mean(windows: &mut [ScaledWindow]) {
    let fraction = (windows.len() as f64).recip();
    for channel in 0..WRENCH {
        let (mut mean, mut of_targets) = ([0.0; WIDTH], 0.0);
        for window in windows.iter() {
            for (sum, entry) in mean.iter_mut().zip(&window.rows[channel]) {
                *sum += fraction * entry;
            }
            of_targets += fraction * window.targets[channel];
        }
        for window in windows.iter_mut() {
            for (entry, mean) in window.rows[channel].iter_mut().zip(&mean) {
                *entry -= mean;
            }
            window.targets[channel] -= of_targets;
        }
    }
}

impl Pairs {
    /// Takes windows with the `sizes` of their channels and a scale applied to gravity, less the
    /// mean of all windows where the wrenches have an offset.
    fn new(
        equations: &[Equation],
        stride_s: f64,
        sizes: &[f64],
        gravity_scale: f64,
        has_offset: bool,
    ) -> Self {
        let scaled = |equation| ScaledWindow::new(equation, sizes, gravity_scale);
        let mut windows: Vec<ScaledWindow> = equations.iter().map(scaled).collect();
        if has_offset {
            subtract_mean(&mut windows);
        }
        let mut products = Products::zero();
        for window in &windows {
            products.add_lower(&window.rows, 1.0);
        }
        Self {
            windows,
            stride_s,
            products,
        }
    }

    /// Returns the window whose wrench belongs to the motion of the window `k`, if it is `shift`
    /// windows later. Windows next to a gap have none.
    fn partner(&self, k: usize, shift: i64) -> Option<&ScaledWindow> {
        let at = usize::try_from(k as i64 + shift).ok()?;
        let load = self.windows.get(at)?;
        let gap_s = load.time_s - self.windows[k].time_s - shift as f64 * self.stride_s;
        (gap_s.abs() <= 0.1 * self.stride_s).then_some(load)
    }

    /// Returns the mean square residual of plain least squares, relative to the sizes of the
    /// channels, if each wrench belongs to the motion `shift` windows before. The products of the
    /// motions are those of all windows but the few without a partner.
    fn mean_square_residual(&self, shift: i64) -> Option<f64> {
        let mut unpaired = Products::zero();
        let mut sums = [0.0; WIDTH];
        let (mut squares, mut count) = (0.0, 0u32);
        for (k, motion) in self.windows.iter().enumerate() {
            let Some(load) = self.partner(k, shift) else {
                unpaired.add_lower(&motion.rows, 1.0);
                continue;
            };
            for (row, target) in motion.rows.iter().zip(&load.targets) {
                for (sum, entry) in sums.iter_mut().zip(row) {
                    *sum += entry * target;
                }
                squares += target * target;
            }
            count += 1;
        }
        if count < FEWEST_PAIRS {
            return None;
        }
        let gram = self.products.square::<10>() - unpaired.square::<10>();
        let right_side = SVector::<f64, 10>::from_fn(|k, _| sums[k]);
        let scale = gram
            .diagonal()
            .map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
        let scaled = SMatrix::<f64, 10, 10>::from_fn(|i, j| {
            gram[(i, j)] * scale[i] * scale[j] + if i == j { 1e-9 } else { 0.0 }
        });
        let right_side = right_side.component_mul(&scale);
        let solution = scaled.cholesky()?.solve(&right_side);
        // Rounding must not make an exact fit less than exact.
        Some(((squares - solution.dot(&right_side)) / f64::from(count)).max(1e-12))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tactid_identify::equations::Channel;

    #[test]
    fn no_equations_have_no_power_and_no_delay() {
        assert_eq!((motion_power(&[]), motion_noise_power(&[])), (0.0, 0.0));
        assert_eq!(coarse_delay(&[], &Channels::of_wrench(), 0.03), None);
    }

    /// Equations with as many rows as a wrench has, 0.03 s apart.
    fn six_rows() -> Vec<Equation> {
        let equation = |k: i32| {
            let mut equation = Equation::new(6);
            equation.time_s = 0.03 * f64::from(k);
            for (entry, row) in equation.rows.iter_mut().enumerate() {
                row.regressor[entry] = 1.0;
                row.target = 1.0;
            }
            equation
        };
        (0..100).map(equation).collect()
    }

    /// Only the channels of a wrench have a coarse delay, and not those of as many joint efforts.
    #[test]
    fn six_efforts_are_no_wrench() {
        let equations = six_rows();
        let wrench = Channels::of_wrench();
        let efforts = Channels {
            channels: (1..=6)
                .map(|joint| Channel {
                    name: format!("effort joint_{joint}"),
                    unit: "N m",
                })
                .collect(),
            kinds: vec![6],
            ..wrench.clone()
        };
        assert_eq!(coarse_delay(&equations, &efforts, 0.03), None);
        let delay = coarse_delay(&equations, &wrench, 0.03).unwrap();
        assert_eq!(delay.delay_s, 0.0);
    }

    /// A stride that is not positive has no delay, and one that is far too short ends the search
    /// nevertheless.
    #[test]
    fn any_stride_ends_the_search() {
        let (equations, wrench) = (six_rows(), Channels::of_wrench());
        for stride_s in [0.0, -0.03, f64::NAN] {
            assert_eq!(coarse_delay(&equations, &wrench, stride_s), None);
        }
        for stride_s in [1e-300, f64::INFINITY] {
            let delay = coarse_delay(&equations, &wrench, stride_s);
            assert!(delay.is_none_or(|delay| delay.delay_s == 0.0), "{delay:?}");
        }
    }
}
