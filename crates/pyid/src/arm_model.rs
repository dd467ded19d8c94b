//! Calibrated arms. The package's `Calibration` contains one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::{Delay, Table};
use tactid_calibrate::{JointCalibration, LinkCalibration};
use tactid_dynamics::InertialParameters;
use tactid_recordings::ArmCalibration;

use crate::errors::IntoPyErr;
use crate::findings::findings;
use crate::record::{AddedCalibrationFindings, fields};

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
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let data = fields(py, &Calibration::new(&self.0))?;
        let report = &self.0.report;
        data.set_item("shortages", findings(py, &report.shortages, "keyword")?)?;
        let contradictions = findings(py, &report.contradictions, "keyword")?;
        data.set_item("contradictions", contradictions)?;
        Ok(data)
    }
}

/// The calibrated model of the joint efforts of an arm, of n joints and B links.
#[derive(Serialize, JsonSchema)]
pub(crate) struct Calibration {
    /// The end-effector frame.
    tip: String,
    /// Names of the n joints between base and tip, in the robot's order.
    joints: Vec<String>,
    /// Unit of the effort of each joint: `N m` or `N`.
    units: Vec<&'static str>,
    /// Names of the B links that these joints move.
    links: Vec<String>,
    /// Gravitational acceleration in world axes, m/s².
    gravity_m_s2: [f64; 3],
    /// Cutoff of the window means, Hz.
    cutoff_hz: f64,
    /// Time by which efforts lag the motion; negative where they lead.
    delay: Delay,
    /// Effort for one unit of the recorded value as it was given, N m or N, (n,).
    effort_gain: Vec<f64>,
    /// Factor from these efforts to torques, without a unit, (n,): 1 where efforts count as
    /// torques.
    gain: Vec<f64>,
    /// Standard deviation of the gain, without a unit, (n,); 0 where it was not to be found.
    gain_std_dev: Vec<f64>,
    /// Offset of the effort, N m or N, (n,).
    offset: Vec<f64>,
    /// Coulomb friction far from standstill at the rms torque of the joint, N m or N, (n,).
    coulomb: Vec<f64>,
    /// Viscous friction, N m s/rad or N s/m, (n,).
    viscous: Vec<f64>,
    /// Friction that saturates at each of `friction_velocities`, N m or N, (n, T).
    friction: Table,
    /// Velocities v of the friction terms tanh(velocity / v), rad/s or m/s, (T,).
    friction_velocities: Vec<f64>,
    /// Friction as a fraction of the joint's torque, without a unit, (n,).
    load_friction: Vec<f64>,
    /// What a payload's torque adds to the load friction, as a fraction of this torque, without a
    /// unit, (n,).
    payload_friction: Vec<f64>,
    /// Inertia of the rotor as the joint moves it, kg m² or kg, (n,).
    rotor_inertia: Vec<f64>,
    /// Largest velocity in the positive and in the negative direction, rad/s or m/s, (n, 2).
    max_velocity: Vec<[f64; 2]>,
    /// Rms of measured less modelled efforts with the URDF alone, N m or N, (n,).
    residual_before: Vec<f64>,
    /// Rms of measured less modelled efforts with the calibration, N m or N, (n,).
    residual_after: Vec<f64>,
    /// Rms of measured less modelled efforts on windows that a second fit did not see, N m or N,
    /// (n,); unknown where these are too few.
    residual_held_out: Vec<f64>,
    /// Ten inertial parameters of each link as the URDF has them, (B, 10): mass, kg, first moments,
    /// kg m, and inertia about the origin of the link's frame, kg m², with all links fixed to it.
    described: Vec<[f64; 10]>,
    /// The calibrated parameters of each link, kg, kg m and kg m², (B, 10). Motion determines
    /// combinations of several links only; the others stay as described.
    calibrated: Vec<[f64; 10]>,
    /// Standard deviations of the calibrated parameters, kg, kg m and kg m², (B, 10).
    std_devs: Vec<[f64; 10]>,
    /// Ten parameters of the payload of each loaded recording, in the tip's frame, kg, kg m and kg
    /// m², (L, 10).
    payloads: Vec<[f64; 10]>,
    /// Number of windows of all recordings that were used.
    windows: usize,
    /// Length of a window, s.
    window_s: f64,
    /// What the motion does not determine.
    #[schemars(extend("x-class" = "Sequence[Finding]"))]
    shortages: AddedCalibrationFindings,
    /// Assumptions that the recordings contradict: a gain that is improbable by what was known of
    /// it, and the one that they contradict most, such as the direction of gravity.
    #[schemars(extend("x-class" = "Sequence[Finding]"))]
    contradictions: AddedCalibrationFindings,
}

impl Calibration {
    fn new(arm: &ArmCalibration) -> Self {
        let (model, report) = (&arm.model, &arm.report);
        let (joints, links) = (&report.joints, &report.links);
        let each = |of: fn(&JointCalibration) -> f64| joints.iter().map(of).collect::<Vec<f64>>();
        let bodies = |of: fn(&LinkCalibration) -> &InertialParameters| {
            links.iter().map(|link| numbers(of(link))).collect()
        };
        let friction = joints.iter().flat_map(|joint| joint.friction.clone());
        Self {
            tip: model.tool.clone(),
            joints: model.joints.clone(),
            units: joints.iter().map(|joint| joint.unit).collect(),
            links: model.links.clone(),
            gravity_m_s2: model.gravity.into(),
            cutoff_hz: model.cutoff_hz,
            delay: report.delay,
            effort_gain: arm.effort_gain.clone(),
            gain: each(|joint| joint.gain),
            gain_std_dev: each(|joint| joint.gain_std_dev),
            offset: each(|joint| joint.offset),
            coulomb: each(|joint| joint.friction.iter().sum()),
            viscous: each(|joint| joint.viscous),
            friction: Table {
                columns: model.friction_widths.len(),
                values: friction.collect(),
            },
            friction_velocities: model.friction_widths.clone(),
            load_friction: each(|joint| joint.load_friction),
            payload_friction: each(|joint| joint.payload_friction),
            rotor_inertia: each(|joint| joint.rotor_inertia),
            max_velocity: joints.iter().map(|joint| joint.max_velocity).collect(),
            residual_before: each(|joint| joint.residual_before),
            residual_after: each(|joint| joint.residual_after),
            residual_held_out: each(|joint| joint.residual_held_out),
            described: bodies(|link| &link.described),
            calibrated: bodies(|link| &link.calibrated),
            std_devs: links.iter().map(|link| link.std_devs).collect(),
            payloads: report.payloads.iter().map(numbers).collect(),
            windows: report.windows,
            window_s: report.window_s,
            shortages: AddedCalibrationFindings,
            contradictions: AddedCalibrationFindings,
        }
    }
}

/// Returns the ten parameters of a body.
fn numbers(body: &InertialParameters) -> [f64; 10] {
    (*body.as_vector()).into()
}
