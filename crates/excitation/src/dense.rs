//! Limits of a motion at closely spaced times, and where a free-floating base goes.

use nalgebra::{UnitQuaternion, Vector3};

use crate::ExcitationError;
use crate::cones::{Cone, Kind, UNIT_M, cones};
use crate::joint_limits::JointLimits;
use crate::limits::{Limit, Margin, REACH_M};
use crate::motion::{JointStates, Motion};
use crate::plant::{Layout, Plant};
use crate::problem::Problem;
use crate::samples::Samples;

/// Time between two samples at which limits are checked, s.
const STEP_S: f64 = 0.01;

/// Fewest samples of a short motion.
const FEWEST: f64 = 500.0;

/// Fraction of a limit from which on it binds.
const BINDING: f64 = 0.98;

/// Largest motion of a free-floating base from where it starts, with the first payload of a
/// problem. A fixed base has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Excursion {
    /// Largest angle by which the base is turned, rad.
    pub attitude_rad: f64,
    /// Largest distance of the base frame's origin from where it starts, m.
    pub position_m: f64,
}

/// Where a free-floating base is along a motion, with the first payload of a problem.
#[derive(Clone, Debug)]
pub struct BasePath {
    step_s: f64,
    /// Angle and distance from where the base starts at each time, rad and m; empty for a fixed
    /// base.
    places: Vec<[f64; 2]>,
}

impl BasePath {
    /// Returns the largest motion of the base from the start until a time, s; until the end for a
    /// later time.
    #[must_use]
    pub fn excursion(&self, until_s: f64) -> Excursion {
        let steps = (until_s / self.step_s).round() as usize;
        let places = self.places.iter().take(steps.saturating_add(1));
        places.fold(Excursion::default(), |largest, [angle, distance]| {
            Excursion {
                attitude_rad: largest.attitude_rad.max(*angle),
                position_m: largest.position_m.max(*distance),
            }
        })
    }
}

/// A motion at closely spaced times.
pub(crate) struct DenseMotion {
    step_s: f64,
    states: Vec<JointStates>,
    samples: Samples,
    /// For each payload, angle and distance of the base at each time, rad and m.
    paths: Vec<Vec<[f64; 2]>>,
    closest: Vec<Closest>,
}

/// Least distance of a pair.
#[derive(Clone, Copy, Debug)]
struct Closest {
    distance_m: f64,
    time_s: f64,
}

/// Parts that a time between two samples is divided into where a pair could come too close.
const PARTS: usize = 10;

/// Largest use of one limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Usage {
    pub(crate) used: f64,
    /// What is left of the limit at least: negative where it is exceeded.
    pub(crate) slack: f64,
    time_s: f64,
    /// Least distance, m, of a limit on one.
    distance_m: Option<f64>,
}

impl DenseMotion {
    /// Computes a motion at times at most [`STEP_S`] apart.
    pub(crate) fn new(plant: &mut Plant, motion: &dyn Motion) -> Result<Self, ExcitationError> {
        let duration_s = motion.duration_s();
        let steps = (duration_s / STEP_S).max(FEWEST).ceil();
        let step_s = duration_s / steps;
        let times = (0..=steps as usize).map(|k| k as f64 * step_s);
        let states = times.map(|time_s| motion.at(time_s)).collect();
        let mut dense = Self::of_states(plant, states, step_s)?;
        dense.refine(plant, motion)?;
        Ok(dense)
    }

    /// Computes distances between samples where a pair could come closer than its least distance.
    fn refine(&mut self, plant: &mut Plant, motion: &dyn Motion) -> Result<(), ExcitationError> {
        let layout = plant.layout();
        let least: Vec<f64> = plant
            .distances
            .limits()
            .map(|(_, least_m)| least_m)
            .collect();
        for sample in 1..self.states.len() {
            let at = |k: usize, pair: usize| {
                let k = k.min(self.states.len() - 1);
                self.samples.at(k)[layout.distance(pair)]
            };
            let is_close = |&pair: &usize| {
                // A pair is looked at more closely where a fall as large as the largest change from
                // sample to sample nearby would bring it below its least distance. This is a
                // heuristic for smooth motions, without proof.
                let around = [sample.saturating_sub(2), sample - 1, sample, sample + 1];
                let distances = around.map(|k| at(k, pair));
                let steps = distances.windows(2).map(|pair| (pair[1] - pair[0]).abs());
                let change = steps.fold(0.0, f64::max);
                distances[1].min(distances[2]) - change < least[pair]
            };
            let close: Vec<usize> = (0..least.len()).filter(is_close).collect();
            if close.is_empty() {
                continue;
            }
            for part in 1..PARTS {
                let time_s = self.step_s * ((sample - 1) as f64 + part as f64 / PARTS as f64);
                let distances = plant.distances_at(&motion.at(time_s), &close)?;
                for (pair, distance_m) in close.iter().zip(distances) {
                    if distance_m < self.closest[*pair].distance_m {
                        self.closest[*pair] = Closest { distance_m, time_s };
                    }
                }
            }
        }
        Ok(())
    }

    /// Computes a motion from its states at times that are `step_s` apart.
    pub(crate) fn of_states(
        plant: &mut Plant,
        states: Vec<JointStates>,
        step_s: f64,
    ) -> Result<Self, ExcitationError> {
        let layout = plant.layout();
        let outputs = layout.count();
        let mut samples = Samples::of_values(outputs, vec![0.0; states.len() * outputs]);
        for (states, values) in states.iter().zip(samples.values.chunks_exact_mut(outputs)) {
            plant.evaluate(states, values)?;
        }
        let closest = |pair: usize| {
            let distance = |k: usize| samples.at(k)[layout.distance(pair)];
            let all = (0..samples.count()).map(|k| (distance(k), k as f64 * step_s));
            let least = all.min_by(|a, b| a.0.total_cmp(&b.0));
            let (distance_m, time_s) = least.unwrap_or((f64::INFINITY, 0.0));
            Closest { distance_m, time_s }
        };
        Ok(Self {
            step_s,
            paths: paths(&layout, &samples, step_s),
            closest: (0..layout.pairs).map(closest).collect(),
            states,
            samples,
        })
    }

    /// Returns how much of a cone is used, without its tightening. The base has its true rotation.
    pub(crate) fn used(&self, cone: &Cone, problem: &Problem) -> Usage {
        if let Kind::Distance { pair, least_m } = cone.kind {
            let Closest { distance_m, time_s } = self.closest[pair];
            let is_apart = distance_m > 0.0;
            return Usage {
                used: if is_apart {
                    least_m / distance_m
                } else {
                    f64::INFINITY
                },
                slack: (distance_m - least_m) / UNIT_M,
                time_s,
                distance_m: Some(distance_m),
            };
        }
        let bounds = [problem.base.attitude_rad, problem.base.position_m];
        let of_base = match cone.limit {
            Limit::BaseAttitude => bounds[0].map(|bound| (0, bound)),
            Limit::BasePosition => bounds[1].map(|bound| (1, bound)),
            _ => None,
        };
        if let Some((entry, bound)) = of_base {
            let path = &self.paths[cone.payload];
            let used = path.iter().map(|at| at[entry] / bound);
            return self.largest(used.map(|used| (used, 1.0 - used)));
        }
        let values = cone
            .untightened()
            .values(&self.samples, self.step_s)
            .into_iter();
        self.largest(values.map(|value| (value.used(), value.slack())))
    }

    /// Returns the largest use, given use and slack at each time. Between samples both follow the
    /// parabola through three of them.
    fn largest(&self, uses: impl Iterator<Item = (f64, f64)>) -> Usage {
        let (used, slack): (Vec<f64>, Vec<f64>) = uses.map(|(used, slack)| (used, -slack)).unzip();
        let (place, used) = peak(&used);
        Usage {
            used,
            slack: -peak(&slack).1,
            time_s: place as f64 * self.step_s,
            distance_m: None,
        }
    }

    /// Returns the margins to all limits of a problem, for joints that move.
    pub(crate) fn margins(
        &self,
        problem: &Problem,
        cones: &[Cone],
        joints: &[usize],
    ) -> Vec<Margin> {
        let mut margins: Vec<Margin> = Vec::new();
        for &joint in joints {
            let name = &problem.robot.joint_names()[joint];
            let limits = &problem.limits[joint];
            for (limit, use_of) in of_joint(name, limits) {
                let uses = self.states.iter().map(|states| use_of(states, joint));
                let worst = self.largest(uses.map(|used| (used, 1.0 - used)));
                margins.push(margin(limit, worst));
            }
        }
        for cone in cones {
            let new = margin(cone.limit.clone(), self.used(cone, problem));
            match margins.iter_mut().find(|margin| margin.limit == new.limit) {
                Some(margin) if margin.used >= new.used => {}
                Some(margin) => *margin = new,
                None => margins.push(new),
            }
        }
        margins
    }

    /// Returns where the base is with the first payload.
    pub(crate) fn base_path(&self) -> BasePath {
        BasePath {
            step_s: self.step_s,
            places: self.paths.first().cloned().unwrap_or_default(),
        }
    }
}

/// Returns the largest value and the index of the sample next to it.
fn peak(values: &[f64]) -> (usize, f64) {
    let of_sample = |(k, &value): (usize, &f64)| {
        let around = k.checked_sub(1).map(|before| &values[before..]);
        let bulge = match around {
            Some([before, middle, after, ..]) if middle >= before && middle >= after => {
                let curvature = 2.0 * middle - before - after;
                (after - before).powi(2) / (8.0 * curvature).max(f64::MIN_POSITIVE)
            }
            _ => 0.0,
        };
        (k, value + bulge)
    };
    let peaks = values.iter().enumerate().map(of_sample);
    peaks.fold((0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a })
}

fn margin(limit: Limit, worst: Usage) -> Margin {
    Margin {
        limit,
        used: worst.used,
        time_s: worst.time_s,
        distance_m: worst.distance_m,
        // Bodies out of reach count as at its end.
        binds: worst.used > BINDING
            && worst
                .distance_m
                .is_none_or(|distance_m| distance_m < REACH_M),
    }
}

type UsageOf<'a> = Box<dyn Fn(&JointStates, usize) -> f64 + 'a>;

/// Returns the limits of a joint with the fraction that a state uses of each.
fn of_joint<'a>(name: &str, limits: &'a JointLimits) -> [(Limit, UsageOf<'a>); 3] {
    let (low, high) = limits.position;
    let position = move |states: &JointStates, joint: usize| {
        let used = (states.position[joint] - 0.5 * (low + high)).abs() / (0.5 * (high - low));
        if used.is_finite() { used } else { 0.0 }
    };
    [
        (Limit::Position(name.to_owned()), Box::new(position)),
        (
            Limit::Velocity(name.to_owned()),
            Box::new(|states, joint| states.velocity[joint].abs() / limits.velocity),
        ),
        (
            Limit::Acceleration(name.to_owned()),
            Box::new(|states, joint| states.acceleration[joint].abs() / limits.acceleration),
        ),
    ]
}

/// Returns angle and distance of the base at each time, for each payload.
fn paths(layout: &Layout, samples: &Samples, step_s: f64) -> Vec<Vec<[f64; 2]>> {
    if !layout.floats {
        return Vec::new();
    }
    let path = |payload| {
        let mut rotation = UnitQuaternion::identity();
        let mut position = Vector3::zeros();
        let mut before: Option<[Vector3<f64>; 2]> = None;
        let mut step = |sample: usize| {
            let outputs = &samples.at(sample)[layout.twist(payload, 0)..];
            let angular = Vector3::from_column_slice(&outputs[..3]);
            let velocity = Vector3::from_column_slice(&outputs[3..6]);
            if let Some([angular_before, velocity_before]) = before {
                let turn = (angular_before + angular) * (0.5 * step_s);
                rotation *= UnitQuaternion::from_scaled_axis(turn);
                position += (velocity_before + rotation * velocity) * (0.5 * step_s);
            }
            before = Some([angular, rotation * velocity]);
            [rotation.angle(), position.norm()]
        };
        (0..samples.count()).map(&mut step).collect()
    };
    (0..layout.payloads).map(path).collect()
}

/// Returns how much of each limit a motion uses, and the excursion of a floating base. The motion
/// may be any, not only a designed one. Limits on position, velocity and acceleration are checked
/// for the joints of [`Problem::moving_joints`] only; torques for all joints.
///
/// Times are at most 10 ms apart, and parabolas give the peaks between them.
///
/// Cost: for each of these times (at least 501), one inverse dynamics with each payload and one row
/// set of the method.
///
/// # Errors
/// Returns the errors of a design for a problem that is not valid.
pub fn margins(
    problem: &Problem,
    motion: &dyn Motion,
) -> Result<(Vec<Margin>, Excursion), ExcitationError> {
    problem.check()?;
    let mut plant = Plant::new(problem)?;
    let joints = problem.moving_joints()?;
    let cones = cones(problem, &plant);
    let dense = DenseMotion::new(&mut plant, motion)?;
    let excursion = dense.base_path().excursion(motion.duration_s());
    Ok((dense.margins(problem, &cones, &joints), excursion))
}
