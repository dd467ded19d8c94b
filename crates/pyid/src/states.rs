//! States of a robot, as arrays.

use std::ops::Range;

use nalgebra::Vector3;
use pyo3::prelude::*;
use tactid_dynamics::{FrameMotion, JointMotion, Manipulator, StateError, StateSeries, Workspace};

use crate::arrays::{Sampled, Series, SeriesArray, common_length};
use crate::errors::{IntoPyErr, detached};
use crate::poses::Poses;
use crate::workspaces::Workspaces;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Number of states that are copied at once: few enough to stay in the processor's cache.
const PART: usize = 1024;

/// The robot's states, as arrays of Python.
pub(crate) struct StateArrays<'a, 'py> {
    robot: &'a Manipulator,
    q: SeriesArray<'py>,
    qd: SeriesArray<'py>,
    qdd: SeriesArray<'py>,
    pose: Poses,
    twist: SeriesArray<'py>,
    acceleration: SeriesArray<'py>,
}

impl<'a, 'py> StateArrays<'a, 'py> {
    /// Takes position, velocity and acceleration of the joints, and pose, twist and acceleration of
    /// the base; what is not given is at rest.
    pub(crate) fn read(
        robot: &'a Manipulator,
        (q, qd, qdd): (&Bound<'py, PyAny>, Argument<'_, 'py>, Argument<'_, 'py>),
        [pose, twist, acceleration]: [Argument<'_, 'py>; 3],
    ) -> PyResult<Self> {
        let dof = robot.dof();
        Ok(Self {
            robot,
            q: SeriesArray::read(q, "q", dof)?,
            qd: SeriesArray::read_or_zero(qd, "qd", dof)?,
            qdd: SeriesArray::read_or_zero(qdd, "qdd", dof)?,
            pose: Poses::read_or_identity(pose, "base_pose")?,
            twist: SeriesArray::read_or_zero(twist, "base_twist", 6)?,
            acceleration: SeriesArray::read_or_zero(acceleration, "base_acceleration", 6)?,
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

    /// Copies all states.
    pub(crate) fn whole(self) -> PyResult<States<'a>> {
        Ok(States {
            robot: self.robot,
            q: self.q.whole()?,
            qd: self.qd.whole()?,
            qdd: self.qdd.whole()?,
            pose: self.pose,
            twist: self.twist.whole()?,
            acceleration: self.acceleration.whole()?,
        })
    }

    /// Copies the states of some samples.
    fn part(&self, samples: Range<usize>) -> PyResult<States<'a>> {
        Ok(States {
            robot: self.robot,
            q: self.q.part(samples.clone())?,
            qd: self.qd.part(samples.clone())?,
            qdd: self.qdd.part(samples.clone())?,
            pose: self.pose.part(samples.clone()),
            twist: self.twist.part(samples.clone())?,
            acceleration: self.acceleration.part(samples)?,
        })
    }

    /// Copies the states a part at a time, and calls `compute` with each and the range of its
    /// samples while the interpreter is released. A copy of all of them would take as long as some
    /// computations.
    pub(crate) fn in_parts(
        &self,
        py: Python<'_>,
        count: usize,
        mut compute: impl FnMut(&States<'_>, Range<usize>) -> PyResult<()> + Send,
    ) -> PyResult<()> {
        for first in (0..count).step_by(PART) {
            let samples = first..count.min(first + PART);
            let states = self.part(samples.clone())?;
            detached(py, || compute(&states, samples))??;
        }
        Ok(())
    }
}

/// States of the robot.
pub(crate) struct States<'a> {
    robot: &'a Manipulator,
    q: Series,
    qd: Series,
    qdd: Series,
    pose: Poses,
    twist: Series,
    acceleration: Series,
}

impl States<'_> {
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

    /// Moves the robot to the first sample, with gravity for the forces that `look` computes, and
    /// calls it there.
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
