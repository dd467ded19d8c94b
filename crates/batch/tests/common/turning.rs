//! A sensor without a robot that rotates about its own origin, with point masses fixed to it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tactid_dynamics::{Manipulator, Wrench};
use tactid_identify::{BaseState, states_of_poses};

use crate::common::Instant;

/// A point mass: kg, and the position in the sensor's frame, m.
pub(crate) type PointMass = (f64, Vector3<f64>);

/// One mass beside the origin.
pub(crate) const BESIDE: [PointMass; 1] = [(4.0, Vector3::new(0.1, 0.05, 0.08))];

/// Masses at the corners of a tetrahedron: 2 kg in sum.
pub(crate) const TETRAHEDRON: [PointMass; 4] = [
    (0.5, Vector3::new(0.12, 0.0, 0.1)),
    (0.5, Vector3::new(-0.04, 0.08, 0.14)),
    (0.5, Vector3::new(0.0, -0.1, 0.02)),
    (0.5, Vector3::new(0.02, 0.01, 0.2)),
];

/// Returns an attitude at a phase, rad, that turns about all axes.
pub(crate) fn about_all_axes(phase: f64) -> UnitQuaternion<f64> {
    let angles = [
        1.2 * (2.0 * phase).sin(),
        0.9 * (3.1 * phase).sin(),
        (1.7 * phase).sin(),
    ];
    UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2])
}

/// Returns an attitude at a phase, rad, that turns about the y axis alone.
pub(crate) fn about_y(phase: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::y() * 1.2 * phase.sin())
}

/// Returns samples of 4 s at 500 Hz without noise, whose phase grows by `speed`, rad/s, in the
/// gravitational acceleration `gravity` in the world, m/s².
pub(crate) fn samples(
    turn: fn(f64) -> UnitQuaternion<f64>,
    speed: f64,
    masses: &[PointMass],
    gravity: Vector3<f64>,
) -> (Manipulator, Vec<Instant>) {
    let instant = |k: u32| {
        let time_s = 2e-3 * f64::from(k);
        let h = 1e-3;
        let turn = |time_s: f64| turn(speed * time_s);
        let force_on = |&(mass_kg, position): &PointMass| {
            let near = turn(time_s + h) * position + turn(time_s - h) * position;
            let far = turn(time_s + 2.0 * h) * position + turn(time_s - 2.0 * h) * position;
            let difference = near * 16.0 - far - turn(time_s) * position * 30.0;
            let acceleration = difference / (12.0 * h * h);
            turn(time_s).inverse() * (acceleration - gravity) * mass_kg
        };
        let moment_of = |mass: &PointMass| mass.1.cross(&force_on(mass));
        Instant {
            time_s,
            base: BaseState {
                pose: Isometry3::from_parts(Translation3::identity(), turn(time_s)),
                ..BaseState::fixed()
            },
            position: vec![],
            velocity: vec![],
            effort: vec![],
            wrenches: vec![Wrench {
                force: masses.iter().map(force_on).sum(),
                moment: masses.iter().map(moment_of).sum(),
            }],
        }
    };
    let mut instants: Vec<Instant> = (0..2000).map(instant).collect();
    let times_s: Vec<f64> = instants.iter().map(|instant| instant.time_s).collect();
    let poses: Vec<_> = instants.iter().map(|instant| instant.base.pose).collect();
    for (instant, state) in instants.iter_mut().zip(states_of_poses(&times_s, &poses)) {
        instant.base = state;
    }
    (Manipulator::lone_body("sensor"), instants)
}
