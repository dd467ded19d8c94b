//! Simulated experiments: the paper's and others.

use std::path::PathBuf;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::pythonize;
use tactid_sim::{BaseMount, JointMotion};

use crate::arrays::{Array, array};
use crate::errors::{IntoPyErr, detached};
use crate::experiment_fields::replaced;
use crate::inertia::MassProperties;
use crate::interruption::InterruptionCheck;
use crate::record::fields;
use crate::text::Text;

/// Experiment to simulate: robot, payload, grasp, excitation, noise and bounds.
///
/// Immutable; made by :meth:`paper`, :meth:`from_toml` or :meth:`from_file`, changed by
/// :meth:`replace`. A field that a file leaves out has its value of the paper's experiment;
/// :attr:`PAPER_TOML` shows all fields.
#[pyclass(module = "tactid", frozen)]
#[derive(Clone)]
pub(crate) struct Experiment(tactid_sim::Experiment);

#[pymethods]
impl Experiment {
    /// Text of the paper's experiment as a file: every field with its meaning, unit and default.
    #[classattr]
    const PAPER_TOML: &'static str = tactid_sim::PAPER_TOML;

    /// Returns the paper's experiment: joints 3, 5 and 6 move for 100 s each at 0.2 Hz, with a
    /// payload of 100 kg.
    #[staticmethod]
    fn paper() -> Self {
        Self(tactid_sim::Experiment::paper())
    }

    /// Returns the experiment that the text of a file describes.
    ///
    /// Raises: ExperimentError: The text is not TOML, a field does not exist, or a value is
    /// impossible. The message names the line.
    #[staticmethod]
    fn from_toml(text: Text) -> PyResult<Self> {
        tactid_sim::Experiment::from_toml(&text)
            .map(Self)
            .map_err(IntoPyErr::into_py_err)
    }

    /// Reads an experiment's file. A relative path of a URDF is taken from the file's folder.
    ///
    /// Raises: ExperimentError: The file cannot be read, is not TOML, or has a field that does not
    /// exist or a value that is impossible.
    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Self> {
        tactid_sim::Experiment::from_file(&path)
            .map(Self)
            .map_err(IntoPyErr::into_py_err)
    }

    /// Returns the experiment with some of its fields changed.
    ///
    /// A table is a dictionary with the fields of that table in the experiment's file, units
    /// included: those that it leaves out stay, ``payload={"mass_kg": 50.0}``. A list replaces the
    /// whole list. :attr:`PAPER_TOML` shows every field of every table.
    ///
    /// Args: frequency: Frequency of every driven joint, Hz. posture: Initial posture:
    /// ``"identifiable"``, ``"table1"``, or one angle for each joint of the arm, rad. seed: Seed of
    /// the random command noise and measurement noise. duration: Simulated time, s: the longest one
    /// with active excitation. step: Step of the physics and interval of the samples, s. gravity:
    /// Gravitational acceleration in world axes, (3,), m/s²: only for a fixed base. robot: Fields
    /// of the table ``[robot]``: URDF, kind of base, tool and fingers. base: Fields of ``[base]``:
    /// mass properties of a floating base. payload: Fields of ``[payload]``, or the payload's mass
    /// properties in the tool frame. gripper: Fields of ``[gripper]``: the grasp. excitation:
    /// Fields of ``[excitation]``: motion of the joints. noise: Fields of ``[noise]``: standard
    /// deviations of the sensors' noise. bounds: Fields of ``[bounds]``, whose violation stops a
    /// run.
    ///
    /// Raises: ExperimentError: A field does not exist, or a value is impossible. The message lists
    /// the fields that exist.
    #[pyo3(signature = (**fields))]
    fn replace(&self, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        match fields {
            Some(fields) => replaced(&self.0, fields).map(Self),
            None => Ok(self.clone()),
        }
    }

    /// Returns the experiment with a designed motion: the arm begins in its first posture and
    /// follows it to its end.
    ///
    /// Args: motion: The folder that :meth:`DesignedMotion.write` wrote, its ``trajectory.mcap``,
    /// or a CSV file with the columns ``time_s`` (s), and ``q_NAME`` (rad or m) and ``qd_NAME``
    /// (rad/s or m/s) for each joint of the arm.
    ///
    /// Raises: ExperimentError: The file cannot be read, has no motion, lacks a joint of the arm,
    /// or leaves the limits of a joint. LogError: ``trajectory.mcap`` cannot be read.
    fn following(&self, motion: PathBuf) -> PyResult<Self> {
        let mut experiment = self.0.clone();
        let followed = experiment.follow(&motion);
        followed.map_err(IntoPyErr::into_py_err)?;
        Ok(Self(experiment))
    }

    /// Returns the experiment as the text of a file.
    fn to_toml(&self) -> PyResult<String> {
        self.0.to_toml().map_err(IntoPyErr::into_py_err)
    }

    /// Returns the tables and fields of the experiment's file as dictionaries, units included.
    ///
    /// A field without a value, as ``urdf`` of the built-in robot, is left out.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        Ok(pythonize(py, &self.0)?.cast_into()?)
    }

    /// Gravitational acceleration in world axes, (3,), m/s²: zero for a floating base.
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.gravity().as_slice())
    }

    /// Kind of base: ``"floating"`` or ``"fixed"``.
    #[getter]
    fn base(&self) -> &'static str {
        match self.0.robot.base {
            BaseMount::Floating => "floating",
            BaseMount::Fixed => "fixed",
        }
    }

    /// Simulated time from the start of the excitation, s: the longest one with active excitation.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration_s
    }

    /// Name of the link in whose frame the payload is expressed.
    #[getter]
    fn tip(&self) -> &str {
        &self.0.robot.tool
    }

    /// True mass properties of the payload, in the tip's frame.
    #[getter]
    fn payload(&self) -> MassProperties {
        MassProperties(self.0.payload.mass_properties())
    }

    /// Text of the robot's URDF.
    ///
    /// Raises:
    ///     ExperimentError: Its file cannot be read.
    #[getter]
    fn urdf(&self) -> PyResult<String> {
        self.0.urdf().map_err(IntoPyErr::into_py_err)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

/// Reads the motion of joints in a file: see :meth:`Experiment.following`.
///
/// Args:
///     path: The motion.
///     rate: Rows a second, of which the last is the end of the motion.
///     most: Largest number of rows, from which on they are rarer.
///
/// Returns:
///     Names of the joints; times since the start, (N,), s; positions, (N, n), rad or m.
///
/// Raises:
///     ExperimentError: The file cannot be read, or has no motion.
///     LogError: ``trajectory.mcap`` cannot be read.
#[pyfunction]
pub(crate) fn read_motion(
    py: Python<'_>,
    path: PathBuf,
    rate: f64,
    most: usize,
) -> PyResult<(Vec<String>, Array, Array)> {
    let read = detached(py, || JointMotion::read(&path))?;
    let motion = read.map_err(IntoPyErr::into_py_err)?;
    let (joints, duration_s) = (motion.joint_names(), motion.duration_s());
    let rows = ((duration_s * rate).ceil() as usize + 1).clamp(2, most.max(2));
    let time = |row: usize| duration_s * row as f64 / (rows - 1) as f64;
    let times: Vec<f64> = (0..rows).map(time).collect();
    let mut positions = Vec::with_capacity(rows * joints.len());
    for &time in &times {
        positions.extend((0..joints.len()).map(|joint| motion.position(joint, time)));
    }
    Ok((
        joints.to_vec(),
        array(py, times, &[rows])?,
        array(py, positions, &[rows, joints.len()])?,
    ))
}

/// Simulates an experiment and writes its log: see ``tactid.simulate``.
#[pyfunction]
#[pyo3(signature = (experiment, out, *, progress=None))]
pub(crate) fn simulate(
    py: Python<'_>,
    experiment: &Experiment,
    out: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    let mut interruption = InterruptionCheck::new(progress);
    let result = detached(py, || {
        tactid_sim::run(&experiment.0, &out, |progress| {
            interruption.check(progress.steps as f64 / progress.total_steps.max(1) as f64)
        })
    })?;
    let report = interruption.finish(py, result.map_err(IntoPyErr::into_py_err))?;
    Ok(fields(py, &report)?.unbind())
}
