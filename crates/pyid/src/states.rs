//! States of a robot, as arrays.

use nalgebra::Vector3;
use pyo3::prelude::*;
use tactid_dynamics::{FrameMotion, JointMotion, Manipulator, StateError, StateSeries, Workspace};

use crate::arrays::{Poses, Sampled, Series, common_length};
use crate::errors::IntoPyErr;
use crate::workspaces::Workspaces;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// The robot's states, as arrays.
pub(crate) struct States<'a> {
    robot: &'a Manipulator,
    q: Series,
    qd: Series,
    qdd: Series,
    pose: Poses,
    twist: Series,
    acceleration: Series,
}

impl<'a> States<'a> {
    /// Joints as given, the base at rest.
    pub(crate) fn read(
        robot: &'a Manipulator,
        q: &Bound<'_, PyAny>,
        qd: Argument<'_, '_>,
        qdd: Argument<'_, '_>,
    ) -> PyResult<Self> {
        let dof = robot.dof();
        Ok(Self {
            robot,
            q: Series::read(q, "q", &[dof])?,
            qd: Series::read_or_zero(qd, "qd", dof)?,
            qdd: Series::read_or_zero(qdd, "qdd", dof)?,
            pose: Poses::read_or_identity(None, "base_pose")?,
            twist: Series::read_or_zero(None, "base_twist", 6)?,
            acceleration: Series::read_or_zero(None, "base_acceleration", 6)?,
        })
    }

    /// The states with the base moving as given.
    pub(crate) fn with_base(
        self,
        pose: Argument<'_, '_>,
        twist: Argument<'_, '_>,
        acceleration: Argument<'_, '_>,
    ) -> PyResult<Self> {
        Ok(Self {
            pose: Poses::read_or_identity(pose, "base_pose")?,
            twist: Series::read_or_zero(twist, "base_twist", 6)?,
            acceleration: Series::read_or_zero(acceleration, "base_acceleration", 6)?,
            ..self
        })
    }

    /// Number of samples; `None` where each array holds one.
    pub(crate) fn samples(&self) -> PyResult<Option<usize>> {
        let series: [&dyn Sampled; 6] = [
            &self.q,
            &self.qd,
            &self.qdd,
            &self.pose,
            &self.twist,
            &self.acceleration,
        ];
        common_length(&series)
    }

    /// Motion of base and joints at a sample.
    pub(crate) fn at(&self, sample: usize) -> (FrameMotion, JointMotion<'_>) {
        let joints = JointMotion {
            position: self.q.at(sample),
            velocity: self.qd.at(sample),
            acceleration: self.qdd.at(sample),
        };
        (self.base(sample), joints)
    }

    /// Motion of the base at each sample, or one that holds for all of them.
    pub(crate) fn bases(&self) -> PyResult<Vec<FrameMotion>> {
        let parts: [&dyn Sampled; 3] = [&self.pose, &self.twist, &self.acceleration];
        let count = common_length(&parts)?.unwrap_or(1);
        Ok((0..count).map(|sample| self.base(sample)).collect())
    }

    /// All samples, with the motion of the base as [`bases`](Self::bases) returns it.
    pub(crate) fn series<'b>(&'b self, bases: &'b [FrameMotion]) -> StateSeries<'b> {
        StateSeries {
            base: bases,
            joints: JointMotion {
                position: self.q.as_slice(),
                velocity: self.qd.as_slice(),
                acceleration: self.qdd.as_slice(),
            },
        }
    }

    /// Motion of the base at a sample.
    fn base(&self, sample: usize) -> FrameMotion {
        FrameMotion {
            pose: *self.pose.at(sample),
            velocity: self.twist.vector(sample, 0),
            angular_velocity: self.twist.vector(sample, 3),
            acceleration: self.acceleration.vector(sample, 0),
            angular_acceleration: self.acceleration.vector(sample, 3),
        }
    }

    /// Moves the robot to the first sample, with gravity for the forces that `look` computes, and calls it there.
    pub(crate) fn first(
        &self,
        workspaces: &Workspaces,
        gravity: &Vector3<f64>,
        look: impl FnOnce(&mut Workspace) -> Result<(), StateError>,
    ) -> PyResult<()> {
        workspaces.with(self.robot, |workspace| {
            let (base, joints) = self.at(0);
            tactid_dynamics::motion_under_gravity(workspace, &base, joints, gravity)
                .and_then(|()| look(workspace))
                .map_err(IntoPyErr::into_py_err)
        })
    }

    /// Moves the robot to each sample in turn, and calls `look` there.
    pub(crate) fn each(
        &self,
        workspaces: &Workspaces,
        samples: Option<usize>,
        mut look: impl FnMut(&mut Workspace) -> Result<(), StateError>,
    ) -> PyResult<()> {
        workspaces.with(self.robot, |workspace| {
            for sample in 0..samples.unwrap_or(1) {
                let (base, joints) = self.at(sample);
                tactid_dynamics::motion(workspace, &base, joints)
                    .and_then(|()| look(workspace))
                    .map_err(IntoPyErr::into_py_err)?;
            }
            Ok(())
        })
    }
}
