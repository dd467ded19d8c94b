//! The inertial parameters of a link. Whatever its `<inertial>` lacks is reported and never refused.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::element::Element;
use super::numbers::{number, rotation, translation};
use crate::inertia::impossible_moments;
use crate::{
    InertialParameters, MassProperties, ModelFinding, symmetric_entries, symmetric_matrix,
};

/// Attributes of `<inertia>`.
pub(super) const ENTRIES: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];

/// Returns the inertial parameters of a link in the link's frame, zero for a link without `<inertial>`, and what is
/// wrong with them.
pub(super) fn link_parameters(
    name: &str,
    link: &Element,
) -> (InertialParameters, Vec<ModelFinding>) {
    let Some(inertial) = link.child("inertial") else {
        return (InertialParameters::zero(), Vec::new());
    };
    let ([mass_kg], of_mass) = required(inertial.child("mass"), ["value"]);
    let (entries, of_inertia) = required(inertial.child("inertia"), ENTRIES);
    let (link_from_inertial, of_origin) = pose(inertial.child("origin"));
    // Nothing is concluded from a zero that stands for an unknown number.
    let (knows_mass, knows_inertia) = (of_mass.is_empty(), of_inertia.is_empty());
    let unknown = [
        ("mass", of_mass),
        ("inertia", of_inertia),
        ("origin", of_origin),
    ];
    let unknown = unknown
        .into_iter()
        .filter(|(_, attributes)| !attributes.is_empty());
    let mut findings: Vec<ModelFinding> = unknown
        .map(|(element, attributes)| ModelFinding::UnknownNumbers {
            link: name.to_owned(),
            element,
            attributes,
        })
        .collect();
    let body = InertialParameters::from(MassProperties {
        mass_kg,
        center_of_mass: Vector3::zeros(),
        inertia: symmetric_matrix(entries),
    });
    let has_inertia = entries.iter().any(|&entry| entry != 0.0);
    if knows_mass && (mass_kg < 0.0 || (mass_kg == 0.0 && has_inertia)) {
        let link = name.to_owned();
        findings.push(ModelFinding::ImpossibleMass { link, mass_kg });
    } else if let Some(moments) = impossible_moments(&body).filter(|_| knows_inertia) {
        let link = name.to_owned();
        findings.push(ModelFinding::ImpossibleInertia { link, moments });
    }
    (body.expressed_in(&link_from_inertial), findings)
}

/// Returns the element `<inertial>` of a body.
pub(super) fn to_xml(body: &MassProperties) -> String {
    let [x, y, z]: [f64; 3] = body.center_of_mass.into();
    let entries = ENTRIES.into_iter().zip(symmetric_entries(&body.inertia));
    let entries: String = entries
        .map(|(name, value)| format!(" {name}=\"{value}\""))
        .collect();
    format!(
        "<inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{}\"/><inertia{entries}/></inertial>",
        body.mass_kg
    )
}

/// Returns the numbers of attributes, zero for those that are missing or unreadable, and the names of these.
fn required<const N: usize>(
    element: Option<&Element>,
    attributes: [&'static str; N],
) -> ([f64; N], Vec<&'static str>) {
    let mut unknown = Vec::new();
    let values = attributes.map(|attribute| {
        let read = element.and_then(|element| number(element, attribute).ok().flatten());
        if read.is_none() {
            unknown.push(attribute);
        }
        read.unwrap_or(0.0)
    });
    (values, unknown)
}

/// Returns the transform of an optional `<origin>`, without what is unreadable in it, and the names of these attributes.
fn pose(origin: Option<&Element>) -> (Isometry3<f64>, Vec<&'static str>) {
    let Some(origin) = origin else {
        return (Isometry3::identity(), Vec::new());
    };
    let (shift, turn) = (translation(origin), rotation(origin));
    let faults = [shift.as_ref().err(), turn.as_ref().err()];
    let unknown = faults.iter().flatten().map(|fault| fault.attribute);
    let unknown = unknown.collect();
    let shift = shift.unwrap_or_else(|_| Translation3::identity());
    let turn = turn.unwrap_or_else(|_| UnitQuaternion::identity());
    (Isometry3::from_parts(shift, turn), unknown)
}
