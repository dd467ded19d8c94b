//! What equations show about the assumptions of an identification.

mod known_mass;
mod offset;
mod residuals;
mod signs;
mod unexplained;

use nalgebra::{SMatrix, SVector};
use tactid_dynamics::InertialParameters;

pub(crate) use self::known_mass::{mass_finding, without_repetition};
use self::offset::{better_with_offset, has_significant_component};
pub(crate) use self::signs::nothing_held;
use self::signs::sign_findings;
use self::unexplained::unexplained_load;
use crate::equations::{Equation, EquationStream};
use crate::finding::Finding;
use crate::fit::{Fit, FitOptions, least_squares};
use crate::solve::BoundingBox;
use crate::solve::consistency::project;

/// Distance in standard deviations from which a contradiction is reported.
pub(crate) const CONTRADICTION: f64 = 5.0;

/// Returns what equations of a stream show about its assumptions without any prior information, and what is wrong in the
/// robot's description. `gripper` is the known part of the identified body. Without enough equations there are only the
/// findings of the description.
///
/// Cost: several fits, each of up to 20 passes over all equations.
pub(crate) fn findings_without_prior(
    equations: &[Equation],
    stream: &EquationStream,
    gripper: Option<InertialParameters>,
) -> Vec<Finding> {
    let channels = stream.channels();
    let Some(fit) = least_squares::fit(equations, FitOptions::new(&channels)) else {
        return stream.model_findings();
    };
    let known = gripper.map_or(SVector::zeros(), |gripper| *gripper.as_vector());
    let (_, inconsistent) = consistent_payload(&fit, &known, None);
    let mut findings: Vec<Finding> = inconsistent.into_iter().collect();
    findings.extend(data_findings(equations, &fit, &fit, stream, known[0]));
    findings.extend(stream.model_findings());
    findings
}

/// Projects the payload's parameters onto physically consistent ones, and reports where these are far away. `known` are
/// the parameters of the known bodies that the fit contains.
pub(crate) fn consistent_payload(
    fit: &Fit,
    known: &SVector<f64, 10>,
    bounding_box: Option<&BoundingBox>,
) -> (SVector<f64, 10>, Option<Finding>) {
    let parameters = fit.parameters - known;
    consistent_parameters(parameters, &fit.metric, fit.scales(), bounding_box)
}

/// Projects the parameters of a payload onto physically consistent ones, and reports where these are far away. `scales` are
/// units in which their standard deviations are of similar size.
pub(crate) fn consistent_parameters(
    parameters: SVector<f64, 10>,
    covariance: &SMatrix<f64, 10, 10>,
    scales: &SVector<f64, 10>,
    bounding_box: Option<&BoundingBox>,
) -> (SVector<f64, 10>, Option<Finding>) {
    match project(&parameters, covariance, scales, bounding_box) {
        None => (parameters, None),
        Some(projection) => {
            let finding = Finding::Inconsistent {
                distance: projection.distance,
                within_box: bounding_box.is_some(),
            };
            let is_far = projection.distance > CONTRADICTION;
            (projection.parameters, is_far.then_some(finding))
        }
    }
}

/// Returns findings about signs, offsets, errors of the model and outliers, and about the mass of the known bodies,
/// `known_bodies_kg`.
pub(crate) fn data_findings(
    equations: &[Equation],
    fit_without_mass: &Fit,
    fit: &Fit,
    stream: &EquationStream,
    known_bodies_kg: f64,
) -> Vec<Finding> {
    // A known mass would hide a wrong sign, and a wrong one would look like an offset.
    let mut findings = model_findings(equations, fit_without_mass, stream, known_bodies_kg);
    let windows = equations.len();
    let outliers = (0..windows).filter(|&k| fit.is_outlier(k)).count();
    if outliers > 0 {
        findings.push(Finding::Outliers { outliers, windows });
    }
    findings
}

/// Returns findings about signs, offsets and errors of the model. One cause has one finding: an offset is not reported
/// where the mass stays negative with it, nor where the model does not explain the load with it either.
fn model_findings(
    equations: &[Equation],
    given: &Fit,
    stream: &EquationStream,
    known_bodies_kg: f64,
) -> Vec<Finding> {
    let (channels, gravity, method) = (stream.channels(), stream.gravity(), stream.method());
    let mut findings = sign_findings(
        equations,
        given,
        &channels,
        &gravity,
        known_bodies_kg,
        method,
    );
    let is_gravity = |finding: &Finding| matches!(finding, Finding::GravityContradicted { .. });
    if findings.iter().any(is_gravity) {
        return findings;
    }
    let may_be_offset = stream.has_sensors() && method.uses_wrench() && channels.offsets == 0;
    let with_offset = may_be_offset
        .then(|| better_with_offset(equations, given, &channels))
        .flatten();
    let best = with_offset.as_ref().unwrap_or(given);
    if let Some(finding) = unexplained_load(equations, best, &channels, method) {
        findings.push(finding);
    } else if let Some(fit) = with_offset
        && fit.parameters[0] >= 0.0
    {
        let offset = fit
            .wrench_offset(stream.offset_frame())
            .filter(has_significant_component);
        findings.extend(offset.map(|offset| Finding::OffsetSuspected { offset }));
    }
    findings
}
