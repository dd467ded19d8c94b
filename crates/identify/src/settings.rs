mod check;

use nalgebra::Vector3;
use tactid_dynamics::BaseKind;
use tactid_nlms::{PAPER_ALPHA, PAPER_BETA};

/// On the ground, m/s².
pub(crate) const STANDARD_GRAVITY: f64 = 9.81;

/// What the end-effector's wrench is learnt from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Way {
    /// The contact wrenches in the fingers, (47)-(48) and (46): the payload alone.
    #[default]
    Tactile,
    /// The motion of the free-floating base and the links, (30) and (44): gripper and payload as one
    /// body, from which the known gripper is taken off.
    JointSensing,
    /// What the joints exert beyond what the arm itself needs, `Jᵀ [f_U; n_U]`: the payload alone.
    /// Arm and gripper are known from the robot's description.
    Effort,
    /// All that is measured, each channel with the weight that its own residuals give it: the wrenches
    /// of the sensors if there are any, the joints' efforts if they are measured, and for a floating
    /// base that nothing acts on it from outside. The payload alone.
    ///
    /// Each source must be true to its model: friction in the joints, or a thruster that fires, is an
    /// error of the whole.
    Combined {
        /// Whether the joints' efforts are measured.
        effort: bool,
    },
}

impl Way {
    /// A short name: `tactile`, `joint-sensing`, `effort` or `combined`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tactile => "tactile",
            Self::JointSensing => "joint-sensing",
            Self::Effort => "effort",
            Self::Combined { .. } => "combined",
        }
    }

    /// Whether the wrenches of sensors take part.
    pub(crate) fn uses_wrench(self) -> bool {
        matches!(self, Self::Tactile | Self::Combined { .. })
    }

    /// Whether the joints' efforts take part.
    pub(crate) fn uses_effort(self) -> bool {
        matches!(self, Self::Effort | Self::Combined { effort: true })
    }
}

/// How rows become parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EstimatorKind {
    /// The paper's filter, in its two stages (48) and (46). For exact measurements; a gradient filter.
    Nlms {
        /// α of (54), in (0, 2).
        alpha: f64,
        /// β of (54), in (0, 1).
        beta: f64,
    },
    /// Least squares on the one-stage form, which is far better conditioned: weighted by the noise that it
    /// sees, with intervals, a possible body, and an eye on the payload being another.
    Rls,
}

impl EstimatorKind {
    /// The paper's filter with the paper's α and β.
    pub const PAPER: Self = Self::Nlms {
        alpha: PAPER_ALPHA,
        beta: PAPER_BETA,
    };

    /// A short name: `nlms` or `rls`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Nlms { .. } => "nlms",
            Self::Rls => "rls",
        }
    }
}

/// How to identify.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What the wrench is learnt from. Default: tactile.
    pub way: Way,
    /// Default: least squares, which any robot should run; the paper's filter is for reproducing it.
    pub estimator: EstimatorKind,
    /// Gravitational acceleration in the inertial frame, m/s², pointing down. Default (`None`):
    /// zero for a floating base, 9.81 along -z for a fixed one.
    pub gravity: Option<Vector3<f64>>,
    /// The estimate is the mean over this last time, s; 0 for the latest value. Default: 0. A gradient
    /// filter never settles, and has 10, as in the paper's Table 2.
    pub average_s: f64,
    /// Both sides of the equations pass a low-pass that has lost 3 dB at this frequency, Hz: a mean
    /// over a window of 0.926 / `cutoff_hz`. Default: 10. It keeps faster noise out of the estimator,
    /// and adds no bias: it filters rows, not measurements.
    pub cutoff_hz: f64,
    /// How often a log is presented to the estimator. Default: 1; 2 for the paper's filter, which corrects
    /// what it learnt of the inertia while the centre of mass was still wrong only where the motion
    /// comes back to it. Online, the samples come once.
    pub epochs: u32,
    /// Samples further apart than this are not bridged, s. Default: 0.1.
    pub max_gap_s: f64,
    /// For the effort way: the efforts in the samples are what the payload alone adds, the arm's own
    /// part is off already. Default: false.
    pub effort_is_net: bool,
    /// Whether the sensors' wrenches may be off by a constant, in their sum and in the tool frame: a
    /// zero that was not set. These are six more unknowns of least squares, so the motion must tell the
    /// payload from them: by other accelerations, or by turning it under gravity. Default: false.
    pub wrench_offset: bool,
    /// The noise of one sample of each wrench sensor, white, as standard deviations in its frame: three
    /// forces in N, three moments in N m. One for all sensors, or one each; empty (the default) where
    /// the residuals are to tell it. It weighs the channels of least squares, which in the first second
    /// is better than what few residuals say; intervals follow the residuals all the same.
    pub wrench_noise: Vec<[f64; 6]>,
    /// The same of each joint's effort, N m or N, in the robot's order.
    pub effort_noise: Vec<f64>,
}

impl Default for Settings {
    /// Least squares on the fingers' wrenches, and its latest value.
    fn default() -> Self {
        Self {
            way: Way::Tactile,
            estimator: EstimatorKind::Rls,
            gravity: None,
            average_s: 0.0,
            epochs: 1,
            cutoff_hz: 10.0,
            max_gap_s: 0.1,
            effort_is_net: false,
            wrench_offset: false,
            wrench_noise: Vec::new(),
            effort_noise: Vec::new(),
        }
    }
}

impl Settings {
    /// The paper's filter with the paper's settings: a mean over the last 10 s, of a log presented twice.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            estimator: EstimatorKind::PAPER,
            average_s: 10.0,
            epochs: 2,
            ..Self::default()
        }
    }

    /// Whether anything is said of the sensors' noise.
    pub(crate) fn gives_noise(&self) -> bool {
        !(self.wrench_noise.is_empty() && self.effort_noise.is_empty())
    }

    /// The gravity that holds for a kind of base.
    pub(crate) fn gravity_for(&self, base: BaseKind) -> Vector3<f64> {
        self.gravity.unwrap_or(match base {
            BaseKind::Floating => Vector3::zeros(),
            BaseKind::Fixed => Vector3::new(0.0, 0.0, -STANDARD_GRAVITY),
        })
    }
}
