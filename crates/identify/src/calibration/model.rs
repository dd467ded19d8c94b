//! The calibrated model of an arm as plain data.

use nalgebra::Vector3;
use tactid_dynamics::{InertialParameters, Manipulator};

use super::estimate::CalibratedEstimate;
use super::recording::EffortRecording;
use super::report::EffortComparison;
use crate::IdentifyError;
use crate::batch::BatchSettings;

/// Noise of the window means of one joint's effort, which has three independent pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffortNoise {
    /// Standard deviation of the white noise, N m or N.
    pub white: f64,
    /// Standard deviation of the slow noise, N m or N.
    pub slow: f64,
    /// Correlation time of the slow noise, s.
    pub slow_time_s: f64,
    /// Standard deviation of the friction at standstill, N m or N: nobody knows it between the two Coulomb values.
    pub standstill: f64,
}

/// What a calibration knows of an arm: the mean and the precision of all unknowns, and the noise of each joint.
///
/// All fields are plain data, so that a program can write them to a file and read them back; [`Self::check`] refuses data
/// that do not fit together or belong to another robot. `n` is the number of joints between base and tool, `B` that of the
/// bodies that they move (`n`, but for mimic joints), `T` that of `friction_widths`, and `K = 10 B + (6 + T) n` that of the
/// unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Name of the link whose frame is that of the payload.
    pub tool: String,
    /// Names of the `n` joints between the base and the tool, in the robot's order.
    pub joints: Vec<String>,
    /// Names of the `B` links that these joints move, from the base outwards.
    pub links: Vec<String>,
    /// Gravitational acceleration in the inertial frame, m/s².
    pub gravity: Vector3<f64>,
    /// Cutoff of the window means, Hz. Recordings for an identification must have the same.
    pub cutoff_hz: f64,
    /// Velocities `v` of the friction terms `tanh(q̇ / v)`, rad/s or m/s.
    pub friction_widths: Vec<f64>,
    /// The `K` unknowns, by groups: ten inertial parameters of each link (in the order of [`InertialParameters`], about
    /// the frame of the link, with all links fixed to it), then for each joint: offset (N m or N), viscous friction, one
    /// friction for each of `friction_widths`, load-dependent friction of the arm, that of the payload (both fractions),
    /// rotor inertia (kg m² or kg), and inverse gain (1 where efforts are torques). Each group has all joints in order;
    /// [`Self::parameter_names`] names them.
    pub parameters: Vec<f64>,
    /// Prior standard deviation of each unknown, which is the unit of its column in `precision`; 0 for a gain that is
    /// known.
    pub scales: Vec<f64>,
    /// Lower triangle, row by row, of the precision (inverse covariance) of the unknowns divided by `scales`:
    /// `K (K + 1) / 2` numbers.
    pub precision: Vec<f64>,
    /// Noise of each joint.
    pub noise: Vec<EffortNoise>,
    /// Link parameters of the first fit, `10 B`, from which the load-dependent friction has its torques.
    pub reference_links: Vec<f64>,
    /// Rms torque of each joint in the first fit, N m or N.
    pub reference_torques: Vec<f64>,
    /// Log evidence of the model on the calibrating recordings.
    pub log_evidence: f64,
}

impl Calibration {
    /// Returns the name of each unknown, such as `forearm_link m*ax` or `elbow_joint viscous`.
    #[must_use]
    pub fn parameter_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Checks that the data fit together, and belong to a robot and the link `tool`.
    ///
    /// # Errors
    /// Returns [`IdentifyError::CalibrationData`] if a field has the wrong length or a number that is not valid,
    /// [`IdentifyError::Model`] if the robot does not have the link, and [`IdentifyError::CalibrationRobot`] with the
    /// first joint or link that differs.
    pub fn check(&self, robot: &Manipulator, tool: &str) -> Result<(), IdentifyError> {
        let _ = (robot, tool);
        Err(IdentifyError::NoEfforts)
    }

    /// Identifies the payload that the arm holds in all of the `loaded` recordings, together with the arm. `unloaded` are
    /// recordings of the same day without payload, which update the calibration first; there may be none.
    ///
    /// The field `delay` of the settings is ignored. Cost: four passes over all windows.
    ///
    /// # Errors
    /// Returns [`IdentifyError::TooFewWindows`] if the loaded recordings have fewer than six windows,
    /// [`IdentifyError::CalibrationRobot`] or [`IdentifyError::CalibrationMismatch`] if a recording is of another robot or
    /// has another cutoff or gravity, [`IdentifyError::CalibrationData`] for data that do not fit together, and the errors
    /// of [`BatchSettings::check`].
    pub fn identify(
        &self,
        loaded: &[EffortRecording],
        unloaded: &[EffortRecording],
        settings: &BatchSettings,
    ) -> Result<CalibratedEstimate, IdentifyError> {
        let _ = (loaded, unloaded, settings);
        Err(IdentifyError::NoEfforts)
    }

    /// Returns measured and modelled efforts of a recording, for plots: those of the robot's description alone, and those
    /// of the calibration. `payload` is held in it, in the tool frame; `None` for an unloaded recording.
    ///
    /// # Errors
    /// Returns [`IdentifyError::CalibrationRobot`], [`IdentifyError::CalibrationMismatch`] or
    /// [`IdentifyError::CalibrationData`], as [`Self::identify`] does.
    pub fn compare(
        &self,
        recording: &EffortRecording,
        payload: Option<&InertialParameters>,
    ) -> Result<EffortComparison, IdentifyError> {
        let _ = (recording, payload);
        Err(IdentifyError::NoEfforts)
    }
}
