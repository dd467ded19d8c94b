//! Orientations as users and messages give them: quaternions that are about normalised, and how
//! else they may be meant.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest difference of a quaternion's norm from one.
///
/// Rounding to two decimals changes the norm by less than 0.02, and single precision by far less.
/// Numbers that are no quaternion, such as zeros or Euler angles, seldom have a norm so close to
/// one.
const NORM_TOLERANCE: f64 = 0.1;

/// Returns the rotation of a quaternion; `None` if its norm is not one to within 0.1, or is not
/// finite.
#[must_use]
pub fn unit_quaternion(quaternion: Quaternion<f64>) -> Option<UnitQuaternion<f64>> {
    // The comparison with NaN is false.
    let is_unit = (quaternion.norm() - 1.0).abs() <= NORM_TOLERANCE;
    is_unit.then(|| UnitQuaternion::new_normalize(quaternion))
}

/// What recorded orientations are, if not `world_from_tool`, or `world_from_base`, by quaternions
/// in the order x, y, z, w.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrientationReading {
    /// The inverse, `tool_from_world` or `base_from_world`.
    Inverse,
    /// Quaternions in the order w, x, y, z.
    ScalarFirst,
    /// The inverse, by quaternions in the order w, x, y, z.
    InverseScalarFirst,
}

/// Another reading of recorded poses.
#[derive(Clone, Copy)]
pub(crate) struct PoseReading {
    pub(crate) orientation: OrientationReading,
    /// Whether an inverse is that of the whole pose, whose position is then that of the world in
    /// the tool frame.
    is_whole: bool,
}

/// The other readings of recorded poses.
pub(crate) const OTHER_READINGS: [PoseReading; 5] = [
    PoseReading::new(OrientationReading::Inverse, false),
    PoseReading::new(OrientationReading::ScalarFirst, false),
    PoseReading::new(OrientationReading::InverseScalarFirst, false),
    PoseReading::new(OrientationReading::Inverse, true),
    PoseReading::new(OrientationReading::InverseScalarFirst, true),
];

impl PoseReading {
    const fn new(orientation: OrientationReading, is_whole: bool) -> Self {
        Self {
            orientation,
            is_whole,
        }
    }

    /// Whether the entries of quaternions are in the order x, y, z, w.
    pub(crate) fn keeps_order(self) -> bool {
        self.orientation == OrientationReading::Inverse
    }

    /// Returns the pose of the body in the world of a recorded one.
    pub(crate) fn read(self, recorded: &Isometry3<f64>) -> Isometry3<f64> {
        let [x, y, z, w]: [f64; 4] = recorded.rotation.coords.into();
        let scalar_first = UnitQuaternion::new_unchecked(Quaternion::new(x, y, z, w));
        let rotation = match self.orientation {
            OrientationReading::Inverse => recorded.rotation,
            _ => scalar_first,
        };
        let read = Isometry3::from_parts(recorded.translation, rotation);
        match self.orientation {
            OrientationReading::ScalarFirst => read,
            _ if self.is_whole => read.inverse(),
            _ => Isometry3::from_parts(read.translation, rotation.inverse()),
        }
    }
}
