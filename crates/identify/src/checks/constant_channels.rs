//! Channels of wrench sensors that never change: a channel that is dead biases the estimate without
//! large residuals.

use educe::Educe;
use tactid_dynamics::Wrench;

/// Fewest samples from which a channel counts as constant, and after which no equation at all is
/// reported.
pub const FEWEST_SAMPLES: u64 = 100;

/// Names of the channels of a wrench.
pub const WRENCH_CHANNELS: [&str; 6] = [
    "force x", "force y", "force z", "moment x", "moment y", "moment z",
];

/// When each channel of some wrench sensors last changed.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct ChannelMonitor(Vec<Sensor>);

/// The channels of one sensor.
#[derive(Clone, Debug)]
struct Sensor {
    last: [f64; 6],
    /// Time of the last change of each channel, s; minus infinity where it has not changed.
    changed_s: [f64; 6],
    time_s: f64,
    samples: u64,
}

/// The channels of one sensor that have not changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConstantChannels {
    /// Index of the sensor.
    pub sensor: usize,
    /// The channels, such as `force x`.
    pub channels: Vec<&'static str>,
    /// Whether all of these values are zero.
    pub is_zero: bool,
}

impl Sensor {
    /// Returns the channels that have not changed in the last `span_s` seconds and are zero, or are
    /// not.
    fn constant_channels(&self, span_s: f64, is_zero: bool) -> Vec<&'static str> {
        let begin_s = self.time_s - span_s;
        let is_constant = |channel: &usize| {
            self.changed_s[*channel] <= begin_s && (self.last[*channel] == 0.0) == is_zero
        };
        let constant = (0..WRENCH_CHANNELS.len()).filter(is_constant);
        constant.map(|channel| WRENCH_CHANNELS[channel]).collect()
    }
}

impl ConstantChannels {
    /// Creates the channels of a sensor of which `mask` is true.
    #[must_use]
    pub fn new(sensor: usize, mask: [bool; 6], is_zero: bool) -> Self {
        let channels = WRENCH_CHANNELS.into_iter().zip(mask);
        let channels = channels.filter_map(|(name, is_one)| is_one.then_some(name));
        Self {
            sensor,
            channels: channels.collect(),
            is_zero,
        }
    }

    /// Returns whether each of the six channels of the sensor is among these.
    #[must_use]
    pub fn mask(&self) -> [bool; 6] {
        WRENCH_CHANNELS.map(|channel| self.channels.contains(&channel))
    }
}

impl ChannelMonitor {
    /// Creates the monitor of so many sensors, none of which has had a sample.
    #[must_use]
    pub fn new(sensors: usize) -> Self {
        let sensor = Sensor {
            last: [0.0; 6],
            changed_s: [f64::NEG_INFINITY; 6],
            time_s: f64::NEG_INFINITY,
            samples: 0,
        };
        Self(vec![sensor; sensors])
    }

    /// Adds a sample of one sensor, by its index, at a time, s.
    pub fn push(&mut self, sensor: usize, time_s: f64, wrench: &Wrench) {
        let Some(sensor) = self.0.get_mut(sensor) else {
            return;
        };
        let values = wrench.force.iter().chain(&wrench.moment);
        for (channel, &value) in values.enumerate() {
            if sensor.samples > 0 && value != sensor.last[channel] {
                sensor.changed_s[channel] = time_s;
            }
            sensor.last[channel] = value;
        }
        sensor.time_s = time_s;
        sensor.samples += 1;
    }

    /// Returns the time at which a channel of a sensor last changed, s; minus infinity where none
    /// has.
    #[must_use]
    pub fn changed_s(&self, sensor: usize) -> f64 {
        let changed_s = self.0.get(sensor).map(|sensor| sensor.changed_s);
        let changed_s = changed_s.into_iter().flatten();
        changed_s.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the channels of each sensor that have not changed in its last `span_s` seconds, or,
    /// for an infinite span, in any of its samples, those that are zero apart from others. Sensors
    /// with fewer than 100 samples are left out.
    #[must_use]
    pub fn constant_channels(&self, span_s: f64) -> Vec<ConstantChannels> {
        let sensors = self.0.iter().enumerate();
        sensors
            .filter(|(_, sensor)| sensor.samples >= FEWEST_SAMPLES)
            .flat_map(|(index, sensor)| {
                [true, false].map(|is_zero| ConstantChannels {
                    sensor: index,
                    channels: sensor.constant_channels(span_s, is_zero),
                    is_zero,
                })
            })
            .filter(|constant| !constant.channels.is_empty())
            .collect()
    }
}
