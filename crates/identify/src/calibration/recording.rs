//! Window means of one recording: everything that calibration and identification need of it.

/// Window means of one recording of joint efforts: measured efforts and the columns of their model.
///
/// It is made by an [`EffortRecorder`](super::EffortRecorder) and does not change. Joints are those between the base and
/// the tool, in the robot's order.
///
/// Memory: some 5 kB for each window of a seven-axis arm, so 110 MB for an hour at a cutoff of 2 Hz.
#[derive(Clone, Debug)]
pub struct EffortRecording {
    times_s: Vec<f64>,
    joints: Vec<String>,
}

impl EffortRecording {
    /// Names of the joints between the base and the tool, n of them, in the robot's order.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.joints
    }

    /// Middle of each of the W windows, on the clock of the samples, s.
    #[must_use]
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Number of windows.
    #[must_use]
    pub fn windows(&self) -> usize {
        self.times_s.len()
    }
}
