//! Boxes in which the tool and the payload must stay, and which they must not enter.

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::{FrameId, Workspace};

use crate::ExcitationError;
use crate::checks::{LARGEST_SIZE_M, positive, value};

/// Most boxes that must not be entered: each link is tested for each of them at each step.
pub const MAX_KEEP_OUT: usize = 100;

/// A box with a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// Pose of the box's centre, with axes parallel to the box's sides.
    pub pose: Isometry3<f64>,
    /// Half the lengths of the sides, m.
    pub half_size: Vector3<f64>,
}

impl OrientedBox {
    /// Returns the box between two opposite corners, m, with sides along the axes of the frame.
    #[must_use]
    pub fn between(low: [f64; 3], high: [f64; 3]) -> Self {
        let (low, high) = (Vector3::from(low), Vector3::from(high));
        Self {
            pose: Isometry3::from_parts((0.5 * (low + high)).into(), nalgebra::one()),
            half_size: 0.5 * (high - low),
        }
    }

    /// Checks that pose and size are finite and at most 1000 km, and that the size is positive.
    pub(crate) fn check(&self, name: &str) -> Result<(), ExcitationError> {
        for &half in &self.half_size {
            positive(&format!("{name}.half_size"), half)?;
            let expected = format!("at most {LARGEST_SIZE_M} m");
            value(
                &format!("{name}.half_size"),
                half,
                half <= LARGEST_SIZE_M,
                &expected,
            )?;
        }
        let translation = self.pose.translation.vector;
        let pose = translation.iter().chain(self.pose.rotation.coords.iter());
        for &entry in pose {
            let name = format!("{name}.pose");
            let expected = "finite numbers up to 1000 km";
            value(&name, entry, entry.abs() <= LARGEST_SIZE_M, expected)?;
        }
        Ok(())
    }
}

/// A box that must not be entered, in the frame of the base.
#[derive(Clone, Debug, PartialEq)]
pub struct KeepOutBox {
    /// Name, such as `table`, by which errors and margins refer to it.
    pub name: String,
    /// Where it is, in the frame of the base.
    pub place: OrientedBox,
}

/// Where the tool and the payload may be. On a floating base the boxes move with the base.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorkspaceBounds {
    /// Box in which the origin of the tool's frame and the bounding box of the payload must stay,
    /// in the frame of the base.
    pub inside: Option<OrientedBox>,
    /// Boxes that the origin of the tool's frame, the bounding box of the payload and the links
    /// with collision shapes must not enter.
    pub keep_out: Vec<KeepOutBox>,
}

impl WorkspaceBounds {
    /// Checks the numbers of all boxes, and how many there are.
    pub(crate) fn check(&self) -> Result<(), ExcitationError> {
        let count = self.keep_out.len();
        let expected = format!("at most {MAX_KEEP_OUT} boxes");
        value(
            "workspace.keep_out",
            count as f64,
            count <= MAX_KEEP_OUT,
            &expected,
        )?;
        if let Some(inside) = &self.inside {
            inside.check("workspace.inside")?;
        }
        for (k, keep_out) in self.keep_out.iter().enumerate() {
            keep_out
                .place
                .check(&format!("workspace.keep_out[{k}] ({})", keep_out.name))?;
        }
        Ok(())
    }
}

/// A body that must stay in a box.
#[derive(Clone, Debug)]
pub(crate) struct Confined {
    /// Name of the body in limits.
    pub(crate) name: &'static str,
    /// Frame in which `bounds` is expressed.
    frame: FrameId,
    /// Bounding box of the body.
    bounds: OrientedBox,
    /// Box in which it must stay, in the frame of the base.
    inside: OrientedBox,
}

impl Confined {
    /// Returns the bodies that are confined to a box: the origin of the tool's frame, and the
    /// payload if its box is given.
    pub(crate) fn to_box(
        inside: OrientedBox,
        frame: FrameId,
        payload_box: Option<OrientedBox>,
    ) -> Vec<Self> {
        let origin = OrientedBox {
            pose: Isometry3::identity(),
            half_size: Vector3::zeros(),
        };
        let body = |(name, bounds)| Self {
            name,
            frame,
            bounds,
            inside,
        };
        let payload = payload_box.map(|bounds| ("the payload", bounds));
        let bodies = [("the tool", origin)].into_iter().chain(payload);
        bodies.map(body).collect()
    }

    /// Returns along each axis of the box the distance of the body's farthest point from the middle
    /// over half the length of the side, at the state of a workspace with the base at the inertial
    /// frame.
    pub(crate) fn used(&self, workspace: &Workspace) -> [f64; 3] {
        let pose = self.inside.pose.inv_mul(&workspace.pose(self.frame)) * self.bounds.pose;
        let rotation = pose.rotation.to_rotation_matrix();
        let reach = rotation.matrix().abs() * self.bounds.half_size;
        let farthest = pose.translation.vector.abs() + reach;
        farthest.component_div(&self.inside.half_size).into()
    }
}
