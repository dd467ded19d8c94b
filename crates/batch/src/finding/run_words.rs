//! Recordings that disagree in words.

use tactid_dynamics::words::{at_most, general};

use super::Disagreement;

/// Probability below which all parameters of several recordings together show a disagreement.
const RARE: f64 = 0.01;

/// Probability below which the number itself is not shown.
const P_SHOWN: f64 = 1e-6;

pub(super) fn runs_disagree(found: &Disagreement) -> String {
    let mut distance = distance_of_runs(
        found.chi_square,
        found.degrees_of_freedom,
        found.noise_degrees_of_freedom,
        found.p_value,
    );
    let mut alone = String::new();
    if found.p_value >= RARE {
        // All parameters together may hide a single value that differs.
        alone = format!(" in {}", found.least_probable);
        distance = format!(
            "{}; all values together: {distance}",
            p_equals(found.least_p_value)
        );
    }
    format!(
        "The {} recordings disagree{alone} by more than their noise ({distance}).{} The intervals \
         include what varies between the recordings, but not what is wrong in all of them.",
        found.runs,
        difference(found).unwrap_or_default()
    )
}

/// Returns a probability as a table shows it: a tiny one is an upper limit.
#[must_use]
pub fn probability(p_value: f64) -> String {
    if p_value >= P_SHOWN {
        general(p_value, 2)
    } else {
        format!("< {}", general(P_SHOWN, 6))
    }
}

/// Returns a probability as a sentence shows it.
#[must_use]
pub fn p_equals(p_value: f64) -> String {
    let shown = probability(p_value);
    if shown.starts_with('<') {
        format!("p {shown}")
    } else {
        format!("p = {shown}")
    }
}

/// Returns how far recordings are from each other, such that the probability can be followed: it is
/// that of Fisher's distribution with both degrees of freedom, of which those of known noise are
/// infinite.
#[must_use]
pub fn distance_of_runs(
    chi_square: f64,
    degrees_of_freedom: f64,
    of_noise: f64,
    p_value: f64,
) -> String {
    let noise = if of_noise.is_infinite() {
        String::new()
    } else {
        format!(" and noise from {of_noise:.0}")
    };
    format!(
        "chi-square {} for {} degrees of freedom{noise}, {}",
        general(chi_square, 4),
        general(degrees_of_freedom, 4),
        p_equals(p_value)
    )
}

/// Says which recording differs most from the others, and in which value.
fn difference(found: &Disagreement) -> Option<String> {
    let (value, difference) = (found.value.as_ref()?, found.difference?);
    let (others, sigmas) = (found.of_others?, found.sigmas?);
    let unit = match value.chars().next() {
        Some('m') => "kg",
        Some('c') => "m",
        _ => "kg m²",
    };
    let sign = if difference < 0.0 { "" } else { "+" };
    let size = format!("{sign}{} {unit}", general(difference, 3));
    let distance = at_most(sigmas.abs(), 1);
    let amount = if difference.abs() < others.abs() {
        let relative = 100.0 * difference / others;
        format!("{relative:+.1} % ({size}, {distance} standard deviations)")
    } else {
        format!("{size} ({distance} standard deviations)")
    };
    Some(match (&found.run, &*found.recordings) {
        (Some(run), _) => {
            let agree = if found.others_agree {
                "agree"
            } else {
                "disagree, too"
            };
            format!(" {run} differs most from the others, which {agree}: its {value} by {amount}.")
        }
        (None, [first, second, ..]) => {
            format!(" {second} differs from {first} most in {value}, by {amount}.")
        }
        (None, _) => format!(" They differ most in {value}, by {amount}."),
    })
}
