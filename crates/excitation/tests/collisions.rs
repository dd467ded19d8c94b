//! Designs that keep bodies in their places and apart, checked by points on the bodies at closely
//! spaced times.

use nalgebra::{Isometry3, Point3, Vector3};
use tactid_dynamics::{FrameId, FrameMotion, Urdf, Workspace, motion};
use tactid_excitation::{
    CollisionFinding, CollisionModel, Design, DesignSettings, JointStates, KeepOutBox, Limit,
    Motion, NotTested, OrientedBox, Problem, WorkspaceBounds, design, margins,
};

use crate::common::{TOOL, on_ground, urdf};

/// Depth by which a limit may be exceeded, m: less than one millionth of the boxes.
const TOLERANCE_M: f64 = 1e-7;

/// Points along each side of a box.
const POINTS: usize = 7;

fn quick() -> DesignSettings {
    DesignSettings {
        starts: 1,
        iterations: 15,
        ..DesignSettings::default()
    }
}

fn shapes(problem: &Problem) -> CollisionModel {
    let no_files = &mut |_: &str| panic!("the built-in robot has no meshes");
    CollisionModel::of_urdf(&urdf(), &problem.robot, no_files).unwrap()
}

/// Returns a grid of points in a box and on its surface, in the frame of the box's owner.
fn points(bounds: &OrientedBox) -> Vec<Point3<f64>> {
    let at = |k: usize| 2.0 * k as f64 / (POINTS - 1) as f64 - 1.0;
    let all = 0..POINTS.pow(3);
    all.map(|k| {
        let [x, y, z] = [k, k / POINTS, k / POINTS.pow(2)].map(|k| at(k % POINTS));
        bounds.pose * Point3::from(Vector3::new(x, y, z).component_mul(&bounds.half_size))
    })
    .collect()
}

/// Returns how far a point is outside of a box, m; inside, minus the distance from the surface.
fn outside(bounds: &OrientedBox, point: &Point3<f64>) -> f64 {
    let beyond = (bounds.pose.inverse() * point).coords.abs() - bounds.half_size;
    let apart = beyond.map(|x| x.max(0.0)).norm();
    if apart > 0.0 { apart } else { beyond.max() }
}

/// Calls a function with the pose of a frame at a thousand times for each second of a motion.
fn each_pose(
    problem: &Problem,
    motion_of: &dyn Motion,
    frame: FrameId,
    mut visit: impl FnMut(Isometry3<f64>),
) {
    let mut workspace = Workspace::new(&problem.robot);
    let base = FrameMotion::at_rest(Isometry3::identity());
    let steps = (1000.0 * motion_of.duration_s()) as usize;
    for k in 0..=steps {
        let states = motion_of.at(k as f64 * 1e-3);
        motion(&mut workspace, &base, states.joints()).unwrap();
        visit(workspace.pose(frame));
    }
}

/// Returns the largest fraction that a design uses of limits of a kind.
fn largest(design: &Design, is_of: impl Fn(&Limit) -> bool) -> f64 {
    let of_kind = design.margins.iter().filter(|margin| is_of(&margin.limit));
    of_kind.map(|margin| margin.used).fold(0.0, f64::max)
}

fn payload_box() -> OrientedBox {
    OrientedBox::between([0.1, -0.1, -0.05], [0.3, 0.1, 0.15])
}

/// Returns the box around tool and payload at the start, larger by `room` metres on each side.
fn around_start(problem: &Problem, room: f64) -> OrientedBox {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let tool = problem.robot.frame(TOOL).unwrap();
    each_pose(problem, &Resting(problem.start.clone()), tool, |pose| {
        let origin = [Point3::origin()].into_iter();
        for point in points(&payload_box()).into_iter().chain(origin) {
            for (axis, x) in (pose * point).iter().enumerate() {
                low[axis] = low[axis].min(x - room);
                high[axis] = high[axis].max(x + room);
            }
        }
    });
    OrientedBox::between(low, high)
}

/// A motion at rest.
struct Resting(Vec<f64>);

impl Motion for Resting {
    fn duration_s(&self) -> f64 {
        0.01
    }

    fn at(&self, _time_s: f64) -> JointStates {
        JointStates::at_rest(&self.0)
    }
}

/// Tool and payload stay in a box that binds, and out of another one.
#[test]
fn tool_and_payload_stay_in_their_place() {
    let mut problem = on_ground();
    problem.payload_box = Some(payload_box());
    let tool = problem.robot.frame(TOOL).unwrap();
    let inside = around_start(&problem, 0.2);
    let low = inside.pose.translation.vector - inside.half_size;
    let below = OrientedBox::between(
        [low.x, low.y, low.z - 1.0],
        [low.x + 2.0, low.y + 2.0, low.z + 0.1],
    );
    let table = KeepOutBox {
        name: "table".to_owned(),
        place: below,
    };
    let bounds = WorkspaceBounds {
        inside: Some(inside),
        keep_out: vec![table],
    };
    let excess = |motion: &dyn Motion| {
        let (mut beyond, mut entered) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        each_pose(&problem, motion, tool, |pose| {
            for point in points(&payload_box()) {
                beyond = beyond.max(outside(&inside, &(pose * point)));
                entered = entered.max(problem.least_distance_m - outside(&below, &(pose * point)));
            }
        });
        (beyond, entered)
    };
    let free = design(&problem, &quick()).unwrap();
    let (beyond, entered) = excess(&free.trajectory);
    assert!(beyond > 0.1 && entered > 0.1, "{beyond} {entered}");
    let mut bounded = problem.clone();
    bounded.workspace = bounds;
    let kept = design(&bounded, &quick()).unwrap();
    let (beyond, entered) = excess(&kept.trajectory);
    assert!(
        beyond < TOLERANCE_M && entered < TOLERANCE_M,
        "{beyond} {entered}"
    );
    let is_payload = |limit: &Limit| matches!(limit, Limit::Workspace("the payload", _));
    assert!(largest(&kept, is_payload) > 0.95);
    let is_table = |limit: &Limit| matches!(limit, Limit::Distance(..));
    assert!(largest(&kept, is_table) > 0.3, "{:?}", kept.margins);
    assert!(kept.prediction.largest().1 > free.prediction.largest().1);
    assert!(kept.margins.iter().all(|margin| margin.used <= 1.0 + 1e-6));
    // The free motion is reported to exceed both.
    let (all, _) = margins(&bounded, &free.trajectory).unwrap();
    let exceeded = |name: &str| {
        let mut named = all
            .iter()
            .filter(|margin| margin.limit.to_string().contains(name));
        named.any(|margin| margin.used > 1.0)
    };
    assert!(exceeded("in the workspace") && exceeded("the payload and the keep-out box table"));
}

/// The payload keeps away from the links, although a motion without collision shapes hits them.
#[test]
fn the_payload_does_not_hit_the_robot() {
    let mut problem = on_ground();
    problem.payload_box = Some(OrientedBox::between([0.0, -0.6, -0.2], [0.4, 0.02, 0.2]));
    let free = design(&problem, &quick()).unwrap();
    assert!(free.findings.is_empty());
    problem.collisions = Some(shapes(&problem));
    let used = |motion: &dyn Motion| {
        let (all, _) = margins(&problem, motion).unwrap();
        let pairs = all
            .into_iter()
            .filter(|margin| matches!(margin.limit, Limit::Distance(..)));
        pairs.map(|margin| margin.used).fold(0.0, f64::max)
    };
    assert!(used(&free.trajectory) > 1.0);
    let kept = design(&problem, &quick()).unwrap();
    assert!(used(&kept.trajectory) <= 1.0 + 1e-6);
    // The box of the payload overlaps the link next to its own, and neighbours their joints.
    let [adjacent, reduced, touching] = kept.findings.as_slice() else {
        panic!("{:?}", kept.findings)
    };
    let pair = |first: &str, second: &str| [first, second].map(str::to_owned);
    assert!(matches!(
        reduced,
        CollisionFinding::LeastDistanceReduced { pair: names, at_start_m, asked_m }
            if *names == pair("forearm_link", "wrist_2_link") && at_start_m < &(2.0 * asked_m)
    ));
    assert_eq!(
        *touching,
        CollisionFinding::PairsNotTested {
            pairs: vec![pair("wrist_2_link", "the payload")],
            because: NotTested::InContact,
        }
    );
    let expected =
        "not tested for collisions, because one joint connects them: base_link and shoulder_link, ";
    assert!(adjacent.to_string().starts_with(expected), "{adjacent}");
}

fn message(problem: &Problem) -> String {
    let failed = |design: Design| panic!("{:?}", design.margins);
    design(problem, &quick()).map_or_else(|error| error.to_string(), failed)
}

/// Places and boxes that are impossible name the bodies and the field.
#[test]
fn impossible_places_are_errors() {
    let mut problem = on_ground();
    problem.workspace.inside = Some(OrientedBox::between([5.0; 3], [6.0; 3]));
    let found = message(&problem);
    let expected = "no motion is possible: the position of the tool along x in the workspace is ";
    assert!(found.starts_with(expected), "{found}");
    let mut problem = on_ground();
    let place = OrientedBox::between([-2.0; 3], [2.0; 3]);
    problem.workspace.keep_out.push(KeepOutBox {
        name: "table".to_owned(),
        place,
    });
    let expected = "no motion is possible: the tool and the keep-out box table touch at the start";
    assert_eq!(message(&problem), expected);
    problem.workspace.keep_out[0].place.half_size.y = 0.0;
    let expected =
        "`workspace.keep_out[0] (table).half_size` is 0; expected a finite number above zero";
    assert_eq!(message(&problem), expected);
    let mut problem = on_ground();
    problem.collisions = Some(shapes(&problem));
    problem.payload_box = Some(OrientedBox::between([0.0, -0.4, -0.2], [0.4, 0.4, 0.2]));
    let expected = "no motion is possible: wrist_1_link and the payload touch at the start";
    assert_eq!(message(&problem), expected);
    let mut problem = on_ground();
    problem.least_distance_m = f64::NAN;
    assert!(message(&problem).starts_with("`least_distance_m` is NaN"));
    problem = on_ground();
    problem.payload_box = Some(OrientedBox::between([0.0; 3], [0.0, 1.0, 1.0]));
    assert!(message(&problem).starts_with("`payload_box.half_size` is 0"));
}

/// Returns a robot with one link that a mesh describes.
fn with_mesh(file: &str) -> Urdf {
    Urdf::from_xml(&format!(
        "<robot name='arm'><link name='base'/><link name='arm'>\
         <inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>\
         <collision><geometry><mesh filename='{file}' scale='0.001 0.001 0.001'/></geometry></collision></link>\
         <joint name='turn' type='continuous'><parent link='base'/><child link='arm'/></joint></robot>"
    ))
    .unwrap()
}

/// Returns a tetrahedron as an STL file of text, a binary one and an OBJ file.
fn tetrahedron() -> [Vec<u8>; 3] {
    let corners = [[0, 0, 0], [100, 0, 0], [0, 100, 0], [0, 0, 100]];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let text = |[x, y, z]: [i32; 3]| format!("{x} {y} {z}");
    let facet = |face: [usize; 3]| {
        let vertices = face
            .map(|k| format!("vertex {}\n", text(corners[k])))
            .concat();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let ascii = format!("solid a\n{}endsolid a\n", faces.map(facet).concat());
    let vertices = corners
        .map(|corner| format!("v {}\n", text(corner)))
        .concat();
    let line = |face: [usize; 3]| format!("f {} {} {}\n", face[0] + 1, face[1] + 1, face[2] + 1);
    let obj = vertices + &faces.map(line).concat();
    let mut binary = vec![0; 80];
    binary.extend(4u32.to_le_bytes());
    for face in faces {
        binary.extend([0; 12]);
        let numbers = face.into_iter().flat_map(|k| corners[k]);
        binary.extend(numbers.flat_map(|x| (x as f32).to_le_bytes()));
        binary.extend([0; 2]);
    }
    [ascii.into_bytes(), binary, obj.into_bytes()]
}

/// Meshes are read as their convex hull, whatever their format; what cannot be read is a finding
/// that names the file.
#[test]
fn meshes_are_read_or_named() {
    let [ascii, mut binary, obj] = tetrahedron();
    let model = |file: &str, bytes: Result<Vec<u8>, String>| {
        let urdf = with_mesh(file);
        let robot = urdf.manipulator(tactid_dynamics::BaseKind::Fixed).unwrap();
        let mut asked = Vec::new();
        let read = &mut |name: &str| {
            asked.push(name.to_owned());
            bytes.clone()
        };
        let model = CollisionModel::of_urdf(&urdf, &robot, read).unwrap();
        assert_eq!(asked, [file]);
        model
            .findings()
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
    };
    let none: Vec<String> = Vec::new();
    assert_eq!(model("a.stl", Ok(ascii.clone())), none);
    assert_eq!(model("a.STL", Ok(binary.clone())), none);
    assert_eq!(model("package://arm/a.obj", Ok(obj)), none);
    binary.truncate(150);
    let flat = String::from_utf8(ascii).unwrap().replace("100", "0");
    let cases = [
        ("a.dae", Ok(Vec::new()), "only STL, OBJ and PLY are read"),
        ("a.stl", Ok(flat.into_bytes()), "its points span no volume"),
        (
            "a.stl",
            Ok(binary),
            "its header announces 4 triangles, but it has room for 1",
        ),
        ("a.stl", Err("no such file".to_owned()), "no such file"),
    ];
    for (file, bytes, because) in cases {
        let expected = [
            format!("the collision shape `{file}` of link arm is left out: {because}"),
            "no link has a collision shape that can be tested: collisions of the robot are not tested".to_owned(),
        ];
        assert_eq!(model(file, bytes), expected);
    }
}

/// Returns an arm with a link that has the shapes of a text.
fn with_shapes(shapes: &str) -> Urdf {
    let mesh =
        "<collision><geometry><mesh filename='' scale='0.001 0.001 0.001'/></geometry></collision>";
    let urdf = with_mesh("");
    assert!(urdf.xml().contains(mesh));
    Urdf::from_xml(&urdf.xml().replace(mesh, shapes)).unwrap()
}

/// Findings are few, and shapes as many as can be tested at each step; what is too far away to
/// measure a distance is left out.
#[test]
fn shapes_and_findings_are_bounded() {
    let findings = |shapes: &str| {
        let urdf = with_shapes(shapes);
        let robot = urdf.manipulator(tactid_dynamics::BaseKind::Fixed).unwrap();
        let read = &mut |_: &str| Err("there is none".to_owned());
        let model = CollisionModel::of_urdf(&urdf, &robot, read).unwrap();
        let findings = model.findings().iter().map(ToString::to_string);
        findings.collect::<Vec<_>>()
    };
    let shape = |origin: &str, geometry: &str| {
        format!("<collision><origin xyz='{origin}'/><geometry>{geometry}</geometry></collision>")
    };
    let small = shape("0 0 1", "<box size='1 1 1'/>");
    assert_eq!(findings(&small.repeat(200)), Vec::<String>::new());
    assert_eq!(
        findings(&small.repeat(203)),
        ["3 more collision shapes are not tested: at most 200 are"]
    );
    let missing = (0..25).map(|k| shape("0 0 0", &format!("<mesh filename='{k}.stl'/>")));
    let found = findings(&(missing.collect::<String>() + &small));
    assert_eq!(found.len(), 21);
    assert_eq!(found[20], "5 more collision shapes are left out");
    for far in [
        shape("0 2e6 0", "<sphere radius='1'/>"),
        shape("0 0 0", "<box size='1 1 1e160'/>"),
    ] {
        let found = findings(&(far + &small));
        assert!(
            found[0].ends_with("it reaches beyond 1000 km") && found.len() == 1,
            "{found:?}"
        );
    }
    let long = shape(
        "0 0 0",
        &format!("<mesh filename='{}.stl'/>", "n".repeat(1000)),
    );
    assert!(findings(&(long + &small))[0].len() < 300);
}
