//! Settings of a design.

use tactid_dynamics::BaseKind;
use tactid_identify::equations::window;

use crate::problem::Problem;
use crate::spline::FEWEST_CONTROL_POINTS;
use crate::variables::End;

/// Time between two knots where the number of control points is not given, s, and the range of
/// their number. On a floating base a step costs several times as much, and more control points
/// hardly improve the motion.
const SPAN_S: f64 = 0.43;
const FLOATING_SPAN_S: f64 = 0.6;
const CONTROL_POINTS: (usize, usize) = (11, 28);

/// Usual length of a pass of a motion along its splines, s: those of a long motion are three
/// quarters to one and a half times as long. A longer pass would need more than [`CONTROL_POINTS`]
/// to use the accelerations of the joints.
const PASS_S: f64 = 10.0;

/// Least usual length of a pass, in averaging windows.
const PASS_IN_WINDOWS: f64 = 10.0;

/// Settings of a design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignSettings {
    /// Seed of the motions that the search starts from. The same seed gives the same motion.
    pub seed: u64,
    /// Number of starts, at least one. Default: 6.
    pub starts: usize,
    /// Most steps of the search from the best start. Default: 50.
    pub iterations: usize,
    /// Number of control points of each joint in one pass, at least [`FEWEST_CONTROL_POINTS`].
    /// Default (`None`): one for each 0.43 s (0.6 s on a floating base), from 11 to 28.
    pub control_points: Option<usize>,
}

impl Default for DesignSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            starts: 6,
            iterations: 50,
            control_points: None,
        }
    }
}

/// Returns the number of passes, in turn forth and back, of the motion of a problem: one, unless
/// the motion is long and ends where it starts, or anywhere.
pub(crate) fn passes(problem: &Problem) -> usize {
    if matches!(problem.end, End::At(_)) {
        return 1;
    }
    let window_s = window::length_s(problem.sensing.equations.cutoff_hz);
    let usual_s = PASS_S.max(PASS_IN_WINDOWS * window_s);
    ((problem.duration_s / usual_s).round() as usize).max(1)
}

impl DesignSettings {
    /// Returns the number of control points of each joint for the motion of a problem.
    pub(crate) fn control_points_for(&self, problem: &Problem) -> usize {
        let (fewest, most) = CONTROL_POINTS;
        let span_s = match problem.robot.base_kind() {
            BaseKind::Fixed => SPAN_S,
            BaseKind::Floating => FLOATING_SPAN_S,
        };
        let usual = ((problem.duration_s / span_s) as usize).saturating_add(5);
        let count = self.control_points.unwrap_or(usual.clamp(fewest, most));
        count.max(FEWEST_CONTROL_POINTS)
    }
}
