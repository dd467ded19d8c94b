//! What acts on the payload from outside: the measured wrench less what the sensor's zero and the
//! load explain.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::{Matrix6, Vector6};

use super::least_squares::OnlineLeastSquares;
use super::noise_tracker::{INITIAL_WINDOWS, MEMORY_WINDOWS};
use super::trusted::JointEstimate;
use crate::contact::{ContactState, Entries, LoadAndContact, Parts, WrenchFrame};
use crate::equations::window::{NOISE_BANDWIDTH, PRODUCT_CORRELATION};
use crate::equations::{Equation, Model, WRENCH};
use crate::solve::offsets::WrenchNoise;
use crate::solve::uncertainty::students_widening;
use crate::solve::weights::rare_distance;

/// Low-pass of fourth order with equal time constants, causal, for samples at any times. Its order
/// suppresses the noise of accelerations, which grows with frequency.
#[derive(Clone, Debug)]
struct LowPass {
    time_constant_s: f64,
    /// Outputs of the stages, one after the other.
    stages: [Entries; 4],
    /// Time of the last instant, s; `None` before the first.
    last_s: Option<f64>,
    /// Gain of a stage for the last instant.
    gain: f64,
    /// Time between the last two instants, s.
    period_s: f64,
}

impl LowPass {
    /// Creates a low-pass that has lost 3 dB at a frequency, Hz.
    fn new(cutoff_hz: f64) -> Self {
        Self {
            time_constant_s: (SQRT_2.sqrt() - 1.0).sqrt() / (TAU * cutoff_hz),
            stages: [Entries::zeros(); 4],
            last_s: None,
            gain: 1.0,
            period_s: 0.0,
        }
    }

    fn push(&mut self, time_s: f64, entries: &Entries) {
        let Some(last_s) = self.last_s.replace(time_s) else {
            self.stages = [*entries; 4];
            return;
        };
        self.period_s = time_s - last_s;
        self.gain = -(-self.period_s / self.time_constant_s).exp_m1();
        let mut input = *entries;
        for stage in &mut self.stages {
            stage.0 += (input.0 - stage.0) * self.gain;
            input = *stage;
        }
    }

    fn output(&self) -> &Entries {
        &self.stages[3]
    }

    /// Delay of what changes slowly, s.
    fn delay_s(&self) -> f64 {
        4.0 * self.period_s * (1.0 - self.gain) / self.gain
    }

    /// Variance of filtered white noise relative to that of one instant.
    fn noise_power(&self) -> f64 {
        // The impulse response is gain⁴ C(n + 3, 3) (1 - gain)ⁿ.
        let x = (1.0 - self.gain).powi(2);
        self.gain.powi(8) * (1.0 + x * (9.0 + x * (9.0 + x))) / (1.0 - x).powi(7)
    }
}

/// Filters the measured wrench together with the motion, and compares it with the load.
///
/// Both pass the same low-pass, so that a load cancels whatever the filter does, and it does so for
/// any estimate: one that changes leaves no transient behind.
#[derive(Clone, Debug)]
pub(crate) struct ContactObserver {
    filter: LowPass,
    /// Covariance of what noise leaves of the filtered wrench, N and N m, in the tool frame, and
    /// the number of windows that it was estimated from.
    noise: Matrix6<f64>,
    windows: f64,
    /// Projection of a wrench in the tool frame onto the channels that are measured; `None` where
    /// all are.
    projection: Option<Matrix6<f64>>,
}

impl ContactObserver {
    pub(crate) fn new(cutoff_hz: f64, projection: Option<Matrix6<f64>>) -> Self {
        Self {
            projection,
            filter: LowPass::new(cutoff_hz),
            noise: Matrix6::zeros(),
            windows: 0.0,
        }
    }

    /// Discards the instants so far: a new stretch begins.
    pub(crate) fn start_stretch(&mut self) {
        self.filter.last_s = None;
    }

    /// Adds the measurements at an instant.
    pub(crate) fn push(&mut self, time_s: f64, model: &Model) {
        if let Some(entries) = Entries::of_instant(model, &self.filter.stages[0]) {
            self.filter.push(time_s, &entries);
        }
    }

    /// Updates the noise after a window that shows it, where nothing contradicts the estimate.
    pub(crate) fn observe_noise(&mut self, equation: &Equation, estimator: &OnlineLeastSquares) {
        let weight = estimator.noise_weight();
        let Some(estimate) = estimator.trusted().filter(|_| estimator.is_settled()) else {
            return;
        };
        let Some(noise) = estimator.wrench_noise() else {
            return;
        };
        if self.windows == 0.0 {
            let samples = f64::from(equation.instants) / NOISE_BANDWIDTH;
            self.noise = noise.covariance * (samples * self.filter.noise_power());
            self.windows = INITIAL_WINDOWS as f64;
        }
        if let Some(parts) = self.parts(estimate, &noise) {
            self.windows = (self.windows + weight).min(MEMORY_WINDOWS);
            // The first window of a contact or of a payload change contradicts nothing yet.
            let clip = (rare_distance(WRENCH) / parts.distance()).min(1.0);
            let product = parts.contact * parts.contact.transpose() * clip;
            self.noise += (product - self.noise) * (weight / self.windows);
        }
    }

    /// Time to which the filtered wrench belongs, s; `None` before the first instant.
    pub(crate) fn time_s(&self) -> Option<f64> {
        Some(self.filter.last_s? - self.filter.delay_s())
    }

    fn parts(&self, estimate: &JointEstimate, noise: &WrenchNoise) -> Option<Parts> {
        self.filter.last_s?;
        let filtered = self.filter.output();
        let regressor = filtered.regressor();
        let load = regressor * estimate.parameters;
        let offset = estimate
            .offsets
            .map_or(Vector6::zeros(), |offsets| offsets.values);
        let widening = students_widening(self.windows / PRODUCT_CORRELATION);
        let rest = filtered.measured() - offset - load;
        Some(Parts {
            load,
            of_load: regressor * estimate.covariance * regressor.transpose(),
            contact: self.projection.map_or(rest, |measured| measured * rest),
            of_contact: self.noise * (widening.powi(2) * noise.factor)
                + estimate.covariance_of_load(&regressor),
        })
    }

    /// Returns the wrench of the load and that of the contact in a frame; `None` before the
    /// estimate of the load has settled for the first time. `is_held` says that the payload cannot
    /// have changed.
    pub(crate) fn wrenches(
        &self,
        estimator: &OnlineLeastSquares,
        frame: &WrenchFrame,
        is_held: bool,
    ) -> Option<LoadAndContact> {
        let mut parts = self.parts(estimator.trusted()?, &estimator.wrench_noise()?)?;
        let is_rare = parts.distance() > rare_distance(WRENCH);
        let mut state = ContactState::Settled;
        let is_doubtful = is_rare || !estimator.is_settled();
        if !estimator.detects_changes() || (is_doubtful && !is_held) {
            state = ContactState::Changing;
            let ambiguity = parts.contact * parts.contact.transpose();
            parts.of_load += ambiguity;
            parts.of_contact += ambiguity;
        }
        let map = self.filter.output().map_to(frame);
        let projection = self.projection.as_ref();
        Some(parts.mapped(&map, projection, self.time_s()?, state))
    }
}
