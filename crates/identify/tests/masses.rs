//! Methods that need the masses of the robot name the link without one; the tactile method needs none.

#![allow(clippy::unwrap_used, clippy::panic)]

use tactid_identify::{
    BaseKind, EquationSettings, EquationStream, IdentifyError, Manipulator, Method, ModelError,
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
            effort_is_net: true,
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
        assert!(message.ends_with("or use the tactile method, which needs none"));
        let IdentifyError::NoMasses { source, .. } = &error else {
            panic!("{error:?}")
        };
        match base {
            BaseKind::Fixed => assert!(matches!(source, ModelError::NoInertial(link, joint)
                if link == "arm" && joint == "hinge")),
            BaseKind::Floating => {
                assert!(matches!(source, ModelError::MasslessBase(link) if link == "base"));
            }
        }
    }
}
