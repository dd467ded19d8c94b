use nalgebra::Vector3;
use tactid_dynamics::BaseKind;
use tactid_nlms::{PAPER_ALPHA, PAPER_BETA};

/// What the end-effector's wrench is learnt from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Way {
    /// The contact wrenches in the fingers, (47)-(48) and (46): the payload alone.
    #[default]
    Tactile,
    /// The motion of the free-floating base and the links, (30) and (44): gripper and payload as one
    /// body, from which the known gripper is taken off.
    JointSensing,
}

/// How rows become parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EstimatorKind {
    /// The paper's filter, in its two stages (48) and (46).
    Nlms {
        /// α of (54), in (0, 2).
        alpha: f64,
        /// β of (54), in (0, 1).
        beta: f64,
    },
    /// Least squares on the one-stage form, which is far better conditioned.
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
    /// Default: the paper's NLMS.
    pub estimator: EstimatorKind,
    /// Gravitational acceleration in the inertial frame, m/s², pointing down. Default (`None`):
    /// zero for a floating base, 9.81 along -z for a fixed one.
    pub gravity: Option<Vector3<f64>>,
    /// The estimate is the mean over this last time, s; 0 for the latest value. Default: 10, as in
    /// the paper's Table 2. A gradient filter never settles; least squares does, and wants 0.
    pub average_s: f64,
    /// Rows are means over intervals of this length, s; 0 for each pair of samples. Default: 0.05. The
    /// mean keeps faster noise out of a filter that would amplify it; it takes nothing off a motion
    /// that is slow against it.
    pub interval_s: f64,
    /// How often a log is presented to the estimator. Default: 2 for the paper's filter, which corrects
    /// what it learnt of the inertia while the centre of mass was still wrong only where the motion
    /// comes back to it; 1 for least squares. Online, the samples come once.
    pub epochs: u32,
    /// Samples further apart than this are not bridged, s. Default: 0.1.
    pub max_gap_s: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            way: Way::Tactile,
            estimator: EstimatorKind::PAPER,
            gravity: None,
            average_s: 10.0,
            epochs: 2,
            interval_s: 0.05,
            max_gap_s: 0.1,
        }
    }
}

impl Settings {
    /// The gravity that holds for a kind of base.
    pub(crate) fn gravity_for(&self, base: BaseKind) -> Vector3<f64> {
        self.gravity.unwrap_or(match base {
            BaseKind::Floating => Vector3::zeros(),
            BaseKind::Fixed => Vector3::new(0.0, 0.0, -9.81),
        })
    }

    /// Least squares instead of the paper's filter, and its latest value instead of a mean.
    #[must_use]
    pub fn least_squares() -> Self {
        Self {
            estimator: EstimatorKind::Rls,
            average_s: 0.0,
            epochs: 1,
            ..Self::default()
        }
    }
}
