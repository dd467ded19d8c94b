//! The online solvers: samples in, an estimate at any time. `tactid.online` wraps them.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use tactid_dynamics::Wrench;
use tactid_identify::{BaseState, IdentifyError, PayloadEstimate, PushOutcome, Sample};
use tactid_recordings::DEFAULT_TIP;

use crate::arrays::{Poses, Series, common_length, output};
use crate::dynamics::Manipulator;
use crate::errors::{ArgumentError, IntoPyErr};
use crate::findings::{FindingData, data_finding};
use crate::identification::{EstimateData, SingularValuesData, WrenchOffsetData};
use crate::options;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A solver that takes samples one by one.
trait Solver: Send {
    fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError>;
    /// Does the work that pushing has deferred.
    fn finish(&mut self);
    fn estimate(&self) -> PayloadEstimate;
}

impl Solver for tactid_identify::Identifier {
    fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        self.push(sample)
    }
    fn finish(&mut self) {
        self.finish();
    }
    fn estimate(&self) -> PayloadEstimate {
        self.estimate()
    }
}

impl Solver for tactid_identify::PaperFilter {
    fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        self.push(sample)
    }
    fn finish(&mut self) {}
    fn estimate(&self) -> PayloadEstimate {
        self.estimate()
    }
}

/// Base class of the online solvers: samples in, an estimate at any time.
#[pyclass(module = "tactid._native", frozen, subclass)]
pub(crate) struct OnlineSolver {
    /// The solver, which the subclass shares under its own type.
    solver: Arc<Mutex<dyn Solver>>,
    dof: usize,
    sensors: usize,
}

#[pymethods]
impl OnlineSolver {
    /// Takes one sample, or N in a row: see :meth:`tactid.Identifier.push`.
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
        let joints = [Some(q), qd, effort];
        let base = [base_pose, base_twist];
        let samples = Samples::read((self.dof, self.sensors), time, joints, wrenches, base)?;
        py.detach(|| samples.push_to(&mut *lock(&self.solver)))
    }

    /// Returns the payload as known now.
    fn estimate(&self, py: Python<'_>) -> PyResult<EstimateData> {
        let estimate = py.detach(|| lock(&self.solver).estimate());
        EstimateData::new(py, &estimate)
    }
}

/// Online least squares: see :class:`tactid.Identifier`.
#[pyclass(module = "tactid._native", frozen, extends = OnlineSolver)]
pub(crate) struct Identifier(Arc<Mutex<tactid_identify::Identifier>>);

#[pymethods]
impl Identifier {
    #[new]
    fn new(
        robot: &Manipulator,
        sensors: Vec<String>,
        effort: bool,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let request = options::request(options)?;
        let settings = request.online_settings(effort);
        let tip = request.tip.as_deref().unwrap_or(DEFAULT_TIP);
        let names: Vec<&str> = sensors.iter().map(String::as_str).collect();
        let solver = tactid_identify::Identifier::new(&robot.0, tip, &names, &settings)
            .map_err(IntoPyErr::into_py_err)?;
        let (solver, base) = shared(robot, &names, solver);
        Ok(PyClassInitializer::from(base).add_subclass(Self(solver)))
    }

    /// Returns the covariance of the payload's linear parameters, (10, 10); None before the noise is known.
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let covariance = py.detach(|| lock(&self.0).covariance());
        // Symmetric: row by row and column by column are the same.
        let rows = covariance.map(|matrix| output(py, matrix.as_slice().to_vec(), None, &[10, 10]));
        rows.transpose()
    }

    /// Returns the offset of the wrenches; None where it is not an unknown.
    fn wrench_offset(&self, py: Python<'_>) -> PyResult<Option<WrenchOffsetData>> {
        let offset = py.detach(|| lock(&self.0).wrench_offset());
        let data = offset.map(|offset| WrenchOffsetData::new(py, &offset));
        data.transpose()
    }

    /// Returns what the most recent windows show about the assumptions: the kind of each finding and its data.
    fn findings(&self, py: Python<'_>) -> PyResult<Vec<FindingData>> {
        let findings = py.detach(|| {
            let identifier = lock(&self.0).clone();
            identifier.findings()
        });
        let data = findings.iter().map(|finding| data_finding(py, finding));
        data.collect()
    }
}

/// The paper's filter: see :class:`tactid.PaperFilter`.
#[pyclass(module = "tactid._native", frozen, extends = OnlineSolver)]
pub(crate) struct PaperFilter(Arc<Mutex<tactid_identify::PaperFilter>>);

#[pymethods]
impl PaperFilter {
    #[new]
    fn new(
        robot: &Manipulator,
        sensors: Vec<String>,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (request, settings) = options::paper_request(options)?;
        let equations = request.online_settings(false);
        let tip = request.tip.as_deref().unwrap_or(DEFAULT_TIP);
        let names: Vec<&str> = sensors.iter().map(String::as_str).collect();
        let solver = tactid_identify::PaperFilter::new(&robot.0, tip, &names, &equations, settings)
            .map_err(IntoPyErr::into_py_err)?;
        let (solver, base) = shared(robot, &names, solver);
        Ok(PyClassInitializer::from(base).add_subclass(Self(solver)))
    }

    /// Prepares for the same samples once more.
    fn rewind(&self, py: Python<'_>) {
        py.detach(|| lock(&self.0).rewind());
    }

    /// Returns how strongly the motion excited mass and inertia.
    fn singular_values(&self, py: Python<'_>) -> PyResult<SingularValuesData> {
        let values = py.detach(|| lock(&self.0).singular_values());
        SingularValuesData::new(py, &values)
    }
}

/// Returns the base class of a solver, and the solver that a subclass shares with it.
fn shared<T: Solver + 'static>(
    robot: &Manipulator,
    sensors: &[&str],
    solver: T,
) -> (Arc<Mutex<T>>, OnlineSolver) {
    let solver = Arc::new(Mutex::new(solver));
    let base = OnlineSolver {
        solver: solver.clone(),
        dof: robot.0.dof(),
        sensors: sensors.len(),
    };
    (solver, base)
}

fn lock<T: ?Sized>(solver: &Mutex<T>) -> MutexGuard<'_, T> {
    // A push that panicked has left numbers behind, not broken memory.
    solver.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Samples in arrays, one after the other.
struct Samples {
    time: Series,
    q: Series,
    qd: Series,
    effort: Series,
    wrenches: Series,
    pose: Poses,
    twist: Series,
    count: usize,
}

impl Samples {
    fn read(
        (dof, sensors): (usize, usize),
        time: &Bound<'_, PyAny>,
        [q, qd, effort]: [Argument<'_, '_>; 3],
        wrenches: Argument<'_, '_>,
        [pose, twist]: [Argument<'_, '_>; 2],
    ) -> PyResult<Self> {
        let wrenches = match wrenches {
            Some(given) => Series::read(given, "wrenches", &[sensors, 6])?,
            None if sensors == 0 => Series::read_or_empty(None, "wrenches", 0)?,
            None => {
                return Err(ArgumentError::new_err(format!(
                    "`wrenches` is missing: the identifier has {sensors} sensors"
                )));
            }
        };
        let mut samples = Self {
            time: Series::read(time, "time", &[])?,
            q: Series::read_or_empty(q, "q", dof)?,
            qd: Series::read_or_empty(qd, "qd", dof)?,
            effort: Series::read_or_empty(effort, "effort", dof)?,
            wrenches,
            pose: Poses::read_measured_or_identity(pose, "base_pose")?,
            twist: Series::read_or_zero(twist, "base_twist", 6)?,
            count: 1,
        };
        let Self { time, q, qd, .. } = &samples;
        let Self {
            effort,
            wrenches,
            pose,
            ..
        } = &samples;
        let all = common_length(&[time, q, qd, effort, wrenches, pose, &samples.twist])?;
        samples.count = all.unwrap_or(1);
        Ok(samples)
    }

    /// Pushes every sample, and returns how many were used.
    fn push_to(&self, solver: &mut dyn Solver) -> PyResult<usize> {
        let (mut used, mut loads) = (0, Vec::new());
        for k in 0..self.count {
            loads.clear();
            loads.extend(self.wrenches.at(k).chunks_exact(6).map(|six| Wrench {
                force: Vector3::from_column_slice(&six[..3]),
                moment: Vector3::from_column_slice(&six[3..]),
            }));
            let sample = Sample {
                time_s: self.time.at(k)[0],
                base: BaseState {
                    pose: *self.pose.at(k),
                    velocity: self.twist.vector(k, 0),
                    angular_velocity: self.twist.vector(k, 3),
                    ..BaseState::fixed()
                },
                joint_position: self.q.at(k),
                joint_velocity: self.qd.at(k),
                joint_effort: self.effort.at(k),
                wrenches: &loads,
            };
            let outcome = solver.push(&sample).map_err(IntoPyErr::into_py_err)?;
            used += usize::from(match outcome {
                PushOutcome::Used | PushOutcome::PayloadChanged => true,
                PushOutcome::Started | PushOutcome::Rejected => false,
            });
        }
        solver.finish();
        Ok(used)
    }
}
