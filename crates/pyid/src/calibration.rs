//! Calibration of an arm from logs. The package's `calibrate` calls it.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use tactid_identify::calibration::{EffortComparison, KnownPayload};
use tactid_recordings::{CalibratingLogs, LogRole, UsedLog};

use crate::arm_model::ArmModel;
use crate::arrays::{Array, array};
use crate::errors::{IntoPyErr, urdf_is_at_fault, with_option};
use crate::faults::FaultData;
use crate::findings::{FindingData, contradiction_data, finding_data};
use crate::interruption::InterruptionCheck;
use crate::options;

/// `tactid.calibration_data.CalibrationLog`.
#[derive(IntoPyObject)]
struct LogData {
    path: PathBuf,
    role: &'static str,
    duration: f64,
    time: Array,
    velocity: Array,
    measured: Array,
    described: Array,
    calibrated: Array,
    friction: Array,
    faults: Vec<FaultData>,
    findings: Vec<FindingData>,
    damage: Vec<String>,
}

impl LogData {
    fn new(py: Python<'_>, log: UsedLog) -> PyResult<Self> {
        let EffortComparison {
            joints,
            times_s,
            velocities,
            measured,
            described,
            calibrated,
            friction,
        } = log.comparison;
        let shape = [times_s.len(), joints.len()];
        let by_joint = |values: Vec<f64>| array(py, values, &shape);
        let findings = log.findings.iter();
        Ok(Self {
            path: log.path,
            role: match log.role {
                LogRole::Unloaded => "unloaded",
                LogRole::Loaded => "loaded",
                LogRole::HeldOut => "hold_out",
            },
            duration: log.duration_s,
            time: array(py, times_s, &shape[..1])?,
            velocity: by_joint(velocities)?,
            measured: by_joint(measured)?,
            described: by_joint(described)?,
            calibrated: by_joint(calibrated)?,
            friction: by_joint(friction)?,
            faults: log.faults.iter().map(FaultData::from).collect(),
            findings: findings
                .map(|each| finding_data(py, each, false))
                .collect::<PyResult<_>>()?,
            damage: log.damage,
        })
    }
}

/// What `tactid.calibrate` makes its result from.
#[derive(IntoPyObject)]
pub(crate) struct RunData {
    model: Py<ArmModel>,
    gain_prior: f64,
    contradictions: Vec<FindingData>,
    logs: Vec<LogData>,
}

/// A log with its payload: path, mass, its standard deviation, centre of mass, inertia about it.
type Loaded = (PathBuf, f64, f64, Option<[f64; 3]>, Option<[[f64; 3]; 3]>);

/// Calibrates an arm from logs: see :func:`tactid.calibrate`.
#[pyfunction]
#[pyo3(signature = (unloaded, loaded, hold_out, gain_std_dev, options, progress=None))]
pub(crate) fn calibrate_logs(
    py: Python<'_>,
    unloaded: Vec<PathBuf>,
    loaded: Vec<Loaded>,
    hold_out: Vec<PathBuf>,
    gain_std_dev: Option<f64>,
    options: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<RunData> {
    let request = options::request(options)?;
    let logs = CalibratingLogs {
        unloaded,
        loaded: loaded.into_iter().map(known_payload).collect(),
        held_out: hold_out,
        gain_std_dev,
    };
    let mut interruption = InterruptionCheck::new(progress);
    let result = py.detach(|| {
        let observer =
            &mut |progress: tactid_recordings::Progress| interruption.check(progress.fraction);
        tactid_recordings::calibrate_logs(&logs, &request, observer)
    });
    let found = interruption.finish(py, result.map_err(IntoPyErr::into_py_err));
    let run = match found {
        Err(error) if request.urdf.is_some() && urdf_is_at_fault(py, &error)? => {
            with_option(Err(error), "urdf")?
        }
        found => found?,
    };
    let logs = run.logs.into_iter().map(|log| LogData::new(py, log));
    let contradictions = run.contradiction.iter();
    Ok(RunData {
        contradictions: contradictions
            .map(|each| contradiction_data(py, each))
            .collect::<PyResult<_>>()?,
        gain_prior: run.gain_std_dev,
        logs: logs.collect::<PyResult<_>>()?,
        model: Py::new(py, ArmModel(Arc::new(run.arm)))?,
    })
}

fn known_payload(
    (path, mass_kg, mass_std_dev_kg, com, inertia): Loaded,
) -> (PathBuf, KnownPayload) {
    let payload = KnownPayload {
        mass_kg,
        mass_std_dev_kg,
        center_of_mass: com.map(Vector3::from),
        // Rows and columns of an inertia are the same.
        inertia: inertia.map(Matrix3::from),
    };
    (path, payload)
}
