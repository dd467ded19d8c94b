//! The online identifier.

use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::{SMatrix, Vector3};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use tactid_dynamics::Wrench;
use tactid_identify::{BaseState, Pushed, Sample};

use crate::arrays::{Poses, Series, common_length, output};
use crate::dynamics::Manipulator;
use crate::errors::{ArgumentError, IntoPyErr};
use crate::payload::PayloadEstimate;
use crate::request::{Argument, Given};

/// Identifies the payload of one robot online: samples in, asked at any time.
///
/// Args:
///     robot: The robot with its gripper and without the payload.
///     tool: The end-effector frame, a link of the robot. What is below it is the gripper.
///     sensors: The links in whose frames the wrenches of each sample are.
///     way: ``"tactile"``, from the contact wrenches; ``"effort"``, from what the joints exert beyond what the
///         arm itself needs; ``"joint-sensing"``, from the motion of a free-floating robot, the known gripper
///         taken off; or ``"combined"``, from all that is measured, each with its weight.
///     estimator: ``"rls"``, least squares, which tells its uncertainty, the nearest possible body and a change of
///         payload; or ``"nlms"``, the paper's filter.
///     effort: For the combined way, whether each sample has the joints' efforts.
///     alpha: Of NLMS, in (0, 2).
///     beta: Of NLMS, in (0, 1).
///     gravity: Gravitational acceleration in world axes, (3,), m/s², pointing down. Where left out:
///         zero for a floating base, 9.81 along -z for a fixed one.
///     average: The estimate is the mean over this last time, s, or the latest value for 0. Where left out:
///         10 for NLMS, as in the paper, and 0 for least squares.
///     cutoff: Both sides of the equations pass a low-pass that has lost 3 dB here, Hz. It keeps noise out of
///         the estimator and adds no bias.
///     max_gap: Samples further apart are not bridged, s.
///     wrench_offset: Whether the wrenches, summed in the tool frame, may be off by a constant: six more unknowns.
///     wrench_noise: Standard deviations of one sample of a sensor's wrench, (6,), N and N m, or (S, 6) for S
///         sensors. Learnt from the residuals where left out.
///     effort_noise: The same of a joint's effort, () or (n,), N m or N.
///
/// Least squares learns the noise from the first 32 windows, 1 s at a cutoff of 10 Hz; before, intervals are
/// rough and no change is seen. One sample takes some microseconds, a call from Python more: give many at once
/// where you can.
///
/// Raises:
///     ModelError: The robot has no such link.
///     ArgumentError: A setting is out of range.
///     IdentificationError: The way does not fit the robot or the sensors.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Identifier {
    identifier: Mutex<tactid_identify::Identifier>,
    dof: usize,
    sensors: usize,
}

#[pymethods]
impl Identifier {
    #[new]
    #[pyo3(signature = (robot, tool, sensors=Vec::new(), *, way="tactile", estimator="rls", effort=true, alpha=1.8, beta=0.9, gravity=None, average=None, cutoff=10.0, max_gap=0.1, wrench_offset=false, wrench_noise=None, effort_noise=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: Vec<String>,
        way: &str,
        estimator: &str,
        effort: bool,
        alpha: f64,
        beta: f64,
        gravity: Argument<'_, '_>,
        average: Option<f64>,
        cutoff: f64,
        max_gap: f64,
        wrench_offset: bool,
        wrench_noise: Argument<'_, '_>,
        effort_noise: Argument<'_, '_>,
    ) -> PyResult<Self> {
        let settings = Given {
            way: Some(way),
            effort,
            estimator,
            alpha,
            beta,
            gravity,
            average,
            cutoff: Some(cutoff),
            epochs: None,
            max_gap: Some(max_gap),
            wrench_offset,
            wrench_noise,
            effort_noise,
        }
        .settings()?;
        let names: Vec<&str> = sensors.iter().map(String::as_str).collect();
        let identifier = tactid_identify::Identifier::new(&robot.0, tool, &names, settings)
            .map_err(IntoPyErr::into_py_err)?;
        Ok(Self {
            identifier: Mutex::new(identifier),
            dof: robot.0.dof(),
            sensors: names.len(),
        })
    }

    /// Takes one sample, or N in a row.
    ///
    /// Args:
    ///     time: On one clock, s, () or (N,).
    ///     q: Joint positions in the order of the robot's ``joint_names``, (n,) or (N, n), rad or m.
    ///     qd: Joint velocities, (n,) or (N, n), rad/s or m/s. Derived from the positions where left out.
    ///     wrenches: Force then moment **on the payload**, each in its sensor's frame and about that frame's
    ///         origin, (S, 6) or (N, S, 6), N and N m. May be left out without sensors.
    ///     effort: For the effort way: what each joint exerts, (n,) or (N, n), N m or N.
    ///     base_pose: ``world_from_base``, (4, 4) or (7,), or N of them; identity where left out.
    ///     base_twist: Velocity of the base frame's origin, then angular velocity, in world axes, (6,) or
    ///         (N, 6); zero where left out.
    ///
    /// Returns:
    ///     How many samples were used: they gave rows once an interval was full. Bad ones (not finite, not
    ///     later than the one before) are refused and counted, and the first of all, or after a gap, only
    ///     starts an interval.
    ///
    /// Raises:
    ///     ArgumentError: A shape does not fit.
    #[pyo3(signature = (time, q, qd=None, wrenches=None, *, effort=None, base_pose=None, base_twist=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn push(
        &self,
        py: Python<'_>,
        time: &Bound<'_, PyAny>,
        q: &Bound<'_, PyAny>,
        qd: Argument<'_, '_>,
        wrenches: Argument<'_, '_>,
        effort: Argument<'_, '_>,
        base_pose: Argument<'_, '_>,
        base_twist: Argument<'_, '_>,
    ) -> PyResult<usize> {
        let time = Series::read(time, "time", &[])?;
        let q = Series::read(q, "q", &[self.dof])?;
        let qd = Series::read_or_empty(qd, "qd", self.dof)?;
        let effort = Series::read_or_empty(effort, "effort", self.dof)?;
        let wrenches = match wrenches {
            Some(given) => Series::read(given, "wrenches", &[self.sensors, 6])?,
            None if self.sensors == 0 => Series::read_or_zero(None, "wrenches", 0)?,
            None => {
                return Err(ArgumentError::new_err(format!(
                    "`wrenches` is missing: the identifier has {} sensors",
                    self.sensors
                )));
            }
        };
        let pose = Poses::read_or_identity(base_pose, "base_pose")?;
        let twist = Series::read_or_zero(base_twist, "base_twist", 6)?;
        let count =
            common_length(&[&time, &q, &qd, &effort, &wrenches, &pose, &twist])?.unwrap_or(1);
        py.detach(|| {
            let mut identifier = self.lock();
            let (mut used, mut loads) = (0, Vec::with_capacity(self.sensors));
            for k in 0..count {
                loads.clear();
                loads.extend(wrenches.at(k).chunks_exact(6).map(|wrench| Wrench {
                    force: Vector3::from_column_slice(&wrench[..3]),
                    moment: Vector3::from_column_slice(&wrench[3..]),
                }));
                let sample = Sample {
                    time_s: time.at(k)[0],
                    base: BaseState {
                        pose: *pose.at(k),
                        velocity: twist.vector(k, 0),
                        angular_velocity: twist.vector(k, 3),
                        ..BaseState::fixed()
                    },
                    joint_position: q.at(k),
                    joint_velocity: qd.at(k),
                    joint_effort: effort.at(k),
                    wrenches: &loads,
                };
                let pushed = identifier.push(&sample).map_err(IntoPyErr::into_py_err)?;
                used += usize::from(matches!(pushed, Pushed::Used | Pushed::Changed));
            }
            identifier.finish();
            Ok(used)
        })
    }

    /// Prepares for the same samples once more: what was learnt stays, times and counts begin anew. It is for the
    /// paper's filter: least squares would take the samples for new ones, and be too sure.
    fn rewind(&self, py: Python<'_>) {
        py.detach(|| self.lock().rewind());
    }

    /// The payload as known now: the mean over the last ``average``, or the latest value for 0.
    fn estimate(&self, py: Python<'_>) -> PayloadEstimate {
        py.detach(|| PayloadEstimate(self.lock().estimate()))
    }

    /// Covariance of the payload's linear parameters as least squares knows it, (10, 10): of mass, kg; first
    /// moments, kg m; inertia about the end-effector's origin, kg m², xx, xy, xz, yy, yz, zz. Zero in directions that
    /// the motion did not determine; None for the paper's filter.
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let covariance = py.detach(|| self.lock().covariance());
        let rows = |matrix: SMatrix<f64, 10, 10>| matrix.as_slice().to_vec(); // symmetric
        covariance
            .map(|matrix| output(py, rows(matrix), None, &[10, 10]))
            .transpose()
    }

    /// What the wrenches are off by, in the end-effector's frame and about its origin, (6,), N and N m; None unless
    /// ``wrench_offset`` asks for it.
    fn wrench_offset<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let offset = py.detach(|| self.lock().wrench_offset());
        offset
            .map(|six| output(py, six.to_vec(), None, &[6]))
            .transpose()
    }
}

impl Identifier {
    fn lock(&self) -> MutexGuard<'_, tactid_identify::Identifier> {
        // A push that panicked has left numbers behind, not broken memory.
        self.identifier
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
