//! Measured and modelled efforts of a recording.

use tactid_identify::solve::Vector;

use super::recording::EffortRecording;
use super::rows::EffortModel;

/// Measured and modelled efforts of W windows and n joints, each W x n, by window, in N m or N.
#[derive(Clone, Debug, PartialEq)]
pub struct EffortComparison {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Middle of each window, s.
    pub times_s: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub velocities: Vec<f64>,
    /// Measured efforts that belong to the motion: without the delay of the calibration.
    pub measured: Vec<f64>,
    /// Efforts of the robot's description alone, with the payload and without friction.
    pub described: Vec<f64>,
    /// Efforts of the calibration with the payload.
    pub calibrated: Vec<f64>,
    /// Friction within `calibrated`: what it contains beside the torques of links and payload.
    pub friction: Vec<f64>,
}

/// Returns measured and modelled efforts of a recording with the arm's unknowns and a payload.
pub(crate) fn compare(
    model: &EffortModel,
    recording: &EffortRecording,
    arm: &[f64],
    payload: &Vector,
) -> EffortComparison {
    let mut comparison = EffortComparison {
        joints: recording.arm.joints.clone(),
        times_s: recording.times_s().to_vec(),
        velocities: Vec::new(),
        measured: Vec::new(),
        described: Vec::new(),
        calibrated: Vec::new(),
        friction: Vec::new(),
    };
    for window in 0..recording.windows() {
        for joint in 0..model.layout.joints {
            let columns = recording.columns(window, joint);
            let modelled = model.effort(recording, (window, joint), arm, payload);
            let of_payload = columns.payload.dot(payload);
            comparison.velocities.push(columns.velocity);
            let measured = model.measured(recording, (window, joint), arm);
            comparison.measured.push(measured);
            comparison.described.push(columns.described + of_payload);
            comparison
                .calibrated
                .push(modelled.torque + modelled.friction);
            comparison.friction.push(modelled.friction);
        }
    }
    comparison
}

impl EffortComparison {
    /// Returns the rms of each joint's measured less modelled efforts in its unit, NaN without any.
    pub(crate) fn rms(&self, modelled: &[f64]) -> Vec<f64> {
        let joints = self.joints.len();
        let of_joint = |joint: usize| {
            let pairs = self.measured.iter().zip(modelled).skip(joint);
            let squares = pairs.step_by(joints).map(|(a, b)| (a - b).powi(2));
            (squares.sum::<f64>() / self.times_s.len() as f64).sqrt()
        };
        (0..joints).map(of_joint).collect()
    }
}
