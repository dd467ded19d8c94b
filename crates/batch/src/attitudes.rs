//! Attitudes, told apart by the direction of gravity in the tool.

use nalgebra::Vector3;

/// An attitude is the same as long as it, or gravity in it, turns by less than this angle, rad:
/// half a degree, more than the noise of encoders and of orientations, and less than two attitudes
/// of a calibration differ by.
pub(crate) const SAME_ATTITUDE_RAD: f64 = 0.009;

/// Returns whether two directions of gravity in the tool are those of one attitude.
pub(crate) fn are_same_attitude(first: &Vector3<f64>, other: &Vector3<f64>) -> bool {
    first.angle(other) < SAME_ATTITUDE_RAD
}

/// The different attitudes that were met, by the direction of gravity in the tool.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attitudes(Vec<Vector3<f64>>);

impl Attitudes {
    /// Returns the number of an attitude, given gravity in the tool: that of an earlier one, or a
    /// new one.
    pub(crate) fn number(&mut self, down: &Vector3<f64>) -> usize {
        let is_same = |other: &Vector3<f64>| are_same_attitude(other, down);
        self.0.iter().position(is_same).unwrap_or_else(|| {
            self.0.push(*down);
            self.0.len() - 1
        })
    }

    /// Number of attitudes.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }
}
