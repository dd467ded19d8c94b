//! What is wrong in a URDF without preventing a model is reported, with what the model assumes.

use nalgebra::{UnitQuaternion, Vector3};
use tactid_dynamics::{
    BaseKind, IgnoredPart, InertialParameters, Manipulator, MimicFault, ModelError, ModelFinding,
    Urdf,
};

const SOUND: &str = "<inertial><mass value='1'/>\
    <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>";

/// Returns a robot with a joint `hinge` that moves a link `arm` with the given content.
fn robot(arm: &str) -> Manipulator {
    with(arm, "<axis xyz='0 0 1'/>", "")
}

fn with(arm: &str, hinge: &str, more: &str) -> Manipulator {
    let xml = format!(
        "<robot name='r'><link name='base'>{SOUND}</link><link name='arm'>{arm}</link>\
         <joint name='hinge' type='continuous'><parent link='base'/><child link='arm'/>{hinge}</joint>\
         {more}</robot>"
    );
    Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap()
}

fn inertial(mass: &str, [xx, yy, zz]: [&str; 3]) -> String {
    format!(
        "<inertial><mass value='{mass}'/>\
         <inertia ixx='{xx}' ixy='0' ixz='0' iyy='{yy}' iyz='0' izz='{zz}'/></inertial>"
    )
}

/// Returns the inertial parameters of the link `arm`.
fn arm(robot: &Manipulator) -> InertialParameters {
    robot.bodies().nth(1).unwrap().parameters
}

fn unknown(element: &'static str, attributes: &[&'static str]) -> ModelFinding {
    ModelFinding::UnknownNumbers {
        link: "arm".to_owned(),
        element: element.into(),
        attributes: attributes.iter().map(|&name| name.into()).collect(),
    }
}

fn massless(links: &[&str]) -> ModelFinding {
    ModelFinding::Massless {
        links: links.iter().map(|&link| link.to_owned()).collect(),
    }
}

/// A sound robot, a thin rod, a point mass and a frame without mass have no findings.
#[test]
fn nothing_is_found_in_a_sound_robot() {
    let frame = "<link name='tool0'/><joint name='flange' type='fixed'>\
        <parent link='arm'/><child link='tool0'/></joint>";
    let rod = inertial("1", ["0", "1", "1"]);
    let point = inertial("1", ["0", "0", "0"]);
    for sound in [SOUND, &rod, &point] {
        assert_eq!(with(sound, "", frame).findings(), []);
    }
}

/// An inertia that no body has is used as it is written. Its moments are those about the centre of
/// mass, in which rounding errors count as zero.
#[test]
fn impossible_inertias() {
    for (entries, expected) in [
        (["1", "1", "2.1"], [1.0, 1.0, 2.1]),
        (["5", "1", "-0.1"], [-0.1, 1.0, 5.0]),
    ] {
        let robot = robot(&inertial("2", entries));
        let link = "arm".to_owned();
        let moments = expected;
        let finding = ModelFinding::ImpossibleInertia { link, moments };
        assert_eq!(robot.findings(), [finding]);
        let given = Vector3::from(entries.map(|entry| entry.parse::<f64>().unwrap()));
        let used = arm(&robot).inertia_about_origin().diagonal();
        assert!((used - given).norm() < 1e-14, "{used}");
    }
    // The eigenvalues of a matrix of ones are (0, 0, 3), and the first comes out as -2e-16.
    let ones = inertial("1", ["1e-6"; 3]).replace("'0'", "'1e-6'");
    let [ModelFinding::ImpossibleInertia { moments, .. }] = &robot(&ones).findings()[..] else {
        unreachable!("{ones}")
    };
    assert_eq!(moments[..2], [0.0, 0.0]);
    // The rest of a difference is no inertia.
    assert_eq!(
        robot(&inertial("1", ["-1.4e-20", "0", "4e-18"])).findings(),
        []
    );
    // A cylinder with moments of four digits is possible.
    assert_eq!(
        robot(&inertial("1", ["-2e-22", "1.0004", "1"])).findings(),
        []
    );
}

/// A mass that is negative, or zero where the inertia is not, is used as it is written.
#[test]
fn impossible_masses() {
    for (mass, entries) in [("-2", ["1"; 3]), ("-2", ["0"; 3]), ("0", ["1"; 3])] {
        let robot = robot(&inertial(mass, entries));
        let mass_kg = mass.parse().unwrap();
        let link = "arm".to_owned();
        let findings = robot.findings();
        assert_eq!(findings[0], ModelFinding::ImpossibleMass { link, mass_kg });
        assert_eq!(arm(&robot).mass(), mass_kg);
        assert_eq!(
            findings.get(1),
            (mass_kg == 0.0).then(|| massless(&["arm"])).as_ref()
        );
    }
}

/// Numbers of an `<inertial>` that are missing or are not finite count as zero, and nothing is
/// concluded from that zero.
#[test]
fn unknown_numbers() {
    let entries = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
    let without_inertia = "<inertial><mass value='3'/></inertial>";
    let robot_without = robot(without_inertia);
    assert_eq!(robot_without.findings(), [unknown("inertia", &entries)]);
    assert_eq!(arm(&robot_without).mass(), 3.0);
    for mass in ["heavy", "nan", "inf", "1 2", ""] {
        let found = robot(&inertial(mass, ["1"; 3])).findings();
        assert_eq!(
            found,
            [unknown("mass", &["value"]), massless(&["arm"])],
            "{mass}"
        );
    }
    for entry in ["x", "NaN", "1e999"] {
        let robot = robot(&inertial("1", [entry, "1", "1"]));
        assert_eq!(robot.findings(), [unknown("inertia", &["ixx"])]);
        assert_eq!(
            arm(&robot).inertia_about_origin().diagonal(),
            Vector3::new(0.0, 1.0, 1.0)
        );
    }
    let empty = [
        unknown("mass", &["value"]),
        unknown("inertia", &entries),
        massless(&["arm"]),
    ];
    assert_eq!(robot("<inertial/>").findings(), empty);
    let moved = |origin: &str| SOUND.replace("<mass", &format!("<origin {origin}/><mass"));
    let robot_moved = robot(&moved("xyz='0 2' rpy='0 0 1'"));
    assert_eq!(robot_moved.findings(), [unknown("origin", &["xyz"])]);
    assert_eq!(arm(&robot_moved).first_moment(), Vector3::zeros());
    let turned = robot(&moved("xyz='0 2 0' rpy='a b c'"));
    assert_eq!(turned.findings(), [unknown("origin", &["rpy"])]);
    assert_eq!(arm(&turned).first_moment(), Vector3::new(0.0, 2.0, 0.0));
}

/// What the links of a fixed base lack has no effect and is not reported.
#[test]
fn a_fixed_base_needs_no_mass() {
    let xml = |base: &str| {
        format!(
            "<robot name='r'><link name='base'>{base}</link><link name='arm'>{SOUND}</link>\
             <joint name='hinge' type='revolute'><parent link='base'/><child link='arm'/></joint></robot>"
        )
    };
    let heavy = inertial("heavy", ["1", "1", "9"]);
    for (base, expected) in [("", 1), (&*inertial("1", ["1", "1", "9"]), 1), (&heavy, 2)] {
        let findings = |kind| Manipulator::from_urdf(&xml(base), kind).unwrap().findings();
        assert_eq!(findings(BaseKind::Fixed), []);
        assert_eq!(findings(BaseKind::Floating).len(), expected, "{base}");
    }
}

/// Bodies without mass are reported together; a robot needs mass on the way to its tip.
#[test]
fn massless_bodies() {
    let chain = |masses: [&str; 3], base| {
        let [a, b, c] = masses;
        let xml = format!(
            "<robot name='r'><link name='base'/><link name='a'>{a}</link><link name='b'>{b}</link>\
             <link name='c'>{c}</link><link name='tip'/>\
             <joint name='1' type='revolute'><parent link='base'/><child link='a'/></joint>\
             <joint name='2' type='revolute'><parent link='a'/><child link='b'/></joint>\
             <joint name='3' type='revolute'><parent link='a'/><child link='c'/><mimic joint='2'/></joint>\
             <joint name='4' type='fixed'><parent link='b'/><child link='tip'/></joint></robot>"
        );
        Manipulator::from_urdf(&xml, base).unwrap()
    };
    let partly = chain(["", SOUND, ""], BaseKind::Fixed);
    assert_eq!(partly.findings(), [massless(&["a", "c"])]);
    let tip = partly.frame("tip").unwrap();
    assert!(partly.check_masses(Some(tip)).is_ok() && partly.check_masses(None).is_ok());
    let error = partly.check_bodies().unwrap_err();
    assert!(matches!(&error, ModelError::NoInertial(a, joint) if a == "a" && joint == "1"));
    // Another branch has mass, and masses that were removed are known.
    let beside = chain(["", "", SOUND], BaseKind::Fixed);
    assert!(beside.check_masses(None).is_ok());
    let error = beside.check_masses(Some(tip)).unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("from `a` on") && message.contains("joint `1`"),
        "{message}"
    );
    let removed = partly.without_subtree(partly.base_frame());
    assert_eq!(removed.mass(), 0.0);
    assert_eq!(removed.findings(), partly.findings());
    assert!(removed.check_masses(Some(tip)).is_ok());

    let floating = chain([SOUND; 3], BaseKind::Floating);
    assert_eq!(floating.findings(), [massless(&["base"])]);
    assert!(floating.check_masses(Some(tip)).is_ok());
    for error in [floating.check_base_mass(), floating.check_bodies()] {
        assert!(matches!(error, Err(ModelError::MasslessBase(base)) if base == "base"));
    }
    let nothing = chain([""; 3], BaseKind::Floating).check_masses(None);
    assert!(matches!(nothing, Err(ModelError::MasslessBase(_))));
}

/// A simulation needs bodies that exist: what one link lacks, another that is fixed to it may have.
#[test]
fn bodies_that_can_exist() {
    let mounted = |part: &str| {
        with(
            SOUND,
            "",
            &format!(
                "<link name='part'>{part}</link><joint name='mount' type='fixed'>\
                 <parent link='arm'/><child link='part'/></joint>"
            ),
        )
    };
    let small = mounted(&inertial("1", ["0.1", "0.1", "0.5"]));
    assert_eq!(small.findings().len(), 1);
    assert!(small.check_bodies().is_ok());
    let large = mounted(&inertial("1", ["1", "1", "9"]));
    let error = large.check_bodies().unwrap_err();
    assert!(matches!(error, ModelError::Inertia { link, .. } if link == "arm"));
    let light = mounted(&inertial("-2", ["0"; 3]))
        .check_bodies()
        .unwrap_err();
    assert!(matches!(light, ModelError::Mass { mass_kg: -1.0, .. }));
}

/// A joint with several degrees of freedom is fixed at its zero position. The case of a type's
/// letters does not matter.
#[test]
fn joints_with_several_degrees_of_freedom() {
    for kind in ["floating", "planar", "Floating"] {
        let more = format!(
            "<link name='cart'>{SOUND}</link><joint name='drive' type='{kind}'>\
             <origin xyz='1 0 0'/><parent link='arm'/><child link='cart'/></joint>"
        );
        let robot = with(SOUND, "", &more);
        let [
            ModelFinding::JointTakenAsFixed {
                joint,
                joint_type: found,
            },
        ] = &robot.findings()[..]
        else {
            unreachable!("{kind}")
        };
        assert_eq!((joint.as_str(), &**found), ("drive", &*kind.to_lowercase()));
        assert_eq!(robot.joint_names(), ["hinge"]);
        assert_eq!(arm(&robot).mass(), 2.0);
        assert_eq!(arm(&robot).first_moment(), Vector3::x());
    }
    let capitals = "<link name='hand'/><joint name='slide' type='Prismatic'>\
        <parent link='arm'/><child link='hand'/></joint>";
    assert_eq!(with(SOUND, "", capitals).joint_names(), ["hinge", "slide"]);
}

fn follower(name: &str, rest: &str) -> String {
    format!(
        "<link name='{name}_link'>{SOUND}</link><joint name='{name}' type='prismatic'>\
         <parent link='arm'/><child link='{name}_link'/>{rest}</joint>"
    )
}

/// A mimic joint that follows another mimic joint follows the joint that leads both.
#[test]
fn chains_of_mimic_joints() {
    let chain = follower("b", "<mimic joint='a' multiplier='3' offset='0.5'/>")
        + &follower("a", "<mimic joint='hinge' multiplier='-2' offset='0.25'/>");
    let direct = follower("b", "<mimic joint='hinge' multiplier='-6' offset='1.25'/>")
        + &follower("a", "<mimic joint='hinge' multiplier='-2' offset='0.25'/>");
    let [chain, direct] = [chain, direct].map(|more| with(SOUND, "", &more));
    assert_eq!(chain.joint_names(), ["hinge"]);
    assert_eq!(chain.findings(), []);
    assert_eq!(format!("{chain:?}"), format!("{direct:?}"));
}

/// A mimic joint that cannot follow its joint moves independently, and others can follow it.
#[test]
fn mimic_joints_that_cannot_follow() {
    let fixed = "<link name='plate'/><joint name='mount' type='fixed'>\
        <parent link='arm'/><child link='plate'/></joint>";
    for (mimic, leader, because) in [
        ("<mimic joint='hnge'/>", "hnge", MimicFault::NoSuchJoint),
        ("<mimic/>", "", MimicFault::NoSuchJoint),
        ("<mimic joint='mount'/>", "mount", MimicFault::LeaderIsFixed),
        ("<mimic joint='a'/>", "a", MimicFault::Circular),
        (
            "<mimic joint='hinge' multiplier='inf'/>",
            "hinge",
            MimicFault::Numbers,
        ),
        (
            "<mimic joint='hinge' offset='x'/>",
            "hinge",
            MimicFault::Numbers,
        ),
    ] {
        let more = follower("a", mimic) + &follower("b", "<mimic joint='a'/>") + fixed;
        let robot = with(SOUND, "", &more);
        let finding = ModelFinding::MimicNotFollowed {
            joint: "a".to_owned(),
            leader: leader.to_owned(),
            because,
        };
        assert_eq!(robot.findings()[0], finding);
        let circular = because == MimicFault::Circular;
        assert_eq!(
            robot.joint_names().len(),
            if circular { 3 } else { 2 },
            "{mimic}"
        );
    }
    let xml = format!(
        "<robot name='r'><link name='base'/><link name='arm'>{SOUND}</link>\
         <joint name='hinge' type='revolute'><parent link='base'/><child link='arm'/></joint>{}</robot>",
        follower("a", "<mimic joint='hinge'/>")
    );
    let below = Urdf::from_xml(&xml).unwrap();
    let below = below
        .manipulator_below(BaseKind::Fixed, Some("arm"))
        .unwrap();
    assert_eq!(below.joint_names(), ["a"], "its leader is above the base");
    assert_eq!(below.findings().len(), 1);
}

/// Elements and attributes that the format does not have are ignored and reported, unless they
/// belong to other programs.
#[test]
fn unknown_and_repeated_parts() {
    let of_other_programs = "<visual><x/></visual><visual/><collision><geometry><mesh/></geometry></collision>\
        <drake:contact/><gazebo:a b='c'/>";
    assert_eq!(
        robot(&(SOUND.to_owned() + of_other_programs)).findings(),
        []
    );
    let arm = SOUND.replace("<inertia ", "<inertia IXX='1' drake:a='2' ")
        + "<contact/><contact/>"
        + SOUND;
    let hinge = "<axis rpy='0 0 1'/><orgin xyz='1 2 3'/>";
    let hand = format!(
        "<gazebo reference='arm'/><link name='hand'>{SOUND}<contact/></link>\
         <joint name='wrist' type='fixed'><parent link='arm'/><child link='hand'/></joint>"
    );
    let ignored =
        |part, name: &str, inside: &'static str, owners: &[&str]| ModelFinding::PartIgnored {
            part,
            name: name.to_owned(),
            inside: inside.into(),
            owners: owners.iter().map(|&owner| owner.to_owned()).collect(),
        };
    let expected = [
        ignored(IgnoredPart::UnknownAttribute, "rpy", "axis", &["hinge"]),
        ignored(IgnoredPart::UnknownAttribute, "IXX", "inertia", &["arm"]),
        ignored(IgnoredPart::UnknownElement, "orgin", "joint", &["hinge"]),
        ignored(
            IgnoredPart::UnknownElement,
            "contact",
            "link",
            &["arm", "hand"],
        ),
        ignored(IgnoredPart::RepeatedElement, "inertial", "link", &["arm"]),
    ];
    assert_eq!(with(&arm, hinge, &hand).findings(), expected);
}

/// The rotation of an origin may be a quaternion, as URDF 1.2 has it.
#[test]
fn quaternions() {
    let rotation = |origin: &str| {
        let robot = with(SOUND, origin, "");
        let joint = robot.bodies().nth(1).unwrap().joint.unwrap();
        joint.parent_from_body.rotation
    };
    let quarter = rotation(&format!(
        "<origin rpy='0 0 {}'/>",
        std::f64::consts::FRAC_PI_2
    ));
    assert!(rotation("<origin quat_xyzw='0 0 2 2'/>").angle_to(&quarter) < 1e-15);
    let both = "<origin rpy='0 0 0' quat_xyzw='0 0 1 1'/>";
    assert_eq!(
        rotation(both).angle(),
        0.0,
        "roll, pitch and yaw come first"
    );
}

/// Where the pitch is a right angle, or nearly, a quaternion keeps its digits.
#[test]
fn quaternions_at_a_right_angle() {
    let half = std::f64::consts::FRAC_PI_4;
    for (roll, tilt, yaw) in [(0.3, 0.0, -2.0), (0.0, 1e-9, 1.0), (-1.0, 1e-3, 0.0)] {
        for pitch in [2.0 * half - tilt, tilt - 2.0 * half] {
            let given = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let [x, y, z, w] = given.coords.into();
            let robot = with(SOUND, &format!("<origin quat_xyzw='{x} {y} {z} {w}'/>"), "");
            let joint = robot.bodies().nth(1).unwrap().joint.unwrap();
            let read = joint.parent_from_body.rotation;
            assert!(read.angle_to(&given) < 1e-15, "{roll} {pitch} {yaw}");
        }
    }
}
