//! What a batch of equations shows about the assumptions of an identification.

use nalgebra::SVector;
use tactid_dynamics::InertialParameters;

use super::fit::{Fit, FitOptions};
use super::least_squares;
use super::suspicions::{CONTRADICTION, suspected_offset, suspected_signs};
use super::unexplained::unexplained_load;
use crate::equations::{Equation, EquationStream};
use crate::finding::Finding;
use crate::solve::BoundingBox;
use crate::solve::consistency::project;

/// Returns what equations of a stream show about its assumptions without any prior knowledge, and what is wrong in the
/// robot's description. `gripper` is the known part of the identified body. Without enough equations there are only the
/// findings of the description.
///
/// Cost: several fits, each of up to 20 passes over all equations.
pub(crate) fn findings_without_knowledge(
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
    match project(&parameters, &fit.covariance, fit.scales(), bounding_box) {
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
/// `known_kg`.
pub(crate) fn data_findings(
    equations: &[Equation],
    fit_without_mass: &Fit,
    fit: &Fit,
    stream: &EquationStream,
    known_kg: f64,
) -> Vec<Finding> {
    let (channels, gravity, method) = (stream.channels(), stream.gravity(), stream.method());
    // A known mass would hide a wrong sign, and a wrong one would look like an offset.
    let mut findings = suspected_signs(
        equations,
        fit_without_mass,
        &channels,
        &gravity,
        known_kg,
        method,
    );
    let is_gravity = |finding: &Finding| matches!(finding, Finding::GravityContradicted { .. });
    let may_be_offset = stream.has_sensors() && method.uses_wrench() && channels.offsets == 0;
    if may_be_offset && !findings.iter().any(is_gravity) {
        let frame = stream.offset_frame();
        findings.extend(suspected_offset(
            equations,
            fit_without_mass,
            &channels,
            frame,
        ));
    }
    if findings.is_empty() {
        // Otherwise the error of the model has a name.
        findings.extend(unexplained_load(
            equations,
            fit_without_mass,
            &channels,
            method,
        ));
    }
    let windows = equations.len();
    let outliers = (0..windows).filter(|&k| fit.is_outlier(k)).count();
    if outliers > 0 {
        findings.push(Finding::Outliers { outliers, windows });
    }
    findings
}
