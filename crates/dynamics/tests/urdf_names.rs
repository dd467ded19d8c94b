//! Names with an XML prefix, which are not part of the URDF format, and what a program reads
//! besides the model.

use crate::common::{RandomTree, rng};
use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use rand::rngs::StdRng;
use tactid_dynamics::urdf_rs::{Geometry, Vec3};
use tactid_dynamics::{BaseKind, Manipulator, MassProperties, ModelError, Urdf};

/// Additions that no reader of URDFs may notice. Tools write them; `link` and `mass` are names that
/// the format has.
const ELEMENTS: [&str; 6] = [
    "<drake:joint name='ball' type='ball'><parent link='x'/><drake:child link='y'/></drake:joint>",
    "<xacro:property name=\"a\" value='>'/>",
    "<drake:link name='stray'><link name='inner'/></drake:link>",
    "<!-- <drake:link name='a:b'> -->",
    "<mujoco:a><![CDATA[</mujoco:a> a:b='c']]></mujoco:a>",
    "<plain:note>text with drake:names, &amp; <b a:c='d'>more</b></plain:note>",
];
const ATTRIBUTES: [&str; 4] = [
    " drake:acceleration='5'",
    " a:value=\"it's > 1\"",
    " xacro:name='say \"hello\"'",
    "\n\tb:ixx = '7'",
];

/// Inserts elements and attributes with prefixes at random between and in the tags of a URDF.
fn with_prefixed_names(xml: &str, rng: &mut StdRng) -> String {
    let mut changed = String::new();
    let mut depth = 0;
    for piece in xml.split_inclusive('>') {
        let tag = piece.trim_start();
        let is_end = tag.starts_with("</");
        depth += i32::from(!is_end && !tag.ends_with("/>")) - i32::from(is_end);
        if !is_end && rng.random_bool(0.4) {
            let at = piece.find(['/', '>']).unwrap();
            let quoted = piece[..at].matches('\'').count() % 2;
            assert_eq!(
                quoted, 0,
                "the tree's values have neither a slash nor a bracket"
            );
            let attribute = ATTRIBUTES[rng.random_range(0..ATTRIBUTES.len())];
            changed += &format!("{}{attribute}{}", &piece[..at], &piece[at..]);
        } else {
            changed += piece;
        }
        if depth > 0 && rng.random_bool(0.3) {
            changed += ELEMENTS[rng.random_range(0..ELEMENTS.len())];
        }
    }
    changed
}

/// A URDF with undeclared prefixes gives the robot of the URDF without them, findings included.
#[test]
fn prefixed_names_change_nothing() {
    let rng = &mut rng(1);
    for xml in (0..200).map(|seed| RandomTree::new(seed).urdf(true)) {
        let changed = with_prefixed_names(&xml, rng);
        let [given, expected] =
            [&changed, &xml].map(|xml| Manipulator::from_urdf(xml, BaseKind::Floating).unwrap());
        assert_eq!(format!("{given:?}"), format!("{expected:?}"), "{changed}");
    }
}

/// Declared prefixes and a default namespace change nothing either.
#[test]
fn declared_prefixes_change_nothing() {
    let xml = RandomTree::new(2).urdf(true);
    let declared = xml
        .replace(
            "<robot ",
            "<robot xmlns:drake='http://drake' xmlns='http://ros' ",
        )
        .replace("<mass ", "<mass drake:value='1000' ");
    let [given, expected] =
        [&declared, &xml].map(|xml| Manipulator::from_urdf(xml, BaseKind::Floating).unwrap());
    assert_eq!(format!("{given:?}"), format!("{expected:?}"));
}

/// Text that is not XML is refused as such, also where it has prefixes.
#[test]
fn broken_xml_with_prefixes_is_refused() {
    for xml in [
        "<robot name='r'><drake:a></robot>",
        "<robot name='r'><link a:b='c></robot>",
        "<a:robot name='r'/>",
        "<robot name='r' a:b=>",
    ] {
        let error = Manipulator::from_urdf(xml, BaseKind::Fixed).unwrap_err();
        assert!(matches!(error, ModelError::Syntax(_)), "{xml}: {error}");
    }
}

fn described(collision: &str) -> Result<Urdf, ModelError> {
    Urdf::from_xml(&format!(
        "<robot name='r'><link name='base'/><link name='arm'>{collision}<inertial><mass value='1'/>\
         <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>\
         <joint name='slide' type='prismatic'><parent link='base'/><child link='arm'/>\
         <limit lower='-0.5' upper='2' effort='1' velocity='1'/></joint>\
         <link name='hand'/><joint name='turn' type='continuous'><parent link='arm'/><child link='hand'/>\
         <limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>"
    ))
}

fn collision(origin: &str, shape: &str) -> String {
    format!("<collision><origin xyz='{origin}'/><geometry>{shape}</geometry></collision>")
}

/// Collision boxes are returned with pose and half size, limits where the joint has some.
#[test]
fn boxes_and_limits_are_read() {
    let shapes = collision("0 0 1", "<box size='1 2 3'/>")
        + &collision("0 0 0", "<sphere radius='1'/>")
        + &collision("1 0 0", "<box size='4 4 4'/>");
    let urdf = described(&shapes).unwrap();
    let boxes = urdf.collision_boxes("arm").unwrap();
    assert_eq!(boxes.len(), 2);
    assert!(matches!(&boxes[0].geometry, Ok(Geometry::Box { size }) if **size == [1.0, 2.0, 3.0]));
    assert_eq!(boxes[0].link_from_shape.translation.z, 1.0);
    let robot = urdf.manipulator(BaseKind::Fixed).unwrap();
    assert_eq!(robot.joint_limits(0), Some((-0.5, 2.0)));
    assert_eq!(robot.joint_limits(1), None);
    assert_eq!(robot.joint_limits(2), None);
    assert_eq!(urdf.root_link(), "base");
    assert!(
        urdf.robot()
            .joints
            .iter()
            .all(|joint| joint.mimic.is_none())
    );
    let error = urdf.collision_boxes("leg").unwrap_err();
    assert!(matches!(error, ModelError::UnknownFrame { .. }), "{error}");
}

/// Collision shapes are returned in the order of the file, with their sizes; what the format does
/// not have keeps its name.
#[test]
fn collision_shapes_are_read() {
    let all = collision("0 0 1", "<cylinder radius='1' length='3'/>")
        + &collision("0 0 0", "<sphere radius='2'/>")
        + &collision("0 0 0", "<capsule radius='1' length='4'/>")
        + &collision(
            "0 0 0",
            "<mesh filename='package://a/b.stl' scale='2 2 2'/>",
        )
        + &collision("0 0 0", "<cone radius='1'/>")
        + "<collision/>";
    let shapes = described(&all).unwrap().collision_shapes("arm").unwrap();
    assert_eq!(shapes[0].link_from_shape.translation.z, 1.0);
    let geometries: Vec<_> = shapes.into_iter().map(|shape| shape.geometry).collect();
    let expected = [
        Ok(Geometry::Cylinder {
            radius: 1.0,
            length: 3.0,
        }),
        Ok(Geometry::Sphere { radius: 2.0 }),
        Ok(Geometry::Capsule {
            radius: 1.0,
            length: 4.0,
        }),
        Ok(Geometry::Mesh {
            filename: "package://a/b.stl".to_owned(),
            scale: Some(Vec3([2.0; 3])),
        }),
        Err("cone".to_owned()),
        Err(String::new()),
    ];
    assert_eq!(format!("{geometries:?}"), format!("{expected:?}"));
    for shape in ["<sphere/>", "<cylinder radius='1' length='-1'/>"] {
        let urdf = described(&collision("0 0 0", shape)).unwrap();
        let error = urdf.collision_shapes("arm").unwrap_err();
        assert!(matches!(error, ModelError::ShapeSize { .. }), "{error}");
        assert!(urdf.collision_boxes("arm").unwrap().is_empty());
    }
}

/// A box with an impossible size or pose is refused with its link.
#[test]
fn impossible_boxes_are_refused() {
    for size in ["0 1 1", "1 -1 1"] {
        let urdf = described(&collision("0 0 0", &format!("<box size='{size}'/>"))).unwrap();
        let error = urdf.collision_boxes("arm").unwrap_err();
        assert!(matches!(error, ModelError::ShapeSize { link, .. } if link == "arm"));
    }
    for (origin, size) in [("nan 0 0", "1 1 1"), ("0 0 0", "1 inf 1"), ("0 0 0", "1 1")] {
        let urdf = described(&collision(origin, &format!("<box size='{size}'/>"))).unwrap();
        let error = urdf.collision_boxes("arm").unwrap_err();
        assert!(matches!(error, ModelError::Numbers { kind: "link", name, .. } if name == "arm"));
    }
}

/// The model and the text that is written have the replaced mass properties.
#[test]
fn mass_properties_can_be_replaced() {
    let mut urdf = described("").unwrap();
    let body = MassProperties {
        mass_kg: 5.0,
        center_of_mass: Vector3::new(0.1, 0.2, 0.3),
        inertia: Matrix3::new(1.0, 0.1, 0.0, 0.1, 1.2, 0.05, 0.0, 0.05, 0.9),
    };
    urdf.set_mass_properties("base", &body).unwrap();
    let written = Urdf::from_xml(urdf.xml()).unwrap();
    for urdf in [&urdf, &written] {
        let model = urdf.manipulator(BaseKind::Floating).unwrap();
        let error = model.check_bodies().err();
        assert!(
            matches!(error, Some(ModelError::NoInertial(ref link, _)) if link == "hand"),
            "the hand moves and has no mass"
        );
    }
    let fixed = written.xml().replace("continuous", "fixed");
    let model = Manipulator::from_urdf(&fixed, BaseKind::Floating).unwrap();
    let base = model.bodies().next().unwrap().parameters;
    let read = base.mass_properties().unwrap();
    assert!((read.mass_kg - 5.0).abs() < 1e-15);
    assert!((read.center_of_mass - body.center_of_mass).norm() < 1e-15);
    assert!((read.inertia - body.inertia).norm() < 1e-15);
    let impossible = MassProperties {
        mass_kg: -1.0,
        ..body
    };
    let error = urdf.set_mass_properties("base", &impossible).unwrap_err();
    assert!(matches!(error, ModelError::Mass { .. }), "{error}");
    let error = urdf.set_mass_properties("leg", &body).unwrap_err();
    assert!(matches!(error, ModelError::UnknownFrame { .. }), "{error}");
}

/// Replacing mass properties changes nothing else in the text, and replaces every former
/// `<inertial>`.
#[test]
fn the_rest_of_the_text_stays() {
    let body = MassProperties {
        mass_kg: 2.0,
        center_of_mass: Vector3::new(0.0, 0.5, 0.0),
        inertia: Matrix3::identity(),
    };
    let inertial = "<inertial><origin xyz=\"0 0.5 0\"/><mass value=\"2\"/>\
        <inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial>";
    for (given, expected) in [
        (
            "<link name='a'/>",
            format!("<link name='a'>{inertial}</link>"),
        ),
        (
            "<link name='a'> text <!-- a --><inertial/><visual/><inertial>x</inertial></link>",
            format!("<link name='a'>{inertial} text <!-- a --><visual/></link>"),
        ),
    ] {
        let around = |link: &str| {
            format!("<?xml version='1.0'?>\n<robot name='é'>{link}<b c='&lt;'/></robot>")
        };
        let mut urdf = Urdf::from_xml(&around(given)).unwrap();
        urdf.set_mass_properties("a", &body).unwrap();
        assert_eq!(urdf.xml(), around(&expected));
    }
}

/// A URDF with a few bytes that are wrong is a robot or an error, and never a panic.
#[test]
fn damaged_files_never_panic() {
    let rng = &mut rng(3);
    let mut read = 0;
    for seed in 0..2000 {
        let xml = RandomTree::new(seed % 20).urdf(true);
        let mut bytes = with_prefixed_names(&xml, rng).into_bytes();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..bytes.len());
            let from = rng.random_range(0..bytes.len());
            match rng.random_range(0..3) {
                0 => bytes[at] = bytes[from],
                1 => drop(bytes.drain(at..(at + 20).min(from.max(at)))),
                _ => bytes.insert(at, bytes[from]),
            }
        }
        let Ok(mut urdf) = Urdf::from_xml(&String::from_utf8_lossy(&bytes)) else {
            continue;
        };
        let root = urdf.root_link().to_owned();
        if let Ok(robot) = urdf.manipulator(BaseKind::Floating) {
            let _ = (robot.findings(), robot.check_bodies());
            read += 1;
        }
        let _ = urdf.collision_boxes(&root);
        let body = MassProperties {
            mass_kg: 1.0,
            center_of_mass: Vector3::zeros(),
            inertia: Matrix3::identity(),
        };
        urdf.set_mass_properties(&root, &body).unwrap();
    }
    assert!(read > 200, "{read} of 2000 are still robots");
}
