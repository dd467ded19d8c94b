//! What options of a request choose: the estimator, the signs of the wrenches, and where a sensor
//! stands.

use std::path::PathBuf;

use nalgebra::{Isometry3, Quaternion, Translation3, Vector3, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use tactid_options::{Kind, Value, read_as};

use crate::arm_calibration::ArmCalibration;
use crate::{RecordingError, unit_quaternion};
use tactid_dynamics::words::three_digits;
use tactid_dynamics::{BaseKind, MassProperties};
use tactid_identify::{body_of_values, values_of_body};

/// How equations become parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorKind {
    /// Robust weighted least squares over the whole recording: `least-squares`.
    #[default]
    LeastSquares,
    /// The paper's two-stage NLMS filter: `nlms`.
    Nlms,
}

impl Value for EstimatorKind {
    read_as!(Kind::Choice(&["least-squares", "nlms"]), Self);
}

/// Whether the wrenches have an unknown constant offset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OffsetChoice {
    /// Where the data of a recording show one.
    #[default]
    Auto,
    /// In any case.
    Yes,
    /// Never: the sensor's zero was set.
    No,
}

impl Value for OffsetChoice {
    read_as!(Kind::Choice(&["auto", "yes", "no"]), Self);

    fn is_effective(&self) -> bool {
        *self != Self::Auto
    }
}

/// What the driver of a sensor has subtracted from its wrenches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WrenchIs {
    /// Nothing but a constant.
    #[default]
    Raw,
    /// The weight of the configured payload, but not the forces that accelerate it.
    WithoutWeight,
    /// The weight of the configured payload and the forces that accelerate it, so that contacts are
    /// left.
    Contact,
}

impl Value for WrenchIs {
    read_as!(Kind::Choice(&["raw", "without-weight", "contact"]), Self);

    fn is_effective(&self) -> bool {
        *self != Self::Raw
    }
}

/// The payload that is configured in a controller, in the tip's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfiguredPayload(pub MassProperties);

impl Value for ConfiguredPayload {
    const KIND: Kind = Kind::Payload;

    /// Reads mass and centre of mass, and the inertia about it where it is given.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f64>::deserialize(deserializer)?;
        let (given, inertia) = numbers.split_at_checked(4).ok_or_else(|| short(&numbers))?;
        let mut values = [0.0; 10];
        values[..4].copy_from_slice(given);
        match inertia.len() {
            0 => {}
            6 => values[4..].copy_from_slice(inertia),
            _ => return Err(short(&numbers)),
        }
        Ok(Self(body_of_values(&values)))
    }

    fn numbers(&self) -> Vec<f64> {
        values_of_body(&self.0).to_vec()
    }
}

/// Returns the error of a body that has neither four nor ten numbers.
fn short<E: serde::de::Error>(numbers: &[f64]) -> E {
    E::invalid_length(numbers.len(), &"four or ten numbers")
}

/// Gravity, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum GravityChoice {
    /// The gravity of the kind of base, which the data may contradict.
    #[default]
    Auto,
    /// The gravitational acceleration in world axes, m/s².
    Given(Vector3<f64>),
    /// Its direction is unknown; its size is 9.81 m/s².
    Unknown,
}

impl GravityChoice {
    /// Returns the acceleration in world axes, m/s², from which the identification starts; `None`
    /// for that of the kind of base.
    #[must_use]
    pub fn vector(self) -> Option<Vector3<f64>> {
        match self {
            Self::Auto => None,
            Self::Given(gravity) => Some(gravity),
            // Also a floating base has gravity if its direction is sought.
            Self::Unknown => Some(BaseKind::Fixed.default_gravity()),
        }
    }
}

impl Value for GravityChoice {
    const KIND: Kind = Kind::Gravity;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(rename_all = "lowercase")]
        enum Word {
            Auto,
            Unknown,
        }
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Given {
            Vector([f64; 3]),
            Word(Word),
        }
        Ok(match Given::deserialize(deserializer)? {
            Given::Vector(entries) => Self::Given(entries.into()),
            Given::Word(Word::Auto) => Self::Auto,
            Given::Word(Word::Unknown) => Self::Unknown,
        })
    }

    fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Given(gravity) => gravity.as_slice().to_vec(),
            Self::Auto | Self::Unknown => Vec::new(),
        }
    }

    fn is_effective(&self) -> bool {
        *self != Self::Auto
    }
}

/// Where the frame of the only wrench sensor stands: fixed to a link of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorFrame {
    /// The link; without a robot, the body whose motion is measured.
    pub parent: String,
    /// Origin of the sensor's frame in the frame of the link, m.
    pub origin_m: [f64; 3],
    /// Orientation of the sensor's frame in the frame of the link: the quaternion `[x, y, z, w]`.
    pub quaternion: [f64; 4],
}

impl SensorFrame {
    /// Creates the frame with its origin, m, and its orientation, the quaternion `[x, y, z, w]`, in
    /// the frame of the link `parent`.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] if the norm of the quaternion is not one to
    /// within 0.1, as for the orientations of a recording.
    pub fn new(
        parent: &str,
        origin_m: [f64; 3],
        quaternion: [f64; 4],
    ) -> Result<Self, RecordingError> {
        let frame = Self {
            parent: parent.to_owned(),
            origin_m,
            quaternion,
        };
        frame.parent_from_sensor().map(|_| frame)
    }

    /// Returns the pose of the sensor's frame in the frame of the link.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] as [`new`](Self::new) does.
    pub fn parent_from_sensor(&self) -> Result<Isometry3<f64>, RecordingError> {
        pose("sensor_frame", self.origin_m, self.quaternion)
    }
}

/// Returns the pose that an option gives.
///
/// # Errors
/// Returns [`RecordingError::Option`] if the norm of the quaternion is not one to within 0.1.
pub(crate) fn pose(
    option: &'static str,
    origin_m: [f64; 3],
    quaternion: [f64; 4],
) -> Result<Isometry3<f64>, RecordingError> {
    let quaternion = Quaternion::from(Vector4::from(quaternion));
    let rotation = unit_quaternion(quaternion).ok_or_else(|| RecordingError::Option {
        option,
        what: format!(
            "the quaternion (qx, qy, qz, qw) of `{option}` has the norm {}, but must have the norm 1",
            three_digits(quaternion.norm())
        ),
    })?;
    Ok(Isometry3::from_parts(
        Translation3::from(origin_m),
        rotation,
    ))
}

impl Value for SensorFrame {
    const KIND: Kind = Kind::Frame;

    /// Reads eight entries, or the name of the link and seven numbers.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Given {
            Pair(String, [f64; 7]),
            Entries(String, f64, f64, f64, f64, f64, f64, f64),
        }
        let (parent, [x, y, z, qx, qy, qz, qw]) = match Given::deserialize(deserializer)? {
            Given::Pair(parent, numbers) => (parent, numbers),
            Given::Entries(parent, x, y, z, qx, qy, qz, qw) => (parent, [x, y, z, qx, qy, qz, qw]),
        };
        Ok(Self {
            parent,
            origin_m: [x, y, z],
            quaternion: [qx, qy, qz, qw],
        })
    }

    fn numbers(&self) -> Vec<f64> {
        [&self.origin_m[..], &self.quaternion].concat()
    }
}

impl Value for ArmCalibration {
    const KIND: Kind = Kind::Calibration;

    /// Reads the path of a file, and the file.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let path = PathBuf::deserialize(deserializer)?;
        Self::read(&path).map_err(serde::de::Error::custom)
    }
}
