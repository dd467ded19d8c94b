//! Robots that urdf-rs describes, and what stands between a document and urdf-rs.

use crate::common::RandomTree;
use tactid_dynamics::urdf_rs::{self, JointType};
use tactid_dynamics::{BaseKind, Manipulator, ModelError, ModelFinding, Urdf};

/// The robot of a document is the one that urdf-rs reads from it, to the digit.
#[test]
fn a_robot_of_urdf_rs_is_the_robot_of_its_document() {
    for seed in 0..100 {
        let xml = RandomTree::new(seed).urdf(true);
        let read = urdf_rs::read_from_string(&xml).unwrap();
        let urdf = Urdf::from_xml(&xml).unwrap();
        for base in [None, Some(urdf.root_link())] {
            let expected = urdf.manipulator_below(BaseKind::Floating, base).unwrap();
            for robot in [&read, urdf.robot()] {
                let robot = Manipulator::from_robot(robot, BaseKind::Floating, base).unwrap();
                assert_eq!(format!("{robot:?}"), format!("{expected:?}"));
            }
        }
    }
}

const ARM: &str = "<robot name='r'><link name='base'/>\
    <link name='arm'><inertial><mass value='1'/>\
    <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>\
    <joint name='hinge' type='continuous'><parent link='base'/><child link='arm'/></joint></robot>";

/// What no document can say is reported or refused as what it can.
#[test]
fn robots_that_a_program_makes() {
    let arm = urdf_rs::read_from_string(ARM).unwrap();
    let build = |robot| Manipulator::from_robot(&robot, BaseKind::Fixed, None);
    let mut robot = arm.clone();
    robot.links[1].inertial.mass.value = f64::NAN;
    let element = "mass";
    let finding = &build(robot).unwrap().findings()[0];
    assert!(matches!(finding, ModelFinding::UnknownNumbers { element: e, .. } if *e == element));
    let mut robot = arm.clone();
    robot.joints[0].joint_type = JointType::Spherical;
    let finding = &build(robot).unwrap().findings()[0];
    assert!(
        matches!(finding, ModelFinding::JointTakenAsFixed { joint_type, .. } if *joint_type == "spherical")
    );
    let mut robot = arm.clone();
    robot.joints[0].origin.rpy[1] = f64::INFINITY;
    let error = build(robot).unwrap_err();
    assert_eq!(error.to_string(), "the origin of `hinge` is not finite");
    let mut robot = arm.clone();
    robot.joints[0].axis.xyz[0] = f64::NAN;
    let error = build(robot).unwrap_err();
    assert_eq!(error.to_string(), "the axis of `hinge` is not finite");
    let mut robot = arm;
    robot.links.clear();
    robot.joints.clear();
    assert!(matches!(build(robot), Err(ModelError::Syntax(_))));
}

/// Names are as in the document, whatever characters they have.
#[test]
fn names_with_escapes() {
    let names = [
        "&lt;&amp;&gt;",
        "&quot;'\n\té",
        " a ",
        "&unknown;",
        "&#233;",
    ];
    let expected = ["<&>", "\"'\n\té", " a ", "&unknown;", "é"];
    for (name, expected) in names.into_iter().zip(expected) {
        let given = format!("\"{name}\"");
        let robot = Manipulator::from_urdf(&ARM.replace("'hinge'", &given), BaseKind::Fixed);
        assert_eq!(robot.unwrap().joint_names(), [expected]);
    }
    for character in ["\u{1}", "&#1;"] {
        let xml = ARM.replace("<link name='arm'", &format!("\n<link name='a{character}'"));
        let error = Manipulator::from_urdf(&xml, BaseKind::Fixed).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("line 2: an attribute has a character"),
            "{message}"
        );
    }
}

/// A robot may have many links; more than any robot has are refused with the line.
#[test]
fn many_links() {
    let links = |count| {
        let links = (0..count).map(|k| format!("\n<link name='{k}'/>"));
        format!("<robot name='r'>{}</robot>", links.collect::<String>())
    };
    let few = Manipulator::from_urdf(&links(20_000), BaseKind::Fixed).unwrap_err();
    assert!(matches!(few, ModelError::Roots(roots) if roots.len() == 20_000));
    let many = Manipulator::from_urdf(&links(400_001), BaseKind::Fixed).unwrap_err();
    let message = many.to_string();
    assert!(
        message.contains("line 400002") && message.contains("more than 400000"),
        "{message}"
    );
    let boxes = "<collision><geometry><box size='1 1 1'/></geometry></collision>".repeat(40_000);
    let xml = format!("<robot name='r'><link name='a'>{boxes}</link></robot>");
    let error = Manipulator::from_urdf(&xml, BaseKind::Fixed).unwrap_err();
    assert!(
        error.to_string().contains("this link has more than 100000"),
        "{error}"
    );
}
