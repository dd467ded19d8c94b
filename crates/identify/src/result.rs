//! The identified payload, as every solver returns it.

use std::ops::Range;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use tactid_dynamics::{
    InertialParameters, MassProperties, Wrench, symmetric_entries, symmetric_matrix,
};

use crate::serial::{self, TenValues};

/// Names of [`PayloadEstimate::values`], in order: mass, centre of mass, and inertia about it.
pub const VALUE_NAMES: [&str; 10] = [
    "mass", "com x", "com y", "com z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz",
];

/// Index ranges of mass, centre of mass and inertia among the ten values: three kinds of one unit
/// each.
pub const KINDS: [Range<usize>; 3] = [0..1, 1..4, 4..10];

/// Fraction of the largest principal moment by which an estimate may violate the triangle
/// inequality and still count as physically consistent: plates and rods lie on the boundary, and no
/// estimate is exact.
const BOUNDARY: f64 = 0.01;

/// Whether the motion excites a value, and whether the noise leaves enough of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Observability {
    /// The motion excites the value, and 1.96 standard deviations are less than the largest value
    /// of its kind (mass, centre of mass, inertia); of the mass, one standard deviation is at most
    /// a quarter of it.
    Identifiable,
    /// The motion excites the value, but noise leaves it a wider interval, which contains the truth
    /// as any other does.
    Uncertain,
    /// The motion does not excite the value, or not more than the noise of the motion itself does.
    /// The number in [`PayloadEstimate::body`] is meaningless.
    Unobservable,
}

/// An identified payload with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PayloadEstimate {
    /// Name of the frame in which the payload is expressed: the end-effector frame.
    pub frame: Arc<str>,
    /// Mass, centre of mass in `frame`, and inertia about the centre of mass along the axes of
    /// `frame`.
    #[serde(rename = "values", serialize_with = "serialize_body")]
    #[schemars(with = "TenValues<f64>")]
    pub body: MassProperties,
    /// Mass properties of the whole load as one body, in `frame`: gripper, payload and, where one
    /// is given, known tool; for the joint-sensing method only.
    #[serde(serialize_with = "serialize_composite")]
    #[schemars(with = "Option<TenValues<f64>>", extend("x-class" = "MassProperties"))]
    pub composite: Option<MassProperties>,
    /// Whether the motion excites each of [`VALUE_NAMES`], and whether the noise leaves enough of
    /// it.
    #[schemars(with = "TenValues<Observability>")]
    pub observability: [Observability; 10],
    /// Limits of the 95 % interval of each of [`VALUE_NAMES`], in its unit: 1.96 standard
    /// deviations to each side, but no further than a body can reach that fits into the bounding
    /// box, if one is given. A limit is infinite where nothing bounds the value.
    #[schemars(with = "TenValues<[f64; 2]>", extend("default" = []))]
    pub intervals: [[f64; 2]; 10],
    /// Standard deviation of each of [`VALUE_NAMES`], in its unit, infinite where the value is
    /// unobservable, or divided by a mass that is not known to a quarter.
    #[schemars(with = "TenValues<f64>")]
    pub std_devs: [f64; 10],
    /// Covariance of mass, kg, first moments, kg m, and inertia about the origin of `frame`, kg m²
    /// (xx, xy, xz, yy, yz, zz), (10, 10): what another identification takes of this body where it
    /// is its known tool. What it contains for unobservable values does not count. `None` online.
    pub covariance: Option<[[f64; 10]; 10]>,
    /// Whether a body with these parameters can exist, within 1 % of its largest principal moment.
    pub is_physical: bool,
    /// Number of averaging windows so far. Online least squares counts those before a payload
    /// change, too, which the estimate no longer uses.
    #[schemars(extend("default" = 0))]
    pub windows: u64,
    /// Number of payload changes that online least squares has detected; zero for a recording.
    #[schemars(extend("default" = 0))]
    pub payload_changes: u64,
    /// Time of the last payload change on the samples' clock, s, or minus infinity: the estimate
    /// uses the samples after it.
    #[schemars(extend("default" = "-inf"))]
    pub since_s: f64,
    /// Number of samples that were rejected: not finite, or with derivatives that are not, or not
    /// later than the one before.
    #[schemars(extend("default" = 0))]
    pub rejected: u64,
    /// Number of gaps that were too long to be bridged.
    #[schemars(extend("default" = 0))]
    pub gaps: u64,
}

impl PayloadEstimate {
    /// Returns the ten values in the order of [`VALUE_NAMES`]: mass, kg; centre of mass, m; inertia
    /// about it, kg m².
    #[must_use]
    pub fn values(&self) -> [f64; 10] {
        values_of_body(&self.body)
    }

    /// Returns whether each of [`VALUE_NAMES`] is [identifiable](Observability::Identifiable).
    #[must_use]
    pub fn identifiable(&self) -> [bool; 10] {
        self.observability
            .map(|of| of == Observability::Identifiable)
    }

    /// Returns the names of the values that are not identifiable: uncertain or unobservable.
    pub fn not_identifiable(&self) -> impl Iterator<Item = &'static str> + '_ {
        let named = VALUE_NAMES.iter().zip(&self.observability);
        named
            .filter(|(_, of)| **of != Observability::Identifiable)
            .map(|(name, _)| *name)
    }

    /// Returns the names of the values that the motion excites, but that are not identifiable.
    pub fn uncertain(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.named(Observability::Uncertain)
    }

    /// Returns the names of the values that the motion does not excite.
    pub fn unobservable(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.named(Observability::Unobservable)
    }

    /// Returns the names of the values with this observability.
    fn named(&self, expected: Observability) -> impl Iterator<Item = &'static str> + '_ {
        let named = VALUE_NAMES.iter().zip(&self.observability);
        named
            .filter(move |(_, of)| **of == expected)
            .map(|(name, _)| *name)
    }
}

/// Constant offset of the wrenches: what the sensor measures when nothing acts on it. Subtracting
/// it from every measured wrench tares the sensor. Cloning it allocates nothing.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WrenchOffset {
    /// Name of the frame in which the offset is expressed, and about whose origin its moment is. It
    /// is the sensor's own frame where there is one sensor that does not move relative to the
    /// end-effector frame. Otherwise the offset is that of the sum of the wrenches, in the
    /// end-effector frame.
    pub frame: Arc<str>,
    /// Force in N and moment in N m, with the sign of the measured wrenches, which act on the
    /// payload.
    #[serde(rename = "values", serialize_with = "serialize_wrench")]
    #[schemars(with = "[f64; 6]")]
    pub wrench: Wrench,
    /// Standard deviations of force, N, and moment, N m, infinite where the motion does not
    /// distinguish the offset from the payload; unknown online, where they are not estimated.
    #[serde(serialize_with = "serial::or_nan")]
    #[schemars(with = "[f64; 6]")]
    pub std_devs: Option<[f64; 6]>,
}

impl WrenchOffset {
    /// Returns the force in N, then the moment in N m.
    #[must_use]
    pub fn values(&self) -> [f64; 6] {
        let (f, n) = (&self.wrench.force, &self.wrench.moment);
        [f.x, f.y, f.z, n.x, n.y, n.z]
    }

    /// Returns the same offset for wrenches of the opposite sign, which act on the sensor.
    #[must_use]
    pub fn negated(self) -> Self {
        Self {
            wrench: Wrench {
                force: -self.wrench.force,
                moment: -self.wrench.moment,
            },
            ..self
        }
    }
}

/// Serialises force, N, and moment, N m, as one sequence.
fn serialize_wrench<S: Serializer>(wrench: &Wrench, serializer: S) -> Result<S::Ok, S::Error> {
    let (f, n) = (&wrench.force, &wrench.moment);
    [f.x, f.y, f.z, n.x, n.y, n.z].serialize(serializer)
}

/// Serialises the [ten values](VALUE_NAMES) of a body.
///
/// # Errors
/// Returns the errors of the serializer.
pub fn serialize_body<S: Serializer>(
    of: &MassProperties,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    values_of_body(of).serialize(serializer)
}

/// Serialises a body as a structure of its name around its [ten values](VALUE_NAMES).
///
/// # Errors
/// Returns the errors of the serializer.
pub fn serialize_composite<S: Serializer>(
    of: &Option<MassProperties>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    #[serde(rename = "MassProperties")]
    struct Values([f64; 10]);
    of.as_ref()
        .map(|body| Values(values_of_body(body)))
        .serialize(serializer)
}

/// Returns the ten values of a body, in the order of [`VALUE_NAMES`].
#[must_use]
pub fn values_of_body(body: &MassProperties) -> [f64; 10] {
    let a = &body.center_of_mass;
    let [xx, xy, xz, yy, yz, zz] = symmetric_entries(&body.inertia);
    [body.mass_kg, a.x, a.y, a.z, xx, xy, xz, yy, yz, zz]
}

/// Returns the body with these ten values, in the order of [`VALUE_NAMES`].
#[must_use]
pub fn body_of_values(values: &[f64; 10]) -> MassProperties {
    let [mass_kg, x, y, z, xx, xy, xz, yy, yz, zz] = *values;
    MassProperties {
        mass_kg,
        center_of_mass: nalgebra::Vector3::new(x, y, z),
        inertia: symmetric_matrix([xx, xy, xz, yy, yz, zz]),
    }
}

/// Returns whether a body can have these properties, within 1 % of its largest principal moment.
#[must_use]
pub fn is_physical(body: &MassProperties) -> bool {
    InertialParameters::from(*body).is_physical_within(BOUNDARY)
}
