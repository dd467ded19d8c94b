//! Errors for faulty URDFs name the link or joint at fault and the reason.

#![allow(clippy::unwrap_used, clippy::panic)]

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
    let number = Urdf {
        base: format!("<link name='base'>{}</link>", inertial("heavy", [1.0; 3])),
        ..Urdf::default()
    };
    assert_says!(number.error(), ModelError::Syntax(_), "not a URDF");
    let read = Manipulator::from_urdf_file("/nowhere/robot.urdf".as_ref(), BaseKind::Fixed);
    assert_says!(
        read.unwrap_err(),
        ModelError::File { .. },
        "/nowhere/robot.urdf"
    );
}

/// A moving link or a floating base without mass is a robot whose poses are known. The check of its masses names the link
/// and the joint that moves it, also for a mimic joint, and knows the masses that were removed.
#[test]
fn massless_links() {
    let massless = |name: &str| format!("<link name='{name}'/>");
    let check = |urdf: &Urdf, base: BaseKind| {
        let robot = Manipulator::from_urdf(&urdf.xml(), base).unwrap();
        robot.check_masses()
    };
    let arm = Urdf {
        arm: massless("arm"),
        ..Urdf::default()
    };
    assert_says!(
        check(&arm, BaseKind::Floating).unwrap_err(),
        ModelError::NoInertial(..),
        "`arm`",
        "`hinge`",
        "<inertial>"
    );
    let base = Urdf {
        base: massless("base"),
        ..Urdf::default()
    };
    assert!(check(&base, BaseKind::Fixed).is_ok());
    assert_says!(
        check(&base, BaseKind::Floating).unwrap_err(),
        ModelError::MasslessBase(_),
        "`base`",
        "floating"
    );
    let follower = Urdf {
        more: massless("hand") + &joint("wrist", "arm", "hand", "<mimic joint='hinge'/>"),
        ..Urdf::default()
    };
    assert_says!(
        check(&follower, BaseKind::Fixed).unwrap_err(),
        ModelError::NoInertial(..),
        "`hand`",
        "`wrist`"
    );
    let whole = Manipulator::from_urdf(&Urdf::default().xml(), BaseKind::Floating).unwrap();
    let rest = whole.without_subtree(whole.base_frame());
    assert_eq!(rest.mass(), 1.0);
    assert!(rest.check_masses().is_ok());
}

/// A mass must be positive and finite, also with zero inertia.
#[test]
fn impossible_masses() {
    for (mass, moments) in [
        ("0", [1.0; 3]),
        ("-2", [1.0; 3]),
        ("-2", [0.0; 3]),
        ("nan", [0.0; 3]),
        ("inf", [1.0; 3]),
    ] {
        let urdf = Urdf {
            arm: format!("<link name='arm'>{}</link>", inertial(mass, moments)),
            ..Urdf::default()
        };
        let shown = mass.replace("nan", "NaN");
        assert_says!(
            urdf.error(),
            ModelError::Mass { .. },
            "`arm`",
            &shown,
            "positive"
        );
    }
}

/// An inertia must satisfy the triangle inequality and have no negative moment.
#[test]
fn impossible_inertias() {
    for moments in [[1.0, 1.0, 2.1], [-0.1, 1.0, 1.0], [5.0, 1.0, 1.0]] {
        let urdf = Urdf {
            arm: format!("<link name='arm'>{}</link>", inertial("1", moments)),
            ..Urdf::default()
        };
        assert_says!(
            urdf.error(),
            ModelError::Inertia { .. },
            "`arm`",
            "sum of the other two"
        );
    }
    let rod = Urdf {
        arm: format!("<link name='arm'>{}</link>", inertial("1", [0.0, 1.0, 1.0])),
        ..Urdf::default()
    };
    assert!(
        Manipulator::from_urdf(&rod.xml(), BaseKind::Floating).is_ok(),
        "a thin rod"
    );
}

/// Every number of a URDF must be finite.
#[test]
fn numbers_that_are_not_finite() {
    let in_joint = |rest: &str| Urdf {
        joint: joint("hinge", "base", "arm", rest),
        ..Urdf::default()
    };
    for rest in [
        "<origin xyz='nan 0 0'/>",
        "<origin rpy='0 inf 0'/>",
        "<axis xyz='0 nan 1'/>",
        "<axis xyz='0 0 inf'/>",
    ] {
        assert_says!(
            in_joint(rest).error(),
            ModelError::NotFinite { .. },
            "`hinge`"
        );
    }
    for inertial in [
        inertial("1", [f64::NAN, 1.0, 1.0]),
        inertial("1", [1.0, 1.0, f64::INFINITY]),
        inertial("1", [1.0; 3]).replace("<mass", "<origin xyz='0 nan 0'/><mass"),
    ] {
        let urdf = Urdf {
            arm: format!("<link name='arm'>{inertial}</link>"),
            ..Urdf::default()
        };
        assert_says!(
            urdf.error(),
            ModelError::NotFinite { .. },
            "`arm`",
            "not finite"
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
    for kind in ["floating", "planar"] {
        let urdf = Urdf {
            joint: joint("hinge", "base", "arm", "").replace("continuous", kind),
            ..Urdf::default()
        };
        assert_says!(urdf.error(), ModelError::JointKind { .. }, "`hinge`", kind);
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
    assert_says!(two_roots.error(), ModelError::Roots(_), "base", "stray");
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

/// A mimic joint must follow an existing, moving and independent joint with a finite multiplier and
/// offset.
#[test]
fn mimic_joints_that_cannot_be_honoured() {
    let following = |mimic: &str| Urdf {
        more: link("hand") + &joint("wrist", "arm", "hand", mimic),
        ..Urdf::default()
    };
    let unknown = following("<mimic joint='hnge'/>");
    assert_says!(
        unknown.error(),
        ModelError::Mimic { .. },
        "`wrist`",
        "`hnge`",
        "not have"
    );
    let itself = following("<mimic joint='wrist'/>");
    assert_says!(
        itself.error(),
        ModelError::Mimic { .. },
        "`wrist`",
        "mimics a joint itself"
    );
    let wild = following("<mimic joint='hinge' multiplier='inf'/>");
    assert_says!(
        wild.error(),
        ModelError::Mimic { .. },
        "`wrist`",
        "not finite"
    );
    let mut of_fixed = following("<mimic joint='hinge'/>");
    of_fixed.joint = of_fixed.joint.replace("continuous", "fixed");
    assert_says!(
        of_fixed.error(),
        ModelError::Mimic { .. },
        "`wrist`",
        "does not move"
    );
    let mut chained = following("<mimic joint='hinge'/>");
    chained.more += &(link("finger") + &joint("grip", "hand", "finger", "<mimic joint='wrist'/>"));
    assert_says!(
        chained.error(),
        ModelError::Mimic { .. },
        "`grip`",
        "`wrist`",
        "leads"
    );
}

/// The error for an unknown base or tip lists the existing links.
#[test]
fn unknown_frames_list_the_links() {
    let xml = Urdf::default().xml();
    let below = Manipulator::from_urdf_below(&xml, BaseKind::Floating, Some("bse"));
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
