//! Whether the data and the result agree with a known mass.

use tactid_identify::KnownMass;

use super::CONTRADICTION;
use crate::finding::Finding;

/// Reports where the payload's mass from the data alone, `found_kg` with its standard deviation,
/// contradicts the known one and no other finding, in `of_data`, explains why, or where the result,
/// `estimated_kg`, is not the known one. `within_box` is whether the result also had to fit into a
/// bounding box.
pub fn mass_finding(
    known: KnownMass,
    (found_kg, std_dev_kg): (f64, f64),
    estimated_kg: f64,
    within_box: bool,
    of_data: &[Finding],
) -> Option<Finding> {
    // At least the standard deviation of an exact mass in a fit: data without noise have none.
    let of_difference_kg = std_dev_kg
        .hypot(known.std_dev_kg)
        .max(known.with(0.0).std_dev_kg);
    let distance = (found_kg - known.mass_kg).abs() / of_difference_kg;
    // A motion that does not determine the mass contradicts none.
    if std_dev_kg.is_finite() && distance > CONTRADICTION {
        return (!of_data.iter().any(contradicts_any_mass)).then_some(Finding::MassContradicted {
            known_mass_kg: known.mass_kg,
            known_mass_std_dev_kg: known.std_dev_kg,
            found_kg,
            std_dev_kg,
            distance,
        });
    }
    (!known.agrees_with(estimated_kg, CONTRADICTION)).then_some(Finding::KnownMassNotKept {
        known_mass_kg: known.mass_kg,
        known_mass_std_dev_kg: known.std_dev_kg,
        estimated_kg,
        within_box,
    })
}

/// Returns the findings about a payload in the order of a result: that about its known mass, that
/// it is far from consistent bodies, and those of the data, without those that one about the mass
/// contains.
pub fn without_repetition(
    of_mass: Option<Finding>,
    inconsistent: Option<Finding>,
    of_data: Vec<Finding>,
) -> Vec<Finding> {
    // A mass that is not kept says that no consistent body is near, and why.
    let is_not_kept = matches!(of_mass, Some(Finding::KnownMassNotKept { .. }));
    let inconsistent = inconsistent.filter(|_| !is_not_kept);
    // An empty gripper explains a contradicted known mass, and is not reported a second time.
    let is_contradicted = matches!(of_mass, Some(Finding::MassContradicted { .. }));
    let repeats =
        |finding: &Finding| is_contradicted && matches!(finding, Finding::NothingHeld { .. });
    let of_data = of_data.into_iter().filter(|finding| !repeats(finding));
    of_mass
        .into_iter()
        .chain(inconsistent)
        .chain(of_data)
        .collect()
}

/// Returns whether a finding is the reason why the data contradict any known mass.
fn contradicts_any_mass(finding: &Finding) -> bool {
    matches!(
        finding,
        Finding::GravityContradicted { .. }
            | Finding::WrongAssumption(_)
            | Finding::NegativeMass { .. }
            | Finding::KnownBodiesTooHeavy { .. }
    )
}
