//! What poses at rest show, and which one would show most besides.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Poses at rest from which a payload is identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RestingPoses {
    /// Number of attitudes, each the mean of its samples.
    pub attitudes: usize,
    /// Number of samples in all of them.
    pub samples: usize,
    /// Frame of the sensor: that of the next attitude.
    pub frame: String,
    /// Whether an offset of the wrenches is identified, too.
    pub has_offset: bool,
    /// Standard deviation of a force between attitudes, N; zero where no force is measured.
    pub force_noise: f64,
    /// Standard deviation of a moment between attitudes, N m; zero where no moment is measured.
    pub moment_noise: f64,
    /// Direction of gravity in the frame of the sensor in the attitude that would add most, without a
    /// unit: along an axis, or in the middle between two or three, so that each entry is -1, 0 or 1.
    pub next_gravity: [f64; 3],
    /// Name of the value that it would improve most, of [`VALUE_NAMES`](crate::VALUE_NAMES).
    pub next_value: Cow<'static, str>,
    /// Standard deviation of this value with that attitude, relative to the present one, without a
    /// unit; 0 where the value is unobservable without it.
    pub next_fraction: f64,
}
