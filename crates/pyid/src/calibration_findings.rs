//! Findings about calibrations: the kind of each, and a dictionary of the numbers and names that belong to it.

use pyo3::prelude::*;
use tactid_calibrate::{Assumption, CalibratingRecording, Contradiction, MotionShortage};
use tactid_recordings::{ArmChanged, ChangedQuantity};

use crate::finding_data::{FindingData, fields};

/// Returns what Python's `tactid.findings.Finding` is made from, for what the motion of a calibration does not determine.
pub(crate) fn shortage_data(py: Python<'_>, shortage: &MotionShortage) -> PyResult<FindingData> {
    Ok(match shortage {
        MotionShortage::Still {
            joint,
            max_velocity,
        } => ("joint_still", fields!(py, joint, max_velocity)),
        MotionShortage::OneDirection { joint, is_positive } => {
            ("joint_one_direction", fields!(py, joint, is_positive))
        }
        MotionShortage::Gain { joint, std_dev } => ("gain_uncertain", fields!(py, joint, std_dev)),
    })
}

/// Returns what Python's `tactid.findings.Finding` is made from, for an assumption that the logs of a calibration contradict.
pub(crate) fn contradiction_data(
    py: Python<'_>,
    contradiction: &Contradiction,
) -> PyResult<FindingData> {
    let Contradiction {
        assumption,
        size,
        std_dev,
        joint,
        shown,
    } = contradiction;
    let shown = shown.map(<[f64; 3]>::from);
    Ok(match assumption {
        Assumption::Gravity => ("gravity_tilted", fields!(py, size, std_dev, joint, shown)),
        Assumption::JointZero => ("joint_zero_off", fields!(py, size, std_dev, joint)),
        Assumption::Gains => ("gain_contradicted", fields!(py, size, std_dev, joint)),
        Assumption::PayloadCenter(payload) => (
            "payload_com_contradicted",
            fields!(py, size, std_dev, joint, payload, shown),
        ),
        Assumption::GainPrior(prior_std_dev) => (
            "gain_improbable",
            fields!(py, size, std_dev, joint, prior_std_dev),
        ),
    })
}

/// Returns the data of an assumption that a calibration contradicts, for the result of an identification with it.
pub(crate) fn calibration_contradicted(
    py: Python<'_>,
    contradiction: &Contradiction,
) -> PyResult<FindingData> {
    let (assumption, data) = contradiction_data(py, contradiction)?;
    data.bind(py).set_item("assumption", assumption)?;
    Ok(("calibration_contradicted", data))
}

/// Returns the data of a joint whose zero has moved since the calibration.
pub(crate) fn joint_zero_moved(py: Python<'_>, found: &Contradiction) -> PyResult<FindingData> {
    let Contradiction {
        size,
        std_dev,
        joint,
        ..
    } = found;
    Ok(("joint_zero_moved", fields!(py, size, std_dev, joint)))
}

/// Returns the data of a recording that calibrated the arm.
pub(crate) fn recording_calibrated(
    py: Python<'_>,
    used: CalibratingRecording,
) -> PyResult<FindingData> {
    let is_loaded = used.is_loaded;
    Ok(("recording_calibrated", fields!(py, is_loaded)))
}

/// Returns the data of a joint whose effort is noisier than at the calibration.
pub(crate) fn effort_noisier(
    py: Python<'_>,
    joint: &str,
    noise_ratio: f64,
) -> PyResult<FindingData> {
    Ok(("effort_noisier", fields!(py, joint, noise_ratio)))
}

/// Returns the data of an unloaded recording that does not fit the other one.
pub(crate) fn unloaded_left_out(py: Python<'_>, noise_ratio: f64) -> PyResult<FindingData> {
    Ok(("unloaded_left_out", fields!(py, noise_ratio)))
}

/// Returns the data of friction or gains that have changed.
pub(crate) fn arm_changed(py: Python<'_>, changed: &ArmChanged) -> PyResult<FindingData> {
    let ArmChanged {
        quantity,
        change,
        joint,
        joint_change,
        has_unloaded,
    } = changed;
    let data = fields!(py, change, joint, joint_change, has_unloaded);
    Ok(match quantity {
        ChangedQuantity::Friction => ("friction_changed", data),
        ChangedQuantity::Gains => ("gains_changed", data),
    })
}
