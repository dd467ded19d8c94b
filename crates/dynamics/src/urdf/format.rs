//! What a model is made from among the elements and attributes of the URDF format.

/// Attribute of an element: its name, how many numbers it has (0 for a text), and what is written
/// where it is missing.
pub(super) type Attribute = (&'static str, usize, &'static str);

/// What is written for an unknown number.
pub(super) const UNKNOWN: &str = "nan";

/// Elements without children that have their attributes checked. A misspelled attribute of another
/// element is missed elsewhere or means nothing for motion and mass.
pub(super) const LEAVES: [&str; 7] = [
    "origin", "axis", "mass", "inertia", "mimic", "parent", "child",
];

/// Elements that a link may have more than once.
pub(super) const REPEATABLE: [&str; 2] = ["visual", "collision"];

/// Elements that are written where they are missing.
pub(super) const REQUIRED: [&str; 2] = ["mass", "inertia"];

/// Shapes of a `<geometry>`.
pub(super) const SHAPES: [&str; 5] = ["box", "cylinder", "capsule", "sphere", "mesh"];

/// Attribute that an `<origin>` may have in place of `rpy`, since URDF 1.1.
pub(super) const QUATERNION: &str = "quat_xyzw";

/// Types of joints.
pub(super) const JOINT_TYPES: [&str; 6] = [
    "revolute",
    "continuous",
    "prismatic",
    "fixed",
    "floating",
    "planar",
];

/// Returns the attributes that are kept of an element.
pub(super) fn attributes(element: &str) -> &'static [Attribute] {
    match element {
        "link" => &[("name", 0, "")],
        "joint" => &[("name", 0, ""), ("type", 0, "")],
        "parent" | "child" => &[("link", 0, "")],
        "origin" => &[("xyz", 3, "0 0 0"), ("rpy", 3, "0 0 0")],
        "axis" => &[("xyz", 3, "1 0 0")],
        "mass" => &[("value", 1, UNKNOWN)],
        "inertia" => &[
            ("ixx", 1, UNKNOWN),
            ("ixy", 1, UNKNOWN),
            ("ixz", 1, UNKNOWN),
            ("iyy", 1, UNKNOWN),
            ("iyz", 1, UNKNOWN),
            ("izz", 1, UNKNOWN),
        ],
        "mimic" => &[("joint", 0, ""), ("multiplier", 1, "1"), ("offset", 1, "0")],
        "limit" => &[
            ("lower", 1, "0"),
            ("upper", 1, "0"),
            ("effort", 1, "0"),
            ("velocity", 1, "0"),
        ],
        "box" => &[("size", 3, "0 0 0")],
        "cylinder" | "capsule" => &[("radius", 1, "0"), ("length", 1, "0")],
        "sphere" => &[("radius", 1, "0")],
        "mesh" => &[("filename", 0, ""), ("scale", 3, "1 1 1")],
        _ => &[],
    }
}

/// Returns the elements that are kept inside an element, in the order in which they are written.
pub(super) fn children(element: &str) -> &'static [&'static str] {
    match element {
        "link" => &["inertial"],
        "joint" => &["parent", "child", "origin", "axis", "limit", "mimic"],
        "inertial" => &["origin", "mass", "inertia"],
        _ => &[],
    }
}

/// Returns the elements that the format has inside an element and that no model needs.
pub(super) fn unused(element: &str) -> &'static [&'static str] {
    match element {
        "link" => &REPEATABLE,
        "joint" => &["dynamics", "calibration", "safety_controller"],
        _ => &[],
    }
}
