//! Channels of wrench sensors that never change: a channel that is dead biases the estimate without large residuals.

use tactid_dynamics::Wrench;

/// Fewest samples from which a channel counts as constant.
const FEWEST_SAMPLES: u64 = 100;

/// Names of the channels of a wrench.
const CHANNELS: [&str; 6] = [
    "force x", "force y", "force z", "moment x", "moment y", "moment z",
];

/// Which channels of each sensor have changed so far.
#[derive(Clone, Debug)]
pub struct ConstantChannels(Vec<Sensor>);

/// The channels of one sensor.
#[derive(Clone, Debug, Default)]
struct Sensor {
    first: [f64; 6],
    has_changed: [bool; 6],
    samples: u64,
}

/// The channels of one sensor that have had the same value in all samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constants {
    /// Index of the sensor.
    pub sensor: usize,
    /// The channels, such as `force x`.
    pub channels: Vec<&'static str>,
    /// Whether all of these values are zero.
    pub is_zero: bool,
}

impl ConstantChannels {
    /// Creates the record for so many sensors, none of which has had a sample.
    #[must_use]
    pub fn new(sensors: usize) -> Self {
        Self(vec![Sensor::default(); sensors])
    }

    /// Notes a sample of one sensor, by its index.
    pub fn push(&mut self, sensor: usize, wrench: &Wrench) {
        let Some(sensor) = self.0.get_mut(sensor) else {
            return;
        };
        let values = wrench.force.iter().chain(&wrench.moment);
        for (channel, &value) in values.enumerate() {
            if sensor.samples == 0 {
                sensor.first[channel] = value;
            }
            sensor.has_changed[channel] |= value != sensor.first[channel];
        }
        sensor.samples += 1;
    }

    /// Returns the constant channels of each sensor that has some and has had at least 100 samples.
    #[must_use]
    pub fn constants(&self) -> Vec<Constants> {
        let sensors = self.0.iter().enumerate();
        sensors
            .filter(|(_, sensor)| sensor.samples >= FEWEST_SAMPLES)
            .filter_map(|(index, sensor)| {
                let constant = (0..6).filter(|&channel| !sensor.has_changed[channel]);
                let constant: Vec<usize> = constant.collect();
                (!constant.is_empty()).then(|| Constants {
                    sensor: index,
                    channels: constant.iter().map(|&channel| CHANNELS[channel]).collect(),
                    is_zero: constant.iter().all(|&channel| sensor.first[channel] == 0.0),
                })
            })
            .collect()
    }
}
