//! Settings of active identification.

use crate::ExcitationError;
use crate::checks::{positive, value};

/// Settings of active identification.
#[derive(Clone, Debug, PartialEq)]
pub struct ActiveSettings {
    /// Largest half width of the 95 % intervals, as a fraction of the largest value of their kind
    /// (mass, centre of mass, inertia). Default: 0.01.
    pub within: f64,
    /// Number of spans of the splines in a plan. Default: 10.
    pub spans: usize,
    /// Number of spans after which the next plan begins, fewer than `spans`. Default: 6.
    pub followed_spans: usize,
    /// Duration of a span, s. Default: 0.15.
    pub span_s: f64,
    /// Motions that a plan is searched from, besides the rest of the previous one. Default: 2.
    pub starts: usize,
    /// Steps of the search in a plan. Default: 5.
    pub iterations: usize,
    /// Seed of the motions that the search starts from.
    pub seed: u64,
    /// Standard deviation of the white noise of one sample of each joint's velocity, rad/s or m/s,
    /// in the robot's order; empty where velocities are exact. An error of the acceleration, which
    /// is differentiated from velocities, is an error of the load of a heavy payload that can be
    /// far above the noise of a wrench sensor.
    pub velocity_noise: Vec<f64>,
}

impl Default for ActiveSettings {
    fn default() -> Self {
        Self {
            within: 0.01,
            spans: 10,
            followed_spans: 6,
            span_s: 0.15,
            starts: 2,
            iterations: 5,
            seed: 0,
            velocity_noise: Vec::new(),
        }
    }
}

impl ActiveSettings {
    /// Checks that the numbers are in their ranges.
    pub(super) fn check(&self) -> Result<(), ExcitationError> {
        positive("within", self.within)?;
        positive("span_s", self.span_s)?;
        let (spans, followed) = (self.spans as f64, self.followed_spans as f64);
        value("spans", spans, self.spans > 3, "at least four")?;
        let is_part = (1..self.spans).contains(&self.followed_spans);
        let expected = "from 1 to less than `spans`";
        value("followed_spans", followed, is_part, expected)?;
        for (joint, &noise) in self.velocity_noise.iter().enumerate() {
            let is_valid = noise >= 0.0 && noise.is_finite();
            let name = format!("velocity_noise[{joint}]");
            value(&name, noise, is_valid, "at least zero and finite")?;
        }
        Ok(())
    }
}
