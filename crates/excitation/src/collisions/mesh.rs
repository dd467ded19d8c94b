//! Convex hulls of meshes.

use std::io::Cursor;

use nalgebra::Vector3;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::shape::SharedShape;
use parry3d_f64::transformation::try_convex_hull;

use super::placed::Placed;

/// Directions in which the hull of a mesh is exact. A search for closest points visits all corners, and a mesh may have thousands.
const DIRECTIONS: usize = 100;

/// Returns the convex hull of the mesh in the bytes of a file, whose coordinates are multiplied by `scale`. The end of its name
/// determines the format. A hull of many corners is replaced by that of the farthest ones in [`DIRECTIONS`] directions, with a margin
/// that contains all others.
///
/// # Errors
/// Returns the reason why there is no hull: the format, what is wrong with the file, or points that are all in one plane.
pub(crate) fn convex_hull(
    file: &str,
    bytes: &[u8],
    scale: &Vector3<f64>,
) -> Result<Placed, String> {
    let (_, extension) = file.rsplit_once('.').unwrap_or_default();
    let points = match extension.to_ascii_lowercase().as_str() {
        "stl" => stl_points(bytes),
        "obj" => obj_points(bytes),
        _ => Err("only STL and OBJ are read".to_owned()),
    }?;
    let scaled = |[x, y, z]: [f64; 3]| Vector::new(x * scale.x, y * scale.y, z * scale.z);
    let points: Vec<Vector> = points.into_iter().map(scaled).collect();
    if points.iter().any(|point| !point.is_finite()) {
        return Err("a coordinate is not finite".to_owned());
    }
    let no_volume = || "its points span no volume".to_owned();
    let (corners, _) = try_convex_hull(&points).map_err(|_| no_volume())?;
    let (fewer, faces) = try_convex_hull(&farthest(&corners)).map_err(|_| no_volume())?;
    let shape = SharedShape::convex_mesh(fewer, &faces).ok_or_else(no_volume)?;
    let beyond = corners
        .iter()
        .map(|corner| shape.distance_to_local_point(*corner, true));
    Ok(Placed {
        pose: Pose::IDENTITY,
        margin_m: beyond.fold(0.0, f64::max),
        shape,
    })
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

fn stl_points(bytes: &[u8]) -> Result<Vec<[f64; 3]>, String> {
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor).map_err(|error| error.to_string())?;
    let mut points = Vec::new();
    for triangle in triangles {
        let triangle = triangle.map_err(|error| error.to_string())?;
        let corners = triangle.vertices.into_iter();
        points.extend(corners.map(|corner| <[f32; 3]>::from(corner).map(f64::from)));
    }
    Ok(points)
}

fn obj_points(bytes: &[u8]) -> Result<Vec<[f64; 3]>, String> {
    let without_materials = |_: &std::path::Path| Ok(Default::default());
    let options = tobj::LoadOptions::default();
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, without_materials)
        .map_err(|error| error.to_string())?;
    let positions = models
        .iter()
        .map(|model| model.mesh.positions.as_chunks().0);
    let points = positions.flatten();
    Ok(points
        .map(|point: &[f32; 3]| point.map(f64::from))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hull of many corners keeps a hundred at most, and a small margin around it contains the others.
    #[test]
    fn many_corners_become_few_with_a_margin() {
        let corners: Vec<[f64; 3]> = (0..1000)
            .map(|k| {
                let (turn, z) = (2.4 * f64::from(k), f64::from(2 * k + 1) / 1000.0 - 1.0);
                let radius = (1.0 - z * z).sqrt();
                [radius * turn.cos(), 2.0 * radius * turn.sin(), 3.0 * z]
            })
            .collect();
        let vertex = |[x, y, z]: &[f64; 3]| format!("v {x} {y} {z}\n");
        let face = |k: usize| format!("f {} {} {}\n", k + 1, k + 2, k + 3);
        let obj: String = corners
            .iter()
            .map(vertex)
            .chain((0..998).map(face))
            .collect();
        let hull = convex_hull("a.obj", obj.as_bytes(), &Vector3::repeat(0.1)).unwrap();
        let kept = hull.shape.as_convex_polyhedron().unwrap().points().len();
        assert!(kept <= DIRECTIONS && kept > DIRECTIONS / 2, "{kept}");
        assert!(
            hull.margin_m > 0.0 && hull.margin_m < 0.02,
            "{}",
            hull.margin_m
        );
        for [x, y, z] in corners {
            let corner = Vector::new(0.1 * x, 0.1 * y, 0.1 * z);
            let outside = hull.shape.distance_to_local_point(corner, true);
            assert!(outside <= hull.margin_m + 1e-7, "{outside}");
        }
    }
}
