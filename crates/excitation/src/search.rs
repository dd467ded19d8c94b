//! Sequential conic programming with a trust region.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};

use crate::ExcitationError;
use crate::cones::{Cone, LinearCone};
use crate::joint_rows::{JointRow, ROUNDING, clamp_positions};
use crate::objective::{Objective, Uncertainty};
use crate::progress::{Observer, Progress, report};
use crate::samples::{Sampler, Samples};
use crate::subproblem::{Inequality, PENALTY, Subproblem, along};

/// First, largest and least radius of the trust region, in units of the variables' scales: a step
/// of one changes a velocity or an acceleration by about its limit.
pub(crate) const FIRST_RADIUS: f64 = 0.3;
const LARGEST_RADIUS: f64 = 2.0;
const LEAST_RADIUS: f64 = 1e-4;

/// Fractions of the predicted improvement that accept a step, shrink and enlarge the radius.
const ACCEPTED: f64 = 0.05;
const POOR: f64 = 0.3;
const GOOD: f64 = 0.7;

/// Factor by which the radius grows.
const GROWTH: f64 = 1.6;

/// Slack below which a limit is in the conic program from the start. The others are added where a
/// solution exceeds them by more than what is negligible.
const NEAR: f64 = 0.25;
const NEGLIGIBLE: f64 = 1e-4;

/// Excess beyond what was predicted from which a step is corrected.
const CURVED: f64 = 2e-4;

/// Improvement of the largest interval's logarithm below which several steps have converged.
const CONVERGED: f64 = 2e-3;
const CONVERGED_STEPS: usize = 4;

/// Fraction of the limits of each joint that a random start uses.
const RANDOM_FRACTION: f64 = 0.8;

/// Halvings of a start until it holds other limits, and the excess that the search corrects.
const MOST_HALVINGS: i32 = 12;
const START_EXCESS: f64 = 0.1;

/// A motion with its functions.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub(crate) values: Vec<f64>,
    pub(crate) uncertainty: Uncertainty,
    /// Largest fraction by which a cone is exceeded.
    pub(crate) excess: f64,
}

impl Point {
    /// Returns the largest function.
    pub(crate) fn objective(&self) -> f64 {
        let functions = self.uncertainty.functions.iter();
        functions.fold(f64::NEG_INFINITY, |a, &b| a.max(b))
    }

    pub(crate) fn progress(&self, start: usize, iteration: usize) -> Progress {
        Progress {
            start,
            iteration,
            objective: self.objective().exp(),
            excess: self.excess,
        }
    }

    /// Returns what a search minimises.
    pub(crate) fn merit(&self) -> f64 {
        self.objective() + PENALTY * self.excess
    }
}

/// What a step of the search linearises.
pub(crate) struct Linear {
    pub(crate) functions: Vec<(f64, Vec<f64>)>,
    pub(crate) samples: Samples,
}

/// The best step of a linear program.
struct Step {
    /// Change of the variables, in units of their scales.
    change: Vec<f64>,
    /// Variables after the step.
    values: Vec<f64>,
    /// Improvement that the program predicts.
    predicted: f64,
    /// Excess that the program predicts.
    excess: f64,
}

/// A step that has been evaluated.
struct Trial {
    point: Option<Point>,
    predicted: f64,
    /// Improvement over what was predicted.
    ratio: f64,
}

impl Trial {
    /// A step that the conic solver did not find: the trust region shrinks.
    const REJECTED: Self = Self {
        point: None,
        predicted: f64::INFINITY,
        ratio: f64::NEG_INFINITY,
    };
}

/// A search for the best motion.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    pub(crate) sampler: Sampler,
    pub(crate) objective: Objective,
    pub(crate) cones: Vec<Cone>,
    pub(crate) rows: Vec<JointRow>,
    /// Unit of each variable.
    pub(crate) scales: Vec<f64>,
    /// Variables of the motion without excursion.
    pub(crate) direct: Vec<f64>,
    /// Why a conic program had no solution, if that happened.
    pub(crate) failure: Option<String>,
}

impl Search {
    /// Evaluates a motion; `None` if it does not determine all values.
    pub(crate) fn point(&mut self, values: Vec<f64>) -> Result<Option<Point>, ExcitationError> {
        let samples = self.sampler.sample(&values, false)?;
        let excess = self.excess(&samples);
        let uncertainty = self.objective.uncertainty(&samples);
        Ok(uncertainty.map(|uncertainty| Point {
            values,
            uncertainty,
            excess,
        }))
    }

    /// Returns the largest fraction by which a cone is exceeded.
    fn excess(&self, samples: &Samples) -> f64 {
        let step_s = self.sampler.grid.step_s;
        let values = self.cones.iter().flat_map(|c| c.values(samples, step_s));
        values.fold(0.0, |excess, value| f64::max(excess, -value.slack()))
    }

    /// Returns the largest fraction of a limit of the joints that a motion uses.
    pub(crate) fn used_by_joints(&self, values: &[f64]) -> f64 {
        let used = self.rows.iter().map(|row| row.value(values).abs());
        used.fold(0.0, f64::max)
    }

    /// Returns the motion without excursion plus a multiple of another one's difference from it.
    pub(crate) fn shrunk(&self, values: &[f64], factor: f64) -> Vec<f64> {
        let pairs = self.direct.iter().zip(values);
        pairs
            .map(|(direct, x)| direct + factor * (x - direct))
            .collect()
    }

    /// Draws a motion that exceeds a limit by at most [`START_EXCESS`] where possible; `None` if no
    /// such motion determines all values.
    pub(crate) fn random_start(&mut self, seed: u64) -> Result<Option<Point>, ExcitationError> {
        let mut random = StdRng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let pairs = self.direct.iter().zip(&self.scales);
        let mut values: Vec<f64> = pairs.map(|(x, scale)| x + scale * normal()).collect();
        clamp_positions(&self.rows, &mut values);
        self.fit_joints(&mut values, RANDOM_FRACTION);
        self.start_at(&values)
    }

    /// Returns a motion like another one, which may exceed limits by [`START_EXCESS`] if any does;
    /// `None` if it does not determine all values. Where a joint exceeds its limits, the excursion
    /// of each joint becomes the largest within them.
    pub(crate) fn start_like(
        &mut self,
        mut values: Vec<f64>,
    ) -> Result<Option<Point>, ExcitationError> {
        if self.used_by_joints(&values) > 1.0 + ROUNDING {
            self.fit_joints(&mut values, 1.0);
        }
        self.start_at(&values)
    }

    /// Returns a motion like another one within all limits of the joints; excursions become the
    /// largest within them where one exceeds them; `None` if it does not determine all values. What
    /// it exceeds other limits by, the search corrects.
    pub(crate) fn refined_start(
        &mut self,
        mut values: Vec<f64>,
    ) -> Result<Option<Point>, ExcitationError> {
        if self.used_by_joints(&values) > 1.0 + ROUNDING {
            self.fit_joints(&mut values, 1.0);
        }
        self.point(values)
    }

    /// Returns the largest multiple of a motion, by a power of one half, that exceeds no limit by
    /// more than [`START_EXCESS`], or the one that exceeds them least. A motion that ends where it
    /// starts is within all limits if it is small enough.
    fn start_at(&mut self, values: &[f64]) -> Result<Option<Point>, ExcitationError> {
        let mut best: Option<Point> = None;
        for halvings in 0..MOST_HALVINGS {
            let point = self.point(self.shrunk(values, 0.5f64.powi(halvings)))?;
            if let Some(point) = point {
                let is_possible = point.excess < START_EXCESS;
                if best.as_ref().is_none_or(|best| point.excess < best.excess) {
                    best = Some(point);
                }
                if is_possible {
                    break;
                }
            }
        }
        Ok(best)
    }

    /// Scales each joint's excursion to the largest that uses a fraction of its limits at most.
    fn fit_joints(&self, values: &mut [f64], fraction: f64) {
        let of_joint = self.sampler.variables.of_joint();
        let mut factors = vec![f64::INFINITY; self.sampler.variables.joints()];
        for row in &self.rows {
            let (direct, whole) = (row.value(&self.direct), row.value(values));
            let change = whole - direct;
            let room = fraction.max(direct.abs()) - direct * change.signum();
            let joint = row.terms[0].0 / of_joint;
            if change.abs() > ROUNDING {
                factors[joint] = factors[joint].min(room / change.abs());
            }
        }
        for (k, (value, direct)) in values.iter_mut().zip(&self.direct).enumerate() {
            let factor = factors[k / of_joint];
            if factor.is_finite() {
                *value = direct + factor * (*value - direct);
            }
        }
    }

    /// Improves a motion by up to so many steps.
    pub(crate) fn improve(
        &mut self,
        mut point: Point,
        radius: &mut f64,
        start: usize,
        iterations: usize,
        observer: &mut Observer<'_>,
    ) -> Result<Point, ExcitationError> {
        let mut slow = 0;
        let mut linear = None;
        for iteration in 0..iterations {
            report(observer, point.progress(start, iteration))?;
            let current = match linear.take() {
                Some(current) => current,
                None => self.linearise(&point)?,
            };
            let trial = match self.try_step(&point, &current, *radius) {
                Err(ExcitationError::Solver(failure)) => {
                    self.failure = Some(failure);
                    Trial::REJECTED
                }
                trial => trial?,
            };
            if trial.ratio > GOOD {
                *radius = (GROWTH * *radius).min(LARGEST_RADIUS);
            } else if trial.ratio < POOR {
                *radius *= if trial.ratio > ACCEPTED { 0.7 } else { 0.5 };
            }
            match trial.point {
                Some(better) if trial.ratio > ACCEPTED => {
                    let is_slow = point.merit() - better.merit() < CONVERGED;
                    slow = if is_slow { slow + 1 } else { 0 };
                    point = better;
                    self.failure = None;
                }
                _ => {
                    slow += usize::from(trial.predicted < CONVERGED);
                    linear = Some(current);
                }
            }
            if slow >= CONVERGED_STEPS || *radius < LEAST_RADIUS {
                break;
            }
        }
        Ok(point)
    }

    /// Evaluates the best step within the trust region. Where it exceeds limits that are curved, a
    /// second step starts from the limits where the first one ends.
    fn try_step(
        &mut self,
        point: &Point,
        linear: &Linear,
        radius: f64,
    ) -> Result<Trial, ExcitationError> {
        let linearised =
            |cone: &Cone| cone.linearised(&self.sampler, &linear.samples, &self.scales, radius);
        let mut cones: Vec<Vec<LinearCone>> = self.cones.iter().map(linearised).collect();
        let mut step = self.step(point, linear, &cones, radius)?;
        let mut candidate = self.point(step.values.clone())?;
        let merit = |point: &Option<Point>| point.as_ref().map_or(f64::INFINITY, Point::merit);
        let excess = candidate.as_ref().map_or(0.0, |candidate| candidate.excess);
        let is_poor = point.merit() - merit(&candidate) < POOR * step.predicted;
        if is_poor && excess > step.excess + CURVED {
            self.correct(&mut cones, &step)?;
            let corrected = self.step(point, linear, &cones, radius)?;
            let second = self.point(corrected.values.clone())?;
            if merit(&second) < merit(&candidate) {
                candidate = second;
                step.predicted = step.predicted.min(corrected.predicted);
            }
        }
        let ratio = (point.merit() - merit(&candidate)) / step.predicted.max(1e-12);
        Ok(Trial {
            point: candidate,
            predicted: step.predicted,
            ratio,
        })
    }

    /// Adds to the values of linear cones what the limits differ from them after a step.
    fn correct(
        &mut self,
        linear: &mut [Vec<LinearCone>],
        step: &Step,
    ) -> Result<(), ExcitationError> {
        let samples = self.sampler.sample(&step.values, false)?;
        for (cone, linear) in self.cones.iter().zip(linear) {
            let values = cone.values(&samples, self.sampler.grid.step_s);
            for linear in linear {
                let (head, tail) = linear.after(&step.change);
                let value = &values[linear.sample];
                linear.value.head += value.head - head;
                for (own, (value, tail)) in linear
                    .value
                    .tail
                    .iter_mut()
                    .zip(value.tail.iter().zip(tail))
                {
                    *own += value - tail;
                }
            }
        }
        Ok(())
    }

    /// Computes functions and gradients, in units of the variables' scales.
    pub(crate) fn linearise(&mut self, point: &Point) -> Result<Linear, ExcitationError> {
        let samples = self.sampler.sample(&point.values, true)?;
        Ok(self.linear(point, samples))
    }

    /// Returns functions and gradients, given the samples of a motion with their derivatives.
    pub(crate) fn linear(&self, point: &Point, samples: Samples) -> Linear {
        let uncertainty = &point.uncertainty;
        let mut gradients = self
            .objective
            .gradients(uncertainty, &self.sampler, &samples);
        for gradient in &mut gradients {
            for (entry, scale) in gradient.iter_mut().zip(&self.scales) {
                *entry *= scale;
            }
        }
        let functions = uncertainty.functions.iter().copied().zip(gradients);
        Linear {
            functions: functions.collect(),
            samples,
        }
    }

    /// Returns the best step within the trust region for functions and limits that are linear. Few
    /// limits bind, so the program has the near ones and grows by those that its solutions exceed.
    fn step(
        &self,
        point: &Point,
        linear: &Linear,
        cones: &[Vec<LinearCone>],
        radius: f64,
    ) -> Result<Step, ExcitationError> {
        let inequalities = self.inequalities(&point.values, radius);
        let near = |cone: &LinearCone| cone.value.slack() < NEAR;
        let cones = || cones.iter().flatten();
        let (mut kept, mut others): (Vec<_>, Vec<_>) = cones().partition(|cone| near(cone));
        let change = loop {
            let change = Subproblem {
                functions: &linear.functions,
                inequalities: &inequalities,
                cones: &kept,
                radius,
                variables: self.scales.len(),
            }
            .solve()?;
            let excess = |cone: &&LinearCone| cone.excess_after(&change);
            let allowed = kept.iter().map(excess).fold(0.0, f64::max) + NEGLIGIBLE;
            let count = kept.len();
            others.retain(|cone| {
                let holds = excess(cone) <= allowed;
                if !holds {
                    kept.push(cone);
                }
                holds
            });
            if kept.len() == count {
                break change;
            }
        };
        let functions = linear.functions.iter().map(|(f, g)| f + along(g, &change));
        let largest = functions.fold(f64::NEG_INFINITY, f64::max);
        let excess = cones().map(|cone| cone.excess_after(&change));
        let excess = excess.fold(0.0, f64::max);
        let pairs = point.values.iter().zip(&change).zip(&self.scales);
        let mut values: Vec<f64> = pairs.map(|((x, d), scale)| x + d * scale).collect();
        clamp_positions(&self.rows, &mut values);
        // The solver meets the limits of the joints to its tolerance only.
        let used = self.used_by_joints(&values);
        Ok(Step {
            values: if used > 1.0 + ROUNDING {
                self.shrunk(&values, used.recip())
            } else {
                values
            },
            predicted: point.merit() - largest - PENALTY * excess,
            change,
            excess,
        })
    }

    /// Returns the limits of the joints that a step within the trust region could exceed.
    fn inequalities(&self, values: &[f64], radius: f64) -> Vec<Inequality> {
        let mut inequalities = Vec::new();
        for row in &self.rows {
            let value = row.value(values);
            let terms = row.terms.iter();
            let gradient: Vec<(usize, f64)> =
                terms.map(|(k, f)| (*k, f * self.scales[*k])).collect();
            let reach = radius * gradient.iter().map(|(_, f)| f.abs()).sum::<f64>();
            for sign in [-1.0, 1.0] {
                if 1.0 + sign * value < reach {
                    inequalities.push(Inequality {
                        constant: 1.0 + sign * value,
                        gradient: gradient.iter().map(|(k, f)| (*k, sign * f)).collect(),
                    });
                }
            }
        }
        inequalities
    }
}
