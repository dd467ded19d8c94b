//! Samples in arrays, as the online solvers take them.

use nalgebra::Vector3;
use pyo3::prelude::*;
use tactid_dynamics::words::counted;
use tactid_dynamics::{BaseKind, Wrench};
use tactid_identify::{BaseState, IdentifyError, PushOutcome, Sample};
use tactid_recordings::base_is_fixed;

use crate::arguments::{read_joints, read_wrenches};
use crate::arrays::{Sampled, Series, common_length};
use crate::errors::{ArgumentError, IntoPyErr};
use crate::poses::Poses;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// What each sample must have.
#[derive(Clone, Copy)]
pub(crate) struct Expected {
    /// Number of joints; `None` for a sensor without a robot.
    pub(crate) dof: Option<usize>,
    pub(crate) base: BaseKind,
    pub(crate) sensors: usize,
    pub(crate) uses_effort: bool,
}

/// Samples in arrays, one after the other.
pub(crate) struct Samples {
    time: Series,
    q: Series,
    qd: Series,
    effort: Series,
    wrench: Series,
    pose: Poses,
    twist: Series,
    acceleration: Option<Series>,
    count: usize,
}

impl Samples {
    pub(crate) fn read(
        expects: Expected,
        time: &Bound<'_, PyAny>,
        joints: [Argument<'_, '_>; 3],
        wrench: Argument<'_, '_>,
        base: [Argument<'_, '_>; 3],
    ) -> PyResult<Self> {
        check_given(expects, joints, wrench)?;
        check_base(expects, base)?;
        let [q, qd, effort] = read_joints(joints, expects.dof)?;
        let [pose, twist, acceleration] = base;
        let acceleration = acceleration.map(|given| Series::read(given, "acceleration", &[6]));
        let mut samples = Self {
            time: Series::read(time, "time", &[])?,
            q,
            qd,
            effort,
            wrench: read_wrenches(wrench, expects.sensors)?,
            pose: Poses::read_measured_or_identity(pose, "pose")?,
            twist: Series::read_or_zero(twist, "twist", 6)?,
            acceleration: acceleration.transpose()?,
            count: 1,
        };
        let Self {
            time,
            q,
            qd,
            effort,
            wrench,
            pose,
            twist,
            acceleration,
            ..
        } = &samples;
        let mut all: Vec<&dyn Sampled> = vec![time, q, qd, effort, wrench, pose, twist];
        all.extend(acceleration.iter().map(|series| series as &dyn Sampled));
        samples.count = common_length(&all)?.unwrap_or(1);
        Ok(samples)
    }

    /// Passes every sample to `push`, and returns how many were used.
    pub(crate) fn for_each(
        &self,
        mut push: impl FnMut(&Sample<'_>) -> Result<PushOutcome, IdentifyError>,
    ) -> PyResult<usize> {
        let (mut used, mut loads) = (0, Vec::new());
        for k in 0..self.count {
            loads.clear();
            loads.extend(self.wrench.at(k).chunks_exact(6).map(|six| Wrench {
                force: Vector3::from_column_slice(&six[..3]),
                moment: Vector3::from_column_slice(&six[3..]),
            }));
            let sample = Sample {
                time_s: self.time.at(k)[0],
                base: self.base(k),
                joint_position: self.q.at(k),
                joint_velocity: self.qd.at(k),
                joint_effort: self.effort.at(k),
                wrenches: &loads,
            };
            let outcome = push(&sample).map_err(IntoPyErr::into_py_err)?;
            used += usize::from(match outcome {
                PushOutcome::Used | PushOutcome::PayloadChanged | PushOutcome::PayloadReturned => {
                    true
                }
                PushOutcome::Started | PushOutcome::Rejected => false,
            });
        }
        Ok(used)
    }

    /// Returns the state of the base at a sample.
    fn base(&self, k: usize) -> BaseState {
        let measured = self.acceleration.as_ref();
        BaseState {
            pose: *self.pose.at(k),
            velocity: self.twist.vector(k, 0),
            angular_velocity: self.twist.vector(k, 3),
            acceleration: measured.map(|series| series.vector(k, 0)),
            angular_acceleration: measured.map(|series| series.vector(k, 3)),
        }
    }
}

/// Checks that a sample has the joints and the wrenches that it needs.
fn check_given(
    expects: Expected,
    [q, _, effort]: [Argument<'_, '_>; 3],
    wrench: Argument<'_, '_>,
) -> PyResult<()> {
    if let (Some(dof @ 1..), None) = (expects.dof, q) {
        return Err(ArgumentError::new_err(format!(
            "`q` is missing: the robot has {}",
            counted(dof, "joint")
        )));
    }
    if expects.sensors > 0 && wrench.is_none() {
        return Err(ArgumentError::new_err(format!(
            "`wrench` is missing: each sample has that of {}",
            counted(expects.sensors, "sensor")
        )));
    }
    if expects.uses_effort && effort.is_none() {
        return Err(ArgumentError::new_err(
            "`effort` is missing: the method uses the efforts of the joints",
        ));
    }
    Ok(())
}

/// Checks that the motion of the base, or of the sensor without a robot, is complete, and absent
/// for a fixed base.
fn check_base(expects: Expected, given: [Argument<'_, '_>; 3]) -> PyResult<()> {
    let names = ["pose", "twist", "acceleration"];
    let first = names.iter().zip(given).find(|(_, given)| given.is_some());
    if let (BaseKind::Fixed, Some((name, _))) = (expects.base, first) {
        return Err(base_is_fixed(name).into_py_err());
    }
    if expects.base == BaseKind::Fixed {
        return Ok(());
    }
    let whose = if expects.dof.is_some() {
        "the floating base"
    } else {
        "the sensor"
    };
    let message = match given {
        [None, ..] => format!("`pose` is missing: that of {whose} in the world"),
        [_, None, _] => format!(
            "`twist` is missing: online, the velocities of {whose} are not derived from its poses"
        ),
        [Some(_), Some(_), _] => return Ok(()),
    };
    Err(ArgumentError::new_err(message))
}
