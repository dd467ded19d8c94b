//! The first part of a recording, looked at before the whole: its filter and its delay.

use nalgebra::{SMatrix, SVector};

use super::streams::{Aligned, Aligner, Event, Layout};
use crate::equation::{Equation, Row};
use crate::fit::{Fit, Options};
use crate::front::EquationStream;
use crate::noise::{self, Channels};
use crate::{IdentifyError, Sample, Settings, Method, window};

/// How much of the recording is looked at, s.
pub(crate) const LENGTH_S: f64 = 30.0;

/// The shortest window that is tried has this many samples of the slowest stream.
const FEWEST_SAMPLES: f64 = 16.0;
/// The longest window that is tried, s.
const LONGEST_S: f64 = 1.0;

/// The part of the accelerations' power that may be noise.
const QUIET: f64 = 1e-4;

/// The part of the accelerations' power that the filter keeps at least.
const KEPT: f64 = 0.8;

/// Delays up to this are looked for, s.
const LONGEST_DELAY_S: f64 = 0.5;
/// A delay is corrected when it is this many times its standard deviation, and longer than
/// [`SHORTEST_DELAY_S`].
const SIGNIFICANT: f64 = 6.0;
/// A coarse delay must explain so much more, as a difference of sums of squares in units of noise:
/// the best of many tries is lucky.
const LUCK: f64 = 60.0;
/// Gravity of the other sign that leaves less than this part of the mean square residual makes any
/// delay meaningless.
const OTHER_GRAVITY: f64 = 0.25;
/// Shorter delays do no harm that is worth an interpolation, s.
const SHORTEST_DELAY_S: f64 = 1e-4;

/// What turns a recording's events into equations.
pub(crate) struct Chain<'a> {
    pub(crate) robot: &'a tactid_dynamics::Manipulator,
    pub(crate) tool: &'a str,
    pub(crate) sensors: &'a [&'a str],
    pub(crate) settings: &'a Settings,
    pub(crate) layout: &'a Layout,
}

impl Chain<'_> {
    /// All equations of some events.
    fn equations(
        &self,
        events: &[Event],
        delay_s: f64,
        cutoff_hz: f64,
    ) -> Result<Vec<Equation>, IdentifyError> {
        let settings = Settings {
            cutoff_hz,
            ..self.settings.clone()
        };
        let mut front = EquationStream::new(self.robot, self.tool, self.sensors, &settings)?;
        let mut aligner = Aligner::new(self.layout.clone(), delay_s, settings.max_gap_s);
        let mut equations = Vec::new();
        for event in events {
            aligner.push(event.clone());
            while let Some(aligned) = aligner.next() {
                let (_, equation) = front.push(&sample(&aligned))?;
                equations.extend(equation.cloned());
            }
        }
        Ok(equations)
    }

    /// The highest cutoff that lets little of the motion's noise in: what is lost of the motion costs
    /// information, what comes in of its noise must be taken off again.
    ///
    /// Noise that is white shows in the differences; of the other kind only that the accelerations'
    /// power rises with the cutoff, so none above that is chosen where it depends least on it. Where
    /// all let noise in, it is the lowest that keeps [`KEPT`] of that power.
    pub(crate) fn cutoff_hz(&self, events: &[Event], period_s: f64) -> Result<f64, IdentifyError> {
        let mut length_s = (FEWEST_SAMPLES * period_s).min(LONGEST_S);
        let mut tried: Vec<Tried> = Vec::new();
        while length_s <= LONGEST_S {
            let cutoff_hz = window::cutoff_hz(length_s);
            let equations = self.equations(events, 0.0, cutoff_hz)?;
            if equations.len() < 4 {
                break;
            }
            tried.push(Tried {
                cutoff_hz,
                power: power(&equations, |equation| &equation.rows),
                noise: power(&equations, |equation| &equation.differences),
            });
            length_s *= 2.0;
        }
        let change = |pair: &[Tried]| (pair[0].power - pair[1].power).abs() / pair[0].power;
        let flattest = tried
            .windows(2)
            .filter(|pair| pair[0].power > 0.0)
            .min_by(|a, b| change(a).total_cmp(&change(b)))
            .map(|pair| &pair[0])
            .or(tried.first());
        let Some(flattest) = flattest else {
            return Ok(self.settings.cutoff_hz);
        };
        let not_above = |one: &&Tried| one.cutoff_hz <= flattest.cutoff_hz;
        let is_quiet = |one: &&Tried| one.noise <= QUIET * one.power;
        let keeps_motion = |one: &&Tried| one.power >= KEPT * flattest.power;
        let quiet = tried.iter().filter(not_above).find(is_quiet);
        let chosen = quiet.or_else(|| tried.iter().rev().find(keeps_motion));
        Ok(chosen.unwrap_or(flattest).cutoff_hz)
    }

    fn channels(&self) -> Channels {
        Channels::of_a_wrench().with_offsets(self.settings.wrench_offset)
    }

    /// Geometric mean of the channels' residual deviations, and the mean square of the accelerations;
    /// `None` where there is too little.
    pub(crate) fn misfit(
        &self,
        events: &[Event],
        cutoff_hz: f64,
    ) -> Result<Option<(f64, f64)>, IdentifyError> {
        let equations = self.equations(events, 0.0, cutoff_hz)?;
        Ok(
            Fit::new(&equations, Options::new(&self.channels())).map(|fit| {
                let std_devs = &fit.noise.std_devs;
                let logarithms: f64 = std_devs.iter().map(|std_dev| std_dev.ln()).sum();
                let misfit = (logarithms / std_devs.len() as f64).exp();
                (misfit, power(&equations, |equation| &equation.rows))
            }),
        )
    }

    /// By how much later than the motion the wrenches are stamped, s, and its standard deviation.
    pub(crate) fn delay_s(
        &self,
        events: &[Event],
        cutoff_hz: f64,
    ) -> Result<Option<(f64, f64)>, IdentifyError> {
        if self.settings.method != Method::Tactile {
            return Ok(None);
        }
        let mut equations = self.equations(events, 0.0, cutoff_hz)?;
        let Some(mut delay_s) = coarse_delay_s(&equations, window::stride_s(cutoff_hz)) else {
            return Ok(None);
        };
        let channels = self.channels();
        let mut found = None;
        for _ in 0..4 {
            if delay_s != 0.0 {
                equations = self.equations(events, delay_s, cutoff_hz)?;
            }
            let options = Options {
                delay: true,
                ..Options::new(&channels)
            };
            let Some((rest_s, std_dev_s)) = Fit::new(&equations, options).and_then(|f| f.delay)
            else {
                return Ok(None);
            };
            found = Some((delay_s + rest_s, std_dev_s));
            if !rest_s.is_finite() || (delay_s + rest_s).abs() > LONGEST_DELAY_S {
                return Ok(None);
            }
            if rest_s.abs() < 0.01 * SHORTEST_DELAY_S || rest_s.abs() < 0.1 * std_dev_s {
                break;
            }
            delay_s += rest_s;
        }
        Ok(found)
    }
}

/// Whether a delay is worth correcting.
pub(crate) fn is_significant((delay_s, std_dev_s): (f64, f64)) -> bool {
    delay_s.abs() > SHORTEST_DELAY_S && delay_s.abs() > SIGNIFICANT * std_dev_s
}

/// A sample of what was aligned.
pub(crate) fn sample(aligned: &Aligned) -> Sample<'_> {
    Sample {
        time_s: aligned.time_s,
        base: aligned.base,
        joint_position: &aligned.joints.position,
        joint_velocity: &aligned.joints.velocity,
        joint_effort: &aligned.joints.effort,
        wrenches: &aligned.wrenches,
    }
}

/// A cutoff, the power of the accelerations behind it, and the part of that which is white noise.
struct Tried {
    cutoff_hz: f64,
    power: f64,
    noise: f64,
}

/// Mean square of the regressors' entries that are accelerations of turning, 1/s⁴.
fn power(equations: &[Equation], rows: impl Fn(&Equation) -> &Vec<Row>) -> f64 {
    let rows = equations.iter().flat_map(rows);
    let squares: f64 = rows
        .map(|row| row.regressor.fixed_rows::<6>(4).norm_squared())
        .sum();
    squares / equations.len() as f64
}

/// The multiple of the windows' stride by which the wrenches fit the motion best; `None` where the
/// sign of gravity is in doubt.
fn coarse_delay_s(equations: &[Equation], stride_s: f64) -> Option<f64> {
    let reach = (LONGEST_DELAY_S / stride_s).ceil() as i64;
    let mut sizes = [0.0; 6];
    noise::sizes(equations, &Channels::of_a_wrench().kinds, &mut sizes);
    let at = |shift, gravity_off| misfit(equations, stride_s, shift, gravity_off, &sizes);
    let none = at(0, 0.0)?;
    if at(0, 2.0).is_some_and(|other| other < OTHER_GRAVITY * none) {
        return None;
    }
    let shifts = (-reach..=reach).filter_map(|shift| Some((at(shift, 0.0)?, shift)));
    let (best, shift) = shifts.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let independent = equations.len() as f64 / window::NOISE_CORRELATION * 6.0;
    let gain = (none - best) / best.max(f64::MIN_POSITIVE) * independent;
    Some(if gain > LUCK {
        shift as f64 * stride_s
    } else {
        0.0
    })
}

/// Mean square residual, relative to what is measured, of motions paired with later wrenches.
fn misfit(
    equations: &[Equation],
    stride_s: f64,
    shift: i64,
    gravity_off: f64,
    sizes: &[f64],
) -> Option<f64> {
    let mut gram = SMatrix::<f64, 10, 10>::zeros();
    let mut target = SVector::<f64, 10>::zeros();
    let (mut squares, mut count) = (0.0, 0u32);
    for (k, motion) in equations.iter().enumerate() {
        let Some(load) = usize::try_from(k as i64 + shift)
            .ok()
            .and_then(|at| equations.get(at))
        else {
            continue;
        };
        if (load.time_s - motion.time_s - shift as f64 * stride_s).abs() > 0.1 * stride_s {
            continue; // a gap lies between
        }
        for (channel, size) in sizes.iter().enumerate() {
            let Row {
                mut regressor,
                gravity,
                ..
            } = motion.rows[channel];
            let mut first = regressor.fixed_rows_mut::<4>(0);
            first += gravity * gravity_off;
            let row = regressor / *size;
            let target = load.rows[channel].target / size;
            gram.syger(1.0, &row, &row, 1.0);
            target += row * target;
            squares += target * target;
        }
        count += 1;
    }
    if count < 20 {
        return None;
    }
    gram.fill_upper_triangle_with_lower_triangle();
    let scale = gram
        .diagonal()
        .map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
    let scaled = SMatrix::<f64, 10, 10>::from_fn(|i, j| {
        gram[(i, j)] * scale[i] * scale[j] + if i == j { 1e-9 } else { 0.0 }
    });
    let target = target.component_mul(&scale);
    let solution = scaled.cholesky()?.solve(&target);
    // Rounding must not make an exact fit less than exact.
    Some(((squares - solution.dot(&target)) / f64::from(count)).max(1e-12))
}
