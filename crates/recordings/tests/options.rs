//! Options are declared once: the table of declarations, and requests that are read by the names of
//! options.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};
use tactid_dynamics::MassProperties;
use tactid_recordings::{
    ActsOn, BoundingBox, EstimatorKind, GivenTool, GravityChoice, Kind, Method, OffsetChoice,
    Request, SensorFrame, Use,
};

fn read(options: Value) -> Result<Request, serde_json::Error> {
    serde_json::from_value(options)
}

/// A value of each kind is read as the field has it.
#[test]
fn a_request_is_read_by_the_names_of_its_options() {
    let given = json!({
        "method": "joint-sensing",
        "estimator": "nlms",
        "wrench_acts_on": "sensor",
        "wrench_offset": "yes",
        "cutoff_hz": 5,
        "epochs": 3,
        "tip": "hand",
        "imu_topic": null,
        "joint_topic": "/joint_states",
        "wrench_topic": ["/left", "/right"],
        "rename_joints": {"a": "b"},
        "gravity": [0, 0, -9.81],
        "effort_gain": [1, 2.5],
        "effort_noise": 0.5,
        "wrench_noise": [1, 1, 1, 0.1, 0.1, 0.1],
        "sensor_frame": ["wrist", 0.1, 0.2, 0.3, 0, 0, 0, 1],
        "bounding_box": [[0, 0, 0], [1, 2, 3]],
        "known_tool": {
            "mass_kg": 2,
            "center_of_mass": [0, 0, 0.1],
            "inertia": [[1, 2, 3], [4, 5, 6], [7, 8, 9]],
        },
        "unloaded": "empty.mcap",
    });
    let expected = Request {
        method: Some(Method::JointSensing),
        estimator: Some(EstimatorKind::Nlms),
        wrench_acts_on: Some(ActsOn::Sensor),
        wrench_offset: Some(OffsetChoice::Yes),
        cutoff_hz: Some(5.0),
        epochs: Some(3),
        tip: Some("hand".to_owned()),
        joint_topic: Some(vec!["/joint_states".to_owned()]),
        wrench_topic: Some(vec!["/left".to_owned(), "/right".to_owned()]),
        rename_joints: Some(BTreeMap::from([("a".to_owned(), "b".to_owned())])),
        gravity: Some(GravityChoice::Given(Vector3::new(0.0, 0.0, -9.81))),
        effort_gain: Some(vec![1.0, 2.5]),
        effort_noise: Some(vec![0.5]),
        wrench_noise: Some(vec![[1.0, 1.0, 1.0, 0.1, 0.1, 0.1]]),
        sensor_frame: Some(
            SensorFrame::new("wrist", [0.1, 0.2, 0.3], [0.0, 0.0, 0.0, 1.0]).unwrap(),
        ),
        bounding_box: Some(BoundingBox {
            min: Vector3::zeros(),
            max: Vector3::new(1.0, 2.0, 3.0),
        }),
        known_tool: Some(GivenTool::from(MassProperties {
            mass_kg: 2.0,
            center_of_mass: Vector3::new(0.0, 0.0, 0.1),
            inertia: Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0),
        })),
        unloaded: Some("empty.mcap".into()),
        ..Request::default()
    };
    assert_eq!(read(given).unwrap(), expected);
}

/// The pose of a sensor's frame may be a list of its own.
#[test]
fn a_sensor_frame_may_have_its_pose_apart() {
    let pair = json!({"sensor_frame": ["wrist", [0.1, 0.2, 0.3, 0, 0, 0, 1]]});
    let expected = SensorFrame::new("wrist", [0.1, 0.2, 0.3], [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(read(pair).unwrap().sensor_frame, expected.ok());
    assert_eq!(read(json!({})).unwrap(), Request::default());
}

/// A name that is no option, and a value of another type, are refused.
#[test]
fn what_is_no_option_is_refused() {
    for wrong in [
        json!({"cutoff": 5}),
        json!({"cutoff_hz": "5 Hz"}),
        json!({"wrench_offset": true}),
        json!({"method": "magic"}),
        json!({"epochs": 1.5}),
        json!({"gravity": [0, 0]}),
        json!({"wrench_noise": [1]}),
        json!({"bounding_box": [[0, 0, 0]]}),
        json!({"sensor_frame": ["wrist", 0, 0]}),
        json!({"calibration": "no_such_file.toml"}),
    ] {
        assert!(read(wrong.clone()).is_err(), "{wrong}");
    }
}

/// Each option has what an interface shows: sentences, a group, uses, and the unit that its name
/// has.
#[test]
fn every_option_is_declared_whole() {
    let units = [("_s", "s"), ("_hz", "Hz"), ("_kg", "kg")];
    for option in Request::OPTIONS {
        assert!(option.text.ends_with('.'), "{option:?}");
        assert!(
            !option.group.is_empty() && !option.uses.is_empty(),
            "{option:?}"
        );
        for (suffix, unit) in units {
            assert!(
                !option.name.ends_with(suffix) || option.unit == unit,
                "{option:?}"
            );
        }
    }
    let option = |name| {
        Request::OPTIONS
            .iter()
            .find(|each| each.name == name)
            .unwrap()
    };
    assert_eq!(option("urdf").kind, Kind::Path);
    assert_eq!(option("effort_gain_std_dev").kind, Kind::Fractions);
    assert!(option("cutoff_hz").uses.contains(&Use::Design));
}
