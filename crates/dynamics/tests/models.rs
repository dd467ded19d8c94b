//! Manipulators from a Denavit-Hartenberg table and from a URDF.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;

use crate::common::{self, Cloud, RandomTree, State, assert_close, numbers, rng, tactid, vector};
use nalgebra::{Isometry3, Matrix4, Vector3};
use rand::RngExt;
use tactid_dynamics::{
    BaseKind, DhLink, DhRobot, FrameMotion, InertialParameters, JointKind, Manipulator, ModelError,
    Urdf, forces,
};

/// Table 1 of the paper: θ, a, d, α of each joint.
const TABLE_1: [[f64; 4]; 6] = [
    [0.0, 0.0, 0.089159, FRAC_PI_2],
    [0.0, -0.42500, 0.0, 0.0],
    [0.0, -0.39225, 0.0, 0.0],
    [0.0, 0.0, 0.10915, FRAC_PI_2],
    [0.0, 0.0, 0.09465, -FRAC_PI_2],
    [0.0, 0.0, 0.08230, 0.0],
];

fn ball() -> InertialParameters {
    let mut parameters = InertialParameters::zero().as_vector().to_owned();
    for (entry, value) in [(0, 2.0), (4, 0.1), (7, 0.1), (9, 0.1)] {
        parameters[entry] = value;
    }
    InertialParameters::from_vector(parameters)
}

fn table_1(base_from_table: Isometry3<f64>) -> DhRobot {
    let link = |(row, [theta, a, d, alpha]): (usize, [f64; 4])| DhLink {
        joint: format!("joint_{}", row + 1),
        link: format!("frame_{}", row + 1),
        kind: JointKind::Revolute,
        theta,
        d,
        a,
        alpha,
        parameters: ball(),
    };
    DhRobot {
        base_kind: BaseKind::Floating,
        base: "base".to_owned(),
        base_parameters: ball(),
        base_from_table,
        links: TABLE_1.into_iter().enumerate().map(link).collect(),
    }
}

/// Returns the transform of one row as a matrix.
#[rustfmt::skip]
fn dh_matrix(theta: f64, a: f64, d: f64, alpha: f64) -> Matrix4<f64> {
    let ((s, c), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
    Matrix4::new(
        c, -s * ca, s * sa, a * c,
        s, c * ca, -c * sa, a * s,
        0.0, sa, ca, d,
        0.0, 0.0, 0.0, 1.0,
    )
}

/// Returns a state at rest with the base at the inertial frame.
fn at(position: Vec<f64>) -> State {
    let none = vec![0.0; position.len()];
    State {
        base: FrameMotion::at_rest(Isometry3::identity()),
        position,
        velocity: none.clone(),
        acceleration: none,
    }
}

/// The pose of each frame of Table 1 is the product of the table's matrices up to it.
#[test]
fn dh_frames_are_products_of_matrices() {
    let rng = &mut rng(1);
    let robot = Manipulator::from_dh(&table_1(Isometry3::identity())).unwrap();
    assert_eq!(robot.dof(), 6);
    for _ in 0..50 {
        let state = at(numbers(rng, 6, 3.0));
        let workspace = state.moved(&robot);
        let mut expected = Matrix4::identity();
        for (joint, [theta, a, d, alpha]) in TABLE_1.into_iter().enumerate() {
            expected *= dh_matrix(theta + state.position[joint], a, d, alpha);
            let frame = robot.frame(&format!("frame_{}", joint + 1)).unwrap();
            let given = workspace.pose(frame).to_homogeneous();
            assert_close(&given, &expected, 1e-14, "frame");
        }
    }
}

/// A frame carries those that joints move relative to it, and neither itself, nor frames of its own
/// body, nor what stands beside it.
#[test]
fn a_frame_carries_what_moves_with_it() {
    let robot = tactid();
    let carries = |carrier, carried| {
        robot.carries(robot.frame(carrier).unwrap(), robot.frame(carried).unwrap())
    };
    assert!(carries("base_link", "finger_right_link") && carries("tool0", "finger_left_link"));
    for (carrier, carried) in [
        ("finger_left_link", "finger_right_link"),
        ("finger_right_link", "finger_left_link"),
        ("finger_left_link", "tool0"),
        ("tool0", "gripper_link"),
        ("tool0", "tool0"),
    ] {
        assert!(!carries(carrier, carried), "{carrier} {carried}");
    }
}

/// The project's robot is the arm of Table 1 on its spacecraft: `tool0` is always frame 6.
#[test]
fn tool0_is_frame_6_of_table_1() {
    let rng = &mut rng(2);
    let (urdf, mount) = (tactid(), Isometry3::translation(-0.95, 0.0, 0.75));
    let table = Manipulator::from_dh(&table_1(mount)).unwrap();
    let (tool, frame_6) = (
        urdf.frame("tool0").unwrap(),
        table.frame("frame_6").unwrap(),
    );
    for _ in 0..50 {
        let of_table = at(numbers(rng, 6, 3.0));
        let mut of_urdf = at(vec![0.0; urdf.dof()]);
        for (joint, name) in table.joint_names().iter().enumerate() {
            of_urdf.position[urdf.joint_index(name).unwrap()] = of_table.position[joint];
        }
        let given = of_urdf.moved(&urdf).pose(tool).to_homogeneous();
        let expected = of_table.moved(&table).pose(frame_6).to_homogeneous();
        assert_close(&given, &expected, 1e-14, "tool0");
    }
}

/// Returns a row of a table as two links of a URDF: one that the joint moves, and one at the
/// table's frame.
fn row_as_urdf(link: &DhLink, parent: &str) -> String {
    let kind = if link.kind == JointKind::Prismatic {
        "prismatic"
    } else {
        "revolute"
    };
    let DhLink {
        joint,
        link: name,
        theta,
        d,
        a,
        alpha,
        ..
    } = link;
    format!(
        "<link name='at_{joint}'/><link name='{name}'>{BALL}</link>\
         <joint name='{joint}' type='{kind}'><parent link='{parent}'/><child link='at_{joint}'/>\
         <origin rpy='0 0 {theta}'/><axis xyz='0 0 1'/>\
         <limit lower='0' upper='0' effort='0' velocity='0'/></joint>\
         <joint name='to_{name}' type='fixed'><parent link='at_{joint}'/><child link='{name}'/>\
         <origin xyz='{a} 0 {d}' rpy='{alpha} 0 0'/></joint>"
    )
}

/// An arm has the same joint torques from a table and from a URDF with the joints' frames and the
/// table's frames as links of their own, also with prismatic joints.
#[test]
fn dh_and_urdf_of_one_arm_agree() {
    let rng = &mut rng(3);
    let mut table = table_1(common::isometry(rng));
    let (x, (roll, pitch, yaw)) = (
        table.base_from_table.translation.vector,
        table.base_from_table.rotation.euler_angles(),
    );
    let mut xml = format!(
        "<robot name='dh'><link name='base'>{BALL}</link><link name='mount'/>\
         <joint name='to_mount' type='fixed'><parent link='base'/><child link='mount'/>\
         <origin xyz='{} {} {}' rpy='{roll} {pitch} {yaw}'/></joint>",
        x.x, x.y, x.z
    );
    let mut parent = "mount".to_owned();
    for (row, link) in table.links.iter_mut().enumerate() {
        if row % 3 == 1 {
            link.kind = JointKind::Prismatic;
        }
        [link.theta, link.a, link.d, link.alpha] =
            std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        xml.push_str(&row_as_urdf(link, &parent));
        parent = link.link.clone();
    }
    xml.push_str("</robot>");
    let of_table = Manipulator::from_dh(&table).unwrap();
    let of_urdf = Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap();
    assert_eq!(of_table.joint_names(), of_urdf.joint_names());
    for _ in 0..20 {
        let state = State::random(rng, of_table.dof());
        let gravity = vector(rng, 10.0);
        let torques = [&of_table, &of_urdf].map(|robot| {
            let mut workspace = state.moved(robot);
            forces(&mut workspace, &gravity);
            Vec::from(workspace.joint_torques().unwrap())
        });
        for (given, expected) in torques[0].iter().zip(&torques[1]) {
            assert!((given - expected).abs() < 1e-12 * (1.0 + expected.abs()));
        }
    }
}

const BALL: &str = "<inertial><mass value='2'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial>";

/// The error for a faulty table names the joint or link at fault.
#[test]
fn dh_faults_are_named() {
    let refused = |change: fn(&mut DhRobot)| {
        let mut table = table_1(Isometry3::identity());
        change(&mut table);
        Manipulator::from_dh(&table).unwrap_err()
    };
    let error = refused(|table| table.links[2].joint = "joint_1".to_owned());
    assert!(matches!(error, ModelError::Duplicate("joint", name) if name == "joint_1"));
    let error = refused(|table| table.links[2].link = "base".to_owned());
    assert!(matches!(error, ModelError::Duplicate("link", name) if name == "base"));
    let error = refused(|table| table.links[3].alpha = f64::NAN);
    assert!(matches!(error, ModelError::NotFinite { name, .. } if name == "joint_4"));
    let error = refused(|table| table.base_from_table.translation.x = f64::INFINITY);
    assert!(matches!(error, ModelError::NotFinite { name, .. } if name == "base"));
    let error = refused(|table| table.links[4].parameters = InertialParameters::zero());
    assert!(matches!(error, ModelError::Mass { link, .. } if link == "frame_5"));
    let error = refused(|table| table.base_parameters = -ball());
    assert!(matches!(error, ModelError::Mass { link, .. } if link == "base"));
    let mut fixed = table_1(Isometry3::identity());
    (fixed.base_kind, fixed.base_parameters) = (BaseKind::Fixed, InertialParameters::zero());
    assert!(
        Manipulator::from_dh(&fixed).is_ok(),
        "a fixed base needs no mass"
    );
}

/// Joints are in depth-first order, with children in the order of the file, independently of the
/// order of the links.
#[test]
fn joints_are_in_depth_first_order() {
    let link = |name: &str| format!("<link name='{name}'>{BALL}</link>");
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            "<joint name='{name}' type='continuous'><parent link='{parent}'/><child link='{child}'/></joint>"
        )
    };
    let xml = [
        "<robot name='y'>".to_owned(),
        joint("left_tip", "left", "left_end"),
        joint("right", "base", "right"),
        joint("left", "base", "left"),
        ["left_end", "right", "left", "base"].map(link).concat(),
        "</robot>".to_owned(),
    ]
    .concat();
    let robot = Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap();
    assert_eq!(robot.joint_names(), ["right", "left", "left_tip"]);
    let frames: Vec<_> = robot.frame_names().collect();
    assert_eq!(frames, ["base", "right", "left", "left_end"]);
    assert_eq!(robot.frame_name(robot.frame("left").unwrap()), "left");
    assert_eq!(robot.joint_index("left"), Some(1));
    assert_eq!(robot.joint_index("tail"), None);
    assert_eq!(robot.base_kind(), BaseKind::Floating);
}

/// A robot has the mass of all its links. Removing the end-effector subtracts its mass, and a
/// payload adds its own.
#[test]
fn masses_add_up() {
    for tree in (0..20).map(RandomTree::new) {
        let robot = tree.robot();
        let expected: f64 = tree.0.iter().map(|link| link.parameters.mass()).sum();
        assert!((robot.mass() - expected).abs() < 1e-13 * expected);
    }
    let robot = tactid();
    let tool = robot.frame("tool0").unwrap();
    let gripper = at(vec![0.0; robot.dof()])
        .moved(&robot)
        .subtree_parameters(tool);
    assert!(
        (gripper.mass() - 6.0).abs() < 1e-12,
        "palm 4 kg, two fingers of 1 kg"
    );
    assert!((robot.without_subtree(tool).mass() + 6.0 - robot.mass()).abs() < 1e-9);
    let payload = Cloud::random(&mut rng(4)).parameters();
    let loaded = robot.with_payload(tool, &payload);
    assert!((loaded.mass() - robot.mass() - payload.mass()).abs() < 1e-9);
    let off = loaded.without_subtree(robot.base_frame()).mass();
    assert!(
        (off - 1000.0).abs() < 1e-9,
        "only the spacecraft's own link is left: {off}"
    );
}

/// The robot below a link is that subtree, with the link as its base.
#[test]
fn below_a_link_is_that_part_of_the_tree() {
    let xml = RandomTree::new(3).urdf(false);
    let whole = Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap();
    let part = Urdf::from_xml(&xml).unwrap();
    let part = part
        .manipulator_below(BaseKind::Floating, Some("link_1"))
        .unwrap();
    assert_eq!(part.frame_name(part.base_frame()), "link_1");
    assert!(
        part.joint_names()
            .iter()
            .all(|name| whole.joint_index(name).is_some())
    );
    assert!(part.joint_index("joint_1").is_none());
    let rng = &mut rng(5);
    let state = State::random(rng, whole.dof());
    let moved = state.moved(&whole);
    let of_part = |values: &[f64]| -> Vec<f64> {
        let names = part.joint_names().iter();
        names
            .map(|name| values[whole.joint_index(name).unwrap()])
            .collect()
    };
    let state = State {
        base: moved.frame_motion(whole.frame("link_1").unwrap()),
        position: of_part(&state.position),
        velocity: of_part(&state.velocity),
        acceleration: of_part(&state.acceleration),
    };
    let moved_part = state.moved(&part);
    for name in part.frame_names() {
        let given = moved_part.frame_motion(part.frame(name).unwrap());
        let expected = moved.frame_motion(whole.frame(name).unwrap());
        assert_close(&given.acceleration, &expected.acceleration, 1e-12, name);
    }
}

/// A massless root `world` with the robot on a fixed joint is accepted as a fixed base. Mesh files
/// need not exist, and a massless link on a fixed joint is accepted.
#[test]
fn world_root_meshes_and_massless_frames() {
    let mesh = "<visual><geometry><mesh filename='package://nowhere/arm.stl'/></geometry></visual>";
    let xml = format!(
        "<robot name='bolted'><link name='world'/><link name='base'/><link name='arm'>{BALL}{mesh}</link>\
         <link name='tool'/>\
         <joint name='bolt' type='fixed'><parent link='world'/><child link='base'/><origin xyz='0 0 1'/></joint>\
         <joint name='hinge' type='continuous'><parent link='base'/><child link='arm'/></joint>\
         <joint name='flange' type='fixed'><parent link='arm'/><child link='tool'/><origin xyz='0 0 2'/></joint></robot>"
    );
    let robot = Manipulator::from_urdf(&xml, BaseKind::Fixed).unwrap();
    assert_eq!(robot.joint_names(), ["hinge"]);
    let pose = at(vec![FRAC_PI_2])
        .moved(&robot)
        .pose(robot.frame("tool").unwrap());
    // A joint without <axis> turns about x: 2 m along z become 2 m along -y.
    assert_close(
        &pose.translation.vector,
        &Vector3::new(0.0, -2.0, 1.0),
        1e-15,
        "tool",
    );
    assert!(robot.check_masses(None).is_ok());
    let floating = Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap();
    let error = floating.check_base_mass().unwrap_err();
    assert!(matches!(error, ModelError::MasslessBase(link) if link == "world"));
}

/// A moving link may have its mass in a link that is fixed to it.
#[test]
fn mass_may_sit_on_a_fixed_link() {
    let xml = format!(
        "<robot name='carrier'><link name='base'/><link name='carrier'/><link name='load'>{BALL}</link>\
         <joint name='slide' type='continuous'><parent link='base'/><child link='carrier'/></joint>\
         <joint name='clamp' type='fixed'><parent link='carrier'/><child link='load'/></joint></robot>"
    );
    let robot = Manipulator::from_urdf(&xml, BaseKind::Fixed).unwrap();
    assert_eq!(robot.mass(), 2.0);
}

/// A chain of twenty thousand links is read and moved without exhausting the stack.
#[test]
fn long_chains_are_read() {
    let count = 20_000;
    let mut xml = format!("<robot name='chain'><link name='l0'>{BALL}</link>");
    for link in 1..count {
        write!(
            xml,
            "<link name='l{link}'/><joint name='j{link}' type='fixed'>\
             <parent link='l{}'/><child link='l{link}'/><origin xyz='0 0 0.001'/></joint>",
            link - 1
        )
        .unwrap();
    }
    let robot = Manipulator::from_urdf(&(xml + "</robot>"), BaseKind::Floating).unwrap();
    let tip = robot.frame(&format!("l{}", count - 1)).unwrap();
    let workspace = at(Vec::new()).moved(&robot);
    let height = workspace.pose(tip).translation.z;
    assert!((height - 0.001 * f64::from(count - 1)).abs() < 1e-9);
    assert_eq!(robot.without_subtree(robot.base_frame()).mass(), 2.0);
    let below = workspace.subtree_parameters(robot.base_frame());
    assert_eq!(below, InertialParameters::zero());
}

/// A joint keeps its kind if a joint of another kind mimics it with multiplier 1 and precedes it.
#[test]
fn joint_kind_is_not_that_of_a_mimic() {
    let xml = format!(
        "<robot name='m'><link name='base'/><link name='a'>{BALL}</link><link name='b'>{BALL}</link>\
         <joint name='follower' type='prismatic'><parent link='base'/><child link='a'/>\
         <limit lower='0' upper='1' effort='1' velocity='1'/><mimic joint='leader'/></joint>\
         <joint name='leader' type='continuous'><parent link='base'/><child link='b'/></joint></robot>"
    );
    let robot = Manipulator::from_urdf(&xml, BaseKind::Fixed).unwrap();
    assert_eq!(robot.joint_names(), ["leader"]);
    assert_eq!(robot.joint_kind(0), Some(JointKind::Revolute));
    assert_eq!(robot.joint_kind(1), None);
}
