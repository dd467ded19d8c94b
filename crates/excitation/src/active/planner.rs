//! The planner: from the present estimate to the next second of motion.

use std::f64::consts::PI;

use nalgebra::{Isometry3, SMatrix};
use rand::SeedableRng;
use rand::rngs::StdRng;
use tactid_dynamics::InertialParameters;
use tactid_identify::equations::window;
use tactid_identify::{HALF_WIDTH_95, PayloadEstimate, VALUE_NAMES};

use super::belief::Belief;
use super::check::{Checked, largest_within_limits, relax_to_rest};
use super::contradiction::PriorContradiction;
use super::interior::improve;
use super::prior::{Prior, Vector};
use super::settings::ActiveSettings;
use crate::ExcitationError;
use crate::design::search;
use crate::limits::Limit;
use crate::motion::Trajectory;
use crate::plant::Plant;
use crate::problem::{Problem, targets_from, targets_within};
use crate::rest::check_places;
use crate::search::{Point, Search};
use crate::spline::{Spline, SplineBasis};
use crate::variables::{End, Variables};

/// Samples of the outputs in each span of the splines: with spans of 0.15 s, one each 75 ms.
const STEPS_PER_SPAN: usize = 2;

/// Samples in each span at which the limits of a plan are checked.
const CHECKED_STEPS_PER_SPAN: usize = 5;

/// Control points of a spline beyond one for each span: the degree of the splines.
const MORE_CONTROL_POINTS: usize = 5;

/// Halvings of a start that is not within all limits.
const MORE_HALVINGS: usize = 3;

/// Payloads that are drawn from the confidence region to check a plan.
const DRAWN: usize = 12;

/// Fraction of a limit that a plan leaves for noise of the estimate and time between two samples.
const TIGHTENING: f64 = 0.05;

/// Plans after which the largest interval must be smaller by the fraction [`PROGRESS`].
const PATIENCE: usize = 6;

/// Fraction by which it must be smaller.
const PROGRESS: f64 = 0.02;

/// Plans after which all values must be determined. The first ones are gentle, and noise hides what
/// they show for a while.
const PATIENCE_AT_FIRST: usize = 20;

/// Fraction of the bound of the base that a plan uses, unless the base is there already: then it
/// may go further by a stride. Near its bound the base could hardly move, and plans would be slow.
const USED: f64 = 0.6;
const STRIDE: f64 = 0.15;

/// Least distance of the centre of mass of which a plan's target is a fraction, in radii of
/// gyration. The mean of a prior is near the tip, so that the first plans determine the centre of
/// mass before the inertia. With the tenth of [`targets_within`], the largest rms error of the
/// twenty seeds of `make bench-active` was 1.5 % in place of 0.37 %.
const NEAREST_CENTER: f64 = 1e-3;

/// Seeds of one plan, and plans of one seed, that differ from another's.
const SEEDS: u64 = 1000;

/// What the robot does next.
#[derive(Clone, Debug)]
pub enum Step {
    /// It follows this motion for [`Planner::followed_s`]. The motion itself goes on to a
    /// standstill, where it stays: a robot that gets no further plan follows it to its end.
    Move(Trajectory),
    /// All ten intervals are within their targets: the robot follows the motion it has to its end.
    Reached,
    /// Several plans in a row did not make the largest interval smaller, or the robot exceeds a
    /// limit already at rest, for a payload that is possible: the robot follows the motion it has
    /// to its end.
    OutOfReach {
        /// The value with the largest interval relative to its target.
        value: &'static str,
        /// Ratio of that interval to its target; infinite where the value is not known.
        ratio: f64,
        /// A limit that binds the last plan.
        binding: Option<Limit>,
    },
    /// The estimate contradicts these bounds of the prior, so that the plans so far may have
    /// exceeded limits: the robot follows the motion it has to its end.
    Contradicted(Vec<PriorContradiction>),
}

/// Plans motions that identify a payload, each from the estimate that the ones before have given.
///
/// Each plan is the motion after which the predicted intervals, given all that is known already,
/// are the smallest, within the limits of a [`Problem`], also on places and distances of bodies. It
/// begins with the position, the velocity and the acceleration that the previous plan reaches after
/// [`followed_s`](Self::followed_s), and ends at a standstill, so that the robot can always stop
/// within its limits.
///
/// A plan is checked for a sample of the payloads that are possible, with a margin of some percent
/// of the limits that depend on the payload, unless the rest of the previous plan uses more, and
/// this is no proof for all of them. Before the first estimate they are [`Prior::samples`] and
/// twelve random payloads of the prior: so the motion starts gently. After it, they are the mean,
/// the ends at three standard deviations along the three axes of the confidence region in which the
/// load is the most uncertain, and twelve random payloads of it.
#[derive(Clone, Debug)]
pub struct Planner {
    problem: Problem,
    prior: Prior,
    settings: ActiveSettings,
    joints: Vec<usize>,
    of_prior: Belief,
    basis: SplineBasis,
    /// Splines of the joints that move in the plan that is followed, from its beginning on.
    splines: Vec<Spline>,
    /// Number of plans so far.
    plans: u64,
    /// Largest ratio of an interval to its target before each plan.
    history: Vec<f64>,
    /// Standard deviation of the noise of one sample of each joint's acceleration, rad/s² or m/s².
    acceleration_noise: Vec<f64>,
    binding: Option<Limit>,
}

impl Planner {
    /// Creates the planner of a robot that rests at the problem's start. Payloads, targets,
    /// duration and end of the problem are not used: they follow from the prior, the estimates and
    /// the settings. A pair of bodies that touch at the start is not tested, and only the
    /// [`Design::findings`](crate::Design::findings) of a design from the same start list it.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Value`] for a number that is out of range,
    /// [`ExcitationError::Impossible`] where the tool or the payload is not in its place at the
    /// start, and the errors of a design for a problem that is not valid.
    pub fn new(
        mut problem: Problem,
        prior: Prior,
        settings: ActiveSettings,
    ) -> Result<Self, ExcitationError> {
        prior.check()?;
        settings.check()?;
        let of_prior = Belief::of_prior(&prior).ok_or(ExcitationError::NotObservable)?;
        problem.duration_s = settings.spans as f64 * settings.span_s;
        problem.end = End::Free;
        set_payloads(&mut problem, &of_prior.payloads(&prior), settings.within);
        problem.check()?;
        if !settings.velocity_noise.is_empty() {
            problem
                .robot
                .check_length("velocity_noise", &settings.velocity_noise)?;
        }
        let joints = problem.moving_joints()?;
        check_places(&problem, &joints)?;
        let count = settings.spans + MORE_CONTROL_POINTS;
        let basis = SplineBasis::new(count, problem.duration_s);
        let at_rest = |&joint: &usize| Spline::at_rest(basis.clone(), problem.start[joint]);
        let slope = differentiation_gain(problem.sensing.equations.cutoff_hz);
        let acceleration_noise = settings.velocity_noise.iter().map(|noise| noise * slope);
        let planner = Self {
            acceleration_noise: acceleration_noise.collect(),
            splines: joints.iter().map(at_rest).collect(),
            basis,
            of_prior,
            plans: 0,
            history: Vec::new(),
            binding: None,
            problem,
            prior,
            settings,
            joints,
        };
        // A plan that is too short for an averaging window is an error now and not on the way.
        planner.search(STEPS_PER_SPAN, &Isometry3::identity())?;
        Ok(planner)
    }

    /// Returns the time after which the next plan begins, s.
    #[must_use]
    pub fn followed_s(&self) -> f64 {
        self.settings.followed_spans as f64 * self.settings.span_s
    }

    /// Returns the largest ratio of a 95 % interval of an estimate to its target, with the index of
    /// the value: targets are reached where it is at most one. Infinite where a value is not known.
    #[must_use]
    pub fn largest_ratio(&self, estimate: &PayloadEstimate) -> (usize, f64) {
        let targets = targets_within(&estimate.body.into(), self.settings.within);
        let targets = targets.unwrap_or([0.0; 10]);
        let std_devs = estimate.std_devs;
        let ratio = |k: usize| match HALF_WIDTH_95 * std_devs[k] / targets[k] {
            // A value without a number is not known.
            ratio if ratio.is_nan() => f64::INFINITY,
            ratio => ratio,
        };
        let ratios = (0..10).map(|k| (k, ratio(k)));
        ratios.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a })
    }

    /// Plans the motion that begins where the plan before has been followed for
    /// [`followed_s`](Self::followed_s). `covariance` comes from
    /// [`Identifier::covariance`](tactid_identify::Identifier::covariance), and `base` is the
    /// measured pose of a floating base relative to the pose in which it started.
    ///
    /// It is called once for each period of [`followed_s`](Self::followed_s), and takes tens of
    /// milliseconds. Within a plan, the position of the base is integrated from its velocity in its
    /// own frame, without its rotation since the beginning of the plan: an error as large as this
    /// rotation, for which the unused part of the bound leaves room. The noise of the accelerations
    /// is that at the problem's start.
    ///
    /// Where no motion within the limits is found, the plan is the rest of the one before, which
    /// comes to a standstill. Where the estimate contradicts the prior, nothing more is planned.
    ///
    /// # Errors
    /// Returns the errors of the dynamics for a robot without masses.
    pub fn plan(
        &mut self,
        estimate: &PayloadEstimate,
        covariance: Option<&SMatrix<f64, 10, 10>>,
        base: &Isometry3<f64>,
    ) -> Result<Step, ExcitationError> {
        let parameters = InertialParameters::from(estimate.body);
        let contradictions = covariance
            .map(|covariance| self.prior.contradictions(&parameters, covariance))
            .unwrap_or_default();
        if !contradictions.is_empty() {
            return Ok(Step::Contradicted(contradictions));
        }
        let (place, ratio) = self.largest_ratio(estimate);
        if ratio <= 1.0 {
            return Ok(Step::Reached);
        }
        self.history.push(ratio);
        let is_determined = ratio.is_finite();
        let patience = [PATIENCE_AT_FIRST, PATIENCE][usize::from(is_determined)];
        // Both are infinite where no motion has determined all values.
        if let [.., before] = self.history[..self.history.len().saturating_sub(patience)]
            && ratio >= before * (1.0 - PROGRESS)
        {
            return Ok(self.out_of_reach(place, ratio));
        }
        let measured = covariance
            .and_then(|covariance| self.of_prior.with(parameters.as_vector(), covariance));
        let belief = measured.unwrap_or_else(|| self.of_prior.clone());
        let before = (self.splines.clone(), self.plans);
        if self.plans > 0 {
            let followed = self.settings.followed_spans;
            let tails = self.splines.iter().map(|spline| spline.tail(followed));
            self.splines = tails.collect();
        }
        self.plans += 1;
        let improved = self.improve(&belief, base);
        let is_stuck = self.plans == 1 && matches!(improved, Ok(false));
        if improved.is_err() || is_stuck {
            (self.splines, self.plans) = before;
            self.history.pop();
        }
        improved?;
        if is_stuck {
            // What is measured at rest changes nothing about it.
            return Ok(self.out_of_reach(place, ratio));
        }
        let splines = self
            .joints
            .iter()
            .copied()
            .zip(self.splines.iter().cloned());
        let trajectory = Trajectory::new(
            self.problem.duration_s,
            &self.problem.start,
            splines.collect(),
        );
        Ok(Step::Move(trajectory))
    }

    fn out_of_reach(&self, place: usize, ratio: f64) -> Step {
        Step::OutOfReach {
            value: VALUE_NAMES[place],
            ratio,
            binding: self.binding.clone(),
        }
    }

    /// Replaces the splines by a better motion from the same start. Returns false where even the
    /// rest of the previous plan exceeds a limit, so that nothing else is safe.
    fn improve(&mut self, belief: &Belief, base: &Isometry3<f64>) -> Result<bool, ExcitationError> {
        let payloads = belief.payloads(&self.prior);
        set_payloads(&mut self.problem, &payloads, self.settings.within);
        let mut search = self.search(STEPS_PER_SPAN, base)?;
        search.objective.known = belief.information;
        if let Some(binding) = relax_to_rest(&mut search)? {
            self.binding = Some(binding);
            return Ok(false);
        }
        let Some(best) = self.best_start(&mut search)? else {
            return Ok(true);
        };
        let best = improve(&mut search, best, self.settings.iterations)?;
        let checked = self.checked(belief, &search, &best, base)?;
        self.splines = search.sampler.variables.splines(&checked.values);
        self.binding = checked.binding;
        Ok(true)
    }

    /// Returns the search for the next motion, with limits that include where the base is already.
    fn search(
        &self,
        steps_per_span: usize,
        base: &Isometry3<f64>,
    ) -> Result<Search, ExcitationError> {
        let mut plant = Plant::new(&self.problem)?;
        plant.add_acceleration_noise(&self.problem, &self.acceleration_noise)?;
        let variables = Variables::continuing(&self.basis, &self.splines);
        let direct = variables.values(self.splines.iter());
        let direct = direct.unwrap_or_else(|| variables.direct());
        let problem = &self.problem;
        let mut search = search(
            problem,
            &plant,
            &self.joints,
            variables,
            steps_per_span,
            direct,
        )?;
        for cone in &mut search.cones {
            cone.tightening = TIGHTENING;
            let excursion = match cone.limit {
                Limit::BaseAttitude => problem
                    .base
                    .attitude_rad
                    .map(|bound| base.rotation.scaled_axis() / bound),
                Limit::BasePosition => problem
                    .base
                    .position_m
                    .map(|bound| base.rotation.inverse() * base.translation.vector / bound),
                _ => None,
            };
            if let Some(excursion) = excursion {
                cone.start = excursion.into();
                let used = (excursion.norm() + STRIDE).clamp(USED, 1.0 - TIGHTENING);
                cone.tightening = 1.0 - used;
            }
        }
        Ok(search)
    }

    /// Returns the first of the seeds of the present plan.
    fn seed(&self) -> u64 {
        let plan = self
            .settings
            .seed
            .wrapping_mul(SEEDS)
            .wrapping_add(self.plans);
        plan.wrapping_mul(SEEDS)
    }

    /// Returns the best of the rest of the previous plan and of random motions; `None` where no
    /// motion determines all values.
    fn best_start(&self, search: &mut Search) -> Result<Option<Point>, ExcitationError> {
        let mut best = search.point(search.direct.clone())?;
        for start in 0..self.settings.starts as u64 {
            let seed = self.seed().wrapping_add(start);
            let mut point = search.random_start(seed)?;
            for _ in 0..MORE_HALVINGS {
                point = match point {
                    Some(point) if point.excess > 0.0 => {
                        search.point(search.shrunk(&point.values, 0.5))?
                    }
                    inside => inside,
                };
            }
            if let Some(point) = point
                && best
                    .as_ref()
                    .is_none_or(|best| point.merit() < best.merit())
            {
                best = Some(point);
            }
        }
        Ok(best)
    }

    /// Returns the variables of a motion, or of one between the rest of the previous plan and it,
    /// for which all limits hold for the payloads of the problem and for others of the confidence
    /// region, at closely spaced times.
    fn checked(
        &mut self,
        belief: &Belief,
        search: &Search,
        point: &Point,
        base: &Isometry3<f64>,
    ) -> Result<Checked, ExcitationError> {
        let mut payloads = belief.payloads(&self.prior);
        let mut random = StdRng::seed_from_u64(self.seed());
        for _ in 0..DRAWN {
            payloads.push(belief.draw(&self.prior, &mut random));
        }
        set_payloads(&mut self.problem, &payloads, self.settings.within);
        let mut dense = self.search(CHECKED_STEPS_PER_SPAN, base)?;
        largest_within_limits(search, &mut dense, point)
    }
}

/// Replaces the payloads of a problem, the first of which is the one that is expected, and the
/// targets that follow from it.
fn set_payloads(problem: &mut Problem, payloads: &[Vector], within: f64) {
    let payloads = payloads.iter().copied();
    problem.payloads = payloads.map(InertialParameters::from_vector).collect();
    if let Some(targets) = targets_from(&problem.payloads[0], within, NEAREST_CENTER) {
        problem.targets = targets;
    }
}

/// Returns the standard deviation of the white noise that has a mean over an averaging window as
/// noisy as the mean slope of a signal with white noise of one, 1/s. The ratio of the mean squares
/// of the slope of `cos⁴(πt/T)` and of itself is `16 · 5/35 · (π/T)²`.
fn differentiation_gain(cutoff_hz: f64) -> f64 {
    (16.0f64 / 7.0).sqrt() * PI / window::length_s(cutoff_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gain agrees with the weights of an averaging window and their slopes.
    #[test]
    fn differentiation_gain_is_that_of_the_window() {
        let length_s = window::length_s(5.0);
        let weight = |t: f64| (PI * t / length_s).cos().powi(4);
        let (mut squares, mut slopes) = (0.0, 0.0);
        for k in 0..10_000 {
            let t = length_s * (f64::from(k) / 10_000.0 - 0.5);
            let slope = (weight(t + 1e-6) - weight(t - 1e-6)) / 2e-6;
            squares += weight(t).powi(2);
            slopes += slope * slope;
        }
        let expected = (slopes / squares).sqrt();
        assert!((differentiation_gain(5.0) / expected - 1.0).abs() < 1e-4);
    }
}
