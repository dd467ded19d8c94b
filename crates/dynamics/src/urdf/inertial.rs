//! The inertial parameters of a link. What its `<inertial>` lacks is reported, never refused.

use nalgebra::Vector3;
use urdf_rs::{Inertial, Link, Pose, Vec3};

use super::element::parse;
use super::pose::{is_finite, isometry};
use crate::inertia::impossible_moments;
use crate::{
    InertialParameters, MassProperties, ModelError, ModelFinding, symmetric_entries,
    symmetric_matrix,
};

/// Attributes of `<inertia>`.
const ENTRIES: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];

/// Returns the inertial parameters of a link in the link's frame, zero for a link without
/// `<inertial>`, and what is wrong with them. `rotation` is the attribute of its `<origin>` that
/// gives the rotation.
pub(super) fn link_parameters(
    link: &Link,
    rotation: &'static str,
) -> (InertialParameters, Vec<ModelFinding>) {
    let Inertial {
        origin,
        mass,
        inertia: i,
    } = &link.inertial;
    let (mass, entries) = ([mass.value], [i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz]);
    let of_mass = unknown([("value", &mass[..])]);
    let of_inertia = unknown(ENTRIES.into_iter().zip(entries.chunks(1)));
    let of_origin = unknown([("xyz", &origin.xyz[..]), (rotation, &origin.rpy[..])]);
    let ([mass_kg], entries) = (known(mass), entries.map(|entry| known([entry])[0]));
    let link_from_inertial = isometry(&Pose {
        xyz: Vec3(known(*origin.xyz)),
        rpy: Vec3(known(*origin.rpy)),
    });
    // Nothing is concluded from a zero that stands for an unknown number.
    let (knows_mass, knows_inertia) = (of_mass.is_empty(), of_inertia.is_empty());
    let unknown = [
        ("mass", of_mass),
        ("inertia", of_inertia),
        ("origin", of_origin),
    ];
    let unknown = unknown.into_iter().filter(|(_, names)| !names.is_empty());
    let mut findings: Vec<ModelFinding> = unknown
        .map(|(element, attributes)| ModelFinding::UnknownNumbers {
            link: link.name.clone(),
            element: element.into(),
            attributes: attributes.into_iter().map(Into::into).collect(),
        })
        .collect();
    let body = InertialParameters::from(MassProperties {
        mass_kg,
        center_of_mass: Vector3::zeros(),
        inertia: symmetric_matrix(entries),
    });
    let has_inertia = entries.iter().any(|&entry| entry != 0.0);
    let link = link.name.clone();
    if knows_mass && (mass_kg < 0.0 || (mass_kg == 0.0 && has_inertia)) {
        findings.push(ModelFinding::ImpossibleMass { link, mass_kg });
    } else if let Some(moments) = impossible_moments(&body).filter(|_| knows_inertia) {
        findings.push(ModelFinding::ImpossibleInertia { link, moments });
    }
    (body.expressed_in(&link_from_inertial), findings)
}

/// Returns the text of a URDF with another body in the `<inertial>` of a link. The rest of the text
/// stays as it is.
pub(super) fn replace(text: &str, link: &str, body: &MassProperties) -> Result<String, ModelError> {
    let robot = parse(text)?;
    let mut text = text.to_owned();
    let mut links = robot.children("link");
    if let Some(element) = links.find(|one| one.attribute("name") == Some(link)) {
        let mut former: Vec<_> = element.children("inertial").collect();
        while let Some(former) = former.pop() {
            text.replace_range(former.span.clone(), "");
        }
        let (inertial, end) = (to_xml(body), element.tag.end);
        if element.tag == element.span {
            // `<link .../>` becomes `<link ...>...</link>`.
            text.replace_range(end - 2..end, &format!(">{inertial}</link>"));
        } else {
            text.insert_str(end, &inertial);
        }
    }
    Ok(text)
}

/// Returns the element `<inertial>` of a body.
fn to_xml(body: &MassProperties) -> String {
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

/// Returns the names of the attributes that are not finite.
fn unknown<'a>(numbers: impl IntoIterator<Item = (&'static str, &'a [f64])>) -> Vec<&'static str> {
    let unknown = numbers.into_iter().filter(|(_, values)| !is_finite(values));
    unknown.map(|(name, _)| name).collect()
}

/// Returns the numbers of an attribute, zero where they are unknown.
fn known<const N: usize>(values: [f64; N]) -> [f64; N] {
    if is_finite(&values) { values } else { [0.0; N] }
}
