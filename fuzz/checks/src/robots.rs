//! A robot with every kind of joint that the targets need.

use std::sync::LazyLock;

use tactid_dynamics::{BaseKind, Manipulator, Urdf};

/// An arm with a revolute and a prismatic joint, and a tool of its own link.
const ARM: &str = r#"<robot name="arm">
<link name="base"><inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="upper"><inertial><origin xyz="0 0 0.2"/><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tool0"><inertial><mass value="0.5"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin rpy="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="2" effort="100"/></joint>
<joint name="slide" type="prismatic"><parent link="upper"/><child link="tool0"/><origin xyz="0 0 0.4" rpy="0 0.4 0"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="1" effort="100"/></joint>
</robot>"#;

/// Returns the description of the arm.
#[must_use]
pub(crate) fn urdf() -> &'static str {
    ARM
}

/// Returns the kind of a base.
#[must_use]
pub(crate) fn base_kind(is_floating: bool) -> BaseKind {
    if is_floating {
        BaseKind::Floating
    } else {
        BaseKind::Fixed
    }
}

/// Returns the arm on a base that is fixed or floats.
///
/// # Panics
/// Never: the description is that of a robot.
#[must_use]
pub(crate) fn robot(base: BaseKind) -> &'static Manipulator {
    static ROBOTS: LazyLock<[Manipulator; 2]> = LazyLock::new(|| {
        let urdf = Urdf::from_xml(ARM).expect("a robot");
        [BaseKind::Fixed, BaseKind::Floating].map(|base| urdf.manipulator(base).expect("a robot"))
    });
    &ROBOTS[usize::from(base == BaseKind::Floating)]
}
