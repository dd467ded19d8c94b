//! An assumption that the data contradict.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_identify::solve::HALF_WIDTH_95;

use super::{LARGEST_MASS_CHANGE, LARGEST_SHIFT_M};

/// An assumption that may be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hypothesis {
    /// The wrenches have a constant offset.
    Offset,
    /// The weight of a body was subtracted from the wrenches, or added, but not the forces that
    /// accelerate it.
    Weight,
    /// Gravity has another direction in the axes of the world, or there is none.
    Gravity,
    /// The origin of the sensor is elsewhere in the frame that it is mounted in.
    SensorPlace,
    /// The axes of the sensor are turned.
    SensorRotation,
    /// The gains of the axes of the sensor differ.
    AxisGains,
    /// The wrenches are later than the motion.
    Delay,
    /// The zeros of joints are off.
    JointZeros,
    /// Axes of the sensor are exchanged, or have the opposite sign.
    Axes,
    /// Channels of the sensor are cut off at a limit.
    Saturation,
}

/// An assumption that the data contradict, with what they show in its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WrongAssumption {
    /// The assumption.
    pub cause: Hypothesis,
    /// Another assumption that explains the data as well, so that they cannot tell the two apart.
    pub runner_up: Option<Hypothesis>,
    /// Names of the values: channels, joints or components.
    pub names: Vec<String>,
    /// What the data show: an offset in N and N m, with the sign of the measured wrenches; a
    /// subtracted mass in kg and its centre in the tool frame in m; gravity in world axes in m/s²;
    /// the true origin of the sensor in its assumed frame in m; the rotation vector of its true
    /// axes in this frame in rad; gains, or 1 and -1 for axes; the delay in s; the zeros of joints
    /// in rad, which are to be added to the measured positions; limits in N and N m, with the sign
    /// of the measured wrenches.
    pub values: Vec<f64>,
    /// Standard deviations of the values (N and N m, kg and m, m/s², m, rad or s), infinite where
    /// the data do not determine a value; zero for axes and limits.
    pub std_devs: Vec<f64>,
    /// What is assumed in the place of the values, in their units (N and N m, kg and m, m/s², m,
    /// rad or s).
    pub assumed: Vec<f64>,
    /// Frame of the sensor, in which it does not move; the tool frame where there are several.
    pub frame: Arc<str>,
    /// For a weight that was subtracted along the assumed gravity, although gravity is another one:
    /// this gravity in world axes, m/s².
    #[serde(default)]
    pub along_m_s2: Option<[f64; 3]>,
    /// Residual with this cause relative to that without it, without a unit.
    pub residual_ratio: f64,
    /// Mass of the whole load with all causes that were found, kg.
    pub mass_kg: f64,
    /// Standard deviation of this mass, kg.
    pub mass_std_dev_kg: f64,
    /// By how much the mass certainly changes with the causes, relative to the mass with them,
    /// without a unit.
    pub mass_change: f64,
    /// By how much the centre of mass certainly moves with the causes, m.
    pub shift_m: f64,
    /// Largest change of a value of the result by the causes, relative to half of its 95 %
    /// interval, the larger one of those with and without them, without a unit.
    pub value_change: f64,
    /// Whether the values of the result already take the cause into account.
    #[serde(default)]
    pub is_applied: bool,
}

impl WrongAssumption {
    /// Returns whether the result is wrong without this cause.
    pub(super) fn contradicts(&self) -> bool {
        // Exchanged channels are no matter of degree, nor is a weight that is along another
        // direction than gravity: without accelerations, no mass is known then.
        self.cause == Hypothesis::Axes
            || self.along_m_s2.is_some()
            || self.value_change > 1.0
            || self.mass_change > LARGEST_MASS_CHANGE
            || self.shift_m > LARGEST_SHIFT_M
            // A change of six degrees is larger than the error of a mount, and lets a tenth of the
            // weight act sideways.
            || self.gravity_change() > 2.0 * LARGEST_MASS_CHANGE
    }

    /// Returns the least difference of gravity from the assumed one that its interval allows,
    /// relative to the size of that, without a unit; zero for another cause.
    fn gravity_change(&self) -> f64 {
        if self.cause != Hypothesis::Gravity {
            return 0.0;
        }
        let norm = |values: &mut dyn Iterator<Item = f64>| -> f64 {
            values.map(|value| value * value).sum::<f64>().sqrt()
        };
        let pairs = self.values.iter().zip(&self.assumed);
        let change = norm(&mut pairs.map(|(value, assumed)| value - assumed));
        let half_width = HALF_WIDTH_95 * norm(&mut self.std_devs.iter().copied());
        (change - half_width).max(0.0) / norm(&mut self.assumed.iter().copied())
    }

    /// States an offset or limits with the opposite sign, that of wrenches which act on the sensor.
    /// No other value has a sign of the wrenches.
    pub(super) fn negate_wrenches(&mut self) {
        if matches!(self.cause, Hypothesis::Offset | Hypothesis::Saturation) {
            for value in &mut self.values {
                *value = -*value;
            }
        }
    }
}
