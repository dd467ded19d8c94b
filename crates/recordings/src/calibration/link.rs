//! A link in the file of a calibration.

use nalgebra::{Isometry3, Quaternion, SVector, Translation3, UnitQuaternion, Vector4};
use serde::{Deserialize, Serialize};
use tactid_calibrate::{Calibration, LinkCalibration, LinkDescription};
use tactid_dynamics::InertialParameters;

use super::layout::{Layout, OF_LINK};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Link {
    name: String,
    origin: [f64; 3],
    rotation: [f64; 4],
    axis: [f64; 3],
    without_tool: [f64; OF_LINK],
    described: [f64; OF_LINK],
    calibrated: [f64; OF_LINK],
    std_devs: [f64; OF_LINK],
    scales: [f64; OF_LINK],
}

impl Link {
    pub(super) fn name(&self) -> String {
        self.name.clone()
    }

    pub(super) fn calibrated(&self) -> &[f64; OF_LINK] {
        &self.calibrated
    }

    pub(super) fn scales(&self) -> &[f64; OF_LINK] {
        &self.scales
    }

    /// Returns the link with an index in the model.
    pub(super) fn of(
        model: &Calibration,
        layout: Layout,
        index: usize,
        link: &LinkCalibration,
    ) -> Self {
        let description = &model.descriptions[index];
        let pose = &description.parent_from_link;
        Self {
            name: link.name.clone(),
            origin: pose.translation.vector.into(),
            rotation: pose.rotation.coords.into(),
            axis: description.axis.into(),
            without_tool: (*description.parameters.as_vector()).into(),
            described: (*link.described.as_vector()).into(),
            calibrated: layout.link(&model.parameters, index),
            std_devs: link.std_devs,
            scales: layout.link(&model.scales, index),
        }
    }

    /// Returns what the robot's description says of the link.
    pub(super) fn description(&self) -> LinkDescription {
        let rotation = Quaternion::from(Vector4::from(self.rotation));
        LinkDescription {
            parent_from_link: Isometry3::from_parts(
                Translation3::from(self.origin),
                // The numbers come back as they were written, bit by bit.
                UnitQuaternion::new_unchecked(rotation),
            ),
            axis: self.axis.into(),
            parameters: body(self.without_tool),
        }
    }

    /// Returns what the report of the calibration says of the link.
    pub(super) fn report(&self) -> LinkCalibration {
        LinkCalibration {
            name: self.name.clone(),
            described: body(self.described),
            calibrated: body(self.calibrated),
            std_devs: self.std_devs,
        }
    }
}

/// Returns ten parameters as those of a body.
pub(super) fn body(parameters: [f64; OF_LINK]) -> InertialParameters {
    InertialParameters::from_vector(SVector::from(parameters))
}
