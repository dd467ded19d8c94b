//! Channels of wrench sensors that never change: a channel that is dead biases the estimate without large residuals.

use tactid_dynamics::Wrench;

use crate::Finding;
use crate::recording::Sources;

/// Fewest samples from which a channel counts as constant.
const FEWEST_SAMPLES: u64 = 100;

/// Names of the channels of a wrench.
const CHANNELS: [&str; 6] = [
    "force x", "force y", "force z", "moment x", "moment y", "moment z",
];

/// Which channels of each sensor have changed so far.
pub(crate) struct ConstantChannels(Vec<Sensor>);

/// The channels of one sensor.
#[derive(Clone, Default)]
struct Sensor {
    first: [f64; 6],
    has_changed: [bool; 6],
    samples: u64,
}

impl ConstantChannels {
    pub(crate) fn new(sensors: usize) -> Self {
        Self(vec![Sensor::default(); sensors])
    }

    /// Notes a sample of one sensor.
    pub(crate) fn push(&mut self, sensor: usize, wrench: &Wrench) {
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

    /// Reports the channels of each sensor that never changed.
    pub(crate) fn findings(&self, sources: &Sources) -> Vec<Finding> {
        let named = sources.wrench_names.iter().zip(&sources.sensors);
        let sensors = self.0.iter().zip(named);
        sensors
            .filter(|(sensor, _)| sensor.samples >= FEWEST_SAMPLES)
            .filter_map(|(sensor, (source, frame))| {
                let constant = (0..6).filter(|&channel| !sensor.has_changed[channel]);
                let constant: Vec<usize> = constant.collect();
                (!constant.is_empty()).then(|| Finding::ConstantChannels {
                    source: source.clone(),
                    frame: frame.clone(),
                    is_zero: constant.iter().all(|&channel| sensor.first[channel] == 0.0),
                    channels: constant.iter().map(|&channel| CHANNELS[channel]).collect(),
                })
            })
            .collect()
    }
}
