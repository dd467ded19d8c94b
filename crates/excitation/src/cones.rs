//! Limits that depend on the robot's dynamics, as second-order cones of the outputs along a motion.

use crate::grip::Grip;
use crate::limits::{Limit, REACH_M};
use crate::plant::{Layout, Plant};
use crate::problem::Problem;
use crate::samples::{Sampler, Samples};

/// Fraction of the largest change within the trust region that a limit is kept for. The whole
/// change needs all variables to move by the radius, each in the worst direction, and what a step
/// exceeds nevertheless shows when it is evaluated.
pub(crate) const REACH: f64 = 0.4;

/// Names of the entries of a wrench.
const WRENCH_LABELS: [&str; 6] = [
    "force x", "force y", "force z", "moment x", "moment y", "moment z",
];

/// An affine function of the outputs of one sample.
#[derive(Clone, Debug)]
pub(crate) struct AffineForm {
    constant: f64,
    /// Places of outputs with their factors.
    terms: Vec<(usize, f64)>,
}

impl AffineForm {
    fn constant(constant: f64) -> Self {
        Self {
            constant,
            terms: Vec::new(),
        }
    }

    fn output(place: usize, factor: f64) -> Self {
        Self {
            constant: 0.0,
            terms: vec![(place, factor)],
        }
    }

    fn at(&self, outputs: &[f64]) -> f64 {
        let terms = self.terms.iter();
        self.constant + terms.map(|(place, f)| f * outputs[*place]).sum::<f64>()
    }
}

/// A limit that holds where the norm of the tail is at most the head. Both are dimensionless: the
/// head is one without load.
#[derive(Clone, Debug)]
pub(crate) struct Cone {
    pub(crate) limit: Limit,
    /// Index of the payload for which it must hold.
    pub(crate) payload: usize,
    head: AffineForm,
    tail: Vec<AffineForm>,
    pub(crate) kind: Kind,
    /// The tail at the beginning, if it is integrated: the excursion of the base before the motion,
    /// relative to its bound.
    pub(crate) start: [f64; 3],
    /// What is subtracted from the head, so that the limit holds between the samples, too.
    pub(crate) tightening: f64,
}

/// How a limit depends on the outputs along a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// It depends on the outputs at the same time.
    Instant,
    /// The tail is integrated over the time since the beginning: velocities then become excursions.
    Integral,
    /// The head is the distance of a pair beyond the least one, in units of [`UNIT_M`], at the same
    /// time; the tail is empty.
    Distance {
        /// Index of the pair.
        pair: usize,
        /// Least distance, m.
        least_m: f64,
    },
}

/// Distance that counts as much as the whole of another limit, m: a motion that exceeds its limits
/// by one percent comes closer than allowed by one percent of it.
pub(crate) const UNIT_M: f64 = 0.1;

/// Values of a cone at one sample.
#[derive(Clone, Debug)]
pub(crate) struct ConeValue {
    pub(crate) head: f64,
    pub(crate) tail: Vec<f64>,
}

impl ConeValue {
    fn norm(&self) -> f64 {
        self.tail.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// What is left of the limit: negative where it is exceeded.
    pub(crate) fn slack(&self) -> f64 {
        self.head - self.norm()
    }

    /// Returns the fraction of the limit that is used.
    pub(crate) fn used(&self) -> f64 {
        if self.head > 0.0 {
            self.norm() / self.head
        } else {
            f64::INFINITY
        }
    }
}

/// Values of a cone at one sample with their gradients.
#[derive(Clone, Debug)]
pub(crate) struct LinearCone {
    pub(crate) sample: usize,
    pub(crate) value: ConeValue,
    pub(crate) head: Vec<f64>,
    pub(crate) tail: Vec<Vec<f64>>,
}

/// Returns the cones of a problem. The torques of joints that rest change with the motion of the
/// others, so all joints have one.
pub(crate) fn cones(problem: &Problem, plant: &Plant) -> Vec<Cone> {
    let mut cones = of_payloads(problem, &plant.layout());
    cones.extend(of_places(plant));
    cones
}

/// Names of the axes of a box.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns the cones of limits that depend on the positions of bodies, and not on the payload.
fn of_places(plant: &Plant) -> Vec<Cone> {
    let layout = plant.layout();
    let cone = |limit, kind, head, tail| Cone {
        limit,
        payload: 0,
        head,
        tail,
        kind,
        start: [0.0; 3],
        tightening: 0.0,
    };
    let mut cones = Vec::new();
    for (body, confined) in plant.confined.iter().enumerate() {
        for (axis, name) in AXES.into_iter().enumerate() {
            let used = AffineForm::output(layout.confined(body, axis), 1.0);
            let limit = Limit::Workspace(confined.name, name);
            let head = AffineForm::constant(1.0);
            cones.push(cone(limit, Kind::Instant, head, vec![used]));
        }
    }
    for (pair, ([first, second], least_m)) in plant.distances.limits().enumerate() {
        let limit = Limit::Distance(first.to_owned(), second.to_owned());
        let head = AffineForm {
            constant: -least_m / UNIT_M,
            terms: vec![(layout.distance(pair), UNIT_M.recip())],
        };
        cones.push(cone(
            limit,
            Kind::Distance { pair, least_m },
            head,
            Vec::new(),
        ));
    }
    cones
}

/// Returns the cones of limits that must hold for each payload.
fn of_payloads(problem: &Problem, layout: &Layout) -> Vec<Cone> {
    let cone = |payload, limit, head, tail| Cone {
        limit,
        payload,
        head,
        tail,
        kind: Kind::Instant,
        start: [0.0; 3],
        tightening: 0.0,
    };
    let mut cones = Vec::new();
    for payload in 0..problem.payloads.len() {
        for joint in 0..problem.robot.dof() {
            let limit = problem.limits[joint].effort;
            if limit.is_finite() {
                let effort = AffineForm::output(layout.effort(payload, joint), limit.recip());
                let name = problem.robot.joint_names()[joint].clone();
                cones.push(cone(
                    payload,
                    Limit::Effort(name),
                    AffineForm::constant(1.0),
                    vec![effort],
                ));
            }
        }
        for (entry, limit) in problem.wrench.iter().flatten().enumerate() {
            let of_entry = AffineForm::output(layout.wrench(payload, entry), limit.recip());
            let name = Limit::Wrench(WRENCH_LABELS[entry]);
            cones.push(cone(
                payload,
                name,
                AffineForm::constant(1.0),
                vec![of_entry],
            ));
        }
        for (pad, grip) in problem.grip.iter().flat_map(|grip| [(0, grip), (1, grip)]) {
            let (head, tail) = pad_cone(grip, pad, payload, layout);
            cones.push(cone(payload, Limit::Grip(pad), head, tail));
        }
        let bounds = [
            (Limit::BaseAttitude, problem.base.attitude_rad, 0),
            (Limit::BasePosition, problem.base.position_m, 3),
        ];
        for (limit, bound, first) in bounds {
            let Some(bound) = bound else { continue };
            let entry =
                |k: usize| AffineForm::output(layout.twist(payload, first + k), bound.recip());
            cones.push(Cone {
                kind: Kind::Integral,
                ..cone(
                    payload,
                    limit,
                    AffineForm::constant(1.0),
                    (0..3).map(entry).collect(),
                )
            });
        }
    }
    cones
}

/// Returns head and tail of the friction of a pad.
fn pad_cone(
    grip: &Grip,
    pad: usize,
    payload: usize,
    layout: &Layout,
) -> (AffineForm, Vec<AffineForm>) {
    let load = grip.pad(pad);
    let form = |constant, row: &nalgebra::RowVector6<f64>| AffineForm {
        constant,
        terms: row
            .iter()
            .enumerate()
            .filter(|(_, factor)| **factor != 0.0)
            .map(|(entry, factor)| (layout.wrench(payload, entry), *factor))
            .collect(),
    };
    let tail = load.tail.iter().map(|row| form(0.0, row));
    (form(1.0, &load.head), tail.collect())
}

impl Cone {
    /// Returns the cone of the limit itself.
    pub(crate) fn untightened(&self) -> Self {
        Self {
            tightening: 0.0,
            ..self.clone()
        }
    }

    /// Returns the values at all samples, `step_s` apart.
    pub(crate) fn values(&self, samples: &Samples, step_s: f64) -> Vec<ConeValue> {
        let mut sums = self.start;
        let mut before = vec![0.0; self.tail.len()];
        let value = |sample| {
            let outputs = samples.at(sample);
            let mut tail: Vec<f64> = self.tail.iter().map(|form| form.at(outputs)).collect();
            if self.kind == Kind::Integral {
                for ((entry, sum), before) in tail.iter_mut().zip(&mut sums).zip(&mut before) {
                    if sample > 0 {
                        *sum += 0.5 * step_s * (*before + *entry);
                    }
                    *before = *entry;
                    *entry = *sum;
                }
            }
            ConeValue {
                head: self.head.at(outputs) - self.tightening,
                tail,
            }
        };
        (0..samples.count()).map(value).collect()
    }

    /// Returns whether the limit is the distance of a pair that is too far apart at a sample for
    /// its distance to be known.
    fn is_far(&self, samples: &Samples, sample: usize) -> bool {
        let is_far = |(place, _): &(usize, f64)| samples.at(sample)[*place] >= REACH_M;
        matches!(self.kind, Kind::Distance { .. }) && self.head.terms.iter().all(is_far)
    }

    /// Returns the values with their gradients at the samples where the limit could be exceeded
    /// within the trust region: where the variables, in units of `scales`, change by at most
    /// `radius`.
    pub(crate) fn linearised(
        &self,
        sampler: &Sampler,
        samples: &Samples,
        scales: &[f64],
        radius: f64,
    ) -> Vec<LinearCone> {
        let count = sampler.variables.count();
        let step_s = sampler.grid.step_s;
        let mut sums = vec![vec![0.0; count]; self.tail.len()];
        let (mut head, mut tail) = (vec![0.0; count], sums.clone());
        let gradient = |form: &AffineForm, factor: f64, sum: &mut [f64], at: usize| {
            sampler.add_gradient(samples, at, &form.terms, factor, sum);
        };
        let mut reachable = Vec::new();
        for (sample, value) in self.values(samples, step_s).into_iter().enumerate() {
            if self.is_far(samples, sample) {
                continue;
            }
            head.fill(0.0);
            gradient(&self.head, 1.0, &mut head, sample);
            for ((form, sum), own) in self.tail.iter().zip(&mut sums).zip(&mut tail) {
                own.fill(0.0);
                if self.kind != Kind::Integral {
                    gradient(form, 1.0, own, sample);
                    continue;
                }
                if sample > 0 {
                    gradient(form, 0.5 * step_s, sum, sample - 1);
                    gradient(form, 0.5 * step_s, sum, sample);
                }
                own.copy_from_slice(sum);
            }
            for row in tail.iter_mut().chain([&mut head]) {
                for (entry, scale) in row.iter_mut().zip(scales) {
                    *entry *= scale;
                }
            }
            let change: f64 = tail.iter().chain([&head]).flatten().map(|x| x.abs()).sum();
            if value.slack() < REACH * radius * change {
                reachable.push(LinearCone {
                    sample,
                    value,
                    head: head.clone(),
                    tail: tail.clone(),
                });
            }
        }
        reachable
    }
}
