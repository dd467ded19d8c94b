//! Window means of one recording: everything that calibration and identification need of it.

use std::sync::Arc;

use tactid_identify::equations::window;

use super::arm::{Arm, JointColumns};
use super::delay::{EffortMoments, EffortWindow};
use super::description::{Difference, first_difference};
use crate::CalibrateError;

/// Window means of one recording of joint efforts: measured efforts and the columns of their model.
///
/// It is made by an [`EffortRecorder`](super::EffortRecorder) and does not change. Joints are those
/// between the base and the tool, in the robot's order.
///
/// Memory: 3.6 kB for each window of a seven-axis arm, so 85 MB for an hour at a cutoff of 2 Hz;
/// 2.5 kB more for each window where contradictions are to be found.
///
/// [`EffortRecording::fingerprint`] shows whether two recordings are the same.
#[derive(Clone, Debug)]
pub struct EffortRecording {
    pub(crate) arm: Arc<Arm>,
    times_s: Vec<f64>,
    /// Entries of each window.
    means: Vec<Box<[f64]>>,
    /// Efforts of each joint in each window, for every delay.
    efforts: Vec<Box<[EffortMoments]>>,
    /// Numbers of samples that were rejected, and of gaps.
    pub(crate) rejected: u64,
    pub(crate) gaps: u64,
}

impl EffortRecording {
    /// Creates a recording without windows.
    pub(crate) fn new(arm: Arc<Arm>) -> Self {
        Self {
            arm,
            times_s: Vec::new(),
            means: Vec::new(),
            efforts: Vec::new(),
            rejected: 0,
            gaps: 0,
        }
    }

    /// Adds a window.
    pub(crate) fn push(&mut self, window: &EffortWindow) {
        self.times_s.push(window.mean.time_s);
        self.means.push(window.mean.means.clone());
        self.efforts.push(window.moments.clone());
    }

    /// Returns the recording with the efforts of each joint times its gain.
    pub(crate) fn with_gains(&self, gains: &[f64]) -> Self {
        let of_window = |efforts: &[EffortMoments]| {
            let pairs = efforts.iter().zip(gains);
            pairs.map(|(effort, gain)| effort.times(*gain)).collect()
        };
        Self {
            efforts: self.efforts.iter().map(|each| of_window(each)).collect(),
            ..self.clone()
        }
    }

    /// Returns the means of one joint over one window.
    pub(crate) fn columns(&self, window: usize, joint: usize) -> JointColumns<'_> {
        self.arm.columns(&self.means[window], joint)
    }

    /// Returns a joint's mean effort for the motion in a window, where efforts lag by a delay, s.
    pub(crate) fn effort(&self, window: usize, joint: usize, delay_s: f64) -> f64 {
        self.efforts[window][joint].effort(delay_s, self.window_s())
    }

    /// Returns the derivative of [`Self::effort`] with respect to the delay, per second.
    pub(crate) fn effort_slope(&self, window: usize, joint: usize, delay_s: f64) -> f64 {
        self.efforts[window][joint].slope(delay_s, self.window_s())
    }

    /// Returns times, efforts and velocities of all windows, which do not depend on links.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let joints = self.arm.joints.len();
        let of_joints = (0..self.windows()).flat_map(move |window| {
            let of_joint = move |joint| {
                [
                    self.effort(window, joint, 0.0),
                    self.columns(window, joint).velocity,
                ]
            };
            (0..joints).flat_map(of_joint)
        });
        self.times_s.iter().copied().chain(of_joints)
    }

    /// Names of the joints between the base and the tool, n of them, in the robot's order.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.arm.joints
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

    /// Length of a window, s.
    #[must_use]
    pub fn window_s(&self) -> f64 {
        window::length_s(self.arm.cutoff_hz)
    }

    /// Returns the largest velocity of a joint's window means in the positive and in the negative
    /// direction, both positive numbers or zero, rad/s or m/s.
    pub(crate) fn max_velocities(&self, joint: usize) -> [f64; 2] {
        let velocities = (0..self.windows()).map(|window| self.columns(window, joint).velocity);
        velocities.fold([0.0, 0.0], |[positive, negative]: [f64; 2], velocity| {
            [positive.max(velocity), negative.max(-velocity)]
        })
    }

    /// Checks that another recording is of the same robot.
    pub(crate) fn check_same(&self, other: &Self) -> Result<(), CalibrateError> {
        let (arm, other) = (&self.arm, &other.arm);
        check_names("tool", &[arm.tool.as_str()], &[other.tool.as_str()])?;
        check_names("joint", &arm.joints, &other.joints)?;
        check_names("link", &arm.links, &other.links)?;
        let descriptions = arm.descriptions.iter();
        let found = first_difference(&arm.links, descriptions, &other.descriptions, &arm.gravity)?;
        found.map_or(Ok(()), |(link, Difference { property, values })| {
            let [first, other] = values;
            Err(CalibrateError::Robot(format!(
                "the recordings are of different robots: the link `{link}` has the {property} {first} in the first one, \
                 and {other} in another"
            )))
        })
    }
}

/// Checks that names are the same, and reports the first that differs.
pub(crate) fn check_names<A: AsRef<str>, B: AsRef<str>>(
    what: &'static str,
    expected: &[A],
    found: &[B],
) -> Result<(), CalibrateError> {
    for k in 0..expected.len().max(found.len()) {
        let expected = expected.get(k).map_or("", AsRef::as_ref);
        let found = found.get(k).map_or("", AsRef::as_ref);
        if expected != found {
            return Err(CalibrateError::other_robot(what, expected, found));
        }
    }
    Ok(())
}

/// Checks that cutoffs and gravities, expected and found, are the same but for rounding.
pub(crate) fn check_settings(
    cutoff_hz: (f64, f64),
    gravity: (&[f64], &[f64]),
) -> Result<(), CalibrateError> {
    let same = |a: &f64, b: &f64| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
    let mismatch = |what, expected, found| {
        Err(CalibrateError::Robot(format!(
            "recordings with different {what} cannot be combined: {expected} and {found}"
        )))
    };
    if !same(&cutoff_hz.0, &cutoff_hz.1) {
        let (expected, found) = (cutoff_hz.0.to_string(), cutoff_hz.1.to_string());
        return mismatch("cutoff_hz", expected, found);
    }
    if !gravity.0.iter().zip(gravity.1).all(|(a, b)| same(a, b)) {
        let (expected, found) = (format!("{:?}", gravity.0), format!("{:?}", gravity.1));
        return mismatch("gravity", expected, found);
    }
    Ok(())
}
