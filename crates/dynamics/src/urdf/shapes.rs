//! Shapes of the `<collision>` elements of a link.

use nalgebra::Isometry3;
use urdf_rs::{Geometry, Link};

use super::pose::isometry;
use super::preprocess::{LeftOut, Repairs};
use crate::ModelError;

/// A shape that is fixed to a link, from a `<collision>` element.
#[derive(Clone, Debug)]
pub struct CollisionShape {
    /// Pose of the shape in the link's frame.
    pub link_from_shape: Isometry3<f64>,
    /// The shape in its own frame, or the name of an element that the format does not have, which
    /// is empty where there is no element.
    ///
    /// Cylinders and capsules are along z; boxes, cylinders, capsules and spheres have their centre
    /// at the frame's origin, and their sizes are positive. The length of a capsule is the length
    /// of its cylinder alone. Mesh files are not read.
    pub geometry: Result<Geometry, String>,
}

/// Returns the collision shapes of a link from the elements with the selected names: those that
/// urdf-rs has read, and after them those that the preprocessing has left out.
///
/// # Errors
/// Returns [`ModelError::ShapeSize`] for a size that is not positive, and [`ModelError::Numbers`]
/// for a pose or size that is not finite numbers.
pub(super) fn shapes(
    link: &Link,
    repairs: &Repairs,
    is_selected: impl Fn(&str) -> bool,
) -> Result<Vec<CollisionShape>, ModelError> {
    let mut shapes = Vec::new();
    for collision in &link.collision {
        let (element, sizes) = sizes(&collision.geometry);
        if !is_selected(element) {
            continue;
        }
        if !sizes.iter().all(|&size| size > 0.0) {
            return Err(ModelError::ShapeSize {
                link: link.name.clone(),
                shape: element.to_owned(),
            });
        }
        shapes.push(CollisionShape {
            link_from_shape: isometry(&collision.origin),
            geometry: Ok(collision.geometry.clone()),
        });
    }
    let repair = repairs.links.get(&link.name);
    for LeftOut { element, fault } in repair.iter().flat_map(|repair| &repair.shapes) {
        match fault {
            _ if !is_selected(element) => {}
            Some(fault) => return Err(fault.of("link", &link.name)),
            None => shapes.push(CollisionShape {
                link_from_shape: Isometry3::identity(),
                geometry: Err(element.clone()),
            }),
        }
    }
    Ok(shapes)
}

/// Returns the name of the element of a shape, and its sizes.
fn sizes(geometry: &Geometry) -> (&'static str, Vec<f64>) {
    match geometry {
        Geometry::Box { size } => ("box", size.to_vec()),
        Geometry::Cylinder { radius, length } => ("cylinder", vec![*radius, *length]),
        Geometry::Capsule { radius, length } => ("capsule", vec![*radius, *length]),
        Geometry::Sphere { radius } => ("sphere", vec![*radius]),
        Geometry::Mesh { .. } => ("mesh", Vec::new()),
    }
}
