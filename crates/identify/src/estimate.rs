//! What a user reads.

use tactid_dynamics::{InertialParameters, MassProperties, symmetric_entries, symmetric_matrix};

use crate::SingularValues;

/// The names of [`PayloadEstimate::values`], in order.
pub const VALUE_NAMES: [&str; 10] = [
    "mass", "com.x", "com.y", "com.z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz",
];

/// Mass, centre of mass and inertia among the ten values.
pub(crate) const KINDS: [std::ops::Range<usize>; 3] = [0..1, 1..4, 4..10];

/// A payload as identified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PayloadEstimate {
    /// The payload alone, in the end-effector frame; its inertia about the centre of mass.
    pub body: MassProperties,
    /// Gripper and payload as one body, for the joint-sensing way.
    pub composite: Option<MassProperties>,
    /// For each of [`VALUE_NAMES`]: whether the motion determined it. Where it did not, the number
    /// in `body` is where the estimator happened to start or drift.
    pub identifiable: [bool; 10],
    /// Standard deviation of each of [`VALUE_NAMES`], infinite where the motion did not determine it;
    /// `None` for the paper's filter, which knows of none.
    pub deviations: Option<[f64; 10]>,
    /// How strongly the motion excited the parameters. Online, least squares leaves it out: ask
    /// [`Identifier::singular_values`](crate::Identifier::singular_values).
    pub singular_values: Option<SingularValues>,
    /// Whether a body with these parameters can exist, within 1 % of its largest principal moment.
    pub is_physical: bool,
    /// Windows that gave rows.
    pub intervals: u64,
    /// How often the payload was seen to be another than before, by least squares online.
    pub changes: u64,
    /// The time from which on the estimate is made, on the samples' clock, s: that of the last change,
    /// or minus infinity.
    pub since_s: f64,
    /// Samples refused: not finite, or not later than the one before.
    pub refused: u64,
    /// Intervals that were too long to be bridged.
    pub gaps: u64,
}

impl PayloadEstimate {
    /// Mass, kg; centre of mass, m; inertia about it, kg m²: in the order of [`VALUE_NAMES`].
    #[must_use]
    pub fn values(&self) -> [f64; 10] {
        values(&self.body)
    }

    /// The names of the values that the motion did not determine.
    pub fn not_identifiable(&self) -> impl Iterator<Item = &'static str> + '_ {
        let named = VALUE_NAMES.iter().zip(&self.identifiable);
        named.filter(|(_, known)| !**known).map(|(name, _)| *name)
    }
}

pub(crate) fn values(body: &MassProperties) -> [f64; 10] {
    let a = &body.center_of_mass;
    let [xx, xy, xz, yy, yz, zz] = symmetric_entries(&body.inertia);
    [body.mass_kg, a.x, a.y, a.z, xx, xy, xz, yy, yz, zz]
}

pub(crate) fn body(values: &[f64; 10]) -> MassProperties {
    let [mass_kg, x, y, z, xx, xy, xz, yy, yz, zz] = *values;
    MassProperties {
        mass_kg,
        center_of_mass: nalgebra::Vector3::new(x, y, z),
        inertia: symmetric_matrix([xx, xy, xz, yy, yz, zz]),
    }
}

/// The payload that is left of `composite` without the gripper.
pub(crate) fn without(composite: &MassProperties, gripper: &InertialParameters) -> MassProperties {
    let rest = InertialParameters::from(*composite) - *gripper;
    // A mass of exactly zero has no centre; then there is nothing to take the gripper off from.
    rest.mass_properties().unwrap_or(*composite)
}
