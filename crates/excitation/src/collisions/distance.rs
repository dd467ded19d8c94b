//! Distances of pairs of solids at one state of the joints, and how they change near it.

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query;
use tactid_dynamics::Workspace;

use super::pairs::{Pair, Tested, pairs};
use crate::ExcitationError;
use crate::limits::{Limit, REACH_M};
use crate::problem::Problem;
use crate::shapes::{CollisionFinding, NotTested, Part, PartPlace, Solid, glam_pose};

/// The closest points of two solids, each in the frame of its solid, and the direction from the
/// first to the second in the frame of the base.
#[derive(Clone, Copy, Debug)]
struct Witness {
    points: [Vector; 2],
    normal: Vector,
    /// What the margins of both take from the distance of the points, m.
    margin_m: f64,
}

/// Distances between pairs of solids.
#[derive(Clone, Debug)]
pub(crate) struct Distances {
    solids: Vec<Solid>,
    pairs: Vec<Pair>,
    findings: Vec<CollisionFinding>,
    /// Pose of each solid in the frame of the base.
    poses: Vec<Pose>,
    /// Where the parts of each solid are.
    places: Vec<Vec<PartPlace>>,
    /// Closest points of each pair within reach at the state that was measured last.
    witnesses: Vec<Option<Witness>>,
}

impl Distances {
    /// Returns the pairs of a problem, of which `workspace` holds the motion at the start.
    pub(crate) fn new(problem: &Problem, workspace: &Workspace) -> Result<Self, ExcitationError> {
        let Tested {
            solids,
            pairs,
            mut findings,
        } = pairs(problem)?;
        if let Some(model) = &problem.collisions {
            findings.splice(0..0, model.findings().iter().cloned());
        }
        let mut distances = Self {
            poses: vec![Pose::IDENTITY; solids.len()],
            places: vec![Vec::new(); solids.len()],
            solids,
            pairs,
            findings,
            witnesses: Vec::new(),
        };
        distances.exclude_contacts(workspace)?;
        Ok(distances)
    }

    /// Removes the pairs that are in contact, except for those with a keep-out box, and limits the
    /// others to what they have: a pair that starts close keeps half of its distance.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Impossible`] for a link in the payload that neither holds it nor
    /// is next to the one that does: such a box or a posture is a mistake, and a pair that is not
    /// tested would hide it.
    fn exclude_contacts(&mut self, workspace: &Workspace) -> Result<(), ExcitationError> {
        let mut at_start = vec![0.0; self.pairs.len()];
        self.measure(workspace, &mut at_start);
        let solids = &self.solids;
        let names = |pair: &Pair| [pair.first, pair.second].map(|k| solids[k].name.clone());
        let mut excluded = Vec::new();
        let mut kept = Vec::new();
        for (mut pair, distance) in self.pairs.drain(..).zip(at_start) {
            if pair.is_with_keep_out {
                kept.push(pair);
            } else if distance > 0.0 {
                // A pair beyond reach is at least as far apart as any least distance.
                if distance < REACH_M && 0.5 * distance < pair.least_m {
                    self.findings.push(CollisionFinding::LeastDistanceReduced {
                        pair: names(&pair),
                        at_start_m: distance,
                        asked_m: pair.least_m,
                    });
                    pair.least_m = 0.5 * distance;
                }
                kept.push(pair);
            } else if pair.is_link_in_payload {
                let [link, payload] = names(&pair);
                return Err(ExcitationError::Impossible {
                    limit: Limit::Distance(link, payload),
                    used: f64::INFINITY,
                    at: "at the start",
                });
            } else {
                excluded.push(names(&pair));
            }
        }
        self.pairs = kept;
        self.witnesses = vec![None; self.pairs.len()];
        if !excluded.is_empty() {
            self.findings.push(CollisionFinding::PairsNotTested {
                pairs: excluded,
                because: NotTested::InContact,
            });
        }
        Ok(())
    }

    /// Number of pairs.
    pub(crate) fn count(&self) -> usize {
        self.pairs.len()
    }

    /// Returns what is not tested.
    pub(crate) fn findings(&self) -> &[CollisionFinding] {
        &self.findings
    }

    /// Returns the names of each pair with its least distance, m.
    pub(crate) fn limits(&self) -> impl Iterator<Item = ([&str; 2], f64)> {
        self.pairs.iter().map(|pair| {
            let names = [pair.first, pair.second].map(|k| self.solids[k].name.as_str());
            (names, pair.least_m)
        })
    }

    /// Computes the signed distance of each pair, m, at the state of a workspace with the base at
    /// the inertial frame: negative by the depth of penetration, [`REACH_M`] at most.
    pub(crate) fn measure(&mut self, workspace: &Workspace, distances: &mut [f64]) {
        self.place(workspace);
        self.place_parts();
        self.witnesses.clear();
        for (pair, distance) in self.pairs.iter().zip(distances) {
            let found = self.closest(pair);
            *distance = found.as_ref().map_or(REACH_M, |(distance, _)| *distance);
            self.witnesses.push(found.map(|(_, witness)| witness));
        }
    }

    /// Returns the signed distances of some of the pairs, as [`Distances::measure`] computes all.
    pub(crate) fn measure_some(&mut self, workspace: &Workspace, pairs: &[usize]) -> Vec<f64> {
        self.place(workspace);
        self.place_parts();
        let found = pairs.iter().map(|&k| self.closest(&self.pairs[k]));
        let distances = found.map(|found| found.map_or(REACH_M, |(distance, _)| distance));
        distances.collect()
    }

    /// Computes the distance of each pair along the direction between the points that were the
    /// closest when it was measured last: to first order the distance of the pair itself.
    pub(crate) fn follow(&mut self, workspace: &Workspace, distances: &mut [f64]) {
        self.place(workspace);
        let known = self.pairs.iter().zip(&self.witnesses);
        for ((pair, witness), distance) in known.zip(distances) {
            *distance = witness.map_or(REACH_M, |witness| {
                let [first, second] = witness.points;
                let first = self.poses[pair.first].transform_point(first);
                let second = self.poses[pair.second].transform_point(second);
                witness.normal.dot(second - first) - witness.margin_m
            });
        }
    }

    fn place(&mut self, workspace: &Workspace) {
        for (solid, pose) in self.solids.iter().zip(&mut self.poses) {
            *pose = glam_pose(&workspace.pose(solid.frame));
        }
    }

    fn place_parts(&mut self) {
        let solids = self.solids.iter().zip(&self.poses);
        for ((solid, pose), places) in solids.zip(&mut self.places) {
            places.clear();
            places.extend(solid.parts.iter().map(|part| part.place(pose)));
        }
    }

    /// Returns the distance of a pair and its closest points, or `None` for solids that are further
    /// apart than [`REACH_M`].
    fn closest(&self, pair: &Pair) -> Option<(f64, Witness)> {
        let parts = |solid: usize| self.solids[solid].parts.iter().zip(&self.places[solid]);
        let mut least: Option<(f64, Witness)> = None;
        for (a, place_a) in parts(pair.first) {
            for (b, place_b) in parts(pair.second) {
                // Distances of the shapes without their margins.
                let margin_m = a.margin_m + b.margin_m;
                let reach = margin_m + least.as_ref().map_or(REACH_M, |(distance, _)| *distance);
                if place_a.is_beyond(place_b, reach.max(0.0)) {
                    continue;
                }
                let found = contact([place_a.pose, place_b.pose], [a, b], reach.max(0.0));
                let Some((distance, points, normal)) = found.filter(|found| found.0 < reach) else {
                    continue;
                };
                let points = [
                    self.poses[pair.first].inverse_transform_point(points[0]),
                    self.poses[pair.second].inverse_transform_point(points[1]),
                ];
                let witness = Witness {
                    points,
                    normal,
                    margin_m,
                };
                least = Some((distance - margin_m, witness));
            }
        }
        least
    }
}

/// Returns signed distance, closest points and direction from the first to the second part, in the
/// frame of the base, or `None` for parts that are further apart than `reach`.
fn contact(poses: [Pose; 2], parts: [&Part; 2], reach: f64) -> Option<(f64, [Vector; 2], Vector)> {
    let [a, b] = poses;
    let shapes = parts.map(|part| part.shape.0.as_ref());
    // Shapes that parry does not support do not occur, and count as apart.
    let found = query::contact(&a, shapes[0], &b, shapes[1], reach).ok()?;
    if let Some(found) = found {
        return Some((found.dist, [found.point1, found.point2], found.normal1));
    }
    // The depth of a penetration is not always found: the depth of spheres around both replaces it.
    let intersects = query::intersection_test(&a, shapes[0], &b, shapes[1]);
    if !intersects.ok()?.intersecting {
        return None;
    }
    let spheres = [0, 1].map(|k| shapes[k].compute_bounding_sphere(&[a, b][k]));
    let between = spheres[1].center() - spheres[0].center();
    let normal = between.try_normalize().unwrap_or(Vector::X);
    let points = [
        spheres[0].center() + normal * spheres[0].radius(),
        spheres[1].center() - normal * spheres[1].radius(),
    ];
    Some((normal.dot(points[1] - points[0]), points, normal))
}
