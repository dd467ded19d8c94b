//! One estimate of the motion and the payload from a recording of a free-floating robot.
//!
//! Splines of degree five for the joints and the pose of the base, and the ten parameters, are the
//! unknowns of one least-squares problem, whose rows are all measurements, each in units of its
//! noise. On a base that floats, the noise of the motion is most of what is unknown, and it is the
//! same noise in all sources.

mod bins;
mod bordered;
mod choice;
mod dynamics;
mod estimate;
mod rows;
mod segment;
mod smoothing;
mod spline;

pub(crate) use self::bins::SampleBins;
pub use self::choice::MotionEstimate;
pub(crate) use self::choice::choose;

/// What the splines resolve, and when they are used.
struct TrajectorySettings {
    /// Number of knots of the splines in a second, Hz.
    knots_hz: f64,
    /// Number of bins between two knots.
    bins_of_interval: f64,
    /// Most bins of a recording.
    most_bins: usize,
    /// Noise of what no sensor measures, relative to what the noise of the motion leaves of it.
    exact: f64,
    /// Part of a channel's size that splines and means over bins leave.
    accuracy: f64,
    /// Largest ratio of the mean square of residuals to the variance of their noise.
    explained: f64,
}

/// Splines with 20 knots in a second follow frequencies up to 10 Hz, which is enough for an arm, and
/// three means between two knots lose nothing of it. Beyond 6000 bins, 100 s, windows determine a
/// payload as well.
const SETTINGS: TrajectorySettings = TrajectorySettings {
    knots_hz: 20.0,
    bins_of_interval: 3.0,
    most_bins: 6000,
    exact: 0.01,
    accuracy: 3e-4,
    explained: 2.0,
};
