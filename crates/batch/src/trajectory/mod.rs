//! One estimate of the motion and the payload of a free-floating robot, from a recording or while
//! samples come.
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
mod fixed_lag;
mod lag;
mod marginal_prior;
mod noise;
mod rows;
mod scatter;
mod segment;
mod smoothing;
mod spline;

use schemars::JsonSchema;
use serde::Serialize;

pub(crate) use self::bins::SampleBins;
pub(crate) use self::choice::choose;
pub use self::lag::{LagIdentifier, LagSettings};

/// How the motion that is measured entered an estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MotionEstimate {
    /// Motion and payload were estimated at once, from all measurements: splines of degree five for
    /// the joints and the base. Of a long recording, these are the first 6000 means over about a
    /// sixtieth of a second, those of 67 to 200 s by the rate of its samples (100 s at 1 kHz), and
    /// fewer for robots with more than eight joints.
    WithPayload,
    /// The motion was smoothed before, sample by sample, because one estimate of both is not for
    /// this problem: the base is fixed or has no joints, only some samples have its accelerations,
    /// channels of the wrenches are not measured or interpolated, an offset, a subtracted weight or
    /// the direction of gravity is unknown, gains of efforts are uncertain, a direction of the
    /// parameters is not excited, an assumption is wrong, or some of the recording has another load
    /// or outliers.
    #[default]
    Smoothed,
    /// The motion was smoothed before, because velocities of the joints or of the base are not
    /// measured.
    NoVelocities,
    /// The motion was smoothed before, because the cutoff was chosen for it: splines follow 10 Hz
    /// whatever the cutoff is.
    GivenCutoff,
    /// The motion was smoothed before, because no stretch without gaps is long enough (0.35 s at 50 Hz,
    /// 1.8 s at 30 Hz), or samples are so rare (below 30 Hz) that splines go through all of them.
    TooFew,
    /// The motion was smoothed before, because it has frequencies that splines do not follow, or
    /// noise that is far from white.
    TooFast,
    /// The motion was smoothed before, because splines and payload leave more of the measurements
    /// than their noise: the model has errors, or measured accelerations contradict odometry.
    Unexplained,
    /// The motion was smoothed before, because its noise is so small, or the recording so long, that
    /// the result is at least as precise.
    Exact,
}

/// What the splines resolve, and when they are used.
struct TrajectorySettings {
    /// Number of knots of the splines in a second, Hz.
    knots_hz: f64,
    /// Number of bins between two knots.
    bins_of_interval: f64,
    /// Most bins of a recording.
    most_bins: usize,
    /// Most bins of a recording times the square of the number of coordinates.
    most_entries: usize,
    /// Least degrees of freedom that splines leave of the values of a stretch, relative to their
    /// number.
    least_freedom: f64,
    /// Noise of what no sensor measures, relative to what the noise of the motion leaves of it.
    exact: f64,
    /// Part of a channel's size that splines and means over bins leave.
    accuracy: f64,
    /// Number of intervals before the first estimate while samples come.
    first_intervals: usize,
    /// Least degrees of freedom that splines leave of the values while samples come, relative to
    /// their number.
    freedom_of_window: f64,
    /// Least number of the last bins from which the motion is smoothed while samples come.
    window: usize,
    /// Number of the last intervals over which the noise is averaged while samples come.
    remembered: usize,
    /// Largest ratio of the mean square of residuals to the variance of their noise, but for chance.
    explained: f64,
}

/// Splines with 20 knots in a second follow frequencies up to 10 Hz, which is enough for an arm, and
/// three means between two knots lose nothing of it. 6000 bins bound the time of a result, and those
/// of a robot with eight joints the memory of the normal equations, some 60 MB. While
/// samples come, splines of less than 0.8 s leave too few degrees of freedom to see the noise, those
/// of 1.2 s, or of 72 bins of rarer samples, are at the end of it as those of all samples are, and noise
/// is that of 10 s. Of samples below 40 Hz, splines leave so little that Gauss-Newton diverges from there.
const SETTINGS: TrajectorySettings = TrajectorySettings {
    knots_hz: 20.0,
    bins_of_interval: 3.0,
    most_bins: 6000,
    most_entries: 1_350_000,
    least_freedom: 0.25,
    exact: 0.01,
    accuracy: 3e-4,
    first_intervals: 16,
    freedom_of_window: 0.4,
    window: 72,
    remembered: 200,
    explained: 2.0,
};
