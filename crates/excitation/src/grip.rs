//! What a grip between two flat pads can carry by friction.

use nalgebra::{Matrix3, Point3, RowVector3, RowVector6, Unit, Vector3};
use serde::{Deserialize, Deserializer};
use tactid_options::{Kind, Value};

use crate::ExcitationError;
use crate::checks::{positive, value};

/// A grip of two flat pads that face each other, in the tool frame.
///
/// Each pad carries half of the force along its surface and half of the moment about the normal. A
/// moment `m` across the normal is carried by opposite forces `m / distance_m` along the two
/// surfaces. A force `f` of the payload along the normal, taken positive towards a pad's side,
/// changes the normal force of that pad by `-f/2`, and the force of the other by `+f/2`: both pads
/// are equally stiff. A pad of a finger that controls its force does not share the load like this.
///
/// A pad holds while `|[t, m_n / r]| <= used_fraction * friction * N`, with the force `t` along the
/// surface, the moment `m_n` about the normal, the torsion radius `r` and the normal force `N`
/// (limit surface of a soft finger as an ellipsoid; Howe and Cutkosky 1996).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Point in the middle between the pads, m.
    pub center: Point3<f64>,
    /// Direction from the middle to pad 0; pad 1 is on the opposite side.
    pub normal: Unit<Vector3<f64>>,
    /// Distance between the pads, m.
    pub distance_m: f64,
    /// Force with which each pad presses, N.
    pub grip_force_n: f64,
    /// Coefficient of friction between pad and payload, dimensionless.
    pub friction: f64,
    /// Moment about the normal that a pad carries by friction for each newton of friction along its
    /// surface, m. For a disc with uniform pressure it is two thirds of the radius.
    pub torsion_radius_m: f64,
    /// Fraction of the friction that a motion may use, such as 0.7.
    pub used_fraction: f64,
}

/// Default of the fraction of the friction that a motion may use.
const USED_FRACTION: f64 = 0.7;

/// Its numbers are checked by [`Grip`] itself.
impl Value for Grip {
    const KIND: Kind = Kind::Grip;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Given {
            center: [f64; 3],
            normal: [f64; 3],
            distance: f64,
            force: f64,
            friction: f64,
            torsion_radius: f64,
            used: Option<f64>,
        }
        let given = Given::deserialize(deserializer)?;
        Ok(Self {
            center: given.center.into(),
            normal: Unit::new_normalize(given.normal.into()),
            distance_m: given.distance,
            grip_force_n: given.force,
            friction: given.friction,
            torsion_radius_m: given.torsion_radius,
            used_fraction: given.used.unwrap_or(USED_FRACTION),
        })
    }
}

/// Entries of the load of a pad that friction bounds: two forces along the surface, and torsion.
const TAIL: usize = 3;

/// Load of one pad as a function of the wrench on the payload in the tool frame, relative to the
/// friction of the grip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PadLoad {
    /// What the friction allows: `1 + head · w`.
    pub(crate) head: RowVector6<f64>,
    /// What it must hold: the norm of these rows times `w`.
    pub(crate) tail: [RowVector6<f64>; TAIL],
}

impl Grip {
    /// Checks that all numbers are finite and those that must be positive are.
    pub(crate) fn check(&self) -> Result<(), ExcitationError> {
        positive("grip.distance_m", self.distance_m)?;
        positive("grip.grip_force_n", self.grip_force_n)?;
        positive("grip.friction", self.friction)?;
        positive("grip.torsion_radius_m", self.torsion_radius_m)?;
        positive("grip.used_fraction", self.used_fraction)?;
        let used = self.used_fraction;
        value("grip.used_fraction", used, used <= 1.0, "at most 1")?;
        let vectors = [
            ("grip.center", self.center.coords),
            ("grip.normal", self.normal.into_inner()),
        ];
        for (name, vector) in vectors {
            for &entry in &vector {
                let expected = "finite entries, and for the normal one that is not zero";
                value(name, entry, entry.is_finite(), expected)?;
            }
        }
        Ok(())
    }

    /// Returns the load of pad 0 or 1.
    pub(crate) fn pad(&self, pad: usize) -> PadLoad {
        let side = if pad == 0 { 1.0 } else { -1.0 };
        let n = self.normal.into_inner();
        let across = Matrix3::identity() - n * n.transpose();
        // Moment about the middle: m - c × f.
        let lever = -self.center.coords.cross_matrix();
        // The pads at ±d/2 n carry the moment m across the normal by the forces ±m × n / d.
        let couple = -n.cross_matrix() * (side / self.distance_m);
        let allowed = self.used_fraction * self.friction * self.grip_force_n;
        let along_force = (across * 0.5 + couple * lever) / allowed;
        let along_moment = couple / allowed;
        let torsion = n.transpose() * (0.5 / (self.torsion_radius_m * allowed));
        let row = |force: RowVector3<f64>, moment: RowVector3<f64>| {
            RowVector6::from_iterator(force.iter().chain(&moment).copied())
        };
        // Any two directions along the surface: three would make the program's cones larger.
        let first = n.cross(&Vector3::ith(n.iamin(), 1.0)).normalize();
        let along = |direction: Vector3<f64>| {
            let direction = direction.transpose();
            row(direction * along_force, direction * along_moment)
        };
        // The payload presses on the pad towards which inertia pulls it; the pad pushes along -n.
        let pressure = n.transpose() * (-0.5 * side / self.grip_force_n);
        PadLoad {
            head: row(pressure, RowVector3::zeros()),
            tail: [
                along(first),
                along(n.cross(&first)),
                row(torsion * lever, torsion),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;

    use super::*;

    fn grip() -> Grip {
        Grip {
            center: Point3::new(0.22, 0.0, 0.075),
            normal: Vector3::y_axis(),
            distance_m: 0.04,
            grip_force_n: 1500.0,
            friction: 0.8,
            torsion_radius_m: 0.05,
            used_fraction: 1.0,
        }
    }

    fn used(grip: &Grip, pad: usize, force: [f64; 3], moment: [f64; 3]) -> f64 {
        let load = grip.pad(pad);
        let at_center = Vector3::from(force);
        let moment = Vector3::from(moment) + grip.center.coords.cross(&at_center);
        let wrench = Vector6::from_iterator(at_center.iter().chain(&moment).copied());
        let tail = load.tail.map(|row| (row * wrench)[0]);
        let head = 1.0 + (load.head * wrench)[0];
        tail.iter().map(|x| x * x).sum::<f64>().sqrt() / head
    }

    /// The built-in gripper holds 48 N m across the pads and 2400 N along them at most, whatever
    /// the direction along the surface; a moment about the normal is held by torsion alone.
    #[test]
    fn pads_carry_what_friction_allows() {
        for pad in 0..2 {
            let used = |force, moment| used(&grip(), pad, force, moment);
            assert!((used([0.0; 3], [48.0, 0.0, 0.0]) - 1.0).abs() < 1e-12);
            assert!((used([0.0; 3], [0.0, 0.0, -48.0]) - 1.0).abs() < 1e-12);
            assert!((used([2400.0, 0.0, 0.0], [0.0; 3]) - 1.0).abs() < 1e-12);
            assert!((used([0.0, 0.0, 2400.0], [0.0; 3]) - 1.0).abs() < 1e-12);
            assert!((used([0.0; 3], [0.0, 120.0, 0.0]) - 1.0).abs() < 1e-12);
        }
    }

    /// A net force and a moment that load one pad in the same direction unload the other, and a
    /// force along the normal presses on one pad and relieves the other.
    #[test]
    fn moment_and_normal_force_load_the_pads_differently() {
        // The moment 24 N m about x is the force 600 N along z on pad 0 and -600 N on pad 1, each
        // 0.04 m from the other.
        let (force, moment) = ([0.0, 0.0, 1200.0], [24.0, 0.0, 0.0]);
        assert!((used(&grip(), 0, force, moment) - 1.0).abs() < 1e-12);
        assert!(used(&grip(), 1, force, moment) < 1e-12);
        // The payload accelerates along +y: pad 1, at -y, pushes it.
        let force = [1200.0, 1000.0, 0.0];
        assert!((used(&grip(), 0, force, [0.0; 3]) - 600.0 / (0.8 * 1000.0)).abs() < 1e-12);
        assert!((used(&grip(), 1, force, [0.0; 3]) - 600.0 / (0.8 * 2000.0)).abs() < 1e-12);
    }
}
