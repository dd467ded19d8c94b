//! The load of a wrench sensor, as a recording shows it.

use nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_identify::contact::{Entries, Parts};
use tactid_identify::equations::Equation;
use tactid_identify::equations::window::{NOISE_BANDWIDTH, NOISE_CORRELATION, PRODUCT_CORRELATION};
use tactid_identify::solve::joint_covariance;
use tactid_identify::solve::students_widening;
use tactid_identify::solve::{LEVER_ARM_M, Vector};

use crate::fit::Fit;

/// What a recording says about all that its wrench sensors measure: the load, which is payload and
/// known tool, their offset and their noise. A recording is compensated with it.
///
/// The parameters are those of least squares, which need not be physically consistent. Wrenches are
/// those of all sensors together, in the frame of the estimate and about its origin, force, N, then
/// moment, N m, with the sign of wrenches that act on the payload.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoadEstimate {
    /// Linear parameters: mass, kg; first moments, kg m; inertia about the frame's origin, kg m²,
    /// (10,).
    pub parameters: [f64; 10],
    /// Offset of the wrenches, N and N m, (6,): zero where it was not among the unknowns.
    pub offset: [f64; 6],
    /// Joint covariance of parameters and offset, kg² to (N m)², (16, 16). It has no variance in
    /// directions that the motion does not determine.
    pub covariance: [[f64; 16]; 16],
    /// Changes of the parameters that the motion does not determine, (U, 10): each is as large as
    /// that of a body of this mass within 1 m of the frame's origin.
    pub unobservable: Vec<[f64; 10]>,
    /// Covariance of the noise of the wrench in one sample, N² to (N m)², (6, 6): of white noise
    /// that leaves the residuals of the fit.
    pub noise: [[f64; 6]; 6],
}

impl LoadEstimate {
    /// Returns what the estimate says about another recording: its load is uncertain in the
    /// directions that the motion of its own did not determine, and may have any share of them.
    #[must_use]
    pub fn of_another_recording(&self) -> Self {
        let mut covariance = SMatrix::<f64, 16, 16>::from(self.covariance);
        for change in &self.unobservable {
            let change = SVector::<f64, 10>::from(*change);
            let mut of_parameters = covariance.fixed_view_mut::<10, 10>(0, 0);
            of_parameters += change * change.transpose();
        }
        Self {
            covariance: covariance.into(),
            ..self.clone()
        }
    }

    /// Returns what a fit of equations says; `None` where its first channels are not those of a
    /// wrench. `merged` is the number of windows of which each equation is the mean.
    pub(crate) fn new(fit: &Fit, equations: &[Equation], merged: u32) -> Option<Self> {
        let of_window = fit.noise.wrench_covariance()?;
        let instants = equations.iter().map(|each| f64::from(each.instants));
        let instants = instants.sum::<f64>() / equations.len().max(1) as f64;
        // The noise of windows that are merged is correlated.
        let correlation = if merged > 1 { NOISE_CORRELATION } else { 1.0 };
        let widening = students_widening(equations.len() as f64 / PRODUCT_CORRELATION);
        let of_sample = instants / (NOISE_BANDWIDTH * correlation) * widening.powi(2);
        let offset = fit.offsets.map_or(Vector6::zeros(), |each| each.values);
        Some(Self {
            parameters: fit.parameters.into(),
            offset: offset.into(),
            covariance: joint_covariance(&fit.covariance, fit.offsets.as_ref(), 1.0).into(),
            unobservable: unobservable(fit),
            noise: (of_window * of_sample).into(),
        })
    }
}

/// Returns changes along the directions that a fit does not determine, of a plausible size.
fn unobservable(fit: &Fit) -> Vec<[f64; 10]> {
    let mass = fit.parameters[0].abs();
    let plausible = Vector::from_fn(|k, _| match k {
        0 => mass,
        1..4 => mass * LEVER_ARM_M,
        _ => mass * LEVER_ARM_M * LEVER_ARM_M,
    });
    let directions = fit.null_space.directions().iter();
    directions
        .map(|direction| {
            let change = direction.component_mul(fit.scales());
            let relative = change.component_div(&plausible).amax();
            (change / relative).into()
        })
        .collect()
}

/// A load that is subtracted from measured wrenches.
#[derive(Clone, Debug)]
pub(super) struct Load {
    parameters: Vector,
    offset: Vector6<f64>,
    covariance: SMatrix<f64, 16, 16>,
    /// Covariance of the noise in one sample.
    noise: Matrix6<f64>,
}

impl Load {
    pub(super) fn new(estimate: &LoadEstimate) -> Self {
        Self {
            parameters: estimate.parameters.into(),
            offset: estimate.offset.into(),
            covariance: estimate.covariance.into(),
            noise: estimate.noise.into(),
        }
    }

    /// Returns what the load leaves of the noise in entries.
    pub(super) fn noise_in(&self, noise: &Entries) -> Vector6<f64> {
        noise.measured() - noise.regressor() * self.parameters
    }

    /// Variances of the noise in one sample, as the recording of the load shows it.
    pub(super) fn noise_variances(&self) -> Vector6<f64> {
        self.noise.diagonal()
    }

    /// Returns what the load explains of mean entries, given the variance of the mean relative to
    /// that of one instant, and by what the standard deviations of the noise exceed those of white
    /// noise of the same size.
    pub(super) fn parts(
        &self,
        entries: &Entries,
        noise_power: f64,
        excess: &Vector6<f64>,
    ) -> Parts {
        let regressor = entries.regressor();
        let load = regressor * self.parameters;
        let mut both = SMatrix::<f64, 6, 16>::identity();
        both.fixed_columns_mut::<10>(0).copy_from(&regressor);
        both.fixed_columns_mut::<6>(10).fill_with_identity();
        let of_parameters = self.covariance.fixed_view::<10, 10>(0, 0);
        Parts {
            load,
            of_load: regressor * of_parameters * regressor.transpose(),
            contact: entries.measured() - self.offset - load,
            of_contact: both * self.covariance * both.transpose()
                + self.noise.component_mul(&(excess * excess.transpose())) * noise_power,
        }
    }
}
