//! What a calibration reports beside its data.

use tactid_dynamics::InertialParameters;

use super::model::{Calibration, EffortNoise};

/// The result of a calibration.
#[derive(Clone, Debug)]
pub struct CalibrationResult {
    /// The calibrated model, for a file and for identifications.
    pub calibration: Calibration,
    /// How well it explains the recordings, in readable numbers.
    pub report: CalibrationReport,
}

/// How well a calibration explains its recordings, and what it found.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationReport {
    /// Number of windows of all recordings.
    pub windows: usize,
    /// Length of a window, s.
    pub window_s: f64,
    /// The joints between base and tool.
    pub joints: Vec<JointCalibration>,
    /// The links that they move.
    pub links: Vec<LinkCalibration>,
    /// Identified payload of each recording with a known one, in the tool frame, in the order of the recordings.
    pub payloads: Vec<InertialParameters>,
    /// What the motion does not determine.
    pub shortages: Vec<MotionShortage>,
}

/// The calibrated model of one joint. Efforts are in N m, or in N for a prismatic joint; angles become lengths there.
#[derive(Clone, Debug, PartialEq)]
pub struct JointCalibration {
    /// Name of the joint.
    pub name: String,
    /// Unit of its effort: `N m` or `N`.
    pub unit: &'static str,
    /// Factor from measured efforts to torques; 1 where efforts are torques.
    pub gain: f64,
    /// Standard deviation of the gain; 0 where it is known.
    pub gain_std_dev: f64,
    /// Offset of the effort.
    pub offset: f64,
    /// Viscous friction, N m s/rad or N s/m.
    pub viscous: f64,
    /// Friction at each of the widths, whose sum is the Coulomb friction far from standstill.
    pub friction: Vec<f64>,
    /// Load-dependent friction of the arm, a fraction of its torque.
    pub load_friction: f64,
    /// Load-dependent friction of a payload, a fraction of its torque.
    pub payload_friction: f64,
    /// Inertia of the rotor as the joint moves it, kg m² or kg.
    pub rotor_inertia: f64,
    /// Noise of window means.
    pub noise: EffortNoise,
    /// Largest velocity of a window mean in the positive and in the negative direction, rad/s or m/s, both positive
    /// numbers or zero.
    pub max_velocity: [f64; 2],
    /// Rms of measured less modelled efforts of all windows with the robot's description alone.
    pub residual_before: f64,
    /// Rms of measured less modelled efforts of all windows with the calibration.
    pub residual_after: f64,
    /// Rms of measured less modelled efforts of windows that a second fit did not see. NaN where there are too few.
    pub residual_held_out: f64,
}

/// The calibrated parameters of one link, with all links fixed to it, about the link's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkCalibration {
    /// Name of the link.
    pub name: String,
    /// Parameters of the robot's description.
    pub described: InertialParameters,
    /// Calibrated parameters. Motion determines combinations of several links only; the others stay as described.
    pub calibrated: InertialParameters,
    /// Standard deviations of the ten calibrated parameters.
    pub std_devs: [f64; 10],
}

/// What the motion of the calibrating recordings does not determine.
#[derive(Clone, Debug, PartialEq)]
pub enum MotionShortage {
    /// A joint does not move: its friction and, with that, its share of the payload stay uncertain.
    Still {
        /// Name of the joint.
        joint: String,
        /// Largest velocity, rad/s or m/s.
        max_velocity: f64,
    },
    /// A joint moves in one direction only: its offset and its Coulomb friction cannot be distinguished.
    OneDirection {
        /// Name of the joint.
        joint: String,
        /// Whether that direction is the positive one.
        is_positive: bool,
    },
    /// The gain of a joint was to be found, but the recordings leave it more uncertain than half of what was known
    /// before.
    Gain {
        /// Name of the joint.
        joint: String,
        /// Standard deviation of its gain.
        std_dev: f64,
    },
}

/// Measured and modelled efforts of W windows and n joints, each W x n, window by window, in N m or N.
#[derive(Clone, Debug, PartialEq)]
pub struct EffortComparison {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Middle of each window, s.
    pub times_s: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub velocities: Vec<f64>,
    /// Measured efforts.
    pub measured: Vec<f64>,
    /// Efforts of the robot's description alone, with the payload and without friction.
    pub described: Vec<f64>,
    /// Efforts of the calibration with the payload.
    pub calibrated: Vec<f64>,
    /// Friction within `calibrated`: what it contains beside the torques of the links and the payload.
    pub friction: Vec<f64>,
}
