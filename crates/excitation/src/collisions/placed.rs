//! Shapes in their places, and the solids that they form.

use parry3d_f64::bounding_volume::BoundingSphere;
use parry3d_f64::math::Pose;
use parry3d_f64::shape::SharedShape;
use tactid_dynamics::FrameId;

use super::convert::{glam_pose, glam_vector};
use crate::workspace_bounds::OrientedBox;

/// A shape with its pose in the frame of its owner.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub(crate) pose: Pose,
    pub(crate) shape: SharedShape,
    /// Distance from the shape up to which its owner may extend, m.
    pub(crate) margin_m: f64,
}

impl Placed {
    /// Returns a box.
    pub(crate) fn cuboid(bounds: &OrientedBox) -> Self {
        let half = glam_vector(&bounds.half_size);
        Self {
            pose: glam_pose(&bounds.pose),
            shape: SharedShape::cuboid(half.x, half.y, half.z),
            margin_m: 0.0,
        }
    }

    /// Returns a point at the origin.
    pub(crate) fn point() -> Self {
        Self {
            pose: Pose::IDENTITY,
            shape: SharedShape::ball(0.0),
            margin_m: 0.0,
        }
    }
}

/// A shape of a solid, with the sphere around it in the frame of the solid.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) pose: Pose,
    pub(crate) shape: SharedShape,
    pub(crate) margin_m: f64,
    pub(crate) sphere: BoundingSphere,
}

/// Shapes that move together: a link, the payload, or a keep-out box.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub(crate) name: String,
    /// Frame in which the poses of the parts are expressed; that of the base for a keep-out box.
    pub(crate) frame: FrameId,
    pub(crate) parts: Vec<Part>,
}

impl Solid {
    pub(crate) fn new(name: String, frame: FrameId, shapes: &[Placed]) -> Self {
        let part = |placed: &Placed| Part {
            pose: placed.pose,
            shape: placed.shape.clone(),
            margin_m: placed.margin_m,
            sphere: placed.shape.compute_bounding_sphere(&placed.pose),
        };
        Self {
            name,
            frame,
            parts: shapes.iter().map(part).collect(),
        }
    }
}
