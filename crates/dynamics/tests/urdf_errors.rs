//! Errors for URDFs that no robot can be made from name the link or joint at fault and the reason.

use tactid_dynamics::{BaseKind, Manipulator, ModelError};

/// A robot with one joint, of which each test replaces an element.
struct Urdf {
    base: String,
    arm: String,
    joint: String,
    more: String,
}

fn inertial(mass: &str, diagonal: [f64; 3]) -> String {
    let [xx, yy, zz] = diagonal;
    format!(
        "<inertial><mass value='{mass}'/>\
         <inertia ixx='{xx}' ixy='0' ixz='0' iyy='{yy}' iyz='0' izz='{zz}'/></inertial>"
    )
}

fn link(name: &str) -> String {
    format!("<link name='{name}'>{}</link>", inertial("1", [1.0; 3]))
}

fn joint(name: &str, parent: &str, child: &str, rest: &str) -> String {
    format!(
        "<joint name='{name}' type='continuous'><parent link='{parent}'/>\
         <child link='{child}'/>{rest}</joint>"
    )
}

impl Default for Urdf {
    fn default() -> Self {
        Self {
            base: link("base"),
            arm: link("arm"),
            joint: joint("hinge", "base", "arm", ""),
            more: String::new(),
        }
    }
}

impl Urdf {
    fn xml(&self) -> String {
        let Self {
            base,
            arm,
            joint,
            more,
        } = self;
        format!("<robot name='r'>{base}{arm}{joint}{more}</robot>")
    }

    fn error(&self) -> ModelError {
        error(&self.xml())
    }
}

fn error(xml: &str) -> ModelError {
    match Manipulator::from_urdf(xml, BaseKind::Floating) {
        Err(error) => error,
        Ok(_) => panic!("this was taken for a robot:\n{xml}"),
    }
}

/// Asserts that an error is the variant and that its message contains each of the words.
macro_rules! assert_says {
    ($error:expr, $variant:pat, $($word:expr),+) => {{
        let error: ModelError = $error;
        assert!(matches!(error, $variant), "{error:?}");
        let message = error.to_string();
        $(assert!(message.contains($word), "no {:?} in: {message}", $word);)+
    }};
}

/// The robot that the tests modify is valid.
#[test]
fn the_sound_robot_is_read() {
    assert!(Manipulator::from_urdf(&Urdf::default().xml(), BaseKind::Floating).is_ok());
}

/// Text that is not a URDF is refused, and the error for a missing file contains its path.
#[test]
fn not_a_urdf() {
    for xml in [
        "",
        "not xml",
        "<robot name='r'>",
        "<robot/>",
        "{}",
        "<html><body/></html>",
    ] {
        assert_says!(error(xml), ModelError::Syntax(_), "not a URDF");
    }
    assert_says!(
        error("<robot name='r'></robot>"),
        ModelError::Syntax(_),
        "link"
    );
    let read = Manipulator::from_urdf_file("/nowhere/robot.urdf".as_ref(), BaseKind::Fixed);
    assert_says!(
        read.unwrap_err(),
        ModelError::File { .. },
        "/nowhere/robot.urdf"
    );
}

/// The pose and the axis of a joint must be finite numbers, as many as the attribute has.
#[test]
fn poses_and_axes_that_are_not_numbers() {
    for (rest, expected) in [
        ("<origin xyz='nan 0 0'/>", "3 finite numbers"),
        ("<origin xyz='1 2'/>", "3 finite numbers"),
        ("<origin xyz='${x} 0 0'/>", "3 finite numbers"),
        ("<origin rpy='0 inf 0'/>", "3 finite numbers"),
        ("<origin quat_xyzw='0 0 1'/>", "4 finite numbers"),
        ("<origin quat_xyzw='0 0 0 0'/>", "4 finite numbers"),
        ("<axis xyz='0 nan 1'/>", "3 finite numbers"),
        ("<axis xyz='0 0 inf'/>", "3 finite numbers"),
        ("<axis xyz=''/>", "3 finite numbers"),
    ] {
        let urdf = Urdf {
            joint: joint("hinge", "base", "arm", rest),
            ..Urdf::default()
        };
        assert_says!(
            urdf.error(),
            ModelError::Numbers { .. },
            "joint `hinge`",
            rest.split('\'').nth(1).unwrap(),
            expected
        );
    }
}

/// A moving joint must have an axis and a supported type.
#[test]
fn joints_without_axis_or_of_another_kind() {
    let urdf = Urdf {
        joint: joint("hinge", "base", "arm", "<axis xyz='0 0 0'/>"),
        ..Urdf::default()
    };
    assert_says!(urdf.error(), ModelError::Axis(_), "`hinge`", "zero");
    for kind in ["ball", "revolut", ""] {
        let urdf = Urdf {
            joint: joint("hinge", "base", "arm", "").replace("continuous", kind),
            ..Urdf::default()
        };
        assert_says!(
            urdf.error(),
            ModelError::JointKind { .. },
            "`hinge`",
            kind,
            "prismatic"
        );
    }
}

/// A joint must name existing links.
#[test]
fn missing_links() {
    for (parent, child) in [("bse", "arm"), ("base", "bse")] {
        let urdf = Urdf {
            joint: joint("hinge", parent, child, ""),
            ..Urdf::default()
        };
        assert_says!(
            urdf.error(),
            ModelError::MissingLink { .. },
            "`hinge`",
            "`bse`"
        );
    }
}

/// The error for a loop names a link of the loop and not a link below it: for two parents, for a
/// loop through the root and for a loop beside the tree.
#[test]
fn loops() {
    let two_parents = Urdf {
        more: link("hand") + &joint("a", "arm", "hand", "") + &joint("b", "base", "hand", ""),
        ..Urdf::default()
    };
    assert_says!(two_parents.error(), ModelError::Loop(_), "`hand`");
    let way_back = Urdf {
        base: link("tail") + &link("base"),
        more: joint("back", "arm", "base", "") + &joint("t", "arm", "tail", ""),
        ..Urdf::default()
    };
    assert!(
        !way_back.error().to_string().contains("`tail`"),
        "{}",
        way_back.error()
    );
    assert_says!(way_back.error(), ModelError::Loop(_), "loop");
    let itself = Urdf {
        joint: joint("hinge", "arm", "arm", ""),
        ..Urdf::default()
    };
    assert_says!(itself.error(), ModelError::Loop(_), "`arm`");
    let ring = ["tail", "one", "two"].map(link).concat()
        + &joint("a", "one", "two", "")
        + &joint("b", "two", "one", "")
        + &joint("c", "two", "tail", "");
    let apart = Urdf {
        more: ring,
        ..Urdf::default()
    };
    let error = apart.error();
    assert!(
        matches!(&error, ModelError::Loop(link) if link == "one" || link == "two"),
        "{error}"
    );
}

/// A robot has one root, and each name is used once.
#[test]
fn roots_and_names() {
    let two_roots = Urdf {
        more: link("stray"),
        ..Urdf::default()
    };
    assert_says!(
        two_roots.error(),
        ModelError::Roots(_),
        "the links base and stray have no parent"
    );
    let link_twice = Urdf {
        more: link("arm"),
        ..Urdf::default()
    };
    assert_says!(
        link_twice.error(),
        ModelError::Duplicate("link", _),
        "`arm`"
    );
    let joint_twice = Urdf {
        more: link("hand") + &joint("hinge", "arm", "hand", ""),
        ..Urdf::default()
    };
    assert_says!(
        joint_twice.error(),
        ModelError::Duplicate("joint", _),
        "`hinge`"
    );
}

/// A link or joint without its names is refused with its line.
#[test]
fn elements_without_names() {
    for (more, line, missing) in [
        ("\n<link/>", "line 2", "`name`"),
        (
            "\n\n<joint type='fixed'><parent link='arm'/><child link='base'/></joint>",
            "line 3",
            "`name`",
        ),
        (
            "\n<joint name='a'><parent link='arm'/></joint>",
            "line 2",
            "<child>",
        ),
        (
            "<joint name='a'>\n<parent/>\n<child link='arm'/></joint>",
            "line 2",
            "`link`",
        ),
    ] {
        let urdf = Urdf {
            more: more.to_owned(),
            ..Urdf::default()
        };
        assert_says!(urdf.error(), ModelError::Syntax(_), line, missing);
    }
}

/// Text that is no XML document is refused with its line; elements that are nested without end
/// exhaust no stack.
#[test]
fn what_is_no_xml_document() {
    for (xml, line, reason) in [
        ("<robot>\n<link name='a'></robot>", "line 2", "link"),
        (
            "<robot>\n\n<link name='a'>",
            "line 3",
            "<link> is not closed",
        ),
        (
            "<robot name='r'/>\n<robot name='s'/>",
            "line 2",
            "second root",
        ),
        (
            "<robot name='r'>\n<link name='a' name='b'/></robot>",
            "line 2",
            "duplicate",
        ),
        ("\n<html/>", "line 2", "<html>"),
    ] {
        assert_says!(error(xml), ModelError::Syntax(_), line, reason);
    }
    let nested = "<robot name='r'>".to_owned() + &"<a>".repeat(1_000_000);
    assert_says!(
        error(&nested),
        ModelError::Syntax(_),
        "200 elements are nested"
    );
    let attributes: String = (0..1_000_000).map(|k| format!(" a{k}=''")).collect();
    let hostile = [
        ("<a/>".repeat(1_000_001), "more than 1000000 elements"),
        (format!("<a{attributes}/>"), "more than 1000 attributes"),
    ];
    for (content, reason) in hostile {
        let xml = format!("<robot name='r'>{content}</robot>");
        assert_says!(error(&xml), ModelError::Syntax(_), reason);
    }
    let too_long = " ".repeat((16 << 20) + 1);
    let reason = "17 MiB, but at most 16 MiB";
    assert_says!(error(&too_long), ModelError::Syntax(_), reason);
    let macros =
        "<robot xmlns:xacro='x'><xacro:macro name='arm'><link name='a'/></xacro:macro></robot>";
    assert_says!(error(macros), ModelError::Syntax(_), "no link", "xacro");
}

/// The error for an unknown base or tip lists the existing links.
#[test]
fn unknown_frames_list_the_links() {
    let xml = Urdf::default().xml();
    let urdf = tactid_dynamics::Urdf::from_xml(&xml).unwrap();
    let below = urdf.manipulator_below(BaseKind::Floating, Some("bse"));
    assert_says!(
        below.unwrap_err(),
        ModelError::UnknownFrame { .. },
        "`bse`",
        "base, arm"
    );
    let robot = Manipulator::from_urdf(&xml, BaseKind::Floating).unwrap();
    let tip = robot.frame("tip").unwrap_err();
    assert_says!(tip, ModelError::UnknownFrame { .. }, "`tip`", "base, arm");
}
