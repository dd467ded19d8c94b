//! Shapes in their places, and the solids that they form.

use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::{Pose, Vector};
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

/// A shape of a solid, with the box around it in the frame of the shape.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) pose: Pose,
    pub(crate) shape: SharedShape,
    pub(crate) margin_m: f64,
    bounds: Aabb,
}

/// Where a part of a solid is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PartPlace {
    /// Pose of the shape in the frame of the base.
    pub(crate) pose: Pose,
    /// Centre of the box around it in the frame of the base, and the vectors from there to the
    /// middles of three sides.
    center: Vector,
    half_sides: [Vector; 3],
}

impl Part {
    /// Returns the place of the part of a solid with a pose in the frame of the base.
    pub(crate) fn place(&self, solid: &Pose) -> PartPlace {
        let pose = *solid * self.pose;
        let half = self.bounds.half_extents();
        PartPlace {
            pose,
            center: pose.transform_point(self.bounds.center()),
            half_sides: [
                pose.rotation * (Vector::X * half.x),
                pose.rotation * (Vector::Y * half.y),
                pose.rotation * (Vector::Z * half.z),
            ],
        }
    }
}

impl PartPlace {
    /// Returns whether the boxes of two parts are further apart than a distance along the line
    /// between their centres or the normal of a side. Parts of which this is true are further
    /// apart; of others it may be true, too.
    pub(crate) fn is_beyond(&self, other: &Self, distance_m: f64) -> bool {
        let between = other.center - self.center;
        let sides = || self.half_sides.iter().chain(&other.half_sides);
        let is_gap = |along: &Vector| {
            let reach: f64 = sides().map(|half_side| half_side.dot(*along).abs()).sum();
            between.dot(*along).abs() - reach > distance_m * along.length()
        };
        is_gap(&between) || sides().any(is_gap)
    }
}

/// Shapes that move together: a link, the payload, or a keep-out box.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub(crate) name: String,
    /// Frame in which the poses of the parts are expressed; the base's for a keep-out box.
    pub(crate) frame: FrameId,
    pub(crate) parts: Vec<Part>,
}

impl Solid {
    pub(crate) fn new(name: String, frame: FrameId, shapes: &[Placed]) -> Self {
        let part = |placed: &Placed| Part {
            pose: placed.pose,
            shape: placed.shape.clone(),
            margin_m: placed.margin_m,
            bounds: placed.shape.compute_local_aabb(),
        };
        Self {
            name,
            frame,
            parts: shapes.iter().map(part).collect(),
        }
    }
}
