//! The fits behind a result: to windows of the smoothed motion, and to the motion itself.

use nalgebra::SMatrix;
use tactid_identify::equations::Equation;
use tactid_identify::{IdentifyError, KnownBodies, KnownMass, PayloadEstimate, values_of_body};

use super::{BatchIdentifier, Solution};
use crate::HistoryPoint;
use crate::fit::{Delay, Fit, FitOptions, least_squares};
use crate::history::history;
use crate::other_load::{Parts, leave_out};
use crate::trajectory::{MotionEstimate, choose};

/// Fits of a recording.
pub(super) struct Fits<'a> {
    /// Fits to windows, without a known mass and with it.
    of_windows: [&'a Fit; 2],
    /// The same fits where the motion was estimated with the payload.
    of_motion: Option<[Fit; 2]>,
    pub(super) motion: MotionEstimate,
}

impl Fits<'_> {
    /// The fit that is reported.
    pub(super) fn of_all(&self) -> &Fit {
        let of_motion = self.of_motion.as_ref();
        of_motion.map_or(self.of_windows[1], |fits| &fits[1])
    }

    /// The fit that is reported where no mass is known.
    pub(super) fn without_mass(&self) -> &Fit {
        let of_motion = self.of_motion.as_ref();
        of_motion.map_or(self.of_windows[0], |fits| &fits[0])
    }
}

/// Returns a fit of the motion and the parameters with the mass of the whole load as one more row,
/// with the scales and the weights of the fit to windows that has this row.
fn with_mass(free: &Fit, of_windows: &Fit, mass: KnownMass) -> Fit {
    let variance = mass.std_dev_kg.powi(2);
    let gain = free.metric.column(0) / (free.metric[(0, 0)] + variance);
    let mut rest = SMatrix::<f64, 10, 10>::identity();
    rest.column_mut(0).axpy(-1.0, &gain, 1.0);
    let of_mass = gain * gain.transpose() * variance;
    let of = |covariance: &SMatrix<f64, 10, 10>| rest * covariance * rest.transpose() + of_mass;
    Fit {
        parameters: free.parameters + gain * (mass.mass_kg - free.parameters[0]),
        covariance: of(&free.covariance),
        metric: of(&free.metric),
        independent: free.independent,
        ..of_windows.clone()
    }
}

impl BatchIdentifier {
    /// Estimates the motion together with the payload where that is more precise than the fits to
    /// windows, and the fit shows nothing unknown beside the payload.
    pub(super) fn fits<'a>(
        &self,
        solution: &'a Solution<'_>,
        with_known_mass: Option<&'a Fit>,
    ) -> Fits<'a> {
        let fit = &solution.found.fit;
        let windows = fit.weights.len();
        let causes = solution.explanation.as_ref();
        let causes = causes.map_or(&[][..], |found| &found.causes);
        let is_plain = fit.null_space.directions().is_empty()
            && solution.channels.offsets == 0
            && solution.other_load.is_none()
            && causes.is_empty()
            && !(0..windows).any(|window| fit.is_outlier(window));
        let found = if is_plain {
            let mut bins = self.bins.clone();
            // Where no more samples are taken, the open bin has one alone.
            if !bins.is_full() {
                bins.finish();
            }
            let smoothed = (&fit.parameters, &fit.covariance);
            choose(&bins, self.stream.model(), smoothed)
        } else {
            Err(MotionEstimate::Smoothed)
        };
        let motion = found.as_ref().err().copied();
        let of_motion = found.ok().map(|found| {
            let free = Fit {
                parameters: found.parameters,
                covariance: found.covariance,
                metric: found.metric,
                bread: found.of_white_noise,
                independent: found.freedom,
                ..fit.clone()
            };
            let with_mass =
                with_known_mass.and_then(|fit| Some(with_mass(&free, fit, fit.known_mass?)));
            [free.clone(), with_mass.unwrap_or(free)]
        });
        Fits {
            of_windows: [fit, with_known_mass.unwrap_or(fit)],
            of_motion,
            motion: motion.unwrap_or(MotionEstimate::WithPayload),
        }
    }

    /// Fits the parameters with the mass of the payload, where that is known.
    pub(super) fn with_known_mass(
        &self,
        solution: &Solution<'_>,
        known: &KnownBodies,
    ) -> Result<Option<Fit>, IdentifyError> {
        let Some(mass) = self.settings.known_mass else {
            return Ok(None);
        };
        let options = FitOptions {
            known_mass: Some(known.mass_of_load(mass)),
            used: solution.other_load.map(Parts::is_rest),
            ..solution.found.values.options(&solution.channels)
        };
        let equations = &solution.found.equations;
        let fit = least_squares::fit(equations, options);
        let mut fit = fit.ok_or_else(|| self.stream.too_few_windows(equations.len()))?;
        leave_out(solution.other_load, &mut fit);
        Ok(Some(fit))
    }

    /// Returns the estimate over time, whose last point is the `result`.
    pub(super) fn history(
        &self,
        equations: &[Equation],
        fits: &Fits<'_>,
        known: &KnownBodies,
        result: &PayloadEstimate,
    ) -> Vec<HistoryPoint> {
        let bounding_box = self.settings.bounding_box.as_ref();
        let with_motion = fits.of_motion.is_some();
        // The factors that widen a result are those of its own fit.
        let of_result = (!with_motion).then_some(&result.std_devs);
        let mut points = history(
            equations,
            fits.of_windows[1],
            known,
            bounding_box,
            of_result,
        );
        if let Some(last) = points.last_mut().filter(|_| with_motion) {
            (last.values, last.std_devs) = (values_of_body(&result.body), result.std_devs);
        }
        points
    }

    /// Estimates the delay of the load with the weights of a fit without it.
    pub(super) fn remaining_delay(&self, solution: &Solution<'_>) -> Option<Delay> {
        if !self.settings.delay {
            return None;
        }
        let found = &solution.found;
        let options = found.values.options(&solution.channels);
        let delay = least_squares::delay(&found.equations, &found.fit, options);
        delay.filter(|delay| delay.delay_s.is_finite())
    }
}
