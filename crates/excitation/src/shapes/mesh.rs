//! Convex hulls of meshes.

use std::collections::hash_map::DefaultHasher;
use std::collections::{HashMap, HashSet};
use std::hash::{Hash, Hasher};

use nalgebra::Vector3;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::shape::SharedShape;
use parry3d_f64::transformation::try_convex_hull;
use tactid_shapes::Mesh;

use super::convert::glam_vector;
use super::placed::Placed;
use crate::checks::LARGEST_SIZE_M;

/// Directions in which the hull of a mesh is exact. A search for closest points visits all corners,
/// and a mesh may have thousands.
const DIRECTIONS: usize = 100;

/// Largest number of points of which all distances are computed, 2 microseconds for each. A finer
/// mesh is replaced by one point in each cell of a grid. The cells are doubled until no more of
/// them have points.
const MAX_POINTS: usize = 50_000;

/// Largest number of points for which the hull is computed as it is, 10 microseconds for each.
const MAX_HULL_POINTS: usize = 1_000;

/// Convex hulls of the meshes of a robot. Each is computed once, however often, under however many
/// names and at however many scales the robot has the mesh.
#[derive(Default)]
pub(crate) struct ConvexHulls {
    by_hash: HashMap<u64, Result<Hull, String>>,
}

/// The corners of a polyhedron, and the distance from it up to which the mesh may extend, m.
#[derive(Clone)]
struct Hull {
    corners: Vec<Vector>,
    margin_m: f64,
}

impl ConvexHulls {
    /// Returns the convex hull of the mesh in the bytes of a file, with coordinates times `scale`.
    /// The end of its name determines the format. A hull of many corners is replaced by the hull of
    /// the farthest ones in [`DIRECTIONS`] directions, with a margin that contains all others.
    ///
    /// # Errors
    /// Returns the reason why there is no hull: the format, what is wrong with the file, or points
    /// that span no volume.
    pub(crate) fn hull(
        &mut self,
        file: &str,
        bytes: &[u8],
        scale: &Vector3<f64>,
    ) -> Result<Placed, String> {
        let mut hasher = DefaultHasher::new();
        // The end of the name decides how the bytes are read.
        (file.rsplit_once('.').map(|(_, end)| end), bytes).hash(&mut hasher);
        let known = self.by_hash.entry(hasher.finish());
        let hull = known
            .or_insert_with(|| Hull::of_mesh(file, bytes))
            .clone()?;
        // The hull of scaled points is the scaled hull.
        let factors = glam_vector(scale);
        let corners: Vec<Vector> = hull
            .corners
            .iter()
            .map(|&corner| corner * factors)
            .collect();
        if !corners
            .iter()
            .all(|corner| corner.abs().max_element() <= LARGEST_SIZE_M)
        {
            return Err("it reaches beyond 1000 km".to_owned());
        }
        Ok(Placed {
            pose: Pose::IDENTITY,
            margin_m: hull.margin_m * scale.amax(),
            shape: polyhedron(&corners)?,
        })
    }
}

impl Hull {
    fn of_mesh(file: &str, bytes: &[u8]) -> Result<Self, String> {
        let vertices = Mesh::read(file, bytes)?.vertices;
        let point = |vertex: &[f32; 3]| Vector::from(vertex.map(f64::from));
        if !vertices.iter().all(|vertex| point(vertex).is_finite()) {
            return Err("a coordinate is not finite".to_owned());
        }
        let (mut points, cell_m) = thinned(&vertices, point);
        let mut corners = farthest(&points);
        let mut shape = polyhedron(&corners)?;
        // Points inside are no corners of the hull.
        points.retain(|&point| shape.distance_to_local_point(point, true) > 0.0);
        points.extend(&corners);
        if points.len() <= MAX_HULL_POINTS {
            (points, _) = try_convex_hull(&points).map_err(|_| NO_VOLUME.to_owned())?;
            corners = farthest(&points);
            shape = polyhedron(&corners)?;
        }
        let beyond = points
            .iter()
            .map(|&point| shape.distance_to_local_point(point, true));
        Ok(Self {
            corners,
            margin_m: beyond.fold(0.0, f64::max) + cell_m,
        })
    }
}

const NO_VOLUME: &str = "its points span no volume";

fn polyhedron(points: &[Vector]) -> Result<SharedShape, String> {
    let (corners, faces) = try_convex_hull(points).map_err(|_| NO_VOLUME.to_owned())?;
    SharedShape::convex_mesh(corners, &faces).ok_or_else(|| NO_VOLUME.to_owned())
}

/// Returns the different points of a mesh and zero. Of more than [`MAX_POINTS`] it returns one in
/// each cell of a grid, and the diagonal of the cells, m.
fn thinned(vertices: &[[f32; 3]], point: impl Fn(&[f32; 3]) -> Vector) -> (Vec<Vector>, f64) {
    let points = || vertices.iter().map(&point);
    if let Some(first) = first_of_each(points(), |point| point.to_array().map(f64::to_bits)) {
        return (first, 0.0);
    }
    let low = points().fold(Vector::INFINITY, Vector::min);
    let high = points().fold(Vector::NEG_INFINITY, Vector::max);
    let mut cell_m = (high - low).max_element() / 512.0;
    loop {
        let cell = |point: Vector| {
            ((point - low) / cell_m)
                .to_array()
                .map(|index| index as u64)
        };
        if let Some(first) = first_of_each(points(), cell) {
            return (first, 3f64.sqrt() * cell_m);
        }
        cell_m *= 2.0;
    }
}

/// Returns the first point of each key, or `None` if there are more than [`MAX_POINTS`] keys.
fn first_of_each(
    points: impl Iterator<Item = Vector>,
    key: impl Fn(Vector) -> [u64; 3],
) -> Option<Vec<Vector>> {
    let mut keys = HashSet::new();
    let mut first = Vec::new();
    for point in points {
        if keys.insert(key(point)) {
            if first.len() == MAX_POINTS {
                return None;
            }
            first.push(point);
        }
    }
    Some(first)
}

/// Returns the farthest of many corners in each of [`DIRECTIONS`] directions; few stay as they are.
fn farthest(corners: &[Vector]) -> Vec<Vector> {
    if corners.len() <= DIRECTIONS {
        return corners.to_vec();
    }
    // Points of a spiral from pole to pole are spread evenly over a sphere.
    let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let direction = |k: usize| {
        let z = (2 * k + 1) as f64 / DIRECTIONS as f64 - 1.0;
        let (sin, cos) = (golden_angle * k as f64).sin_cos();
        Vector::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
    };
    let farthest = |along: Vector| {
        let heights = corners.iter().map(|corner| corner.dot(along)).enumerate();
        heights.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    };
    let mut chosen: Vec<usize> = (0..DIRECTIONS)
        .map(direction)
        .filter_map(farthest)
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|k| corners[k]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns points on an ellipsoid with the half axes 1, 2 and 3.
    fn ellipsoid(count: u32) -> Vec<[f64; 3]> {
        let point = |k: u32| {
            let (turn, z) = (
                2.4 * f64::from(k),
                f64::from(2 * k + 1) / f64::from(count) - 1.0,
            );
            let radius = (1.0 - z * z).sqrt();
            [radius * turn.cos(), 2.0 * radius * turn.sin(), 3.0 * z]
        };
        (0..count).map(point).collect()
    }

    fn convex_hull(text: &str, scale: f64) -> Result<Placed, String> {
        let scale = Vector3::repeat(scale);
        ConvexHulls::default().hull("a.OBJ", text.as_bytes(), &scale)
    }

    fn obj(vertices: &[[f64; 3]]) -> String {
        let line = |[x, y, z]: &[f64; 3]| format!("v {x} {y} {z}\n");
        let vertices: String = vertices.iter().map(line).collect();
        format!("# a mesh\n{vertices}f 1 2 3\n")
    }

    /// A hull of many corners keeps a hundred at most, and a small margin around it contains the
    /// others: for a mesh with a computed hull, one with too many corners for that, and one with
    /// too many points.
    #[test]
    fn many_corners_become_few_with_a_margin() {
        for (count, most) in [(1000, 0.02), (20_000, 0.02), (60_000, 0.03)] {
            let corners = ellipsoid(count);
            let file = obj(&corners);
            let hull = convex_hull(&file, 0.1).unwrap();
            let kept = hull.shape.as_convex_polyhedron().unwrap().points().len();
            assert!(kept <= DIRECTIONS && kept > DIRECTIONS / 2, "{kept}");
            let margin = hull.margin_m;
            assert!(margin > 0.0 && margin < most, "{count}: {margin}");
            for [x, y, z] in corners {
                let corner = Vector::new(0.1 * x, 0.1 * y, 0.1 * z);
                let outside = hull.shape.distance_to_local_point(corner, true);
                assert!(outside <= margin + 1e-7, "{outside}");
            }
        }
    }

    /// Points inside are no corners, however many there are.
    #[test]
    fn the_hull_of_few_corners_is_exact() {
        let inside = ellipsoid(5000)
            .into_iter()
            .map(|point| point.map(|x| 0.3 * x));
        let cube = (0..8).map(|k| [1, 2, 4].map(|bit| if k & bit == 0 { -1.0 } else { 1.0 }));
        let points: Vec<[f64; 3]> = inside.chain(cube).collect();
        let hull = convex_hull(&obj(&points), 1.0).unwrap();
        assert_eq!(hull.shape.as_convex_polyhedron().unwrap().points().len(), 8);
        assert!(hull.margin_m < 1e-12, "{}", hull.margin_m);
    }

    /// A mesh has one hull, which each scale changes, also where it mirrors.
    #[test]
    fn the_scale_is_that_of_each_place() {
        let mut hulls = ConvexHulls::default();
        let file = obj(&ellipsoid(3000));
        let mut used = |scale: Vector3<f64>| hulls.hull("a.obj", file.as_bytes(), &scale).unwrap();
        let (whole, mirrored) = (
            used(Vector3::repeat(1.0)),
            used(Vector3::new(1.0, -0.5, 2.0)),
        );
        for [x, y, z] in ellipsoid(3000) {
            let [whole, mirrored] = [
                (&whole, Vector::new(x, y, z)),
                (&mirrored, Vector::new(x, -0.5 * y, 2.0 * z)),
            ]
            .map(|(hull, point)| hull.shape.distance_to_local_point(point, true) - hull.margin_m);
            assert!(whole <= 1e-7 && mirrored <= 1e-7, "{whole} {mirrored}");
        }
        assert!((mirrored.margin_m / whole.margin_m - 2.0).abs() < 1e-12);
        assert_eq!(hulls.by_hash.len(), 1);
    }

    #[test]
    fn a_mesh_without_a_hull_has_a_reason() {
        let reason = |text: &str, scale: f64| convex_hull(text, scale).err().unwrap();
        assert_eq!(reason("v 1 2 inf\n", 1.0), "a coordinate is not finite");
        assert_eq!(
            reason("v 3 2 3\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", 1e308),
            "it reaches beyond 1000 km"
        );
        assert_eq!(reason("v 1 2 3\nv 1 2 3\n", 1.0), NO_VOLUME);
    }
}
