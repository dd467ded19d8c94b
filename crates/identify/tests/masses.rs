//! Methods that need the masses of the robot name what it lacks, and refuse a robot only where no
//! mass is known; the tactile method needs none.

use tactid_dynamics::ModelFinding;
use tactid_identify::{
    BaseKind, EffortContent, EquationSettings, EquationStream, IdentifyError, Manipulator, Method,
};

const MASSLESS: &str = r#"<robot name="arm"><link name="base"/><link name="arm"/><link name="tool0"/>
  <joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/></joint>
  <joint name="flange" type="fixed"><parent link="arm"/><child link="tool0"/></joint></robot>"#;

fn stream(base: BaseKind, settings: &EquationSettings) -> Result<(), IdentifyError> {
    let robot = Manipulator::from_urdf(MASSLESS, base).unwrap();
    EquationStream::new(&robot, "tool0", &["tool0"], settings).map(|_| ())
}

fn with(method: Method) -> EquationSettings {
    EquationSettings {
        method,
        ..EquationSettings::default()
    }
}

#[test]
fn wrenches_and_net_efforts_need_no_masses() {
    for base in [BaseKind::Fixed, BaseKind::Floating] {
        assert!(stream(base, &with(Method::Tactile)).is_ok());
        let net = EquationSettings {
            effort_content: EffortContent::External,
            ..with(Method::Effort)
        };
        assert!(stream(base, &net).is_ok());
    }
    assert!(stream(BaseKind::Fixed, &with(Method::Combined { effort: false })).is_ok());
}

#[test]
fn other_methods_name_the_link_and_a_method_without() {
    for (base, method) in [
        (BaseKind::Fixed, Method::Effort),
        (BaseKind::Fixed, Method::Combined { effort: true }),
        (BaseKind::Floating, Method::JointSensing),
        (BaseKind::Floating, Method::Combined { effort: false }),
    ] {
        let error = stream(base, &with(method)).unwrap_err();
        let message = error.to_string();
        let expected = format!("the {method} method needs the masses of the robot: ");
        assert!(message.starts_with(&expected), "{message}");
        assert!(message.contains("or use the tactile method, which needs none"));
        assert_eq!(error.option(), Some("method"));
        let place = match base {
            BaseKind::Fixed => "from `arm` on, which joint `hinge` moves",
            BaseKind::Floating => "the floating base `base` has no mass",
        };
        assert!(message.contains(place), "{message}");
    }
}

/// A chain of which one body has mass.
fn partly(base: &str) -> String {
    let inertial = "<inertial><mass value='1'/>\
        <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='9'/></inertial>";
    format!(
        "<robot name='arm'><link name='base'>{base}</link><link name='virtual'/>\
         <link name='tool0'>{inertial}<contact/></link>\
         <joint name='a' type='continuous'><parent link='base'/><child link='virtual'/></joint>\
         <joint name='b' type='continuous'><parent link='virtual'/><child link='tool0'/></joint></robot>"
    )
}

#[test]
fn a_part_of_the_masses_is_enough_and_the_rest_is_reported() {
    let findings = |method, base, text: &str| {
        let robot = Manipulator::from_urdf(&partly(text), base).unwrap();
        let stream = EquationStream::new(&robot, "tool0", &["tool0"], &with(method))?;
        let kind = |finding: ModelFinding| match finding {
            ModelFinding::Massless { .. } => "massless",
            ModelFinding::ImpossibleInertia { .. } => "inertia",
            ModelFinding::PartIgnored { .. } => "ignored",
            other => panic!("{other:?}"),
        };
        Ok::<_, IdentifyError>(
            stream
                .model_findings()
                .into_iter()
                .map(kind)
                .collect::<Vec<_>>(),
        )
    };
    let all = ["inertia", "ignored", "massless"];
    let (fixed, floating) = (BaseKind::Fixed, BaseKind::Floating);
    assert_eq!(findings(Method::Effort, fixed, "").unwrap(), all);
    assert_eq!(findings(Method::Effort, floating, "").unwrap(), all);
    assert_eq!(findings(Method::Tactile, fixed, "").unwrap(), ["ignored"]);
    // The momentum of a floating base is part of the balance.
    let error = findings(Method::JointSensing, floating, "").unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("the floating base `base` has no mass"),
        "{message}"
    );
    let heavy = "<inertial><mass value='9'/>\
        <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>";
    assert_eq!(
        findings(Method::JointSensing, floating, heavy).unwrap(),
        all
    );
}
