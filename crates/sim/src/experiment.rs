//! What is run, as one plain struct and as the TOML file it is read from.

mod check;
mod noise;

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tactid_dynamics::{MassProperties, symmetric_matrix};

pub use self::noise::{Deviation, Noise};
use crate::{BUILT_IN_URDF, SimError};

/// The paper's experiment as a file: every field with its meaning, unit and default.
pub const PAPER_TOML: &str = include_str!("../experiments/paper.toml");

/// An experiment: what is held by what, and how it is moved and sensed.
///
/// Every field has a default, and the defaults together are the paper's experiment. SI units; the payload's
/// properties are in the tool frame.
///
/// ```
/// use tactid_sim::Experiment;
///
/// let experiment = Experiment::from_toml("duration_s = 30.0\n[payload]\nmass_kg = 50.0")?;
/// assert_eq!(experiment.gripper.friction, 0.8); // as in the paper's
///
/// let error = Experiment::from_toml("seed = 1\n[payload]\nmass_kg = -1.0").unwrap_err();
/// assert!(error.to_string().starts_with("line 3: payload.mass_kg = -1"));
/// # Ok::<(), tactid_sim::SimError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Experiment {
    /// Seed of the command noise and of the measurement noise. Same seed, same log. Default 0.
    pub seed: u64,
    /// Simulated time from the start of the excitation, s. Default 300.
    pub duration_s: f64,
    /// Step of the physics and of the samples, s. Default 0.001.
    pub step_s: f64,
    /// Joint positions when the excitation begins. Default `identifiable`.
    pub posture: Posture,
    /// The robot. Default the built-in one.
    pub robot: RobotChoice,
    /// Mass properties of the base in place of the URDF's. Default none: as the URDF says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseProperties>,
    /// The body that is held.
    pub payload: Payload,
    /// How the payload is held.
    pub gripper: Gripper,
    /// How the joints are driven.
    pub excitation: Excitation,
    /// Noise of the sensors. Default none.
    pub noise: Noise,
    /// What a run must keep to.
    pub bounds: Bounds,
}

impl Default for Experiment {
    fn default() -> Self {
        Self {
            seed: 0,
            duration_s: 300.0,
            step_s: 0.001,
            posture: Posture::default(),
            robot: RobotChoice::default(),
            base: None,
            payload: Payload::default(),
            gripper: Gripper::default(),
            excitation: Excitation::default(),
            noise: Noise::default(),
            bounds: Bounds::default(),
        }
    }
}

/// Joint positions of the arm: by name, or one angle in rad (m for a prismatic joint) for each joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Posture {
    /// One of [`NamedPosture`].
    Named(NamedPosture),
    /// In the order of the URDF, without the fingers.
    Joints(Vec<f64>),
}

/// The postures that have a name; both are for six joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NamedPosture {
    /// `[0, -1.2, 1.6, -0.4, π/2, 0]`: the axes of joints 3, 5 and 6 span space.
    Identifiable,
    /// Zeros, as in the paper's Table 1: joints 3 and 6 are parallel and Ixx cannot be identified.
    Table1,
}

impl Default for Posture {
    fn default() -> Self {
        Self::Named(NamedPosture::Identifiable)
    }
}

impl Posture {
    /// The joint positions, rad.
    #[must_use]
    pub fn positions(&self) -> Vec<f64> {
        match self {
            Self::Named(NamedPosture::Identifiable) => {
                vec![0.0, -1.2, 1.6, -0.4, std::f64::consts::FRAC_PI_2, 0.0]
            }
            Self::Named(NamedPosture::Table1) => vec![0.0; 6],
            Self::Joints(positions) => positions.clone(),
        }
    }
}

/// The robot and the names of what the experiment needs of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RobotChoice {
    /// A URDF file, relative to the experiment's file. Default none: the built-in robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<PathBuf>,
    /// The link in whose frame the payload is described. Default `tool0`.
    pub tool: String,
    /// The two prismatic joints that close the gripper at growing position. The collision boxes of the links
    /// they carry are the pads. Default `finger_left_joint`, `finger_right_joint`.
    pub fingers: [String; 2],
}

impl Default for RobotChoice {
    fn default() -> Self {
        Self {
            urdf: None,
            tool: "tool0".to_owned(),
            fingers: ["finger_left_joint", "finger_right_joint"].map(str::to_owned),
        }
    }
}

/// Mass properties of the base, in the frame of the URDF's root link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m. Default the origin.
    #[serde(default)]
    pub center_of_mass_m: [f64; 3],
    /// Inertia about the centre of mass, `[xx, xy, xz, yy, yz, zz]`, kg m².
    pub inertia_kg_m2: [f64; 6],
}

impl BaseProperties {
    /// Returns the mass properties as one value, in the frame of the URDF's root link.
    #[must_use]
    pub fn mass_properties(&self) -> MassProperties {
        MassProperties {
            mass_kg: self.mass_kg,
            center_of_mass: Vector3::from(self.center_of_mass_m),
            inertia: symmetric_matrix(self.inertia_kg_m2),
        }
    }
}

/// The body that is held, in the tool frame when the excitation begins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Payload {
    /// Mass, kg. Default 100.
    pub mass_kg: f64,
    /// Centre of mass, m. Default `[0.5, 0, 0]`.
    pub center_of_mass_m: [f64; 3],
    /// Inertia about the centre of mass, `[xx, xy, xz, yy, yz, zz]` along the axes of the tool, kg m².
    /// Default `[10, 0, 0, 20, 0, 10]`.
    pub inertia_kg_m2: [f64; 6],
    /// What the fingers hold it by.
    pub handle: Handle,
}

impl Default for Payload {
    fn default() -> Self {
        Self {
            mass_kg: 100.0,
            center_of_mass_m: [0.5, 0.0, 0.0],
            inertia_kg_m2: [10.0, 0.0, 0.0, 20.0, 0.0, 10.0],
            handle: Handle::default(),
        }
    }
}

impl Payload {
    /// As one value, in the tool frame.
    #[must_use]
    pub fn mass_properties(&self) -> MassProperties {
        MassProperties {
            mass_kg: self.mass_kg,
            center_of_mass: Vector3::from(self.center_of_mass_m),
            inertia: symmetric_matrix(self.inertia_kg_m2),
        }
    }
}

/// A box along the axes of the tool, between the pads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Handle {
    /// Its middle in the tool frame, m. Default `[0.22, 0, 0.075]`.
    pub center_m: [f64; 3],
    /// Its full size, m. Default `[0.16, 0.04, 0.16]`.
    pub size_m: [f64; 3],
}

impl Default for Handle {
    fn default() -> Self {
        Self {
            center_m: [0.22, 0.0, 0.075],
            size_m: [0.16, 0.04, 0.16],
        }
    }
}

/// The grasp. The fingers close slowly until they press hard enough and are then locked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Gripper {
    /// Force of each finger at which it is locked, N. Default 1500.
    pub grip_force_n: f64,
    /// Coefficient of friction between pad and handle. Default 0.8.
    pub friction: f64,
    /// Speed of each finger, m/s. Default 0.0005; a fast finger throws the payload.
    pub closing_speed_m_s: f64,
}

impl Default for Gripper {
    fn default() -> Self {
        Self {
            grip_force_n: 1500.0,
            friction: 0.8,
            closing_speed_m_s: 0.0005,
        }
    }
}

/// How the joints are driven: each from rest with the acceleration `amplitude · cos(2π · frequency · t)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Excitation {
    /// Whether one joint after another is driven or all at once. Default `sequence`.
    pub mode: ExcitationMode,
    /// Standard deviation of the white noise on each commanded acceleration, as a fraction of its amplitude;
    /// a new value every step. Default 0.01.
    pub command_noise: f64,
    /// The joints that are driven, in this order. Default joints 3, 5 and 6. The others are held still.
    pub joints: Vec<JointExcitation>,
}

impl Default for Excitation {
    fn default() -> Self {
        let joint = |name: &str| JointExcitation {
            name: name.to_owned(),
            amplitude_rad_s2: default_amplitude(),
            frequency_hz: default_frequency(),
        };
        Self {
            mode: ExcitationMode::default(),
            command_noise: 0.01,
            joints: ["joint_3", "joint_5", "joint_6"].map(joint).to_vec(),
        }
    }
}

/// In which order the joints move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExcitationMode {
    /// One after another, each for an equal part of the duration.
    #[default]
    Sequence,
    /// All at once, for the whole duration.
    Together,
}

/// How one joint is driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointExcitation {
    /// The joint, as the URDF calls it.
    pub name: String,
    /// Amplitude of the acceleration, rad/s² (m/s² for a prismatic joint). Default 1.
    #[serde(default = "default_amplitude")]
    pub amplitude_rad_s2: f64,
    /// Frequency, Hz. Default 0.2.
    #[serde(default = "default_frequency")]
    pub frequency_hz: f64,
}

fn default_amplitude() -> f64 {
    1.0
}

fn default_frequency() -> f64 {
    0.2
}

/// What every run must keep to; a run that does not is given up with the reason.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bounds {
    /// Change of the system's linear momentum and of its angular momentum about its initial centre of mass, each
    /// as a fraction of the largest of any single body. Default 0.001.
    pub momentum_drift: f64,
    /// How far the payload may move in the grasp, m. Default 0.0005.
    pub grasp_drift_m: f64,
    /// How far the payload may turn in the grasp, rad. Default 0.001.
    pub grasp_drift_rad: f64,
    /// Contact force and moment against the payload's own motion by Newton and Euler, as a fraction of the
    /// largest wrench so far. Default 0.001.
    pub newton_euler_residual: f64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            momentum_drift: 1e-3,
            grasp_drift_m: 5e-4,
            grasp_drift_rad: 1e-3,
            newton_euler_residual: 1e-3,
        }
    }
}

impl Experiment {
    /// The paper's: joints 3, 5 and 6 for 100 s each at 0.2 Hz, a payload of 100 kg.
    #[must_use]
    pub fn paper() -> Self {
        Self::default()
    }

    /// Reads and checks an experiment; what it does not say is as in the paper's.
    ///
    /// # Errors
    /// [`SimError::Syntax`] or [`SimError::Value`], with the line.
    pub fn from_toml(text: &str) -> Result<Self, SimError> {
        let experiment: Self = toml::from_str(text)
            .map_err(|e| SimError::Syntax(e.to_string().trim_end().to_owned()))?;
        experiment
            .check()
            .map_err(|error| check::with_line(error, text))?;
        Ok(experiment)
    }

    /// As [`Self::from_toml`], from a file. A relative path of a URDF is taken from the file's folder.
    ///
    /// # Errors
    /// As [`Self::from_toml`], or [`SimError::File`].
    pub fn from_file(path: &Path) -> Result<Self, SimError> {
        let mut experiment = Self::from_toml(&read(path)?)?;
        if let (Some(urdf), Some(folder)) = (&mut experiment.robot.urdf, path.parent()) {
            *urdf = folder.join(&*urdf);
        }
        Ok(experiment)
    }

    /// As a file: every field that has a value.
    ///
    /// # Errors
    /// [`SimError::Syntax`], where a value cannot be written in TOML.
    pub fn to_toml(&self) -> Result<String, SimError> {
        toml::to_string(self).map_err(|e| SimError::Syntax(e.to_string()))
    }

    /// Drives every joint at this frequency, Hz.
    pub fn set_frequency(&mut self, frequency_hz: f64) {
        for joint in &mut self.excitation.joints {
            joint.frequency_hz = frequency_hz;
        }
    }

    /// Whether an experiment can have these values.
    ///
    /// # Errors
    /// [`SimError::Value`] for the first that it cannot.
    pub fn check(&self) -> Result<(), SimError> {
        check::experiment(self)
    }

    /// The text of the robot's URDF.
    ///
    /// # Errors
    /// [`SimError::File`].
    pub fn urdf(&self) -> Result<String, SimError> {
        match &self.robot.urdf {
            Some(path) => read(path),
            None => Ok(BUILT_IN_URDF.to_owned()),
        }
    }
}

fn read(path: &Path) -> Result<String, SimError> {
    std::fs::read_to_string(path).map_err(|source| SimError::File {
        path: path.to_owned(),
        source,
    })
}
