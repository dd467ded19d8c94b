//! Identification from arrays: the estimate, the defaults, and arrays that do not fit or hold bad
//! values.

use std::ops::ControlFlow;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_dynamics::BaseKind;
use tactid_recordings::{
    Arrays, FaultKind, Finding, Identified, Method, RecordingError, Request, identify_arrays,
};

use crate::common::{Experiment, SENSORS, TOOL, errors_percent};
use crate::recorded_arrays::{CARRIED_AT, CARRIED_KG, Recording, carried, quick, recorded};

/// Exact arrays give the payload, by both estimators' defaults, in the frame of the default tip.
#[test]
fn arrays_are_identified() {
    let result = recorded().identify(&Request::default()).unwrap();
    let errors = errors_percent(&result.estimate.body);
    assert!(errors.iter().all(|error| error.abs() < 1e-2), "{errors:?}");
    assert_eq!(&*result.estimate.frame, TOOL);
    assert_eq!(result.recording.method, Method::Tactile);
    assert_eq!(result.recording.gravity_m_s2, Vector3::zeros());
    assert!(
        (result.recording.max_gap_s - 5e-3).abs() < 1e-9,
        "{}",
        result.recording.max_gap_s
    );
    assert_eq!(result.recording.delay_s, 0.0);
    assert!(
        result.recording.faults.is_empty(),
        "{:?}",
        result.recording.faults
    );
    assert!((result.recording.duration_s - 2.0).abs() < 0.01);
    assert!(!result.recording.interrupted && result.recording.damage.is_empty());
}

/// A sensor alone is on the ground, its frame is the tip, and its velocities follow from its poses.
#[test]
fn a_sensor_alone_is_on_the_ground() {
    let recording = carried();
    let result = recording.identify(&Request::default()).unwrap();
    assert_eq!(result.recording.gravity_m_s2, Vector3::new(0.0, 0.0, -9.81));
    assert_eq!(&*result.estimate.frame, "sensor");
    let body = result.estimate.body;
    assert!((body.mass_kg - CARRIED_KG).abs() < 1e-4, "{}", body.mass_kg);
    assert!((body.center_of_mass - CARRIED_AT).norm() < 1e-4);
}

/// A delay of any length is found, whether it is a multiple of a window or between two, also with
/// noise.
#[test]
fn delays_of_any_length_are_found() {
    let exact = carried();
    let mut random = SmallRng::seed_from_u64(1);
    for samples in [2, 7, 15, 21, 34, 60, 110] {
        let mut late = exact.clone();
        late.wrenches.rotate_right(6 * samples);
        let first = exact.wrenches[..6].repeat(samples);
        late.wrenches[..6 * samples].copy_from_slice(&first);
        for value in &mut late.wrenches {
            *value += 0.02 * random.sample::<f64, _>(StandardNormal);
        }
        let result = late.identify(&Request::default()).unwrap();
        let delay_s = 0.002 * samples as f64;
        let error_s = (result.recording.delay_s - delay_s).abs();
        assert!(
            error_s < 1e-3,
            "{delay_s} {} {:?}",
            result.recording.delay_s,
            result.recording.findings
        );
    }
}

/// A delay of the wrenches is found, corrected and reported.
#[test]
fn a_delay_is_corrected() {
    let mut recording = carried();
    let late = 4;
    recording.wrenches.rotate_right(6 * late);
    for (k, value) in recording.wrenches[..6 * late].iter_mut().enumerate() {
        *value = if k % 6 == 2 { 19.62 } else { 0.0 };
    }
    let result = recording.identify(&Request::default()).unwrap();
    assert!(
        (result.recording.delay_s - 0.008).abs() < 1e-4,
        "{}",
        result.recording.delay_s
    );
    let is_correction = |finding: &Finding| matches!(finding, Finding::DelayCorrected { applied_s, .. } if *applied_s == result.recording.delay_s);
    assert!(
        result.recording.findings.iter().any(is_correction),
        "{:?}",
        result.recording.findings
    );
}

/// An array with an entry too many or too few is an error that names it. Too many wrenches, and
/// rows of another length than the robot's joints, once were a panic.
#[test]
fn a_wrong_length_is_an_error_with_the_name() {
    type Array = fn(&mut Recording) -> &mut Vec<f64>;
    let arrays: [(&str, Array); 6] = [
        ("q", |r| &mut r.joint_position),
        ("qd", |r| &mut r.joint_velocity),
        ("effort", |r| &mut r.joint_effort),
        ("wrench", |r| &mut r.wrenches),
        ("twist", |r| &mut r.twists),
        ("acceleration", |r| &mut r.accelerations),
    ];
    let recording = recorded();
    let assert_names = |error: RecordingError, expected: &str| {
        let text = error.to_string();
        let is_named = text.starts_with(&format!("`{expected}` has "));
        assert!(
            is_named && text.contains(" entries, but must have "),
            "{text}"
        );
    };
    for (name, array) in arrays {
        assert_names(recording.error(|r| array(r).push(0.0)), name);
        assert_names(recording.error(|r| array(r).extend([0.0; 12])), name);
        if !array(&mut recording.clone()).is_empty() {
            assert_names(
                recording.error(|r| {
                    array(r).pop();
                }),
                name,
            );
        }
    }
    let pop_pose = |r: &mut Recording| r.poses.truncate(2000);
    assert_names(recording.error(pop_pose), "pose");
    let one_sensor = |r: &mut Recording| r.sensors = Some(vec![SENSORS[0]]);
    assert_names(recording.error(one_sensor), "wrench");
    let pop_time = |r: &mut Recording| r.times_s.truncate(2000);
    assert_names(recording.error(pop_time), "q");
}

/// What is missing is named: no sample, no joints, no pose of a floating base or of a sensor
/// without a robot, nothing that measures a load.
#[test]
fn a_missing_array_is_named() {
    let recording = recorded();
    let error = recording.error(|r| r.times_s.clear());
    assert_eq!(error.to_string(), "`time` is empty: there is no sample");
    type Change = fn(&mut Recording);
    let effort = Request {
        method: Some(Method::Effort),
        ..Request::default()
    };
    let error = recording.identify(&effort).unwrap_err().to_string();
    assert!(error.starts_with("`effort` is missing: "), "{error}");
    let cases: [(&str, Change); 5] = [
        ("q", |r| r.joint_position.clear()),
        ("pose", |r| r.poses.clear()),
        ("pose", |r| {
            *r = carried();
            r.poses.clear();
        }),
        ("wrench", |r| {
            r.wrenches.clear();
            r.joint_effort.clone_from(&r.joint_position);
        }),
        ("wrench", |r| {
            r.wrenches.clear();
            r.sensors = None;
        }),
    ];
    for (expected, change) in cases {
        let error = recording.error(change).to_string();
        assert!(
            error.starts_with(&format!("`{expected}` is missing: ")),
            "{error}"
        );
    }
}

/// Values that cannot be used are counted under the name of their array, and the rest is
/// identified.
#[test]
fn bad_values_are_counted() {
    let clean = recorded();
    let mut bad = clean.clone();
    bad.wrenches[12 * 100] = f64::NAN;
    bad.wrenches[12 * 300 + 7] = 1e12;
    bad.joint_position[8 * 500] = f64::INFINITY;
    bad.joint_velocity[8 * 600 + 3] = f64::NAN;
    bad.twists[6 * 700] = f64::NAN;
    bad.poses[800].translation.vector.x = f64::NAN;
    let count = |name, kind| bad.count_faults(name, &kind);
    assert_eq!(count("wrench", FaultKind::NotFinite), 1);
    assert_eq!(count("wrench", FaultKind::OutOfRange), 1);
    assert_eq!(count("q", FaultKind::NotFinite), 1);
    assert_eq!(count("qd", FaultKind::VelocityNotFinite), 1);
    assert_eq!(count("twist", FaultKind::NotFinite), 1);
    assert_eq!(count("pose", FaultKind::NotFinite), 1);
    let errors = errors_percent(&bad.identify(&quick()).unwrap().estimate.body);
    assert!(errors.iter().all(|error| error.abs() < 0.1), "{errors:?}");
}

/// Times that are not finite or do not increase are counted, and so are gaps; the rest is
/// identified.
#[test]
fn bad_times_are_counted() {
    let mut bad = recorded();
    bad.times_s[100] = f64::NAN;
    bad.times_s[200] = bad.times_s[199];
    bad.times_s[300] = -1.0;
    for time_s in &mut bad.times_s[1000..] {
        *time_s += 0.5;
    }
    let count = |kind| bad.count_faults("time", &kind);
    assert_eq!(count(FaultKind::NotFinite), 1);
    assert_eq!(count(FaultKind::OutOfOrder), 2);
    assert_eq!(count(FaultKind::Gap), 1);
    let errors = errors_percent(&bad.identify(&quick()).unwrap().estimate.body);
    assert!(errors.iter().all(|error| error.abs() < 0.1), "{errors:?}");
}

/// Times far in the future are left out, wherever they stand, and not what follows them; a late one
/// that is equal to another but for rounding is, too.
#[test]
fn times_that_are_no_steps_are_left_out() {
    let mut bad = recorded();
    let length_s = bad.identify(&quick()).unwrap().recording.duration_s;
    for (k, time_s) in [(0, 1e3), (500, 1e9), (501, 2e9), (900, 50.0)] {
        bad.times_s[k] = time_s;
    }
    bad.times_s[1500] = bad.times_s[1495] + 1e-15;
    assert_eq!(bad.count_faults("time", &FaultKind::OutOfOrder), 5);
    let found = bad.identify(&quick()).unwrap();
    assert!((found.recording.duration_s - length_s).abs() < 0.01);
    let errors = errors_percent(&found.estimate.body);
    assert!(errors.iter().all(|error| error.abs() < 0.1), "{errors:?}");
}

/// Where a clock is set back by more than a second, only one of the two passes through the same
/// times is used, and they are not mixed: the longer one, or that which has the longer rest.
#[test]
fn passes_of_a_clock_that_is_set_back_are_not_mixed() {
    let exact = carried();
    for (from, by_s, left_out) in [(800, 1.501, 750), (1600, 1.601, 400)] {
        let mut bad = exact.clone();
        for time_s in &mut bad.times_s[from..] {
            *time_s -= by_s;
        }
        assert_eq!(bad.count_faults("time", &FaultKind::OutOfOrder), left_out);
        assert_eq!(bad.count_faults("time", &FaultKind::PutInOrder), 0);
    }
}

/// A pose that is not finite, or a time that cannot be used, does not spoil the velocities of its
/// neighbours.
#[test]
fn bad_poses_do_not_spoil_their_neighbours() {
    let mut bad = carried();
    bad.poses[500].translation.vector.x = f64::NAN;
    bad.times_s[900] = f64::NAN;
    bad.times_s[1200] = bad.times_s[1199];
    assert_eq!(bad.count_faults("pose", &FaultKind::NotFinite), 1);
    assert_eq!(bad.count_faults("samples", &FaultKind::Incomplete), 0);
    let body = bad.identify(&quick()).unwrap().estimate.body;
    assert!((body.mass_kg - CARRIED_KG).abs() < 1e-3, "{}", body.mass_kg);
}

/// Whatever stands in arrays of the right lengths, the result is an estimate or an error, never a
/// panic.
#[test]
fn wild_arrays_do_not_panic() {
    let wild = [f64::NAN, f64::INFINITY, -1e300, 1e300, 0.0, -1.0, 1e12];
    let mut random = SmallRng::seed_from_u64(7);
    let mut recording = carried();
    recording.times_s.truncate(200);
    recording.poses.truncate(200);
    recording.wrenches.truncate(1200);
    for _ in 0..60 {
        let mut changed = recording.clone();
        for _ in 0..random.random_range(1..20) {
            let value = wild[random.random_range(0..wild.len())];
            let k = random.random_range(0..200);
            match random.random_range(0..3) {
                0 => changed.times_s[k] = value,
                1 => changed.wrenches[6 * k] = value,
                _ => changed.poses[k].translation.vector.y = value,
            }
        }
        for request in [Request::default(), Request::paper()] {
            match changed.identified(&request) {
                Ok(Identified::LeastSquares(result)) => assert!(result.estimate.windows > 0),
                Ok(Identified::Paper(result)) => assert!(result.estimate.windows > 0),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
    for samples in [1, 2, 4] {
        let mut short = carried();
        short.times_s.truncate(samples);
        short.poses.truncate(samples);
        short.wrenches.truncate(6 * samples);
        let error = short.identify(&Request::default()).unwrap_err().to_string();
        assert!(error.contains("too few windows"), "{error}");
    }
}

/// Channels of a sensor that never change are reported by name, and left out where they are zero.
#[test]
fn constant_channels_are_reported() {
    for (value, zero) in [(0.0, true), (1.5, false)] {
        let mut recording = carried();
        for wrench in recording.wrenches.chunks_exact_mut(6) {
            (wrench[0], wrench[4]) = (value, value);
        }
        let findings = recording.identify(&quick()).unwrap().recording.findings;
        let found = findings.iter().find_map(|finding| match finding {
            Finding::Data(tactid_batch::Finding::ConstantChannels {
                source,
                frame,
                channels,
                is_zero,
                is_left_out,
                without_moments: false,
                since_s: None,
                is_most: false,
            }) => Some((
                source.as_str(),
                frame.as_str(),
                &channels[..],
                *is_zero,
                *is_left_out,
            )),
            _ => None,
        });
        let channels = ["force x".into(), "moment y".into()];
        let expected = ("wrench", "sensor", &channels[..], zero, zero);
        assert_eq!(found, Some(expected));
    }
}

/// A channel that is left out because it is zero in the beginning is reported as left out, also
/// where it measures later.
#[test]
fn channels_that_measure_later_are_reported_as_left_out() {
    let mut recording = carried();
    let wrenches = recording.wrenches.chunks_exact_mut(6);
    for (time_s, wrench) in recording.times_s.iter_mut().zip(wrenches) {
        *time_s *= 10.0;
        wrench[4] = 0.0;
        if *time_s < 35.0 {
            wrench[3] = 0.0;
        }
    }
    let request = Request {
        cutoff_hz: Some(2.0),
        ..quick()
    };
    let findings = recording.identify(&request).unwrap().recording.findings;
    let found = findings.iter().filter_map(|finding| match finding {
        Finding::Data(tactid_batch::Finding::ConstantChannels {
            channels,
            is_zero,
            is_left_out,
            ..
        }) => Some((channels[0].as_ref(), channels.len(), *is_zero, *is_left_out)),
        _ => None,
    });
    let expected = [("moment y", 1, true, true), ("moment x", 1, false, true)];
    assert_eq!(found.collect::<Vec<_>>(), expected);
}

/// Forces alone determine the mass and the centre of mass, whether what is not measured is zero or
/// no number, and also where the sensor is not at the tip.
#[test]
fn three_forces_determine_mass_and_centre() {
    for absent in [0.0, f64::NAN] {
        let mut recording = carried();
        for wrench in recording.wrenches.chunks_exact_mut(6) {
            wrench[3..].fill(absent);
        }
        let found = recording.identify(&quick()).unwrap();
        let body = &found.estimate.body;
        assert!((body.mass_kg - CARRIED_KG).abs() < 1e-3, "{}", body.mass_kg);
        let moved = (body.center_of_mass - CARRIED_AT).norm();
        assert!(moved < 2e-3, "{moved}");
        assert!(found.estimate.not_identifiable().any(|name| name == "Ixx"));
    }
}

/// Samples that come late are put in order, and the result is that of samples in order.
#[test]
fn late_samples_are_put_in_order() {
    let mut late = recorded();
    let ordered = late.identify(&quick()).unwrap().estimate;
    late.swap_samples(100, 103);
    late.swap_samples(700, 701);
    let found = late.identify(&quick()).unwrap();
    assert_eq!(late.count_faults("time", &FaultKind::PutInOrder), 4);
    assert_eq!(found.recording.faults.len(), 1);
    assert_eq!(found.estimate.values(), ordered.values());
}

/// Interrupted before there is enough for a fit, there is no result.
#[test]
fn interrupted_early_nothing_is_known() {
    let recording = carried();
    let arrays = Arrays {
        time: &recording.times_s,
        wrench: &recording.wrenches,
        pose: &recording.poses,
        ..Arrays::default()
    };
    let result = identify_arrays(
        &arrays,
        &Request::default(),
        &mut |_| ControlFlow::Break(()),
    );
    assert!(matches!(result, Err(RecordingError::Interrupted)));
}

/// Without wrenches, efforts measure the load; where all are zero, nobody has measured them.
#[test]
fn efforts_are_the_default_without_wrenches() {
    let experiment = Experiment {
        base: BaseKind::Fixed,
        duration_s: 2.0,
        ..Experiment::default()
    };
    let mut recording = Recording::of(&experiment.run());
    recording.robot = Some(experiment.robot());
    recording.wrenches.clear();
    recording.poses.clear();
    recording.twists.clear();
    recording.sensors = None;
    recording.joint_effort = vec![0.0; recording.joint_position.len()];
    let refused = recording.identify(&quick()).unwrap_err().to_string();
    assert!(refused.contains("exactly zero in all samples"), "{refused}");
    recording.joint_effort.fill(0.1);
    let result = recording.identify(&quick()).unwrap();
    assert_eq!(result.recording.method, Method::Effort);
    assert_eq!(result.recording.gravity_m_s2, Vector3::new(0.0, 0.0, -9.81));
}
