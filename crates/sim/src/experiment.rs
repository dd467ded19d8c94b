//! Description of an experiment, as one plain struct and as the TOML file that it is read from.

mod active;
mod check;
mod excitation;
mod lines;
mod noise;

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use tactid_dynamics::{BaseKind, MassProperties, symmetric_matrix};

pub use self::active::{ActiveExcitation, BoxCorners};
pub(crate) use self::check::refuse;
pub use self::excitation::{Excitation, ExcitationKind, ExcitationMode, JointExcitation};
pub(crate) use self::lines::{is_given, with_line};
pub use self::noise::{Noise, StdDev};
use crate::{BUILT_IN_URDF, SimError};

/// The paper's experiment as a TOML file, with meaning, unit and default of each field.
pub const PAPER_TOML: &str = include_str!("../experiments/paper.toml");

/// Description of an experiment: robot, payload, grasp, excitation, sensor noise and bounds.
///
/// Every field has a default, and the defaults together are the paper's experiment: [`PAPER_TOML`]
/// states each of them. Units are SI. The payload's properties are expressed in the tool frame.
///
/// ```
/// use tactid_sim::Experiment;
///
/// let experiment = Experiment::from_toml("duration_s = 30.0\n[payload]\nmass_kg = 50.0")?;
/// assert_eq!(experiment.gripper.friction, 0.8); // as in the paper's experiment
///
/// let error = Experiment::from_toml("seed = 1\n[payload]\nmass_kg = -1.0").unwrap_err();
/// assert!(error.to_string().starts_with("line 3: payload.mass_kg = -1"));
/// # Ok::<(), tactid_sim::SimError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Experiment {
    /// Seed of the command noise and of the measurement noise. The same seed gives the same log.
    pub seed: u64,
    /// Simulated time from the start of the excitation, s: the longest one of a run that ends when
    /// the payload is identified.
    pub duration_s: f64,
    /// Step of the physics and interval of the samples, s.
    pub step_s: f64,
    /// Gravitational acceleration in world axes, m/s²: not zero only where the base is fixed.
    /// Default (`None`): zero for a floating base, `[0, 0, -9.81]` for a fixed one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity_m_s2: Option<[f64; 3]>,
    /// Joint positions at the start of the excitation.
    pub posture: Posture,
    /// The robot and the names of its tool and fingers. Default the built-in robot.
    pub robot: RobotChoice,
    /// Mass properties of a floating base instead of the URDF's. Default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseProperties>,
    /// The payload.
    pub payload: Payload,
    /// The grasp.
    pub gripper: Gripper,
    /// Motion of the joints.
    pub excitation: Excitation,
    /// Noise of the sensors. Default none.
    pub noise: Noise,
    /// Bounds; a run aborts where it violates one.
    pub bounds: Bounds,
}

impl Default for Experiment {
    fn default() -> Self {
        Self {
            seed: 0,
            duration_s: 300.0,
            step_s: 0.001,
            gravity_m_s2: None,
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

/// Joint positions of the arm, by name or as numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"identifiable\", \"table1\", or a list of one number for each joint"
)]
pub enum Posture {
    /// A posture with a name.
    Named(NamedPosture),
    /// Position of each joint of the arm in the order of the URDF, without the fingers, rad (m for
    /// a prismatic joint).
    Joints(Vec<f64>),
}

/// Postures with a name, both for an arm of six joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NamedPosture {
    /// `[0, -1.2, 1.6, -0.4, π/2, 0]` rad. The axes of joints 3, 5 and 6 are linearly independent.
    Identifiable,
    /// Zeros, as in the paper's Table 1. Axes 3 and 6 are parallel, and Ixx cannot be identified.
    Table1,
}

impl std::fmt::Display for Posture {
    /// Writes the posture as a file has it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Named(NamedPosture::Identifiable) => f.write_str("\"identifiable\""),
            Self::Named(NamedPosture::Table1) => f.write_str("\"table1\""),
            Self::Joints(positions) => write!(f, "{positions:?}"),
        }
    }
}

impl Default for Posture {
    fn default() -> Self {
        Self::Named(NamedPosture::Identifiable)
    }
}

impl Posture {
    /// Returns the joint positions, rad (m for a prismatic joint).
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

/// The robot, what its base stands on, and the names of the tool link and the finger joints.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct RobotChoice {
    /// Path of a URDF file, relative to the experiment's file. Default none: the built-in robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<PathBuf>,
    /// Whether the base floats or is bolted to the world.
    pub base: BaseMount,
    /// Link with the frame in which the payload is described.
    pub tool: String,
    /// The two prismatic joints that close the gripper by increasing positions. The collision boxes
    /// of the links that they move are the pads.
    pub fingers: [String; 2],
}

impl Default for RobotChoice {
    fn default() -> Self {
        Self {
            urdf: None,
            base: BaseMount::default(),
            tool: "tool0".to_owned(),
            fingers: ["finger_left_joint", "finger_right_joint"].map(str::to_owned),
        }
    }
}

/// What the base of the robot stands on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BaseMount {
    /// Nothing: the base floats as a spacecraft. Its centre of mass starts at the world's origin.
    #[default]
    Floating,
    /// The ground: the base is bolted to the world, with the root link's frame as world frame.
    Fixed,
}

impl BaseMount {
    /// Returns the kind of base of the robot's model.
    #[must_use]
    pub fn kind(self) -> BaseKind {
        match self {
            Self::Floating => BaseKind::Floating,
            Self::Fixed => BaseKind::Fixed,
        }
    }
}

/// Mass properties of the base, expressed in the frame of the URDF's root link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct BaseProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m. Default the frame's origin.
    #[serde(default)]
    pub center_of_mass_m: [f64; 3],
    /// Inertia about the centre of mass, `[xx, xy, xz, yy, yz, zz]`, kg m².
    pub inertia_kg_m2: [f64; 6],
}

impl BaseProperties {
    /// Returns the mass properties as one value, in the frame of the URDF's root link.
    #[must_use]
    pub fn mass_properties(&self) -> MassProperties {
        mass_properties(self.mass_kg, self.center_of_mass_m, self.inertia_kg_m2)
    }
}

fn mass_properties(
    mass_kg: f64,
    center_of_mass: [f64; 3],
    inertia_kg_m2: [f64; 6],
) -> MassProperties {
    MassProperties {
        mass_kg,
        center_of_mass: Vector3::from(center_of_mass),
        inertia: symmetric_matrix(inertia_kg_m2),
    }
}

/// The payload, expressed in the tool frame at the start of the excitation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Payload {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub center_of_mass_m: [f64; 3],
    /// Inertia about the centre of mass, `[xx, xy, xz, yy, yz, zz]` in axes of the tool, kg m².
    pub inertia_kg_m2: [f64; 6],
    /// The part of the payload between the fingers.
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
    /// Returns the mass by which the payload resists a force on the centre of its handle, kg: least
    /// where the force turns it most. It is the payload's mass where the centre of mass is there.
    fn least_mass_at_handle_kg(&self) -> f64 {
        let center_of_mass = Vector3::from(self.center_of_mass_m);
        let arm = (Vector3::from(self.handle.center_m) - center_of_mass).cross_matrix();
        let inertia = symmetric_matrix(self.inertia_kg_m2);
        let turned = inertia.try_inverse().unwrap_or_default();
        let mobility =
            Matrix3::from_diagonal_element(self.mass_kg.recip()) + arm.transpose() * turned * arm;
        mobility.symmetric_eigenvalues().max().recip()
    }

    /// Returns the mass properties as one value, expressed in the tool frame.
    #[must_use]
    pub fn mass_properties(&self) -> MassProperties {
        mass_properties(self.mass_kg, self.center_of_mass_m, self.inertia_kg_m2)
    }
}

/// A box between the pads, along the axes of the tool frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Handle {
    /// Centre in the tool frame, m.
    pub center_m: [f64; 3],
    /// Lengths of the sides, m.
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

/// The grasp. The fingers close slowly until they press with the given force and are then locked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Gripper {
    /// Force of each finger on the handle at which the fingers are locked, N. Default 1500, and at
    /// most 1000 for each kilogram by which the payload resists a force on its handle, because
    /// contacts are as soft as it is light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grip_force_n: Option<f64>,
    /// Coefficient of friction between pad and handle.
    pub friction: f64,
    /// Speed of each finger while closing, m/s, from 0.0001 to 0.01. A fast one throws the payload.
    pub closing_speed_m_s: f64,
}

impl Default for Gripper {
    fn default() -> Self {
        Self {
            grip_force_n: None,
            friction: 0.8,
            closing_speed_m_s: 0.0005,
        }
    }
}

/// Bounds; a run aborts with [`SimError::Bound`] where it violates one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Bounds {
    /// Change of the system's linear momentum and of its angular momentum about the world's origin,
    /// each as a fraction of the largest momentum of any single body. Not used for a fixed base,
    /// which exchanges momentum with the ground.
    pub momentum_drift: f64,
    /// Displacement of the payload in the tool frame, m.
    pub grasp_drift_m: f64,
    /// Rotation of the payload in the tool frame, rad.
    pub grasp_drift_rad: f64,
    /// Residuals of the payload's Newton and Euler equations under the contact forces, as fractions
    /// of the largest contact force and moment.
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
    /// Returns the paper's experiment: joints 3, 5 and 6 for 100 s each at 0.2 Hz, payload 100 kg.
    #[must_use]
    pub fn paper() -> Self {
        Self::default()
    }

    /// Reads and checks an experiment. Missing fields are as in the paper's experiment.
    ///
    /// # Errors
    /// Returns [`SimError::Syntax`] or [`SimError::Value`] with the line.
    pub fn from_toml(text: &str) -> Result<Self, SimError> {
        let experiment: Self = toml::from_str(text).map_err(|e| lines::syntax(&e, text))?;
        experiment.check().map_err(|error| with_line(error, text))?;
        Ok(experiment)
    }

    /// Returns the experiment as TOML, with every field that has a value.
    ///
    /// # Errors
    /// Returns [`SimError::Syntax`] if a value cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String, SimError> {
        toml::to_string(self).map_err(|e| SimError::Syntax(e.to_string()))
    }

    /// Sets the frequency of every driven joint, Hz.
    pub fn set_frequency(&mut self, frequency_hz: f64) {
        for joint in &mut self.excitation.joints {
            joint.frequency_hz = frequency_hz;
        }
    }

    /// Returns the gravitational acceleration in world axes, m/s²: the given one, or the default
    /// for the kind of base.
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        let default = || self.robot.base.kind().default_gravity();
        self.gravity_m_s2.map_or_else(default, Vector3::from)
    }

    /// Returns the force of each finger at which the fingers are locked, N: the given one, or the
    /// default for the payload.
    #[must_use]
    pub fn grip_force_n(&self) -> f64 {
        let default = || (1000.0 * self.payload.least_mass_at_handle_kg()).min(1500.0);
        self.gripper.grip_force_n.unwrap_or_else(default)
    }

    /// Checks that every field has an allowed value.
    ///
    /// # Errors
    /// Returns [`SimError::Value`] for the first field that does not.
    pub fn check(&self) -> Result<(), SimError> {
        check::experiment(self)
    }

    /// Returns the text of the robot's URDF.
    ///
    /// # Errors
    /// Returns [`SimError::File`] if the URDF file cannot be read.
    pub fn urdf(&self) -> Result<String, SimError> {
        match &self.robot.urdf {
            Some(path) => read(path),
            None => Ok(BUILT_IN_URDF.to_owned()),
        }
    }
}

/// Reads a text file of an experiment.
pub(crate) fn read(path: &Path) -> Result<String, SimError> {
    tactid_dynamics::read_text(path).map_err(|source| SimError::File {
        path: path.to_owned(),
        source,
    })
}
