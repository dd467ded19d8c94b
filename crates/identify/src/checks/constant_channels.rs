//! Channels of wrench sensors that never change: a channel that is dead biases the estimate without large residuals.

use tactid_dynamics::Wrench;

/// Fewest samples from which a channel counts as constant, and after which no equation at all is reported.
pub(crate) const FEWEST_SAMPLES: u64 = 100;

/// Names of the channels of a wrench.
const CHANNELS: [&str; 6] = [
    "force x", "force y", "force z", "moment x", "moment y", "moment z",
];

/// When each channel of some wrench sensors last changed.
#[derive(Clone, Debug)]
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

    /// Returns the channels of each sensor that have not changed in its last `span_s` seconds, or, for an infinite
    /// span, in any of its samples. Sensors with fewer than 100 samples are left out.
    #[must_use]
    pub fn constant_channels(&self, span_s: f64) -> Vec<ConstantChannels> {
        let sensors = self.0.iter().enumerate();
        sensors
            .filter(|(_, sensor)| sensor.samples >= FEWEST_SAMPLES)
            .filter_map(|(index, sensor)| {
                let begin_s = sensor.time_s - span_s;
                let constant = (0..6).filter(|&channel| sensor.changed_s[channel] <= begin_s);
                let constant: Vec<usize> = constant.collect();
                (!constant.is_empty()).then(|| ConstantChannels {
                    sensor: index,
                    channels: constant.iter().map(|&channel| CHANNELS[channel]).collect(),
                    is_zero: constant.iter().all(|&channel| sensor.last[channel] == 0.0),
                })
            })
            .collect()
    }
}
