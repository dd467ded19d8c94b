//! What of the motion must be kept to know the effects of another direction of gravity or other
//! zeros of the joints.

use nalgebra::{Matrix3, Vector3};
use tactid_dynamics::{FrameId, JointMotion, Workspace};

use super::instant::Instant;

/// Number of the entries of an instant of so many joints, of which a [`Geometry`] is the mean.
pub(crate) fn entry_count(joints: usize) -> usize {
    9 + 3 * joints
}

/// Computes the entries at an instant, whose motion the workspace has: the axes of the inertial
/// frame in the frame `tool`, then positions, velocities and accelerations of the joints.
pub(crate) fn fill(instant: &Instant, workspace: &Workspace, tool: FrameId, entries: &mut [f64]) {
    let (axes, joints) = entries.split_at_mut(9);
    for (k, own) in axes.chunks_exact_mut(3).enumerate() {
        let axis = workspace.vector_in_frame(tool, &Vector3::ith(k, 1.0));
        own.copy_from_slice(axis.as_slice());
    }
    let vectors = [
        &instant.joint_position,
        &instant.joint_velocity,
        &instant.joint_acceleration,
    ];
    let count = instant.joint_position.len();
    for (k, vector) in vectors.into_iter().enumerate() {
        joints[k * count..(k + 1) * count].copy_from_slice(vector);
    }
}

/// Mean geometry of a window, from which the effects of another direction of gravity and of other
/// zeros of the joints follow.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a>(&'a [f64]);

impl<'a> Geometry<'a> {
    /// Reads the means of the entries; `None` where they were not kept.
    pub fn new(means: &'a [f64]) -> Option<Self> {
        (!means.is_empty()).then_some(Self(means))
    }

    /// The mean rotation `tool_from_world`.
    pub fn tool_from_world(self) -> Matrix3<f64> {
        Matrix3::from_column_slice(&self.0[..9])
    }

    /// The mean motion of the joints.
    pub fn joints(self) -> JointMotion<'a> {
        let joints = &self.0[9..];
        let (position, rest) = joints.split_at(joints.len() / 3);
        let (velocity, acceleration) = rest.split_at(position.len());
        JointMotion {
            position,
            velocity,
            acceleration,
        }
    }
}
