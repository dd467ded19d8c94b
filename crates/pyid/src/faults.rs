//! Data faults as plain Python values.

use pyo3::prelude::*;
use tactid_recordings::{DataFault, FaultKind};

/// `tactid.faults.DataFault`.
#[derive(IntoPyObject)]
pub(crate) struct FaultData {
    topic: String,
    kind: &'static str,
    count: u64,
    first: f64,
    joint: Option<String>,
}

impl From<&DataFault> for FaultData {
    fn from(fault: &DataFault) -> Self {
        let (kind, joint) = match &fault.kind {
            FaultKind::Gap => ("gap", None),
            FaultKind::OutOfOrder => ("out_of_order", None),
            FaultKind::Undecodable => ("undecodable", None),
            FaultKind::NotFinite => ("not_finite", None),
            FaultKind::OutOfRange => ("out_of_range", None),
            FaultKind::PartialJoints => ("partial_joints", None),
            FaultKind::PositionCount => ("position_count", None),
            FaultKind::VelocityNotFinite => ("velocity_not_finite", None),
            FaultKind::NoVelocity => ("no_velocity", None),
            FaultKind::NoEffort => ("no_effort", None),
            FaultKind::EffortNotFinite(joint) => ("effort_not_finite", Some(joint.clone())),
            FaultKind::NotUnitQuaternion => ("not_unit_quaternion", None),
            FaultKind::NoStamp => ("no_stamp", None),
            FaultKind::FarStamp => ("far_stamp", None),
            FaultKind::Incomplete => ("incomplete", None),
        };
        Self {
            topic: fault.topic.clone(),
            kind,
            count: fault.count,
            first: fault.first_s,
            joint,
        }
    }
}
