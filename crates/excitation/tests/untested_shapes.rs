//! Robots with missing collision shapes: no motion is designed unless that is accepted.

use tactid_dynamics::{BaseKind, Urdf};
use tactid_excitation::{CollisionFinding, CollisionModel, DesignSettings, Problem, design};

use crate::common::{on_ground, urdf};

fn quick() -> DesignSettings {
    DesignSettings {
        starts: 1,
        iterations: 5,
        ..DesignSettings::default()
    }
}

/// Returns the problem of the built-in arm, with a changed URDF and meshes that are not found.
fn with_changed_shapes(change: impl Fn(&str) -> String) -> (Problem, CollisionModel) {
    let urdf = Urdf::from_xml(&change(urdf().xml())).unwrap();
    let mut problem = on_ground();
    problem.robot = urdf.manipulator(BaseKind::Fixed).unwrap();
    let missing = &mut |_: &str| Err("its file was not found".to_owned());
    let model = CollisionModel::of_urdf(&urdf, &problem.robot, missing).unwrap();
    (problem, model)
}

/// Adds a mesh to the shapes of a link.
fn adding_mesh(xml: &str, link: &str, file: &str) -> String {
    let start = format!("<link name=\"{link}\">");
    assert!(xml.contains(&start), "{link}");
    let mesh = format!("<collision><geometry><mesh filename='{file}'/></geometry></collision>");
    xml.replace(&start, &format!("{start}{mesh}"))
}

/// A motion could run the robot through a shape that is left out, so none is designed unless that
/// is accepted. The base counts, too: the arm can hit it.
#[test]
fn no_motion_is_designed_while_shapes_are_left_out() {
    for link in ["forearm_link", "base_link"] {
        let (mut problem, model) = with_changed_shapes(|xml| adding_mesh(xml, link, "a.dae"));
        problem.collisions = Some(model.clone());
        let message = design(&problem, &quick()).unwrap_err().to_string();
        let expected = format!(
            "collisions of the robot with itself cannot be tested: collision shapes of the link {link} are left out \
             (`a.dae`: its file was not found); put the meshes, as STL, OBJ or PLY files, where the URDF names them (for \
             package://, ROS_PACKAGE_PATH may name the folder that contains the package), or accept a motion that may \
             run the robot through itself with `collisions` (false)"
        );
        assert_eq!(message, expected);
        assert_eq!(model.untested()[0].link, link);
        problem.collisions = Some(model.accepting_untested());
        let design = design(&problem, &quick()).unwrap();
        assert!(matches!(
            &design.findings[0],
            CollisionFinding::ShapeLeftOut { link: found, .. } if found == link
        ));
    }
}

/// The links of each reason are listed together, and a robot without any shape is as untested as
/// one that lost all.
#[test]
fn the_links_that_lost_their_shapes_are_named() {
    let (mut problem, model) = with_changed_shapes(|xml| {
        let xml = adding_mesh(xml, "forearm_link", "a.stl");
        adding_mesh(
            &adding_mesh(&xml, "wrist_1_link", "b.stl"),
            "wrist_2_link",
            "c.stl",
        )
    });
    problem.collisions = Some(model);
    let message = design(&problem, &quick()).unwrap_err().to_string();
    let expected = "collision shapes of the links forearm_link, wrist_1_link and wrist_2_link are left out (`a.stl`: its";
    assert!(message.contains(expected), "{message}");
    let (mut problem, model) = with_changed_shapes(|xml| {
        xml.replace("<collision", "<visual")
            .replace("</collision", "</visual")
    });
    problem.collisions = Some(model);
    let message = design(&problem, &quick()).unwrap_err().to_string();
    assert!(
        message.contains("the URDF has no collision shapes"),
        "{message}"
    );
}

/// Replaces the collision shapes of a link by visual shapes.
fn with_visuals(xml: &str, link: &str) -> String {
    let start = xml.find(&format!("<link name=\"{link}\">")).unwrap();
    let end = start + xml[start..].find("</link>").unwrap();
    let visual = xml[start..end].replace("collision", "visual");
    format!("{}{visual}{}", &xml[..start], &xml[end..])
}

/// A part of the arm with a visual shape alone is a reason to refuse a motion: the motion could run
/// the arm through it. The last link carries no joint.
#[test]
fn a_part_of_the_arm_without_collision_shape_is_refused() {
    for link in ["forearm_link", "wrist_3_link"] {
        let (mut problem, model) = with_changed_shapes(|xml| with_visuals(xml, link));
        problem.collisions = Some(model.clone());
        let message = design(&problem, &quick()).unwrap_err().to_string();
        let expected = format!(
            "tested: the URDF has no collision shape of the link {link}; give these links collision shapes in the URDF, or accept"
        );
        assert!(message.contains(&expected), "{message}");
        problem.collisions = Some(model.accepting_untested());
        assert!(design(&problem, &quick()).is_ok());
    }
    let (mut problem, model) = with_changed_shapes(|xml| {
        adding_mesh(&with_visuals(xml, "forearm_link"), "wrist_1_link", "b.stl")
    });
    problem.collisions = Some(model);
    let message = design(&problem, &quick()).unwrap_err().to_string();
    let expected = "shapes in the URDF and put the meshes, as STL";
    assert!(message.contains(expected), "{message}");
}

/// A link with a visual shape alone that is fixed to the arm is no reason to refuse a motion, and is reported.
#[test]
fn links_that_have_no_collision_shape_are_reported() {
    let (_, model) = with_changed_shapes(|xml| {
        let visual = "<visual><geometry><sphere radius='1'/></geometry></visual></link>";
        xml.replace(
            "</robot>",
            &format!(
                "<link name='camera'>{visual}<joint name='camera_joint' \
             type='fixed'><parent link='tool0'/><child link='camera'/></joint></robot>"
            ),
        )
    });
    let expected =
        "not tested for collisions, because the URDF has no collision shape of them: camera";
    let found: Vec<String> = model.findings().iter().map(ToString::to_string).collect();
    assert_eq!(found, [expected]);
}
