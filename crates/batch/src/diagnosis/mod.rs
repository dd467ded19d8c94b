//! What equations show about the assumptions of an identification.

mod known_mass;
mod residuals;
mod signs;
mod unexplained;

use nalgebra::{SMatrix, SVector};
use tactid_identify::equations::{Equation, EquationStream};
use tactid_identify::solve::project;
use tactid_identify::{BoundingBox, KnownBodies};

pub use self::known_mass::{mass_finding, without_repetition};
pub(crate) use self::signs::mass_findings;
pub use self::signs::nothing_held;
use self::signs::sign_findings;
use self::unexplained::unexplained_load;
pub use crate::finding::CONTRADICTION;
use crate::finding::Finding;
use crate::fit::further::FurtherValues;
use crate::fit::{Fit, FitOptions, least_squares};
use crate::hypotheses::{Explanation, explanation};

/// Distance of a value from zero in standard deviations up to which it may be zero: exceeded by
/// chance once in 370.
pub(crate) const SIGNIFICANT: f64 = 3.0;

/// Determinant of the residuals' covariance, or their mean square, relative to that with the
/// configured gravity, below which another gravity explains the load far better: the standard
/// deviation shrinks to one half or less in one direction of the channels.
pub(crate) const FAR_BETTER: f64 = 0.25;

/// Distance in standard deviations up to which a consistent body is plausible: about the half-width
/// of a 95 % interval.
const PLAUSIBLE: f64 = 2.0;

/// Fewest windows whose residuals show what is wrong. Of cuts of 4 to 8 windows of a sound
/// recording a quarter contradict some assumption, because the noise of their regressors, and so
/// its bias, is hardly known; of 10 or more none did (`tests/python/test_short_recordings.py`).
pub const LEAST_WINDOWS: usize = 10;

/// Returns what equations of a stream show about its assumptions without any prior information, and
/// what is wrong in the robot's description. `gripper` is the known part of the identified body.
/// Without enough equations there are only the findings of the description.
///
/// Cost: several fits, each of up to 20 passes over all equations.
pub(crate) fn findings_without_prior(
    equations: &[Equation],
    stream: &EquationStream,
    known: &KnownBodies,
) -> Vec<Finding> {
    let of_model = stream.model_findings().into_iter().map(Finding::Model);
    let channels = stream.channels();
    let Some(fit) = least_squares::fit(equations, FitOptions::new(&channels)) else {
        return of_model.collect();
    };
    let consistent = consistent_payload(&fit, known, None);
    let mut findings: Vec<Finding> = consistent.contradiction.into_iter().collect();
    let explanation = wrong_assumptions(equations, &fit, None, stream);
    findings.extend(data_findings(
        [equations; 2],
        &fit,
        &fit,
        stream,
        known.mass_kg(),
        explanation.as_ref(),
        false,
    ));
    findings.extend(of_model);
    findings
}

/// The parameters of the physically consistent body that is nearest to an estimate.
pub struct ConsistentPayload {
    /// The parameters of this body.
    pub parameters: SVector<f64, 10>,
    /// The finding that the body is far away: the estimate has errors besides the noise.
    pub contradiction: Option<Finding>,
    /// Factor on the standard deviations with which the distance is plausible; 1 where it is
    /// already.
    pub widening: f64,
}

/// Returns the physically consistent payload that is nearest to a fit, which contains the `known`
/// bodies.
pub(crate) fn consistent_payload(
    fit: &Fit,
    known: &KnownBodies,
    bounding_box: Option<&BoundingBox>,
) -> ConsistentPayload {
    let of_load = fit.metric + fit.gain_covariance();
    let (parameters, covariance) = known.payload(&fit.parameters, &of_load, fit.known_mass);
    let covariance = fit.null_space.across(&covariance);
    nearest_consistent(parameters, &covariance, fit.scales(), bounding_box)
}

/// Returns the physically consistent payload that is nearest to an estimate. `scales` are units of
/// the parameters in which their standard deviations are of similar size.
pub fn nearest_consistent(
    parameters: SVector<f64, 10>,
    covariance: &SMatrix<f64, 10, 10>,
    scales: &SVector<f64, 10>,
    bounding_box: Option<&BoundingBox>,
) -> ConsistentPayload {
    let projection = project(&parameters, covariance, scales, bounding_box);
    let distance = projection.map_or(0.0, |found| found.distance);
    let is_far = distance > CONTRADICTION;
    ConsistentPayload {
        parameters: projection.map_or(parameters, |found| found.parameters),
        contradiction: is_far.then_some(Finding::Inconsistent {
            distance,
            within_box: bounding_box.is_some(),
        }),
        widening: (distance / PLAUSIBLE).max(1.0),
    }
}

/// Returns the wrong assumptions about a wrench sensor and the motion that explain what a fit, with
/// the values of its further unknowns, leaves unexplained; `None` where there is no sensor, or
/// where nothing is unexplained.
pub(crate) fn wrong_assumptions(
    equations: &[Equation],
    fit: &Fit,
    values: Option<&FurtherValues>,
    stream: &EquationStream,
) -> Option<Explanation> {
    if !stream.measures_wrench() {
        return None;
    }
    explanation(equations, fit, values, stream)
}

/// Returns findings about wrong assumptions, signs, errors of the model and outliers, and about the
/// mass of the known bodies with its standard deviation, `known_bodies_kg`. The equations are those
/// of the recording and those of the fits, which lack what further unknowns explain. Where all that
/// they leave `is_noise`, no load is reported as unexplained.
pub(crate) fn data_findings(
    equations: [&[Equation]; 2],
    fit_without_mass: &Fit,
    fit: &Fit,
    stream: &EquationStream,
    known_bodies_kg: (f64, f64),
    explanation: Option<&Explanation>,
    is_noise: bool,
) -> Vec<Finding> {
    // A known mass would hide a wrong sign, and a wrong one would look like an offset.
    let mut findings = model_findings(
        equations,
        fit_without_mass,
        stream,
        known_bodies_kg,
        explanation,
        is_noise,
    );
    let windows = equations[0].len();
    if windows < LEAST_WINDOWS {
        findings = without_causes(findings, windows);
    }
    let outliers = (0..windows).filter(|&k| fit.is_outlier(k)).count();
    if outliers > 0 {
        findings.push(Finding::Outliers { outliers, windows });
    }
    findings
}

/// Replaces what so few windows cannot show by one finding that they are too few.
fn without_causes(mut findings: Vec<Finding>, windows: usize) -> Vec<Finding> {
    let count = findings.len();
    findings.retain(|finding| {
        matches!(
            finding,
            Finding::NothingHeld { .. } | Finding::KnownBodiesTooHeavy { .. }
        )
    });
    if findings.len() < count {
        let least_windows = LEAST_WINDOWS;
        findings.push(Finding::TooFewWindows {
            windows,
            least_windows,
        });
    }
    findings
}

/// Returns findings about wrong assumptions, signs and errors of the model. A load that wrong
/// assumptions explain is not reported as unexplained, nor residuals of which the caller knows that
/// all `is_noise`. Where wrong assumptions leave more than half of the residuals, the unexplained
/// load comes first. Where a load is unexplained, a mass of zero does not show that nothing is held.
fn model_findings(
    equations: [&[Equation]; 2],
    given: &Fit,
    stream: &EquationStream,
    known_bodies_kg: (f64, f64),
    explanation: Option<&Explanation>,
    is_noise: bool,
) -> Vec<Finding> {
    let (channels, gravity, method) = (stream.channels(), stream.gravity(), stream.method());
    let is_explained = is_noise || explanation.is_some_and(|found| found.explains_load);
    let unexplained = (!is_explained)
        .then(|| unexplained_load(equations, given, &channels, method))
        .flatten();
    let causes = explanation.map_or(&[][..], |found| &found.causes);
    let Some(first) = causes.first() else {
        return sign_findings(
            equations[1],
            given,
            &channels,
            &gravity,
            known_bodies_kg,
            method,
            unexplained,
        );
    };
    let mass = (first.mass_kg, first.mass_std_dev_kg);
    let of_mass = mass_findings(mass, known_bodies_kg, method, false);
    let is_reported = |finding: &Finding| {
        unexplained.is_none() || !matches!(finding, Finding::NothingHeld { .. })
    };
    let of_mass = of_mass.filter(is_reported);
    let causes = causes.iter().cloned().map(Finding::WrongAssumption);
    let is_first = explanation.is_some_and(|found| !found.explains_most);
    let (before, after) = if is_first {
        (unexplained.clone(), None)
    } else {
        (None, unexplained.clone())
    };
    let found = before.into_iter().chain(causes).chain(of_mass);
    found.chain(after).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use tactid_dynamics::MassProperties;

    use super::*;

    /// A body whose greatest moment of inertia exceeds the sum of the others is brought back by so
    /// many standard deviations. Beyond two of them the standard deviations grow, and beyond five
    /// it is a contradiction.
    #[test]
    fn a_contradiction_widens_until_it_is_plausible() {
        let estimate = |excess: f64| {
            let body = MassProperties {
                mass_kg: 1.0,
                center_of_mass: Vector3::zeros(),
                inertia: Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 0.03 + excess)),
            };
            *tactid_dynamics::InertialParameters::from(body).as_vector()
        };
        let std_dev: f64 = 1e-4;
        let covariance = SMatrix::identity() * std_dev.powi(2);
        let scales = SVector::repeat(std_dev);
        for (excess, is_far) in [(-0.001, false), (3e-4, false), (7e-4, false), (0.002, true)] {
            let found = nearest_consistent(estimate(excess), &covariance, &scales, None);
            // The nearest body shares the excess among the three moments.
            let distance = excess.max(0.0) / std_dev / 3f64.sqrt();
            let moved = (found.parameters - estimate(excess)).norm() / std_dev;
            assert!((moved - distance).abs() < 0.01, "{moved} {distance}");
            assert_eq!(found.contradiction.is_some(), is_far);
            let expected = (moved / 2.0).max(1.0);
            assert!(
                (found.widening - expected).abs() < 1e-3,
                "{}",
                found.widening
            );
        }
    }
}
