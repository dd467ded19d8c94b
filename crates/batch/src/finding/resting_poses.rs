//! What poses at rest show, and which one would show most besides.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Poses at rest from which a payload is identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RestingPoses {
    /// Number of attitudes that differ.
    pub attitudes: usize,
    /// Number of poses, each the mean of its samples: an attitude that is visited again is one
    /// more.
    pub poses: usize,
    /// Number of samples in all of them.
    pub samples: usize,
    /// Frame of the sensor: that of the next attitude.
    pub frame: String,
    /// Standard deviation of a force between poses, N; zero where no force is measured.
    pub force_noise: f64,
    /// Standard deviation of a moment between poses, N m; zero where no moment is measured.
    pub moment_noise: f64,
    /// The further attitude that would help most; `None` where another finding contradicts the
    /// result, because then none helps.
    pub next: Option<NextAttitude>,
}

/// A further attitude for poses at rest, and what it would give.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NextAttitude {
    /// Direction of gravity in the frame of the sensor, without a unit: along an axis, or in the
    /// middle between two or three, so that each entry is -1, 0 or 1.
    pub gravity: [f64; 3],
    /// Name of the value that it would improve most, of [`VALUE_NAMES`](tactid_identify::VALUE_NAMES).
    pub value: Cow<'static, str>,
    /// Standard deviation of this value with that attitude, relative to the present one, without a
    /// unit; 0 where the value is unobservable without it.
    pub fraction: f64,
}

/// A pose at rest that the others contradict, as after a contact or a bump of the sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OutlyingPose {
    /// Number of the pose, counted from one.
    pub pose: usize,
    /// Number of its first row in the data, counted from one.
    pub first_row: usize,
    /// Number of its last row in the data, counted from one.
    pub last_row: usize,
    /// The channel that is farthest away, such as `force x`.
    pub channel: Cow<'static, str>,
    /// Size of the difference between the measured load of this channel and that of the others, N
    /// or N m.
    pub residual: f64,
    /// Size of the residual in its standard deviations, without a unit.
    pub distance: f64,
    /// Whether the pose was left out; otherwise the others do not determine as much without it.
    pub is_left_out: bool,
}

/// A centre of mass that no arm reaches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FarCenter {
    /// Its distance from the origin of the tool frame, m.
    pub distance_m: f64,
    /// Half the width of the 95 % interval of the distance, m.
    pub half_width_m: f64,
    /// Name of the tool frame: that of the sensor where there is no robot.
    pub frame: String,
}

/// The rests of which a recording consists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rests {
    /// Number of attitudes to gravity that differ.
    pub attitudes: usize,
    /// Number of rests.
    pub rests: usize,
    /// Fraction of the time at rest, without a unit.
    pub fraction: f64,
}
