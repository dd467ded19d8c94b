//! A sensor whose frame is no link of the robot: the request says where it stands.

use std::ops::ControlFlow;

use crate::common::Experiment;
use crate::recorded_arrays::{CARRIED_AT, CARRIED_KG, carried, quick, recorded};
use crate::recorded_log;
use nalgebra::Vector3;
use tactid_dynamics::{ModelError, Wrench};
use tactid_identify::IdentifyError;
use tactid_recordings::{RecordingError, Request, SensorFrame, identify_log};

fn with_frame(parent: &str, origin_m: [f64; 3], quaternion: [f64; 4]) -> Request {
    Request {
        sensor_frame: Some(SensorFrame::new(parent, origin_m, quaternion).unwrap()),
        ..quick()
    }
}

/// Wrenches in a frame beside that of the poses give the body in the frame of the poses.
#[test]
fn wrenches_are_taken_in_the_given_frame() {
    let request = with_frame("sensor", [0.1, -0.2, 0.3], [0.5, -0.5, 0.5, 0.5]);
    let sensor_from_body = request
        .sensor_frame
        .as_ref()
        .unwrap()
        .parent_from_sensor()
        .unwrap()
        .inverse();
    let mut recording = carried();
    for six in recording.wrenches.chunks_exact_mut(6) {
        let wrench = Wrench {
            force: Vector3::from_column_slice(&six[..3]),
            moment: Vector3::from_column_slice(&six[3..]),
        };
        let there = wrench.expressed_in(&sensor_from_body);
        let values = there.force.iter().chain(&there.moment);
        six.iter_mut()
            .zip(values)
            .for_each(|(value, new)| *value = *new);
    }
    let result = recording.identify(&request).unwrap();
    assert_eq!(&*result.estimate.frame, "sensor");
    let body = result.estimate.body;
    assert!((body.mass_kg - CARRIED_KG).abs() < 1e-4, "{}", body.mass_kg);
    assert!((body.center_of_mass - CARRIED_AT).norm() < 1e-4);
}

/// The messages of a log may name a frame that the robot does not have, or another than the right
/// one.
#[test]
fn the_frame_of_messages_may_be_given() {
    let instants = Experiment {
        duration_s: 1.0,
        ..Experiment::default()
    }
    .run();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let identify = |sensor: &'static [&'static str], request: &Request| {
        let mut recording = recorded_log::Recording::of(&instants);
        recording.sensors = sensor;
        recording.write(&path);
        let found = identify_log(&path, request, &mut |_| ControlFlow::Continue(()));
        found.map(|found| found.into_least_squares().unwrap())
    };
    let right = identify(&["finger_left_link"], &quick()).unwrap();
    match identify(&["thumb"], &quick()) {
        Err(RecordingError::Data { what, option }) => {
            let place = "the frame `thumb` of /finger_0/wrench is neither a link nor fixed to one";
            assert!(what.starts_with(place), "{what}");
            assert_eq!(option, Some("sensor_frame"));
        }
        other => panic!("{other:?}"),
    }
    let given = with_frame("finger_left_link", [0.0; 3], [0.0, 0.0, 0.0, 1.0]);
    let unnamed: &[&str] = &[""];
    let wrong: &[&str] = &["base_link"];
    for named in [&["thumb"][..], wrong, unnamed] {
        let placed = identify(named, &given).unwrap();
        for (a, b) in placed.estimate.values().iter().zip(right.estimate.values()) {
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{a} {b}");
        }
    }
}

/// A frame that cannot be placed is an error that says why.
#[test]
fn a_frame_that_cannot_be_placed_is_an_error() {
    let unit = [0.0, 0.0, 0.0, 1.0];
    match recorded().identify(&with_frame("tool0", [0.0; 3], unit)) {
        Err(RecordingError::Option { option, what }) => {
            assert_eq!(option, "sensor_frame");
            assert!(what.ends_with("but there are 2 sensors"), "{what}");
        }
        other => panic!("{other:?}"),
    }
    match carried().identify(&with_frame("wrist", [0.0; 3], unit)) {
        Err(RecordingError::Identify(IdentifyError::Model(ModelError::UnknownFrame {
            name,
            ..
        }))) => assert_eq!(name, "wrist"),
        other => panic!("{other:?}"),
    }
    for (quaternion, norm) in [([0.0; 4], 0.0), ([1.0; 4], 2.0)] {
        match SensorFrame::new("wrist", [0.0; 3], quaternion) {
            Err(RecordingError::Option { option, what }) => {
                assert_eq!(option, "sensor_frame");
                let message = format!(
                    "the quaternion (qx, qy, qz, qw) of `sensor_frame` has the norm {norm}, but must have the norm 1"
                );
                assert_eq!(what, message);
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(SensorFrame::new("wrist", [0.0; 3], [f64::NAN; 4]).is_err());
    // Two decimals are enough, as for the orientations of a recording.
    let rounded = [0.57, 0.57, 0.57, 0.0];
    assert!(SensorFrame::new("wrist", [0.0; 3], rounded).is_ok());
    match carried().identify(&with_frame("sensor", [f64::NAN, 0.0, 0.0], unit)) {
        Err(RecordingError::Identify(IdentifyError::Option { option, .. })) => {
            assert_eq!(option, "sensor_frame");
        }
        other => panic!("{other:?}"),
    }
}
