//! What the description of a robot says of the links of an arm. Robots of one family share all
//! names and differ in this.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tactid_dynamics::{FrameId, InertialParameters, Manipulator, symmetric_entries};

use crate::CalibrateError;

/// Distance within which points are the same, m: ten times the rounding of a file to 10 µm.
const SAME_POINT_M: f64 = 1e-4;

/// Angle within which directions are the same, rad: a right angle printed as 1.571 is off by 2e-4.
const SAME_DIRECTION: f64 = 5e-4;

/// Difference within which masses are the same, a fraction.
const SAME_MASS: f64 = 1e-4;

/// Difference within which entries of an inertia are the same, a fraction of its trace. A part that
/// moves by [`SAME_POINT_M`] changes the inertia of a link by about as much.
const SAME_INERTIA: f64 = 1e-3;

/// A link of an arm that a joint moves, as the description of the robot has it.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkDescription {
    /// Pose of the link's frame in the frame of the moving link or base before it, at joint zero.
    pub parent_from_link: Isometry3<f64>,
    /// Axis of its joint, a unit vector in the link's frame.
    pub axis: Vector3<f64>,
    /// Parameters of the link and all links fixed to it up to the tool, about the link's frame.
    pub parameters: InertialParameters,
}

impl LinkDescription {
    /// Describes bodies of a robot without the links beyond the tool.
    pub(crate) fn of_bodies(robot: &Manipulator, tool: FrameId, bodies: &[usize]) -> Vec<Self> {
        let robot = robot.without_subtree(tool);
        let all: Vec<_> = robot.bodies().collect();
        let of_body = |&body: &usize| {
            let joint = all[body].joint?;
            Some(Self {
                parent_from_link: joint.parent_from_body,
                axis: joint.axis.into_inner(),
                parameters: all[body].parameters,
            })
        };
        bodies.iter().filter_map(of_body).collect()
    }

    /// Returns the first property in which another description of the link differs.
    fn difference(&self, other: &Self, place: Place<'_>) -> Option<Difference> {
        let placed = match place {
            Place::OnBase(gravity) => self.mounting_difference(other, gravity),
            Place::OnLink => self.pose_difference(other),
        };
        let axes = [self.axis, other.axis];
        placed
            .or_else(|| vector_difference("joint axis", "", axes, are_parallel(&axes)))
            .or_else(|| self.mass_difference(other))
    }

    /// Returns the difference of the gravity in links that move relative to the base. Where the
    /// base stands, and how it is turned about the vertical, changes no effort.
    fn mounting_difference(&self, other: &Self, gravity: &Vector3<f64>) -> Option<Difference> {
        let in_link = [self, other].map(|link| link.parent_from_link.rotation.inverse() * gravity);
        vector_difference("gravity", " m/s²", in_link, are_parallel(&in_link))
    }

    /// Returns the difference of the poses in the link before.
    fn pose_difference(&self, other: &Self) -> Option<Difference> {
        let poses = [&self.parent_from_link, &other.parent_from_link];
        let points = poses.map(|pose| pose.translation.vector);
        let is_same = (points[0] - points[1]).norm() <= SAME_POINT_M;
        vector_difference("origin", " m", points, is_same).or_else(|| {
            let [own, its] = poses.map(|pose| pose.rotation);
            let angles = [own, its].map(roll_pitch_yaw);
            vector_difference("rpy", " rad", angles, own.angle_to(&its) <= SAME_DIRECTION)
        })
    }

    /// Returns the difference of the masses, the centres of mass or the inertias.
    fn mass_difference(&self, other: &Self) -> Option<Difference> {
        let masses = [self, other].map(|link| link.parameters.mass());
        if (masses[0] - masses[1]).abs() > SAME_MASS * masses[0].abs().max(masses[1].abs()) {
            return Some(Difference::new(
                "mass",
                masses.map(|mass| listed(&[mass], " kg")),
            ));
        }
        let [own, its] = [
            self.parameters.mass_properties()?,
            other.parameters.mass_properties()?,
        ];
        let centers = [own.center_of_mass, its.center_of_mass];
        let is_same = (centers[0] - centers[1]).norm() <= SAME_POINT_M;
        vector_difference("centre of mass", " m", centers, is_same).or_else(|| {
            let inertias = [own.inertia, its.inertia];
            let size = inertias[0].trace().abs().max(inertias[1].trace().abs());
            let is_other = (inertias[0] - inertias[1]).amax() > SAME_INERTIA * size;
            let entries = |inertia| listed(&symmetric_entries(&inertia), " kg m²");
            is_other.then(|| Difference::new("inertia", inertias.map(entries)))
        })
    }
}

/// What a link is attached to.
enum Place<'a> {
    /// A fixed base, with gravity in its axes.
    OnBase(&'a Vector3<f64>),
    /// Another moving link.
    OnLink,
}

/// A property of two descriptions that differs.
pub(crate) struct Difference {
    pub(crate) property: &'static str,
    /// Its values in both, with the unit.
    pub(crate) values: [String; 2],
}

impl Difference {
    fn new(property: &'static str, values: [String; 2]) -> Self {
        Self { property, values }
    }
}

/// Returns the first link, from the base outwards, that two descriptions of an arm describe
/// differently.
pub(crate) fn first_difference<'a, 'b>(
    names: &'b [String],
    expected: impl ExactSizeIterator<Item = &'a LinkDescription>,
    found: &[LinkDescription],
    gravity: &Vector3<f64>,
) -> Result<Option<(&'b str, Difference)>, CalibrateError> {
    if [expected.len(), found.len()] != [names.len(); 2] {
        let [links, expected, found] = [names.len(), expected.len(), found.len()];
        return Err(CalibrateError::Field {
            field: "links",
            reason: format!("{expected} and {found} descriptions of {links} links"),
        });
    }
    for (index, ((name, expected), found)) in names.iter().zip(expected).zip(found).enumerate() {
        let place = if index == 0 {
            Place::OnBase(gravity)
        } else {
            Place::OnLink
        };
        if let Some(difference) = expected.difference(found, place) {
            return Ok(Some((name, difference)));
        }
    }
    Ok(None)
}

fn are_parallel(vectors: &[Vector3<f64>; 2]) -> bool {
    vectors[0].angle(&vectors[1]) <= SAME_DIRECTION
}

/// Returns a property with both of its values, unless they are the same.
fn vector_difference(
    property: &'static str,
    unit: &str,
    vectors: [Vector3<f64>; 2],
    are_same: bool,
) -> Option<Difference> {
    let values = || vectors.map(|vector| listed(vector.as_slice(), unit));
    (!are_same).then(|| Difference::new(property, values()))
}

/// Returns the angles of a rotation as a URDF has them, rad.
fn roll_pitch_yaw(rotation: UnitQuaternion<f64>) -> Vector3<f64> {
    let (roll, pitch, yaw) = rotation.euler_angles();
    Vector3::new(roll, pitch, yaw)
}

/// Returns numbers to five significant digits and their unit; what is below a billionth is zero.
fn listed(numbers: &[f64], unit: &str) -> String {
    let rounded = |number: &f64| {
        let number = if number.abs() < 1e-9 { 0.0 } else { *number };
        // Every float in this format is a number again.
        format!("{number:.4e}")
            .parse()
            .unwrap_or(number)
            .to_string()
    };
    let rounded: Vec<String> = numbers.iter().map(rounded).collect();
    rounded.join(" ") + unit
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use tactid_dynamics::{BaseKind, Manipulator};

    use super::{LinkDescription, first_difference};

    const ARM: &str = r#"<robot name="arm">
      <link name="world"/>
      <joint name="stand" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.5" rpy="0 0 0"/></joint>
      <link name="base"/>
      <joint name="turn" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/></joint>
      <link name="upper"><inertial><origin xyz="0.1 0 0.1"/><mass value="8.3931"/>
        <inertia ixx="0.2212" ixy="0" ixz="0" iyy="0.2212" iyz="0" izz="0.0151"/></inertial></link>
      <joint name="bend" type="continuous"><parent link="upper"/><child link="lower"/>
        <origin xyz="0.42512 0 0" rpy="0 1.570796325 0"/><axis xyz="0 1 0"/></joint>
      <link name="lower"><inertial><origin xyz="0.2 0 0.03"/><mass value="2.275"/>
        <inertia ixx="0.0494" ixy="0" ixz="0" iyy="0.0494" iyz="0" izz="0.0041"/></inertial></link>
      <joint name="flange" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.3 0 0"/></joint>
      <link name="tip"/>
      <joint name="mount" type="fixed"><parent link="tip"/><child link="hand"/><origin xyz="0 0 0.1"/></joint>
      <link name="hand"><inertial><mass value="0.9"/>
        <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.001"/></inertial></link>
    </robot>"#;

    /// Describes the two moving bodies.
    fn read(urdf: &str) -> Vec<LinkDescription> {
        let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed).unwrap();
        LinkDescription::of_bodies(&robot, robot.frame("tip").unwrap(), &[1, 2])
    }

    /// Returns how the arm differs from one with other words in some places of its URDF; empty
    /// where it does not.
    fn compared(replaced: &[(&str, &str)]) -> String {
        let other = replaced.iter().fold(ARM.to_owned(), |urdf, (old, new)| {
            assert!(urdf.contains(old), "{old}");
            urdf.replace(old, new)
        });
        let (own, other) = (read(ARM), read(&other));
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        let names = ["upper", "lower"].map(String::from);
        let found = first_difference(&names, own.iter(), &other, &gravity).unwrap();
        found.map_or_else(String::new, |(link, difference)| {
            let [expected, found] = difference.values;
            let property = difference.property;
            format!("`{link}` has the {property} {expected} instead of {found}")
        })
    }

    /// The first link that differs is named with what differs and both values.
    #[test]
    fn another_robot_is_named() {
        let cases = [
            (
                "8.3931",
                "12.93",
                "`upper` has the mass 8.3931 kg instead of 12.93 kg",
            ),
            (
                "0.1 0 0.1",
                "0.1 0 0.12",
                "`upper` has the centre of mass 0.1 0 0.1 m instead of 0.1 0 0.12 m",
            ),
            (
                "0.0151",
                "0.0171",
                "`upper` has the inertia 0.2212 0 0 0.2212 0 0.0151 kg m² instead of",
            ),
            (
                "0.42512",
                "0.6127",
                "`lower` has the origin 0.42512 0 0 m instead of 0.6127 0 0 m",
            ),
            (
                "0 1.570796325 0",
                "0 1.5 0",
                "`lower` has the rpy 0 1.5708 0 rad instead of 0 1.5 0 rad",
            ),
            (
                "<axis xyz=\"0 1 0\"/>",
                "<axis xyz=\"0 -1 0\"/>",
                "`lower` has the joint axis 0 1 0 instead of 0 -1 0",
            ),
            (
                "xyz=\"0 0 0.5\" rpy=\"0 0 0\"",
                "rpy=\"0 0.5 0\"",
                "`upper` has the gravity 0 0 -9.81 m/s² instead of 4.7",
            ),
        ];
        for (old, new, expected) in cases {
            let difference = compared(&[(old, new)]);
            assert!(difference.contains(expected), "{difference}");
        }
        let both = compared(&[("2.275", "3.87"), ("8.3931", "12.93")]);
        assert!(both.contains("`upper`"), "{both}");
    }

    /// Descriptions of fewer links are no arm that is the same.
    #[test]
    fn lists_of_different_lengths_are_refused() {
        let (own, names) = (read(ARM), ["upper", "lower"].map(String::from));
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        for (expected, found) in [(1, 2), (2, 1)] {
            let checked = first_difference(&names, own[..expected].iter(), &own[..found], &gravity);
            let error = checked.err().unwrap().to_string();
            let counts = format!("{expected} and {found} descriptions of 2 links");
            assert!(error.contains(&counts), "{error}");
        }
    }

    /// Rounding, place and vertical turn of the base, and links beyond the tip make no difference.
    #[test]
    fn the_same_robot_is_accepted() {
        let rounded = [
            ("8.3931", "8.393101"),
            ("0.42512", "0.4251204"),
            ("1.570796325", "1.5708"),
            ("0.2212", "0.2212001"),
        ];
        let moved = (
            "xyz=\"0 0 0.5\" rpy=\"0 0 0\"",
            "xyz=\"3 -2 0\" rpy=\"0 0 1.2\"",
        );
        let other_hand = [
            ("0.9", "1.7"),
            (
                "0 0 0.1\"/></joint>\n      <link name=\"hand\"",
                "0.1 0.2 0.3\"/></joint>\n      <link name=\"hand\"",
            ),
        ];
        for replaced in [&rounded[..], &[moved], &other_hand] {
            assert_eq!(compared(replaced), "");
        }
    }
}
