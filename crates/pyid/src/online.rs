//! The online solvers: samples in, an estimate at any time. `tactid._api.online` wraps them.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::pythonize;
use tactid_batch::online_findings;
use tactid_identify::{ContactState, IdentifyError, PushOutcome, Sample, Snapshot, WrenchEstimate};
use tactid_recordings::{OnlineSetup, Request};

use crate::arguments::{borrowed, read_robot, read_sensors};
use crate::arrays::output;
use crate::errors::{IntoPyErr, detached, with_option};
use crate::findings::findings;
use crate::online_samples::{Expected, Samples};
use crate::options;
use crate::record::fields;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A solver that takes samples one by one.
trait Solver: Send {
    fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError>;
    /// Does the work that pushing has deferred.
    fn finish(&mut self) {}
}

impl Solver for tactid_identify::Identifier {
    fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        self.push(sample)
    }
    fn finish(&mut self) {
        self.finish();
    }
}

impl Solver for tactid_batch::LagIdentifier {
    fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        self.push(sample)
    }
    fn finish(&mut self) {
        self.finish_windows();
    }
}

impl Solver for tactid_recordings::PaperFilter {
    fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        self.push(sample)
    }
}

/// Base class of the online solvers: samples in.
#[pyclass(module = "tactid._native", frozen, subclass)]
pub(crate) struct OnlineSolver {
    /// The solver, which the subclass shares under its own type.
    solver: Arc<Mutex<dyn Solver>>,
    expects: Expected,
}

#[pymethods]
impl OnlineSolver {
    /// Takes one sample, or N in a row: see :meth:`tactid.Identifier.push`.
    #[pyo3(signature = (time, q=None, qd=None, wrench=None, *, effort=None, pose=None, twist=None, acceleration=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn push(
        &self,
        py: Python<'_>,
        time: &Bound<'_, PyAny>,
        q: Argument<'_, '_>,
        qd: Argument<'_, '_>,
        wrench: Argument<'_, '_>,
        effort: Argument<'_, '_>,
        pose: Argument<'_, '_>,
        twist: Argument<'_, '_>,
        acceleration: Argument<'_, '_>,
    ) -> PyResult<usize> {
        let joints = [q, qd, effort];
        let base = [pose, twist, acceleration];
        let samples = Samples::read(self.expects, time, joints, wrench, base)?;
        detached(py, || {
            let solver = &mut *lock(&self.solver);
            let used = samples.for_each(|sample| solver.push(sample))?;
            solver.finish();
            Ok(used)
        })?
    }
}

/// Online least squares: see :class:`tactid.Identifier`.
#[pyclass(module = "tactid._native", frozen, extends = OnlineSolver)]
pub(crate) struct Identifier(Arc<Mutex<tactid_identify::Identifier>>);

#[pymethods]
impl Identifier {
    #[new]
    fn new(
        robot: Argument<'_, '_>,
        sensors: Argument<'_, '_>,
        effort: bool,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (setup, expects) = set_up(&options::request(options)?, robot, sensors, effort)?;
        let solver = setup.identifier().map_err(IntoPyErr::into_py_err)?;
        let (solver, base) = shared(expects, solver);
        Ok(PyClassInitializer::from(base).add_subclass(Self(solver)))
    }

    /// Returns the payload as known now.
    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fields(py, &detached(py, || lock(&self.0).estimate())?)
    }

    /// Returns the covariance of the payload's linear parameters, (10, 10); None before the noise
    /// is known.
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let covariance = detached(py, || lock(&self.0).covariance())?;
        // Symmetric: row by row and column by column are the same.
        let rows = covariance.map(|matrix| output(py, matrix.as_slice().to_vec(), None, &[10, 10]));
        rows.transpose()
    }

    /// Returns the payload before the last change; None before a change.
    fn estimate_before_change<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let estimate = detached(py, || lock(&self.0).estimate_before_change())?;
        estimate.map(|estimate| fields(py, &estimate)).transpose()
    }

    /// Returns whether the estimate is one of the payload that is held now.
    fn is_settled(&self, py: Python<'_>) -> PyResult<bool> {
        detached(py, || lock(&self.0).is_settled())
    }

    /// Returns the time since the last payload change, s.
    fn time_since_change(&self, py: Python<'_>) -> PyResult<f64> {
        detached(py, || lock(&self.0).time_since_change_s())
    }

    /// Holds the payload or ends that, and returns whether that is possible.
    fn hold_payload(&self, py: Python<'_>, is_held: bool) -> PyResult<bool> {
        detached(py, || lock(&self.0).hold_payload(is_held))
    }

    /// Sets the zero of the wrench sensor, and returns whether that is possible.
    fn tare(&self, py: Python<'_>) -> PyResult<bool> {
        detached(py, || lock(&self.0).tare())
    }

    /// Returns whether the motion has determined mass, first moments and offset.
    fn knows_weight(&self, py: Python<'_>) -> PyResult<bool> {
        detached(py, || lock(&self.0).knows_weight())
    }

    /// Returns the joint covariance of the payload and of the offset, (16, 16); None where there is
    /// no offset.
    fn joint_covariance<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let covariance = detached(py, || lock(&self.0).joint_covariance())?;
        let rows = covariance.map(|matrix| output(py, matrix.as_slice().to_vec(), None, &[16, 16]));
        rows.transpose()
    }

    /// Returns the wrenches of load and contact about the origin of a link: time, wrench,
    /// covariance, and whether the payload may have changed, of each; None before the estimate has
    /// settled.
    fn wrenches<'py>(
        &self,
        py: Python<'py>,
        point: &str,
        axes: Option<&str>,
    ) -> PyResult<Option<[WrenchData<'py>; 2]>> {
        let found = detached(py, || {
            let identifier = lock(&self.0);
            let frame = identifier.wrench_frame(point, axes)?;
            Ok(identifier.wrenches(&frame))
        })?;
        let found = found.map_err(|error: IdentifyError| error.into_py_err())?;
        let Some(found) = found else {
            return Ok(None);
        };
        let [load, contact] = [found.load, found.contact].map(|each| wrench_data(py, &each));
        Ok(Some([load?, contact?]))
    }

    /// Returns the time by which the wrenches of load and contact lag the last sample, s.
    fn contact_latency(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        detached(py, || lock(&self.0).contact_latency_s())
    }

    /// Returns the offset of the wrenches; None where it is not an unknown.
    fn wrench_offset<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let offset = detached(py, || lock(&self.0).wrench_offset())?;
        offset.map(|offset| fields(py, &offset)).transpose()
    }

    /// Returns what the most recent windows show about the assumptions.
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        findings_of(py, || lock(&self.0).snapshot())
    }
}

/// Motion and payload at once while samples come: see :class:`tactid.LagIdentifier`.
#[pyclass(module = "tactid._native", frozen, extends = OnlineSolver)]
pub(crate) struct LagIdentifier(Arc<Mutex<tactid_batch::LagIdentifier>>);

#[pymethods]
impl LagIdentifier {
    #[new]
    fn new(
        robot: Argument<'_, '_>,
        sensors: Argument<'_, '_>,
        effort: bool,
        lag_s: f64,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (setup, expects) = set_up(&options::request(options)?, robot, sensors, effort)?;
        let solver = setup.lag_identifier(lag_s);
        let solver = solver.map_err(IntoPyErr::into_py_err)?;
        let (solver, base) = shared(expects, solver);
        Ok(PyClassInitializer::from(base).add_subclass(Self(solver)))
    }

    /// Uses the samples that later ones would complete.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        detached(py, || lock(&self.0).finish())
    }

    /// Returns the payload as known now; None where `motion` says why.
    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let estimate = detached(py, || lock(&self.0).estimate())?;
        estimate.map(|estimate| fields(py, &estimate)).transpose()
    }

    /// Returns the estimate of windows from the same samples.
    fn window_estimate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fields(py, &detached(py, || lock(&self.0).online().estimate())?)
    }

    /// Returns how the motion entered the estimate.
    fn motion<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &detached(py, || lock(&self.0).motion())?)?)
    }

    /// Returns the time until which samples are in the last estimate, s.
    fn until_s(&self, py: Python<'_>) -> PyResult<f64> {
        detached(py, || lock(&self.0).until_s())
    }

    /// Returns what the most recent windows show about the assumptions.
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        findings_of(py, || lock(&self.0).online().snapshot())
    }
}

/// Returns the findings of a copy, so that nobody waits for them.
fn findings_of<'py>(
    py: Python<'py>,
    snapshot: impl FnOnce() -> Snapshot + Send,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let noticed = detached(py, || online_findings(&snapshot()))?;
    findings(py, &noticed, "online")
}

/// Time, s, force and moment, their covariance, and whether the payload may have changed.
pub(crate) type WrenchData<'py> = (
    f64,
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    bool,
);

pub(crate) fn wrench_data<'py>(py: Python<'py>, of: &WrenchEstimate) -> PyResult<WrenchData<'py>> {
    let values = of.wrench.entries().to_vec();
    // Symmetric: row by row and column by column are the same.
    let covariance = of.covariance.as_slice().to_vec();
    Ok((
        of.time_s,
        output(py, values, None, &[6])?,
        output(py, covariance, None, &[6, 6])?,
        of.state == ContactState::Changing,
    ))
}

/// The paper's filter: see :class:`tactid.PaperFilter`.
#[pyclass(module = "tactid._native", frozen, extends = OnlineSolver)]
pub(crate) struct PaperFilter(Arc<Mutex<tactid_recordings::PaperFilter>>);

#[pymethods]
impl PaperFilter {
    #[new]
    fn new(
        robot: Argument<'_, '_>,
        sensors: Argument<'_, '_>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let request = options::request(options)?;
        let (setup, expects) = set_up(&request, robot, sensors, false)?;
        let solver = setup.paper_filter(request.paper_settings());
        let solver = solver.map_err(IntoPyErr::into_py_err)?;
        let (solver, base) = shared(expects, solver);
        Ok(PyClassInitializer::from(base).add_subclass(Self(solver)))
    }

    /// Returns the payload as known now.
    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fields(py, &detached(py, || lock(&self.0).estimate())?)
    }

    /// Prepares for the same samples once more.
    fn rewind(&self, py: Python<'_>) {
        py.detach(|| lock(&self.0).rewind());
    }

    /// Returns how strongly the motion excited mass and inertia.
    fn singular_values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fields(py, &detached(py, || lock(&self.0).singular_values())?)
    }
}

/// Resolves what a solver is created from, and what each of its samples must have.
fn set_up(
    request: &Request,
    robot: Argument<'_, '_>,
    sensors: Argument<'_, '_>,
    effort: bool,
) -> PyResult<(OnlineSetup, Expected)> {
    let robot = robot.map(read_robot).transpose()?;
    let robot = robot.as_ref().map(|robot| &robot.get().robot);
    let names = sensors.map(read_sensors).transpose()?;
    let names = names.as_ref().map(|names| borrowed(names));
    let setup = OnlineSetup::new(request, robot, names.as_deref(), effort);
    let setup = setup.map_err(IntoPyErr::into_py_err)?;
    let tip = setup.robot.frame(&setup.tip);
    with_option(tip.map_err(IntoPyErr::into_py_err), "tip")?;
    let expects = Expected {
        dof: robot.map(tactid_dynamics::Manipulator::dof),
        base: setup.robot.base_kind(),
        sensors: setup.sensors.len(),
        uses_effort: setup.settings.method.uses_effort(),
    };
    Ok((setup, expects))
}

/// Returns the base class of a solver, and the solver that a subclass shares with it.
fn shared<T: Solver + 'static>(expects: Expected, solver: T) -> (Arc<Mutex<T>>, OnlineSolver) {
    let solver = Arc::new(Mutex::new(solver));
    let base = OnlineSolver {
        solver: solver.clone(),
        expects,
    };
    (solver, base)
}

fn lock<T: ?Sized>(solver: &Mutex<T>) -> MutexGuard<'_, T> {
    // A push that panicked has left numbers behind, not broken memory.
    solver.lock().unwrap_or_else(PoisonError::into_inner)
}
