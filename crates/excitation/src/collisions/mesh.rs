//! Convex hulls of meshes.

use std::io::Cursor;

use nalgebra::Vector3;
use parry3d_f64::math::Vector;
use parry3d_f64::shape::SharedShape;
use parry3d_f64::transformation::try_convex_hull;

/// Returns the convex hull of the mesh in the bytes of a file, whose coordinates are multiplied by `scale`. The end of its name
/// determines the format.
///
/// # Errors
/// Returns the reason why there is no hull: the format, what is wrong with the file, or points that are all in one plane.
pub(crate) fn convex_hull(
    file: &str,
    bytes: &[u8],
    scale: &Vector3<f64>,
) -> Result<SharedShape, String> {
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
    let hull = try_convex_hull(&points).ok();
    let shape = hull.and_then(|(points, faces)| SharedShape::convex_mesh(points, &faces));
    shape.ok_or_else(|| "its points span no volume".to_owned())
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
