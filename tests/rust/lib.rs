//! What the end-to-end tests share.

/// The Rust examples of the README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
mod readme {}

/// The Rust examples of the tutorial for controllers, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/tutorials/controller.md")]
mod controller {}

use tactid_dynamics::{MassProperties, symmetric_entries};

/// Each parameter's error in percent of its nominal value, or for a zero entry of the largest
/// nominal entry of its kind: mass, centre of mass (x, y, z), inertia (xx, xy, xz, yy, yz, zz).
#[must_use]
pub fn errors_percent(found: &MassProperties, nominal: &MassProperties) -> [f64; 10] {
    let values = |body: &MassProperties| {
        let a = &body.center_of_mass;
        let i = symmetric_entries(&body.inertia);
        [
            body.mass_kg,
            a.x,
            a.y,
            a.z,
            i[0],
            i[1],
            i[2],
            i[3],
            i[4],
            i[5],
        ]
    };
    let (found, nominal) = (values(found), values(nominal));
    let largest = |kind: &[f64]| {
        kind.iter()
            .fold(0.0_f64, |most, value| most.max(value.abs()))
    };
    let kinds = [
        largest(&nominal[..1]),
        largest(&nominal[1..4]),
        largest(&nominal[4..]),
    ];
    let mut errors = [0.0; 10];
    for (k, error) in errors.iter_mut().enumerate() {
        let kind = kinds[usize::from(k > 0) + usize::from(k > 3)];
        let scale = if nominal[k] == 0.0 {
            kind
        } else {
            nominal[k].abs()
        };
        *error = 100.0 * (found[k] - nominal[k]) / scale;
    }
    errors
}

/// The largest of [`errors_percent`], without its sign.
#[must_use]
pub fn worst_percent(found: &MassProperties, nominal: &MassProperties) -> f64 {
    let errors = errors_percent(found, nominal);
    errors
        .into_iter()
        .fold(0.0, |worst, error| worst.max(error.abs()))
}
