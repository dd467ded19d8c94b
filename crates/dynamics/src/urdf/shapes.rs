//! Shapes of the `<collision>` elements of a link.

use nalgebra::{Isometry3, Vector3};

use super::element::Element;
use super::numbers::{Unreadable, number, numbers, origin};
use crate::ModelError;

/// A shape that is fixed to a link, from a `<collision>` element.
#[derive(Clone, Debug, PartialEq)]
pub struct CollisionShape {
    /// Pose of the shape in the link's frame.
    pub link_from_shape: Isometry3<f64>,
    /// The shape itself.
    pub geometry: CollisionGeometry,
}

/// What a shape is, in its own frame. Cylinders and capsules are along z; boxes, cylinders, capsules and spheres have their
/// centre at the frame's origin.
#[derive(Clone, Debug, PartialEq)]
pub enum CollisionGeometry {
    /// A box.
    Box {
        /// Half the lengths of the box's sides, m.
        half_size: Vector3<f64>,
    },
    /// A cylinder.
    Cylinder {
        /// Radius, m.
        radius_m: f64,
        /// Length, m.
        length_m: f64,
    },
    /// A cylinder with half a ball at each end.
    Capsule {
        /// Radius of cylinder and balls, m.
        radius_m: f64,
        /// Length of the cylinder alone, m.
        length_m: f64,
    },
    /// A ball.
    Sphere {
        /// Radius, m.
        radius_m: f64,
    },
    /// A mesh in a file, which is not read here.
    Mesh {
        /// Name of the file as the URDF has it, such as `package://arm/meshes/link.stl`.
        file: String,
        /// Factors for the coordinates of the file, which then are in m.
        scale: Vector3<f64>,
    },
    /// An element that the format does not have, or none.
    Unknown {
        /// Name of the element; empty where there is none.
        element: String,
    },
}

impl CollisionShape {
    /// Reads a `<collision>` element of a link with a name.
    ///
    /// # Errors
    /// Returns [`ModelError::Numbers`] for a pose or size that is not finite numbers, and [`ModelError::ShapeSize`] for a size
    /// that is not positive.
    pub(super) fn of(collision: &Element, link: &str) -> Result<Self, ModelError> {
        let unreadable = |fault: Unreadable| fault.of("link", link);
        let shape = shape_of(collision);
        Ok(Self {
            link_from_shape: origin(collision).map_err(unreadable)?,
            geometry: shape.map_or_else(|| Ok(unknown("")), |shape| geometry(shape, link))?,
        })
    }
}

/// Returns the element of the shape in a `<collision>`.
pub(super) fn shape_of(collision: &Element) -> Option<&Element> {
    collision.child("geometry")?.children.first()
}

fn unknown(element: &str) -> CollisionGeometry {
    CollisionGeometry::Unknown {
        element: element.to_owned(),
    }
}

fn geometry(shape: &Element, link: &str) -> Result<CollisionGeometry, ModelError> {
    let unreadable = |fault: Unreadable| fault.of("link", link);
    let size = |attribute| positive(number(shape, attribute).map_err(unreadable)?, shape, link);
    match shape.name.as_str() {
        "box" => {
            let size = numbers(shape, "size").map_err(unreadable)?;
            let half_size = 0.5 * size.map_or_else(Vector3::zeros, Vector3::from);
            positive(Some(half_size.min()), shape, link)?;
            Ok(CollisionGeometry::Box { half_size })
        }
        "cylinder" => Ok(CollisionGeometry::Cylinder {
            radius_m: size("radius")?,
            length_m: size("length")?,
        }),
        "capsule" => Ok(CollisionGeometry::Capsule {
            radius_m: size("radius")?,
            length_m: size("length")?,
        }),
        "sphere" => Ok(CollisionGeometry::Sphere {
            radius_m: size("radius")?,
        }),
        "mesh" => {
            let scale = numbers(shape, "scale").map_err(unreadable)?;
            Ok(CollisionGeometry::Mesh {
                file: shape.attribute("filename").unwrap_or_default().to_owned(),
                scale: scale.map_or_else(|| Vector3::repeat(1.0), Vector3::from),
            })
        }
        other => Ok(unknown(other)),
    }
}

/// Returns a size that must be given and positive.
fn positive(size: Option<f64>, shape: &Element, link: &str) -> Result<f64, ModelError> {
    size.filter(|size| *size > 0.0)
        .ok_or_else(|| ModelError::ShapeSize {
            link: link.to_owned(),
            shape: shape.name.clone(),
        })
}
