//! The design of a motion.

use std::ops::ControlFlow;

use crate::ExcitationError;
use crate::cones::cones;
use crate::dense::{BasePath, DenseMotion, Excursion, Usage};
use crate::joint_limits::JointLimits;
use crate::joint_rows::{ROUNDING, joint_rows};
use crate::limits::{Limit, Margin};
use crate::motion::{Motion, Trajectory};
use crate::objective::Objective;
use crate::plant::Plant;
use crate::prediction::{Prediction, predict};
use crate::problem::Problem;
use crate::progress::{Observer, report};
use crate::rest::check_rest;
use crate::samples::{Grid, Sampler};
use crate::search::{FIRST_RADIUS, Point, Search};
use crate::settings::{DesignSettings, passes};
use crate::shapes::CollisionFinding;
use crate::spline::SplineBasis;
use crate::variables::{End, Variables};

/// Samples of the outputs in each span of the splines. Products of five polynomials are integrated
/// to a few thousandths.
const STEPS_PER_SPAN: usize = 8;

/// Most control points of the motions from each start. Of 40 arms, postures and speeds, a search
/// with all control points from the start ends in local optima that are up to a third worse, and
/// takes longer.
const FIRST_CONTROL_POINTS: usize = 11;

/// Steps from each start, before the best of them is improved further with all control points.
const FIRST_ITERATIONS: usize = 10;

/// Least radius of the trust region after control points have been added.
const REFINED_RADIUS: f64 = 0.1;

/// Rounds in which limits that are exceeded between the samples are tightened, and steps in each.
const ROUNDS: usize = 10;
const ROUND_ITERATIONS: usize = 3;

/// Radius of the trust region at the beginning of the first of these rounds. Each round halves it,
/// so that the motion ends to move from one limit to another.
const ROUND_RADIUS: f64 = 0.15;

/// Fraction of a limit that a motion is moved away from it in the first round where it exceeded it.
/// Each round doubles it: the excess that is left shrinks from round to round, but a motion along a
/// distance of two bodies keeps a little of it.
const CLEARANCE: f64 = 1e-5;

/// Least factor by which a motion is shrunk to be within all limits.
const LEAST_FACTOR: f64 = 1e-3;

/// Accuracy of the factor by which a motion is shrunk.
const LEAST_SHRINKING: f64 = 5e-3;

/// Fraction of the control points' limit from which on a limit of a joint binds.
const BINDING: f64 = 0.999;

/// A designed motion, and what is to be expected of it.
#[derive(Clone, Debug)]
pub struct Design {
    /// Positions, velocities and accelerations of all joints over time.
    pub trajectory: Trajectory,
    /// Standard deviations of the ten values that the motion determines.
    pub prediction: Prediction,
    /// Largest fraction of each limit that the motion uses, with the payload that uses most.
    pub margins: Vec<Margin>,
    /// Where the base is with the expected payload, in the first pass.
    pub base_path: BasePath,
    /// What the test for collisions leaves out or relaxes; empty for a problem without
    /// [`Problem::collisions`] and keep-out boxes.
    pub findings: Vec<CollisionFinding>,
}

impl Design {
    /// Returns the largest motion of the base with the expected payload. The base returns along the
    /// same path in every second pass, so that further passes do not enlarge it.
    #[must_use]
    pub fn excursion(&self) -> Excursion {
        self.base_path.excursion(self.trajectory.duration_s())
    }

    /// Returns the limits that are active: relaxing one allows smaller intervals.
    pub fn binding(&self) -> impl Iterator<Item = &Limit> {
        let binding = self.margins.iter().filter(|margin| margin.binds);
        binding.map(|margin| &margin.limit)
    }
}

/// Designs the motion of a problem: [`design_observed`] without an observer, at the same cost.
///
/// # Errors
/// Returns the errors of [`design_observed`].
pub fn design(problem: &Problem, settings: &DesignSettings) -> Result<Design, ExcitationError> {
    design_observed(problem, settings, &mut |_| ControlFlow::Continue(()))
}

/// Designs the motion of a problem. Each step of the search calls the observer, which can stop it.
///
/// For all payloads of the problem, limits on position, velocity and acceleration hold at all
/// times; those on torques, wrench, grip and base at samples 10 ms apart (at least 500) and at the
/// peaks of the parabolas through them.
///
/// A motion of 15 s or more that need not end at a given posture has several passes along the same
/// splines, in turn forth and back, each of about 10 s (at least ten averaging windows). All limits
/// hold in each, and the variance falls with their number.
///
/// With [`End::At`], the search starts from one smooth step from the start to the end. It does not
/// look for another way: where this step exceeds a limit on position, velocity or acceleration, the
/// design is [`ExcitationError::Impossible`] although a detour may exist; and where it exceeds
/// torques, grip or base, the search may not find the motions that hold them.
///
/// Cost: each step of the search evaluates the dynamics of each payload some 19 times at each
/// sample, for six joints, and solves one to a few conic programs; there are up to
/// `10 * starts + iterations + 20` steps; the starts have at most 11 control points of each joint.
///
/// # Errors
/// Returns [`ExcitationError::Impossible`], which names the limit, where the robot cannot rest at
/// the start or at the end, cannot get there, or exceeds a limit in every motion that was tried;
/// [`ExcitationError::Solver`] if the conic solver fails, [`ExcitationError::NotObservable`] where
/// no motion determines all values, [`ExcitationError::TooShort`] for a motion shorter than an
/// averaging window, [`ExcitationError::TooFewSamples`] where a window has too few samples,
/// [`ExcitationError::Option`] where the noise of a channel is unknown,
/// [`ExcitationError::Interrupted`] if the observer stops the design, and the errors of a problem
/// that is not valid.
pub fn design_observed(
    problem: &Problem,
    settings: &DesignSettings,
    observer: &mut Observer<'_>,
) -> Result<Design, ExcitationError> {
    design_like(problem, settings, None, observer)
}

/// Designs the motion of a problem from another motion of the same joints as the first start.
pub(crate) fn design_like(
    problem: &Problem,
    settings: &DesignSettings,
    like: Option<&Trajectory>,
    observer: &mut Observer<'_>,
) -> Result<Design, ExcitationError> {
    problem.check()?;
    let passes = passes(problem);
    if passes == 1 {
        return design_pass(problem, settings, like, observer);
    }
    let pass = Problem {
        duration_s: problem.duration_s / passes as f64,
        ..problem.clone()
    };
    let design = design_pass(&pass, settings, like, observer)?;
    let trajectory = design.trajectory.with_passes(passes);
    Ok(Design {
        prediction: predict(problem, &trajectory)?,
        trajectory,
        ..design
    })
}

/// Designs a motion of one pass along its splines.
fn design_pass(
    problem: &Problem,
    settings: &DesignSettings,
    like: Option<&Trajectory>,
    observer: &mut Observer<'_>,
) -> Result<Design, ExcitationError> {
    let count = settings.control_points_for(problem);
    let mut designer = Designer::new(problem, count.min(FIRST_CONTROL_POINTS))?;
    let (mut point, mut radius) = designer.best_start(settings, like, observer)?;
    if count > FIRST_CONTROL_POINTS {
        (designer, point) = designer.refined(count, &point)?;
        radius = radius.max(REFINED_RADIUS);
    }
    let starts = settings.starts.max(1);
    let iterations = settings.iterations - first_iterations(settings);
    let search = &mut designer.search;
    let point = search.improve(point, &mut radius, starts, iterations, observer)?;
    designer.finish(point, starts, observer)
}

/// Returns the number of steps from each start: at most half of those from the best.
fn first_iterations(settings: &DesignSettings) -> usize {
    FIRST_ITERATIONS.min(settings.iterations.div_ceil(2))
}

/// A search with what it needs to know to check its result.
pub(crate) struct Designer<'a> {
    problem: &'a Problem,
    joints: Vec<usize>,
    pub(crate) search: Search,
    plant: Plant,
}

impl<'a> Designer<'a> {
    /// Creates the search for a motion with so many control points of each joint.
    pub(crate) fn new(problem: &'a Problem, count: usize) -> Result<Self, ExcitationError> {
        let joints = problem.moving_joints()?;
        let mut plant = Plant::new(problem)?;
        check_rest(problem, &mut plant, &joints)?;
        Self::with_plant(problem, plant, joints, count)
    }

    fn with_plant(
        problem: &'a Problem,
        plant: Plant,
        joints: Vec<usize>,
        count: usize,
    ) -> Result<Self, ExcitationError> {
        let variables = variables(problem, count, &joints);
        let direct = variables.direct();
        let search = search(problem, &plant, &joints, variables, STEPS_PER_SPAN, direct)?;
        let exceeded = search
            .rows
            .iter()
            .find(|row| row.value(&search.direct).abs() > 1.0 + ROUNDING);
        if let Some(row) = exceeded {
            return Err(ExcitationError::Impossible {
                limit: row.limit.clone(),
                used: row.value(&search.direct).abs(),
                at: "on the way to the end",
            });
        }
        Ok(Self {
            problem,
            joints,
            search,
            plant,
        })
    }

    /// Improves each start by a few steps, and returns the best motion with its trust region.
    fn best_start(
        &mut self,
        settings: &DesignSettings,
        like: Option<&Trajectory>,
        observer: &mut Observer<'_>,
    ) -> Result<(Point, f64), ExcitationError> {
        let search = &mut self.search;
        let variables = &search.sampler.variables;
        let like = like.and_then(|like| variables.values(like.splines().map(|(_, spline)| spline)));
        let mut best: Option<(Point, f64)> = None;
        for start in 0..settings.starts.max(1) {
            // Up to a thousand starts do not share their seeds with another design.
            let seed = settings.seed.wrapping_mul(1000).wrapping_add(start as u64);
            let point = match &like {
                Some(values) if start == 0 => search.start_like(values.clone())?,
                _ => search.random_start(seed)?,
            };
            if let Some(point) = point {
                let steps = first_iterations(settings);
                let mut radius = FIRST_RADIUS;
                let point = search.improve(point, &mut radius, start, steps, observer)?;
                if best
                    .as_ref()
                    .is_none_or(|(best, _)| point.merit() < best.merit())
                {
                    best = Some((point, radius));
                }
            }
        }
        best.ok_or(ExcitationError::NotObservable)
    }

    /// Returns the search with more control points of each joint, and a motion as it has it.
    fn refined(self, count: usize, point: &Point) -> Result<(Self, Point), ExcitationError> {
        let trajectory = self.trajectory(&point.values);
        let mut refined = Self::with_plant(self.problem, self.plant, self.joints, count)?;
        let splines = trajectory.splines().map(|(_, spline)| spline);
        let values = refined.search.sampler.variables.values(splines);
        let values = values.ok_or(ExcitationError::NotObservable)?;
        let point = refined.search.refined_start(values)?;
        Ok((refined, point.ok_or(ExcitationError::NotObservable)?))
    }

    /// Tightens limits until all hold at closely spaced times, and returns the design.
    fn finish(
        mut self,
        mut point: Point,
        start: usize,
        observer: &mut Observer<'_>,
    ) -> Result<Design, ExcitationError> {
        let mut radius_of_round = ROUND_RADIUS;
        let mut clearance = CLEARANCE;
        for _ in 0..ROUNDS {
            if !self.tighten(&point, clearance)? {
                return self.design(&point.values);
            }
            let again = self.search.point(point.values.clone())?;
            let from = again.ok_or(ExcitationError::NotObservable)?;
            let mut radius = radius_of_round;
            radius_of_round *= 0.5;
            clearance *= 2.0;
            let search = &mut self.search;
            point = search.improve(from, &mut radius, start, ROUND_ITERATIONS, observer)?;
        }
        // Smaller motions use less of each limit, so the largest one within all is bracketed.
        let (mut possible, mut impossible) = (None, 1.0);
        let mut factor = 1.0 - LEAST_SHRINKING;
        while factor > LEAST_FACTOR && possible.is_none_or(|low| impossible - low > LEAST_SHRINKING)
        {
            report(observer, point.progress(start, 0))?;
            let values = self.search.shrunk(&point.values, factor);
            if self
                .worst(&values)?
                .is_none_or(|(_, worst)| worst.slack >= 0.0)
            {
                possible = Some(factor);
            } else {
                impossible = factor;
            }
            factor = match possible {
                // Twice the shrinking.
                None => (2.0 * impossible - 1.0).max(0.5 * impossible),
                Some(low) => 0.5 * (low + impossible),
            };
        }
        if let Some(factor) = possible {
            let values = self.search.shrunk(&point.values, factor);
            return self.design(&values);
        }
        if let Some(failure) = self.search.failure.take() {
            return Err(ExcitationError::Solver(failure));
        }
        let worst = self.worst(&point.values)?;
        let (limit, worst) = worst.ok_or(ExcitationError::NotObservable)?;
        Err(ExcitationError::Impossible {
            limit,
            used: worst.used,
            at: "in every motion that was tried",
        })
    }

    fn trajectory(&self, values: &[f64]) -> Trajectory {
        let splines = self.search.sampler.variables.splines(values);
        let splines = self.joints.iter().copied().zip(splines).collect();
        Trajectory::new(self.problem.duration_s, &self.problem.start, splines)
    }

    /// Tightens the cones that a motion exceeds at closely spaced times, by the excess and a
    /// clearance, and returns whether there are any.
    fn tighten(&mut self, point: &Point, clearance: f64) -> Result<bool, ExcitationError> {
        let trajectory = self.trajectory(&point.values);
        let dense = DenseMotion::new(&mut self.plant, &trajectory)?;
        let mut any = false;
        for cone in &mut self.search.cones {
            let slack = dense.used(cone, self.problem).slack;
            if slack < 0.0 {
                // A little more than the excess, because the motion moves towards the limit again.
                cone.tightening += clearance - 1.1 * slack;
                any = true;
            }
        }
        Ok(any)
    }

    /// Returns the limit that a motion exceeds most or uses most, and how much of it.
    fn worst(&mut self, values: &[f64]) -> Result<Option<(Limit, Usage)>, ExcitationError> {
        let trajectory = self.trajectory(values);
        let dense = DenseMotion::new(&mut self.plant, &trajectory)?;
        let cones = self.search.cones.iter();
        let all = cones.map(|c| (c.limit.clone(), dense.used(c, self.problem)));
        Ok(all.min_by(|a, b| a.1.slack.total_cmp(&b.1.slack)))
    }

    fn design(mut self, values: &[f64]) -> Result<Design, ExcitationError> {
        let trajectory = self.trajectory(values);
        let dense = DenseMotion::new(&mut self.plant, &trajectory)?;
        let mut margins = dense.margins(self.problem, &self.search.cones, &self.joints);
        for row in &self.search.rows {
            if row.value(values).abs() > BINDING {
                for margin in margins.iter_mut().filter(|m| m.limit == row.limit) {
                    margin.binds = true;
                }
            }
        }
        Ok(Design {
            prediction: predict(self.problem, &trajectory)?,
            margins,
            base_path: dense.base_path(),
            findings: self.plant.distances.findings().to_vec(),
            trajectory,
        })
    }
}

/// Returns the search for the motion of some joints along splines with these variables, sampled so
/// often in each of their spans. `direct` are the variables of a motion that other motions are
/// shrunk towards.
pub(crate) fn search(
    problem: &Problem,
    plant: &Plant,
    joints: &[usize],
    variables: Variables,
    steps_per_span: usize,
    direct: Vec<f64>,
) -> Result<Search, ExcitationError> {
    let limits: Vec<JointLimits> = joints.iter().map(|&j| problem.limits[j]).collect();
    let names = problem.robot.joint_names();
    let names: Vec<&str> = joints.iter().map(|&j| names[j].as_str()).collect();
    let grid = Grid::new(&variables, steps_per_span);
    let span_s = variables.basis.duration_s() / variables.basis.spans() as f64;
    let scale = |limits: &JointLimits| {
        let range = 0.5 * (limits.position.1 - limits.position.0);
        range
            .min(limits.velocity * span_s)
            .min(limits.acceleration * span_s * span_s)
    };
    let of_joint = variables.of_joint();
    let scales = limits
        .iter()
        .flat_map(|l| vec![scale(l); of_joint])
        .collect();
    let rows = joint_rows(&variables, &limits, &names);
    let sampler = Sampler::new(
        plant.clone(),
        variables,
        grid,
        joints.to_vec(),
        problem.start.clone(),
    );
    Ok(Search {
        objective: Objective::new(problem, &sampler)?,
        cones: cones(problem, plant),
        sampler,
        rows,
        scales,
        direct,
        failure: None,
    })
}

/// Returns the variables of the joints that move.
fn variables(problem: &Problem, count: usize, joints: &[usize]) -> Variables {
    let basis = SplineBasis::new(count, problem.duration_s);
    let of_joints = |all: &[f64]| joints.iter().map(|&joint| all[joint]).collect();
    let end = match &problem.end {
        End::Start => Some(of_joints(&problem.start)),
        End::Free => None,
        End::At(end) => Some(of_joints(end)),
    };
    Variables::new(basis, of_joints(&problem.start), end)
}
