//! The grip that the fingers' contacts form.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use tactid_excitation::Grip;

use crate::SimError;
use crate::contact::ContactPoint;

/// Ratio of the mean distance from the middle of a square to the distance of its corners: contacts
/// are at a pad's corners, its pressure may be anywhere on it. `(√2 + asinh 1) / 6` over `√½`.
const MEAN_TO_CORNER: f64 = 0.541;

/// Returns the grip in the tool frame, with the middle of each pad in the middle of its contacts.
///
/// # Errors
/// Returns [`SimError::Grasp`] if a finger has no contact.
pub(super) fn grip(
    contacts: &[Vec<ContactPoint>; 2],
    world_from_tool: &Isometry3<f64>,
    (grip_force_n, friction, used_fraction): (f64, f64, f64),
) -> Result<Grip, SimError> {
    let tool_from_world = world_from_tool.inverse();
    let pads = contacts.each_ref().map(|points| {
        let points = points.iter().map(|point| Point3::from(point.position));
        points.map(|point| (tool_from_world * point).coords)
    });
    let pads = pads.map(|points| points.collect::<Vec<Vector3<f64>>>());
    let [first, second] = pads
        .each_ref()
        .map(|points| points.iter().sum::<Vector3<f64>>() / points.len() as f64);
    let across = first - second;
    // Without contacts the middle of a pad is not a number.
    let no_pads = || SimError::Grasp("the pads do not touch the handle on two sides".to_owned());
    let normal = Unit::try_new(across, 1e-6).filter(|normal| normal.iter().all(|x| x.is_finite()));
    let normal = normal.ok_or_else(no_pads)?;
    let corners = [(&pads[0], first), (&pads[1], second)].map(|(points, middle)| {
        let distances = points.iter().map(|point| (point - middle).norm());
        distances.sum::<f64>() / points.len() as f64
    });
    Ok(Grip {
        center: ((first + second) * 0.5).into(),
        normal,
        distance_m: across.norm(),
        grip_force_n,
        friction,
        torsion_radius_m: MEAN_TO_CORNER * corners[0].min(corners[1]),
        used_fraction,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contacts(middle: Vector3<f64>) -> Vec<ContactPoint> {
        let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let point = |(x, z)| ContactPoint {
            position: middle + Vector3::new(x, 0.0, z) * 0.06,
            force: Vector3::zeros(),
            normal_force: 0.0,
        };
        corners.map(point).to_vec()
    }

    /// The grip of square pads in a tool frame that is moved and turned.
    #[test]
    fn grip_is_that_of_its_pads() {
        let world_from_tool = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::z() * 0.7);
        let in_world = |y| {
            let mut points = contacts(Vector3::new(0.22, y, 0.075));
            for point in &mut points {
                point.position = (world_from_tool * Point3::from(point.position)).coords;
            }
            points
        };
        let pads = [in_world(0.02), in_world(-0.02)];
        let found = grip(&pads, &world_from_tool, (1500.0, 0.8, 0.7)).unwrap();
        assert!((found.center - Point3::new(0.22, 0.0, 0.075)).norm() < 1e-12);
        assert!((found.normal.into_inner() - Vector3::y()).norm() < 1e-12);
        assert!((found.distance_m - 0.04).abs() < 1e-12);
        // Mean distance from the middle of a square with the side a: (√2 + asinh 1) a / 6.
        let expected = (2f64.sqrt() + 1f64.asinh()) * 0.12 / 6.0;
        assert!((found.torsion_radius_m / expected - 1.0).abs() < 1e-3);
        let none = grip(
            &[pads[0].clone(), Vec::new()],
            &world_from_tool,
            (1500.0, 0.8, 0.7),
        );
        assert!(matches!(none, Err(SimError::Grasp(_))));
    }
}
