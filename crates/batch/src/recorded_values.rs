//! What a result of a recording has besides the payload.

use schemars::JsonSchema;
use serde::Serialize;

/// Gravity whose direction was identified.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct GravityEstimate {
    /// Gravitational acceleration in the inertial frame, m/s². Its size is that of the given one.
    pub values: [f64; 3],
    /// Standard deviations of the values, m/s², infinite where the motion does not determine the
    /// direction.
    pub std_devs: [f64; 3],
}

/// The body whose weight was subtracted from the wrenches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WeightEstimate {
    /// Mass, kg, then centre of mass in the end-effector frame, m.
    pub values: [f64; 4],
    /// Standard deviations of the values, kg and m, infinite where the motion does not determine a
    /// value.
    pub std_devs: [f64; 4],
    /// The gravity, in world axes, m/s², along which the weight was subtracted by a controller that
    /// does not know how its base is mounted; `None` where that is gravity itself.
    pub along_m_s2: Option<[f64; 3]>,
}

/// The estimate at one time of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HistoryPoint {
    /// Time on the clock of the samples, s.
    pub time_s: f64,
    /// The ten values, in the order and the units of [`PayloadEstimate::values`](tactid_identify::PayloadEstimate::values).
    pub values: [f64; 10],
    /// Standard deviations of the values: infinite where a value was not determined yet.
    pub std_devs: [f64; 10],
}
