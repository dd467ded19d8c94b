//! What a request asks for: the paper's filter, known tools and signs, and values that cannot be
//! used.

use nalgebra::{Matrix3, SMatrix, Vector3};
use tactid_batch::Finding as Data;
use tactid_dynamics::{MassProperties, Wrench};
use tactid_identify::{EquationSettings, Sample, states_of_poses};
use tactid_recordings::{
    ActsOn, ConfiguredPayload, EstimatorKind, Finding, GivenTool, GravityChoice, Method,
    OffsetChoice, OnlineSetup, RecordingError, Request, WrenchIs,
};

use crate::recorded_arrays::{CARRIED_KG, Recording, carried, quick, recorded};

/// The paper's filter has the paper's cutoff, gap and delay, as on a log.
#[test]
fn the_papers_filter_has_its_own_defaults() {
    let result = recorded().filtered(&Request::paper());
    let report = &result.recording;
    assert_eq!(report.estimator, EstimatorKind::Nlms);
    assert_eq!(
        (report.cutoff_hz, report.max_gap_s, report.delay_s),
        (10.0, 0.1, 0.0)
    );
    assert!(result.history.epoch.contains(&1));
}

/// The paper's filter subtracts a known tool from the estimate and from all of its history, and
/// judges what remains: less than nothing is no body.
#[test]
fn the_papers_filter_subtracts_a_known_tool() {
    let request = |known_tool| Request {
        average_s: Some(0.0),
        known_tool,
        ..Request::paper()
    };
    let recording = recorded();
    let all = recording.filtered(&request(None));
    let all_kg = all.estimate.body.mass_kg;
    for tool_kg in [0.25 * all_kg, 2.0 * all_kg] {
        let tool = MassProperties {
            mass_kg: tool_kg,
            center_of_mass: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        };
        let result = recording.filtered(&request(Some(tool.into())));
        let rest_kg = result.estimate.body.mass_kg;
        assert!((rest_kg - (all_kg - tool_kg)).abs() < 1e-12, "{rest_kg}");
        if tool_kg > all_kg {
            assert!(!result.estimate.is_physical);
        }
        for (values, whole) in result.history.values.iter().zip(&all.history.values) {
            let (rest_kg, whole_kg) = (values[0], whole[0]);
            let tolerance = 1e-12 * whole_kg.abs();
            assert!((rest_kg + tool_kg - whole_kg).abs() <= tolerance || !whole_kg.is_finite());
        }
    }
}

/// The paper's filter reports a wrong sign, and a known tool that is heavier than the load.
#[test]
fn the_papers_filter_reports_a_negative_mass() {
    let findings = |recording: &Recording, request: &Request| {
        let mut findings = recording.filtered(request).recording.findings;
        findings.retain(|finding| matches!(finding, Finding::Data(_)));
        findings
    };
    let mut recording = recorded();
    assert_eq!(findings(&recording, &Request::paper()), []);
    let heavy = Request {
        known_tool: Some(GivenTool::from(MassProperties {
            mass_kg: 500.0,
            center_of_mass: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        })),
        ..Request::paper()
    };
    let rest_kg = recording.filtered(&heavy).estimate.body.mass_kg;
    match findings(&recording, &heavy)[..] {
        [
            Finding::Data(Data::KnownBodiesTooHeavy {
                known_bodies_kg,
                load_kg,
            }),
        ] => {
            assert_eq!(known_bodies_kg, 500.0);
            assert!((load_kg - (rest_kg + 500.0)).abs() < 1e-9, "{load_kg}");
        }
        ref other => panic!("{other:?}"),
    }
    recording
        .wrenches
        .iter_mut()
        .for_each(|value| *value = -*value);
    for request in [&heavy, &Request::paper()] {
        let found = findings(&recording, request);
        let sign = Finding::Data(Data::NegativeMass {
            method: Method::Tactile,
            or_gravity: false,
        });
        assert_eq!(found, [sign]);
    }
}

/// Wrenches that act on the sensor have the opposite sign.
#[test]
fn wrenches_may_act_on_the_sensor() {
    let mut recording = carried();
    for value in &mut recording.wrenches {
        *value = -*value;
    }
    let request = Request {
        wrench_acts_on: Some(ActsOn::Sensor),
        ..quick()
    };
    let mass_kg = recording.identify(&request).unwrap().estimate.body.mass_kg;
    assert!((mass_kg - CARRIED_KG).abs() < 1e-4, "{mass_kg}");
}

/// Options that only a log can use are errors for arrays.
#[test]
fn options_for_logs_are_rejected() {
    let mut requests = vec![Request::default(); 2];
    requests[0].unloaded = Some("empty.mcap".into());
    requests[1].imu_topic = Some("/imu".to_owned());
    let recording = recorded();
    for (request, expected) in requests.iter().zip(["unloaded", "imu_topic"]) {
        match recording.identify(request) {
            Err(RecordingError::Option { option, what }) => {
                assert_eq!(option, expected);
                assert_eq!(what, format!("`{expected}` does not apply to arrays"));
            }
            other => panic!("{other:?}"),
        }
    }
    let request = Request {
        effort_gain: Some(vec![1.0; 3]),
        ..Request::default()
    };
    match recording.identify(&request) {
        Err(RecordingError::Option { option, what }) => {
            assert_eq!(option, "effort_gain");
            assert!(what.starts_with("3 effort gains for 8 joints"), "{what}");
        }
        other => panic!("{other:?}"),
    }
}

/// A value of the request that is out of range is an error with the name of its field, whatever the
/// recording.
#[test]
fn a_value_out_of_range_is_named() {
    let tool = MassProperties {
        mass_kg: f64::NAN,
        center_of_mass: Vector3::zeros(),
        inertia: Matrix3::zeros(),
    };
    type Change = fn(&mut Request, f64);
    let fields: [(&str, Change); 8] = [
        ("gravity", |r, bad| {
            r.gravity = Some(GravityChoice::Given(Vector3::new(0.0, 0.0, bad)))
        }),
        ("cutoff_hz", |r, bad| r.cutoff_hz = Some(bad)),
        ("max_gap_s", |r, bad| r.max_gap_s = Some(bad)),
        ("delay_s", |r, bad| r.delay_s = Some(bad)),
        ("wrench_noise", |r, bad| {
            r.wrench_noise = Some(vec![[bad; 6]])
        }),
        ("effort_noise", |r, bad| r.effort_noise = Some(vec![bad])),
        ("effort_gain", |r, bad| r.effort_gain = Some(vec![1.0, bad])),
        ("effort_gain_std_dev", |r, bad| {
            r.effort_gain_std_dev = Some(vec![0.05, bad])
        }),
    ];
    let empty = Recording::of(&[]);
    let assert_names = |request: &Request, expected: &str| {
        let error = empty.identify(request).unwrap_err();
        assert_eq!(error.option(), Some(expected), "{error}");
    };
    for (name, change) in fields {
        for bad in [f64::NAN, f64::NEG_INFINITY] {
            let mut request = Request::default();
            change(&mut request, bad);
            assert_names(&request, name);
        }
    }
    let far = Request {
        delay_s: Some(1e9),
        ..Request::default()
    };
    assert_names(&far, "delay_s");
    let epochs = Request {
        epochs: Some(0),
        ..Request::paper()
    };
    assert_names(&epochs, "epochs");
    let unknown_tool = Request {
        known_tool: Some(tool.into()),
        ..Request::default()
    };
    assert_names(&unknown_tool, "known_tool");
}

/// A centre of mass in mm is an error, of a tool with an uncertainty of its own, too.
#[test]
fn a_centre_in_mm_is_named() {
    let body = MassProperties {
        mass_kg: 0.8,
        center_of_mass: Vector3::new(0.0, -12.5, 4.0),
        inertia: Matrix3::identity() * 1e-3,
    };
    let tool = |covariance| Request {
        known_tool: Some(GivenTool {
            covariance,
            ..body.into()
        }),
        ..Request::default()
    };
    let configured = Request {
        configured_payload: Some(ConfiguredPayload(body)),
        wrench_is: Some(WrenchIs::Contact),
        ..Request::default()
    };
    let identified = tool(Some(SMatrix::identity()));
    for (request, option) in [
        (tool(None), "known_tool"),
        (identified, "known_tool"),
        (configured, "configured_payload"),
    ] {
        let error = Recording::of(&[]).identify(&request).unwrap_err();
        assert_eq!(error.option(), Some(option), "{error}");
        let expected = "has its centre of mass 12.5 m from the origin of its frame: expected m, and \
                        less than 10 m; is it in mm?";
        assert_eq!(error.to_string(), format!("`{option}` {expected}"));
    }
}

/// Noise that is given neither once for all nor once for each is an error before anything is read,
/// also where the list is empty; noise that the method does not use is reported.
#[test]
fn counts_of_noise_are_checked() {
    let recording = recorded();
    let assert_counted = |request: &Request, name: &str, given: usize| {
        let error = recording.identify(request).unwrap_err();
        assert_eq!(error.option(), Some(name), "{error}");
        let expected = format!("`{name}` has {given} entries: give one for all, or one for each");
        assert!(error.to_string().starts_with(&expected), "{error}");
    };
    for given in [0, 3] {
        let wrench = Request {
            wrench_noise: Some(vec![[1.0; 6]; given]),
            ..quick()
        };
        assert_counted(&wrench, "wrench_noise", given);
        let effort = Request {
            effort_noise: Some(vec![1.0; given]),
            ..quick()
        };
        assert_counted(&effort, "effort_noise", given);
        let of_gain = Request {
            effort_gain_std_dev: Some(vec![0.05; given]),
            ..quick()
        };
        assert_counted(&of_gain, "effort_gain_std_dev", given);
    }
    let momentum = Request {
        method: Some(Method::JointSensing),
        wrench_noise: Some(vec![[1.0; 6]; 2]),
        ..quick()
    };
    let is_reported = |finding: &Finding| matches!(finding, Finding::OptionNotUsed { option, .. } if option == "wrench_noise");
    let findings = recording.identify(&momentum).unwrap().recording.findings;
    assert!(findings.iter().any(is_reported), "{findings:?}");
}

/// An online solver has the defaults of the equations where the request leaves a choice open, and
/// the samples say whether the combined method has efforts.
#[test]
fn an_online_setup_chooses_nothing_from_data() {
    let robot = recorded().robot.unwrap();
    let setup =
        |request: &Request, effort| OnlineSetup::new(request, Some(&robot), None, effort).unwrap();
    let open = setup(&Request::default(), true);
    assert_eq!(open.settings, EquationSettings::default());
    assert_eq!(
        (open.tip.as_str(), &open.sensors[..]),
        ("tool0", &["tool0".to_owned()][..])
    );
    let request = Request {
        method: Some(Method::Combined { effort: true }),
        cutoff_hz: Some(3.0),
        ..Request::default()
    };
    let combined = setup(&request, false);
    assert_eq!(combined.settings.method, Method::Combined { effort: false });
    assert_eq!(combined.settings.cutoff_hz, 3.0);
    assert!(combined.sensors.is_empty());
    for (choice, is_unknown) in [
        (OffsetChoice::Auto, true),
        (OffsetChoice::Yes, true),
        (OffsetChoice::No, false),
    ] {
        let request = Request {
            wrench_offset: Some(choice),
            ..Request::default()
        };
        let settings = setup(&request, true).settings;
        assert_eq!(settings.wrench_offset, is_unknown, "{choice:?}");
    }
}

/// A value is in the same range online as for a recording.
#[test]
fn an_online_setup_has_the_ranges_of_a_request() {
    let request = Request {
        gravity: Some(GravityChoice::Given(Vector3::new(0.0, 0.0, -98.1))),
        ..Request::default()
    };
    let error = OnlineSetup::new(&request, None, None, false).unwrap_err();
    let expected = "`gravity` is -98.1, but must be between -50 and 50 m/s²";
    assert_eq!(error.to_string(), expected);
}

/// A sensor without a robot is on the ground, and is the tip; online it gives what its recording
/// gives.
#[test]
fn a_sensor_alone_is_identified_online() {
    let setup = OnlineSetup::new(&Request::default(), None, None, true).unwrap();
    assert_eq!(setup.settings.gravity, Some(Vector3::new(0.0, 0.0, -9.81)));
    assert_eq!(
        (setup.tip.as_str(), &setup.sensors[..]),
        ("sensor", &["sensor".to_owned()][..])
    );
    let mut identifier = setup.identifier().unwrap();
    let recording = carried();
    let states = states_of_poses(&recording.times_s, &recording.poses);
    let wrenches = recording.wrenches.chunks_exact(6);
    for ((&time_s, &base), six) in recording.times_s.iter().zip(&states).zip(wrenches) {
        let wrench = Wrench {
            force: Vector3::from_column_slice(&six[..3]),
            moment: Vector3::from_column_slice(&six[3..]),
        };
        identifier
            .push(&Sample {
                time_s,
                base,
                joint_position: &[],
                joint_velocity: &[],
                joint_effort: &[],
                wrenches: &[wrench],
            })
            .unwrap();
    }
    identifier.finish();
    let estimate = identifier.estimate();
    assert_eq!(&*estimate.frame, "sensor");
    let mass_kg = estimate.body.mass_kg;
    assert!((mass_kg - CARRIED_KG).abs() < 1e-3, "{mass_kg}");
}

/// A part of a recording that ends before it begins is none, and the error names the option.
#[test]
fn a_part_ends_after_it_begins() {
    let request = |begin_s, end_s| Request {
        begin_s: Some(begin_s),
        end_s: Some(end_s),
        ..Request::default()
    };
    assert!(request(1.0, 2.0).check().is_ok());
    for (begin_s, end_s) in [(2.0, 2.0), (2.0, 1.0)] {
        match request(begin_s, end_s).check() {
            Err(RecordingError::Option { option, .. }) => assert_eq!(option, "end_s"),
            other => panic!("{other:?}"),
        }
    }
    assert!(request(f64::NAN, 1.0).check().is_err());
}
