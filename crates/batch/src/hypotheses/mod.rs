//! One test for wrong assumptions about a wrench sensor and the motion of the tool.
//!
//! Each hypothesis adds unknowns to those of the payload: an offset of the sensor, a weight that
//! the controller subtracts, another direction of gravity, another place or rotation of the sensor,
//! gains of its axes, a delay, zeros of the joints. Signs and places of the axes are searched as
//! signed permutations ([`axes`]). [`model`] has the measured wrench as a function of all unknowns,
//! [`fitted`] the fit by Gauss-Newton iterations, and this module selects: the hypothesis with the
//! largest gain in likelihood is a cause, and the next one is searched beside it (forward
//! selection), as long as a gain is both significant and of a size that a sound sensor does not
//! have.
//!
//! The likelihood is that of residuals of unknown size, so that a gain is measured against what
//! stays unexplained. Residuals that stay the same for several windows count as one. No residual
//! counts for less than the error that a sound model has beside its noise.

mod axes;
mod beside;
mod fitted;
mod model;
mod report;
mod saturation;
mod windows;

use nalgebra::Vector3;
use tactid_identify::equations::{Equation, EquationStream, Unknowns};
use tactid_identify::solve::HALF_WIDTH_95;

use self::fitted::Fitted;
use self::model::Model;
pub(crate) use self::report::value_change;
use self::report::{Cause, Change};
pub(crate) use self::windows::SLIGHT;
use self::windows::Windows;
use crate::finding::{
    Hypothesis, LARGEST_MASS_CHANGE, LARGEST_SHIFT_M, MOST_LEFT, WrongAssumption,
};
use crate::fit::Fit;
use crate::fit::further::FurtherValues;

/// What is material: the least decrease of the mean square of the residuals by a cause, relative to
/// what stays and to the errors of a sound model. A cause that decreases it by a twentieth is
/// material, too, if it changes the mass or the centre of mass by this fraction of what shows a
/// result to be wrong. Cross-talk of half a percent decreases it by a third.
pub(crate) const MATERIAL: f64 = 0.5;

/// Least gain of a cause in twice the log-likelihood, beyond the logarithm of the number of
/// measurements for each of its unknowns.
const LEAST_GAIN: f64 = 30.0;

/// Error of a gain that cross-talk of half a percent of all other axes can imitate.
const SOUND_GAIN: f64 = 0.02;

impl Hypothesis {
    /// All hypotheses.
    const ALL: [Self; 10] = [
        Self::Offset,
        Self::Weight,
        Self::Gravity,
        Self::SensorPlace,
        Self::SensorRotation,
        Self::AxisGains,
        Self::Delay,
        Self::JointZeros,
        Self::Axes,
        Self::Saturation,
    ];

    /// Number of columns beside those of the payload.
    fn columns(self, joints: usize) -> usize {
        match self {
            Self::Offset | Self::AxisGains => 6,
            Self::Weight => 4,
            Self::Gravity | Self::SensorPlace | Self::SensorRotation => 3,
            Self::Delay => 1,
            Self::JointZeros => joints,
            Self::Axes | Self::Saturation => 0,
        }
    }

    /// Number of unknowns that count in a comparison.
    fn unknowns(self, joints: usize) -> f64 {
        match self {
            // A common factor is one of the payload.
            Self::AxisGains => 5.0,
            // The best of a hundred, and no simpler than gravity of the opposite sign, which is
            // that of forces alone.
            Self::Axes => Self::Gravity.columns(joints) as f64,
            // Both ends of each channel.
            Self::Saturation => 12.0,
            _ => self.columns(joints) as f64,
        }
    }
}

/// What explains the windows.
pub(crate) struct Explanation {
    /// The causes, that with the largest gain first.
    pub(crate) causes: Vec<WrongAssumption>,
    /// Whether something was unexplained, and the causes leave next to nothing of it.
    pub(crate) explains_load: bool,
    /// Whether the causes leave less than half of the residuals.
    pub(crate) explains_most: bool,
}

/// Returns the wrong assumptions that explain what a fit leaves unexplained; none where it leaves
/// nothing.
///
/// Cost: some ten iterations over at most 400 windows for each hypothesis, only where something is
/// unexplained.
pub(crate) fn explanation(
    equations: &[Equation],
    fit: &Fit,
    values: Option<&FurtherValues>,
    stream: &EquationStream,
) -> Option<Explanation> {
    let mut windows = Windows::new(equations, fit, stream)?;
    let (start, active) = identified(fit, values, stream);
    let is_explained = !start.leaves_unexplained(&windows);
    if is_explained && !active.contains(&Hypothesis::Weight) {
        return None;
    }
    windows.add_joints(equations, stream, fit);
    let search = Search {
        measurements: windows.measurements(),
        candidates: candidates(&windows, stream),
        joints: windows.joints(),
        windows: &windows,
    };
    let given = Fitted::new(&windows, &start.with_joints(windows.joints()), &active)?;
    let (found, causes) = if is_explained {
        (given.clone(), Vec::new())
    } else {
        search.select(given.clone())
    };
    let reported = |fits: [&Fitted; 2], causes: &[Cause]| {
        report::causes(stream, &windows, fit, fits, causes).into_iter()
    };
    let of_weight = search.without_weight(&given).and_then(|(without, weight)| {
        reported([&without, &given], &[weight]).find(|found| found.cause == Hypothesis::Gravity)
    });
    let of_rest = reported([&given, &found], &causes);
    let causes: Vec<_> = of_weight.into_iter().chain(of_rest).collect();
    (!is_explained || !causes.is_empty()).then(|| Explanation {
        explains_load: report::explains_load(&windows, &found),
        explains_most: found.squares.sqrt() < MOST_LEFT * given.squares.sqrt(),
        causes,
    })
}

/// Returns the model of a fit, with the values of its further unknowns, and the hypotheses that are
/// among its unknowns.
fn identified(
    fit: &Fit,
    values: Option<&FurtherValues>,
    stream: &EquationStream,
) -> (Model, Vec<Hypothesis>) {
    let mut model = Model::new(fit.parameters, 0, stream.gravity());
    let mut active = Vec::new();
    if let Some(offsets) = &fit.offsets {
        model.offset = stream.offset_frame().map() * offsets.values;
        active.push(Hypothesis::Offset);
    }
    if let Some(values) = values {
        model.weight = values.weight;
        model.is_along_given = values.along.is_some();
        model.gravity = values.gravity;
        let Unknowns { weight, gravity } = values.unknowns;
        active.extend(weight.then_some(Hypothesis::Weight));
        active.extend(gravity.then_some(Hypothesis::Gravity));
    }
    (model, active)
}

/// Returns the hypotheses that the windows can show.
fn candidates(windows: &Windows, stream: &EquationStream) -> Vec<Hypothesis> {
    let has_gravity = stream.gravity() != Vector3::zeros();
    let frame = stream.offset_frame();
    let is_measured = |channels: usize| frame.measured().iter().take(channels).all(|k| *k == 1.0);
    let is_possible = |hypothesis: &Hypothesis| match hypothesis {
        Hypothesis::Offset | Hypothesis::Delay => true,
        Hypothesis::Weight | Hypothesis::Gravity => has_gravity,
        Hypothesis::JointZeros => windows.joints() > 0,
        Hypothesis::SensorRotation => frame.is_of_sensor() && is_measured(3),
        Hypothesis::Saturation => frame.is_of_sensor(),
        Hypothesis::SensorPlace | Hypothesis::AxisGains | Hypothesis::Axes => {
            frame.is_of_sensor() && is_measured(6)
        }
    };
    Hypothesis::ALL.into_iter().filter(is_possible).collect()
}

/// The search for causes among candidates.
struct Search<'a> {
    windows: &'a Windows,
    /// Number of measurements.
    measurements: f64,
    candidates: Vec<Hypothesis>,
    joints: usize,
}

impl Search<'_> {
    /// Mean square of the whitened residuals, one for errors of a sound model alone.
    fn mean_square(&self, fitted: &Fitted) -> f64 {
        fitted.squares / self.measurements
    }

    /// Gain of a fit over another one in twice the log-likelihood, less what its further unknowns
    /// gain by chance. `best` is the fit whose residuals are taken to be errors alone. Mean squares
    /// below `least` count as `least`.
    fn gain(&self, of: &Fitted, over: &Fitted, best: &Fitted, least: f64) -> f64 {
        let independent = (self.measurements / best.correlation).max(2.0);
        let unknowns = |fitted: &Fitted| -> f64 {
            let active = fitted.active.iter();
            active.map(|each| each.unknowns(self.joints)).sum()
        };
        let further = unknowns(of) - unknowns(over);
        let loss = |fitted: &Fitted| loss(self.mean_square(fitted).max(least));
        independent * (loss(over) - loss(of)) - further * independent.ln()
    }

    /// Decrease of the mean square by a fit over another one, relative to what stays.
    fn decrease(&self, of: &Fitted, over: &Fitted) -> f64 {
        let [of, over] = [of, over].map(|fitted| self.mean_square(fitted));
        (over - of) / of.max(1.0)
    }

    /// Returns whether the decrease of the mean square by a fit over another one is more than a
    /// fraction of what is material. Where the other one leaves more than a sound sensor does, half
    /// of that is material.
    fn explains_much(&self, of: &Fitted, over: &Fitted, fraction: f64) -> bool {
        let is_sound = self.mean_square(over) < 1.0 + MATERIAL;
        let least = if is_sound { MATERIAL } else { 0.5 * MATERIAL };
        self.decrease(of, over) > fraction * least
    }

    /// Returns whether a fit is better than another one by more than what a sound sensor may show
    /// by chance: the gain is significant, and explains much or changes values.
    fn is_better(&self, of: &Fitted, over: &Fitted, best: &Fitted) -> bool {
        self.is_notable(of, over, 1.0) && self.gain(of, over, best, 0.0) > LEAST_GAIN
    }

    /// Returns whether a fit explains much more than another one, or changes values, by a fraction
    /// of what is material.
    fn is_notable(&self, of: &Fitted, over: &Fitted, fraction: f64) -> bool {
        let least = fraction * MATERIAL;
        self.explains_much(of, over, fraction)
            || (self.decrease(of, over) > least * SLIGHT
                && self.changes_values(of, over, least, Change::least))
    }

    /// Returns whether the certain or the possible changes of the mass or the centre of mass exceed
    /// a fraction of what shows a result to be wrong.
    fn changes_values(
        &self,
        of: &Fitted,
        over: &Fitted,
        fraction: f64,
        bound: fn(Change) -> f64,
    ) -> bool {
        let [mass_change, shift_m] = report::changes(over, of, self.measurements).map(bound);
        mass_change > fraction * LARGEST_MASS_CHANGE || shift_m > fraction * LARGEST_SHIFT_M
    }

    /// Returns whether a hypothesis that explains little changes the values even beside what is
    /// likeliest, where that leaves the values of a present fit as they are: gains can imitate
    /// cross-talk, which changes nothing.
    fn is_certain(&self, hypothesis: Hypothesis, likeliest: &Fitted, present: &Fitted) -> bool {
        likeliest.active.contains(&hypothesis)
            || self.changes_values(likeliest, present, MATERIAL, Change::most)
            || self
                .with(likeliest, hypothesis)
                .is_some_and(|both| self.is_better(&both, likeliest, &both))
    }

    /// Adds the best hypothesis as long as it is a cause, and drops causes that later ones replace.
    fn select(&self, given: Fitted) -> (Fitted, Vec<Cause>) {
        let mut causes: Vec<Cause> = Vec::new();
        let mut present = given;
        while let Some((next, cause)) = self.next(&present) {
            causes.push(cause);
            present = next;
        }
        self.without_replaced(present, causes)
    }

    /// Returns the fit without a weight that is among the unknowns of a fit with a given gravity,
    /// and this weight as a cause.
    fn without_weight(&self, given: &Fitted) -> Option<(Fitted, Cause)> {
        let is_unknown = |hypothesis| given.active.contains(&hypothesis);
        if !is_unknown(Hypothesis::Weight) || is_unknown(Hypothesis::Gravity) {
            return None;
        }
        let without = self.without(given, Hypothesis::Weight)?;
        let residual_ratio = (given.squares / without.squares).sqrt();
        let weight = Cause {
            hypothesis: Hypothesis::Weight,
            runner_up: None,
            residual_ratio,
        };
        Some((without, weight))
    }

    /// Returns whether further hypotheses may contain a cause. Where a fit leaves much unexplained,
    /// they may. Else each is fitted to first order, and one of them must explain nearly as much as
    /// a cause does, or change the values, also beside the likeliest one.
    ///
    /// Cost: one iteration of a fit of all of them.
    fn may_contain_cause(&self, present: &Fitted, further: &[Hypothesis]) -> bool {
        if !report::explains_load(self.windows, present) {
            return true;
        }
        let sums = present
            .model
            .sums(self.windows, &[&present.active[..], further].concat());
        let fit = |some: &[Hypothesis]| present.to_first_order(&sums, further, some);
        let fits: Option<Vec<_>> = further.iter().map(|each| fit(&[*each])).collect();
        let Some(fits) = fits else { return true };
        let likelihood = |fitted: &Fitted| self.gain(fitted, present, present, 0.0);
        let pairs = || further.iter().zip(&fits);
        let Some((likeliest, best)) =
            pairs().max_by(|a, b| likelihood(a.1).total_cmp(&likelihood(b.1)))
        else {
            return false;
        };
        let nearly = 1.0 - SLIGHT;
        pairs().any(|(each, fitted)| {
            self.is_notable(fitted, present, nearly)
                && (self.explains_much(fitted, present, nearly)
                    || each == likeliest
                    || self.changes_values(best, present, MATERIAL, Change::most)
                    || fit(&[*likeliest, *each])
                        .is_none_or(|both| self.is_notable(&both, best, nearly)))
        })
    }

    /// Returns the next cause beside those of a fit.
    fn next(&self, present: &Fitted) -> Option<(Fitted, Cause)> {
        let left = self.candidates.iter().copied();
        let left: Vec<_> = left.filter(|each| !present.active.contains(each)).collect();
        // To first order, a channel that is cut off explains nothing.
        let linear = left
            .iter()
            .copied()
            .filter(|each| *each != Hypothesis::Saturation);
        if !self.may_contain_cause(present, &linear.collect::<Vec<_>>()) {
            return None;
        }
        let mut fits: Vec<(Hypothesis, Fitted)> = left
            .into_iter()
            .filter_map(|each| Some((each, self.with(present, each)?)))
            .filter(|(_, fitted)| self.is_possible(fitted))
            .collect();
        let least = fits
            .iter()
            .min_by(|a, b| a.1.squares.total_cmp(&b.1.squares))?;
        let least = least.1.clone();
        // Of causes that leave no more than a sound sensor does, the simplest one is right.
        let explained = (SLIGHT * self.mean_square(present)).min(MATERIAL.recip());
        let gain = |fitted: &Fitted, over: &Fitted| self.gain(fitted, over, &least, explained);
        self.prefer_positive_mass(&mut fits, present);
        let likelihood = |fitted: &Fitted| self.gain(fitted, present, &least, 0.0);
        let by_likelihood =
            |a: &(_, Fitted), b: &(_, Fitted)| likelihood(&a.1).total_cmp(&likelihood(&b.1));
        // Of those that are as likely but for rounding, the first one stands for all.
        let most = fits.iter().map(|(_, fitted)| likelihood(fitted));
        let most = most.fold(f64::NEG_INFINITY, f64::max);
        let is_likeliest = |(_, fitted): &&(_, Fitted)| likelihood(fitted) > most - 1.0;
        let likeliest = fits.iter().find(is_likeliest)?.1.clone();
        let is_cause = |(each, fitted): &&(Hypothesis, Fitted)| {
            self.is_better(fitted, present, &least)
                && (self.explains_much(fitted, present, 1.0)
                    || self.is_certain(*each, &likeliest, present))
        };
        let gains = fits
            .iter()
            .filter(is_cause)
            .map(|(_, fitted)| gain(fitted, present));
        // What is far likelier than a cause is one, even if it may leave the values as they are.
        let enough = gains.max_by(f64::total_cmp)? + LEAST_GAIN;
        let is_kept =
            |each: &(Hypothesis, Fitted)| is_cause(&each) || gain(&each.1, present) > enough;
        fits.retain(is_kept);
        fits.sort_by(|a, b| gain(&b.1, present).total_cmp(&gain(&a.1, present)));
        let mut ranked = fits.into_iter();
        let (hypothesis, best) = ranked.next()?;
        // What is as likely is not distinguished by the data, be it simple or not.
        let runner_up = ranked
            .filter(|(_, fitted)| likelihood(&best) - likelihood(fitted) < LEAST_GAIN)
            .max_by(by_likelihood);
        let cause = Cause {
            hypothesis,
            runner_up: runner_up.map(|(other, _)| other),
            residual_ratio: (best.squares / present.squares).sqrt(),
        };
        Some((best, cause))
    }

    /// Returns whether gains are neither signs, which are those of the axes, nor cross-talk, and
    /// whether the interval of one of them does not contain 1.
    fn is_possible(&self, fitted: &Fitted) -> bool {
        let std_devs = fitted.std_devs_of(Hypothesis::AxisGains, self.measurements);
        let gains = &fitted.model.gains;
        let is_another = |(gain, std_dev): (&f64, f64)| {
            (gain - 1.0).abs() > SOUND_GAIN.max(HALF_WIDTH_95 * std_dev)
        };
        !fitted.active.contains(&Hypothesis::AxisGains)
            || (gains.min() > 0.0 && gains.iter().zip(std_devs).any(is_another))
    }

    /// Drops fits of a negative mass, which need a wrong sign as well, where one of a positive mass
    /// explains most.
    fn prefer_positive_mass(&self, fits: &mut Vec<(Hypothesis, Fitted)>, present: &Fitted) {
        let is_positive = |fitted: &Fitted| fitted.model.parameters[0] > 0.0;
        let most = SLIGHT * present.squares;
        let mut positive = fits.iter().filter(|(_, fitted)| is_positive(fitted));
        if positive.any(|(_, fitted)| fitted.squares < most) {
            fits.retain(|(_, fitted)| is_positive(fitted));
        }
    }

    /// Drops each cause without which the others explain the windows as well.
    fn without_replaced(&self, found: Fitted, mut causes: Vec<Cause>) -> (Fitted, Vec<Cause>) {
        let mut present = found;
        let mut place = 0;
        while causes.len() > 1 && place < causes.len() {
            let dropped = causes[place].hypothesis;
            match self.without(&present, dropped) {
                Some(less) if !self.is_better(&present, &less, &present) => {
                    causes.remove(place);
                    present = less;
                }
                _ => place += 1,
            }
        }
        (present, causes)
    }
}

/// Loss of residuals of a mean square, twice the negative log-likelihood of each: of errors whose
/// variance is one at least.
fn loss(mean_square: f64) -> f64 {
    if mean_square > 1.0 {
        mean_square.ln()
    } else {
        mean_square - 1.0
    }
}
