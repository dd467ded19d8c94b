//! Calibrated arms. The package's `Calibration` contains one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyType;
use tactid_calibrate::{CalibrationReport, JointCalibration};
use tactid_dynamics::InertialParameters;
use tactid_recordings::ArmCalibration;

use crate::arrays::{Array, array};
use crate::calibration_findings::{contradiction_data, shortage_data};
use crate::errors::IntoPyErr;
use crate::finding_data::FindingData;

/// The model of an arm that `tactid.Calibration` contains.
#[pyclass(module = "tactid._native", frozen)]
pub(crate) struct ArmModel(pub(crate) Arc<ArmCalibration>);

#[pymethods]
impl ArmModel {
    /// Reads the text of the file of a calibration.
    ///
    /// Raises:
    ///     CalibrationError: The text is not that of a calibration.
    #[new]
    fn new(toml: &str) -> PyResult<Self> {
        let arm = ArmCalibration::from_toml(toml, Path::new("the text of a calibration"));
        Ok(Self(Arc::new(arm.map_err(IntoPyErr::into_py_err)?)))
    }

    /// Returns how a copy is made, which `copy` and `pickle` use.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyType>, (String,))> {
        let toml = self.0.to_toml().map_err(IntoPyErr::into_py_err)?;
        Ok((py.get_type::<Self>(), (toml,)))
    }

    /// Compares all numbers; one that is not known equals another.
    fn __eq__(&self, other: &Self) -> PyResult<bool> {
        if Arc::ptr_eq(&self.0, &other.0) {
            return Ok(true);
        }
        let text = |arm: &ArmCalibration| arm.to_toml().map_err(IntoPyErr::into_py_err);
        Ok(text(&self.0)? == text(&other.0)?)
    }

    /// Reads the file of a calibration.
    ///
    /// Raises:
    ///     CalibrationError: The file cannot be read, or is not that of a calibration.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let arm = ArmCalibration::read(&path).map_err(IntoPyErr::into_py_err)?;
        Ok(Self(Arc::new(arm)))
    }

    /// Writes the file of a calibration, whole or not at all.
    ///
    /// Raises:
    ///     CalibrationError: The file cannot be written.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        self.0.write(&path).map_err(IntoPyErr::into_py_err)
    }

    /// Returns the fields of `tactid.Calibration` by their names.
    fn data(&self, py: Python<'_>) -> PyResult<CalibrationData> {
        CalibrationData::new(py, &self.0)
    }
}

/// `tactid.calibration_data.CalibrationData`, but for the model and its logs.
#[derive(IntoPyObject)]
pub(crate) struct CalibrationData {
    tip: String,
    joints: Vec<String>,
    units: Vec<&'static str>,
    links: Vec<String>,
    gravity: Array,
    cutoff: f64,
    delay: f64,
    delay_std_dev: f64,
    effort_gain: Array,
    gain: Array,
    gain_std_dev: Array,
    offset: Array,
    viscous: Array,
    friction: Array,
    friction_velocities: Array,
    load_friction: Array,
    payload_friction: Array,
    rotor_inertia: Array,
    max_velocity: Array,
    residual_before: Array,
    residual_after: Array,
    residual_held_out: Array,
    described: Array,
    calibrated: Array,
    std_devs: Array,
    payloads: Array,
    windows: usize,
    window: f64,
    shortages: Vec<FindingData>,
    contradictions: Vec<FindingData>,
}

impl CalibrationData {
    fn new(py: Python<'_>, arm: &ArmCalibration) -> PyResult<Self> {
        let (model, report) = (&arm.model, &arm.report);
        let joints = &report.joints;
        let count = joints.len();
        let each =
            |of: fn(&JointCalibration) -> f64| array(py, joints.iter().map(of).collect(), &[count]);
        let widths = &model.friction_widths;
        let frictions = joints.iter().flat_map(|joint| joint.friction.clone());
        let velocities = joints.iter().flat_map(|joint| joint.max_velocity);
        let gains = arm.effort_gain.clone();
        let shortages = report.shortages.iter();
        let contradictions = report.contradictions.iter();
        Ok(Self {
            tip: model.tool.clone(),
            joints: model.joints.clone(),
            units: joints.iter().map(|joint| joint.unit).collect(),
            links: model.links.clone(),
            gravity: array(py, model.gravity.as_slice().to_vec(), &[3])?,
            cutoff: model.cutoff_hz,
            delay: report.delay.delay_s,
            delay_std_dev: report.delay.std_dev_s,
            effort_gain: array(py, gains, &[count])?,
            gain: each(|joint| joint.gain)?,
            gain_std_dev: each(|joint| joint.gain_std_dev)?,
            offset: each(|joint| joint.offset)?,
            viscous: each(|joint| joint.viscous)?,
            friction: array(py, frictions.collect(), &[count, widths.len()])?,
            friction_velocities: array(py, widths.clone(), &[widths.len()])?,
            load_friction: each(|joint| joint.load_friction)?,
            payload_friction: each(|joint| joint.payload_friction)?,
            rotor_inertia: each(|joint| joint.rotor_inertia)?,
            max_velocity: array(py, velocities.collect(), &[count, 2])?,
            residual_before: each(|joint| joint.residual_before)?,
            residual_after: each(|joint| joint.residual_after)?,
            residual_held_out: each(|joint| joint.residual_held_out)?,
            described: of_links(py, report, |report, k| report.links[k].described)?,
            calibrated: of_links(py, report, |report, k| report.links[k].calibrated)?,
            std_devs: std_devs(py, report)?,
            payloads: bodies(py, &report.payloads)?,
            windows: report.windows,
            window: report.window_s,
            shortages: shortages
                .map(|s| shortage_data(py, s))
                .collect::<PyResult<_>>()?,
            contradictions: contradictions
                .map(|each| contradiction_data(py, each))
                .collect::<PyResult<_>>()?,
        })
    }
}

fn of_links(
    py: Python<'_>,
    report: &CalibrationReport,
    body: fn(&CalibrationReport, usize) -> InertialParameters,
) -> PyResult<Array> {
    let all: Vec<_> = (0..report.links.len()).map(|k| body(report, k)).collect();
    bodies(py, &all)
}

fn bodies(py: Python<'_>, bodies: &[InertialParameters]) -> PyResult<Array> {
    let numbers = bodies
        .iter()
        .flat_map(|body| body.as_vector().iter().copied());
    array(py, numbers.collect(), &[bodies.len(), 10])
}

fn std_devs(py: Python<'_>, report: &CalibrationReport) -> PyResult<Array> {
    let numbers = report.links.iter().flat_map(|link| link.std_devs);
    array(py, numbers.collect(), &[report.links.len(), 10])
}
