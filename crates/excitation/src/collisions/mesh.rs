//! Convex hulls of meshes.

use std::collections::hash_map::DefaultHasher;
use std::collections::{HashMap, HashSet};
use std::hash::{Hash, Hasher};
use std::io::Cursor;

use nalgebra::Vector3;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::shape::SharedShape;
use parry3d_f64::transformation::try_convex_hull;

use super::placed::Placed;

/// Directions in which the hull of a mesh is exact. A search for closest points visits all corners, and a mesh may have thousands.
const DIRECTIONS: usize = 100;

const NO_VOLUME: &str = "its points span no volume";

/// Points of a mesh at most. A finer mesh is replaced by one point in each cell of a grid, the finest in which no more cells have
/// points.
const MAX_POINTS: usize = 50_000;

/// Points at most whose convex hull is computed as it is; each takes some microseconds.
const MAX_HULL_POINTS: usize = 1_000;

/// Convex hulls of meshes. Each is computed once, however often and under however many names a robot has the mesh.
#[derive(Default)]
pub(crate) struct ConvexHulls {
    by_hash: HashMap<u64, Result<Placed, String>>,
}

impl ConvexHulls {
    /// Returns [`convex_hull`].
    pub(crate) fn hull(
        &mut self,
        file: &str,
        bytes: &[u8],
        scale: &Vector3<f64>,
    ) -> Result<Placed, String> {
        let mut hasher = DefaultHasher::new();
        let scale_bits: [u64; 3] = scale.map(f64::to_bits).into();
        (extension(file), bytes, scale_bits).hash(&mut hasher);
        let hull = self.by_hash.entry(hasher.finish());
        hull.or_insert_with(|| convex_hull(file, bytes, scale))
            .clone()
    }
}

fn extension(file: &str) -> String {
    let (_, extension) = file.rsplit_once('.').unwrap_or_default();
    extension.to_ascii_lowercase()
}

/// Returns the convex hull of the mesh in the bytes of a file, whose coordinates are multiplied by `scale`. The end of its name
/// determines the format. A hull of many corners is replaced by that of the farthest ones in [`DIRECTIONS`] directions, with a margin
/// that contains all others.
///
/// # Errors
/// Returns the reason why there is no hull: the format, what is wrong with the file, or points that span no volume.
fn convex_hull(file: &str, bytes: &[u8], scale: &Vector3<f64>) -> Result<Placed, String> {
    let vertices = match extension(file).as_str() {
        "stl" => stl_vertices(bytes),
        "obj" => obj_vertices(bytes),
        _ => Err("only STL and OBJ are read".to_owned()),
    }?;
    let scale = Vector::new(scale.x, scale.y, scale.z);
    let placed = |vertex: &[f32; 3]| Vector::from(vertex.map(f64::from)) * scale;
    if !vertices.iter().all(|vertex| placed(vertex).is_finite()) {
        return Err("a coordinate is not finite".to_owned());
    }
    let (points, cell_m) = thinned(&vertices, placed);
    let corners = outermost(points)?;
    let shape = hull(&farthest(&corners))?;
    let beyond = corners
        .iter()
        .map(|corner| shape.distance_to_local_point(*corner, true));
    Ok(Placed {
        pose: Pose::IDENTITY,
        margin_m: beyond.fold(0.0, f64::max) + cell_m,
        shape,
    })
}

/// Returns the points of a mesh, each once, and 0; of many points one in each cell of a grid, and the diagonal of the cells, m.
fn thinned(vertices: &[[f32; 3]], placed: impl Fn(&[f32; 3]) -> Vector) -> (Vec<Vector>, f64) {
    let points = || vertices.iter().map(&placed);
    if let Some(each) = one_of_each(points(), |point| point.to_array().map(f64::to_bits)) {
        return (each, 0.0);
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
        if let Some(each) = one_of_each(points(), cell) {
            return (each, 3f64.sqrt() * cell_m);
        }
        cell_m *= 2.0;
    }
}

/// Returns the first point of each key, or `None` if there are more than [`MAX_POINTS`].
fn one_of_each(
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

/// Returns the corners of the convex hull of points, or of very many points all that may be corners.
fn outermost(mut points: Vec<Vector>) -> Result<Vec<Vector>, String> {
    if points.len() > MAX_HULL_POINTS {
        let farthest = farthest(&points);
        let inner = hull(&farthest)?;
        points.retain(|point| inner.distance_to_local_point(*point, true) > 0.0);
        points.extend(farthest);
    }
    if points.len() > MAX_HULL_POINTS {
        return Ok(points);
    }
    let (corners, _) = try_convex_hull(&points).map_err(|_| NO_VOLUME.to_owned())?;
    Ok(corners)
}

fn hull(points: &[Vector]) -> Result<SharedShape, String> {
    let (corners, faces) = try_convex_hull(points).map_err(|_| NO_VOLUME.to_owned())?;
    SharedShape::convex_mesh(corners, &faces).ok_or_else(|| NO_VOLUME.to_owned())
}

/// Returns the farthest of many corners in each of [`DIRECTIONS`] directions, and few corners as they are.
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

fn stl_vertices(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor).map_err(|error| error.to_string())?;
    let mut vertices = Vec::new();
    for triangle in triangles {
        let triangle = triangle.map_err(|error| error.to_string())?;
        vertices.extend(triangle.vertices.map(<[f32; 3]>::from));
    }
    Ok(vertices)
}

/// Returns the vertices of an OBJ file, which are all that its hull needs.
fn obj_vertices(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let mut vertices = Vec::new();
    for (number, line) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let words = line.split(u8::is_ascii_whitespace);
        let mut words = words.filter(|word| !word.is_empty());
        if words.next() == Some(b"v") {
            let mut coordinate = || std::str::from_utf8(words.next()?).ok()?.parse().ok();
            match (coordinate(), coordinate(), coordinate()) {
                (Some(x), Some(y), Some(z)) => vertices.push([x, y, z]),
                _ => {
                    return Err(format!(
                        "line {number}: expected three coordinates after `v`"
                    ));
                }
            }
        }
    }
    Ok(vertices)
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

    fn obj(vertices: &[[f64; 3]]) -> String {
        let line = |[x, y, z]: &[f64; 3]| format!("v {x} {y} {z}\n");
        let vertices: String = vertices.iter().map(line).collect();
        format!("# a mesh\n{vertices}f 1 2 3\n")
    }

    /// A hull of many corners keeps a hundred at most, and a small margin around it contains the others: those of a mesh whose hull is
    /// computed, of one with too many corners for that, and of one with too many points.
    #[test]
    fn many_corners_become_few_with_a_margin() {
        for (count, most) in [(1000, 0.02), (20_000, 0.02), (60_000, 0.03)] {
            let corners = ellipsoid(count);
            let file = obj(&corners);
            let hull = convex_hull("a.obj", file.as_bytes(), &Vector3::repeat(0.1)).unwrap();
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
        let hull = convex_hull("a.OBJ", obj(&points).as_bytes(), &Vector3::repeat(1.0)).unwrap();
        assert_eq!(hull.shape.as_convex_polyhedron().unwrap().points().len(), 8);
        assert!(hull.margin_m < 1e-12, "{}", hull.margin_m);
    }

    #[test]
    fn a_mesh_without_a_hull_has_a_reason() {
        let reason = |name: &str, text: &str| {
            let hull = convex_hull(name, text.as_bytes(), &Vector3::repeat(1.0));
            hull.err().unwrap()
        };
        assert_eq!(reason("a.dae", ""), "only STL and OBJ are read");
        let vertex = "line 2: expected three coordinates after `v`";
        assert_eq!(reason("a.obj", "v 1 2 3\r\nv 1 2\r\n"), vertex);
        assert_eq!(reason("a.obj", "v 1 2 3\nv 1 2 x\n"), vertex);
        assert_eq!(reason("a.obj", "v 1 2 inf\n"), "a coordinate is not finite");
        assert_eq!(reason("a.obj", "vn 1 2 3\n"), NO_VOLUME);
    }
}
