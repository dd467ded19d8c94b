//! An arm that plans its motion while it identifies its payload.

use std::ops::ControlFlow;
use std::path::Path;

use tactid_dynamics::{BaseKind, Manipulator};
use tactid_logs::LogReader;
use tactid_sim::{
    ActiveExcitation, BUILT_IN_URDF, BaseMount, ExcitationKind, Experiment, PAPER_TOML, RunReport,
    Simulation, run,
};

/// Returns the example: 100 kg on the spacecraft, and a base that turns by at most 0.1 degrees.
fn example() -> Experiment {
    Experiment::from_toml(include_str!("../experiments/active.toml")).unwrap()
}

/// The run ends when all values are known, with the arm at rest and no limit exceeded.
#[test]
fn the_run_ends_at_rest_when_the_payload_is_known() {
    let experiment = example();
    let robot = Manipulator::from_urdf(BUILT_IN_URDF, BaseKind::Floating).unwrap();
    let mut simulation = Simulation::new(&experiment).unwrap();
    let (mut angle, mut used) = (0.0_f64, 0.0_f64);
    let mut base = None;
    let mut speeds = Vec::new();
    while !simulation.is_finished() {
        let sample = simulation.step().unwrap().clone();
        let start = *base.get_or_insert(sample.base.pose.rotation);
        angle = angle.max(start.angle_to(&sample.base.pose.rotation));
        let names: Vec<String> = simulation.arm_joint_names().map(str::to_owned).collect();
        for (name, effort) in names.iter().zip(&sample.joint_torque) {
            let limit = robot.effort_limit(robot.joint_index(name).unwrap());
            used = used.max(effort.abs() / limit.unwrap());
        }
        let speed = |velocity: &f64| velocity.abs();
        speeds.push(
            sample.joint_velocity[..6]
                .iter()
                .map(speed)
                .fold(0.0, f64::max),
        );
    }
    let report = simulation.active_report().unwrap();
    let reached_s = report.reached_s.unwrap();
    assert!(report.interval_ratio.unwrap() <= 1.0, "{report:?}");
    assert!(simulation.time_s() < experiment.duration_s, "{report:?}");
    assert!(
        reached_s < simulation.time_s() && report.plans > 1,
        "{report:?}"
    );
    assert!(angle.to_degrees() <= 0.1, "{}", angle.to_degrees());
    let excursion = simulation.base_excursion().unwrap();
    assert!(
        (excursion.attitude_deg - angle.to_degrees()).abs() < 1e-4,
        "{excursion:?}"
    );
    assert!(report.contradictions.is_empty(), "{report:?}");
    assert!(used <= 1.0, "{used}");
    // The noise of a velocity is 1e-4 rad/s.
    assert!(speeds.iter().copied().fold(0.0, f64::max) > 0.05);
    assert!(*speeds.last().unwrap() < 1e-3, "{:?}", speeds.last());
}

/// Returns the report in a log.
fn logged(log: &Path) -> serde_json::Value {
    let log = LogReader::open(log).unwrap();
    serde_json::from_str(&log.metadata()["tactid.report"]["json"]).unwrap()
}

/// The same seed gives the same bytes, another one another motion; a stopped run keeps its log.
#[test]
fn the_log_depends_on_the_experiment_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = example();
    experiment.duration_s = 2.0;
    let record = |experiment: &Experiment, name: &str| -> (RunReport, Vec<u8>) {
        let log = folder.path().join(name);
        let report = run(experiment, &log, |_| ControlFlow::Continue(())).unwrap();
        (report, std::fs::read(log).unwrap())
    };
    let (report, first) = record(&experiment, "first.mcap");
    assert_eq!((report.steps, report.interrupted), (2000, false));
    assert_eq!(report.active.as_ref().unwrap().plans, 2);
    let in_log = logged(&folder.path().join("first.mcap"));
    assert_eq!(in_log["active"]["plans"], 2);
    assert!(first == record(&experiment, "second.mcap").1);
    experiment.seed = 1;
    assert!(first != record(&experiment, "third.mcap").1);
    let log = folder.path().join("stopped.mcap");
    let stopped = run(&experiment, &log, |progress| {
        if progress.time_s > 1.0 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    let stopped = stopped.unwrap();
    assert!(stopped.interrupted && stopped.steps < 1100);
    assert_eq!(logged(&log)["interrupted"], true);
}

/// A bench robot under gravity finds a small payload; no base is bounded, and no noise is given.
#[test]
fn a_fixed_base_needs_no_bounds() {
    let text = "duration_s = 8.0\n[robot]\nbase = 'fixed'\n[payload]\nmass_kg = 2.0\ncenter_of_mass_m = [0.2, 0.01, 0.08]\n\
                inertia_kg_m2 = [0.02, 0.001, 0.0, 0.03, 0.0, 0.02]\n[excitation]\nkind = 'active'\n[excitation.active]\n\
                mass_kg = [0.5, 3.0]\ncenter_of_mass_m = 0.3\nhalf_diagonal_m = 0.3\nwithin = 0.05\n";
    let experiment = Experiment::from_toml(text).unwrap();
    let mut simulation = Simulation::new(&experiment).unwrap();
    while !simulation.is_finished() {
        simulation.step().unwrap();
    }
    let report = simulation.active_report().unwrap();
    assert!(report.reached_s.is_some(), "{report:?}");
    assert_eq!(simulation.base_excursion(), None);
}

/// A payload that is not within the bounds that were given ends the motion, is named, and what it
/// did to the base is reported.
#[test]
fn wrong_bounds_of_the_payload_are_reported() {
    let mut experiment = example();
    experiment.duration_s = 5.0;
    experiment.seed = 1;
    experiment.excitation.active = Some(ActiveExcitation {
        mass_kg: [5.0, 20.0],
        center_of_mass_m: 0.05,
        half_diagonal_m: 0.05,
        base_attitude_deg: Some(0.1),
        ..ActiveExcitation::default()
    });
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let report = run(&experiment, &log, |_| ControlFlow::Continue(())).unwrap();
    let active = report.active.unwrap();
    assert_eq!(active.reached_s, None);
    assert!(report.simulated_time_s < 2.0, "{active:?}");
    let found = |field: &str| {
        let mut all = active.contradictions.iter();
        all.find(|found| found.field == field).unwrap()
    };
    assert_eq!(active.contradictions.len(), 3, "{active:?}");
    let mass = found("mass_kg[1]");
    assert_eq!(mass.bound, 20.0);
    assert!((mass.estimate - 100.0).abs() < 1.0, "{mass:?}");
    assert!((found("center_of_mass_m").estimate - 0.5).abs() < 0.01);
    assert!((found("half_diagonal_m").estimate - 0.6f64.sqrt()).abs() < 0.02);
    // The base has turned further than it must: the report says how far, as the log does.
    let base = report.base.unwrap();
    assert!(
        base.attitude_deg > 0.2 && base.position_m > 1e-3,
        "{base:?}"
    );
    assert_eq!(logged(&log)["base"]["attitude_deg"], base.attitude_deg);
}

/// Experiments with a field that does not fit, and the beginning of the error.
const FAULTS: [(&str, &str); 13] = [
    (
        "[excitation.active]\nwithin = 0.02",
        "line 2: excitation.active.within = 0.02: is used only with excitation.kind = \"active\"",
    ),
    (
        "[excitation]\nkind = 'active'\nfile = 'motion.csv'",
        "line 3: excitation.file = \"motion.csv\": is used only with excitation.kind = \"designed\"",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nwithin = 0",
        "line 4: excitation.active.within = 0.0: must be positive",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nmass_kg = [5, 1]",
        "line 4: excitation.active.mass_kg = [5.0, 1.0]: must be the least and the largest mass",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nmass_kg = [0, 1]",
        "line 4: excitation.active.mass_kg[0] = 0.0: must be positive",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nfriction_used = 1.5",
        "line 4: excitation.active.friction_used = 1.5: must be at most 1",
    ),
    (
        "[robot]\nbase = 'fixed'\n[excitation]\nkind = 'active'\n[excitation.active]\nbase_attitude_deg = 0.1",
        "line 6: excitation.active.base_attitude_deg = 0.1: bounds the motion of a base that is fixed",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nbase_attitude_deg = 200",
        "line 4: excitation.active.base_attitude_deg = 200.0: must be at most 180",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\npayload_box_m = [[0, 0, 0], [1, 0, 1]]",
        "line 4: excitation.active.payload_box_m = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]]: must be the corner with the least",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nworkspace_m = [[0, 0, -inf], [1, 1, 1]]",
        "line 4: excitation.active.workspace_m = [[0.0, 0.0, -inf], [1.0, 1.0, 1.0]]: must be the corner with the least",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nkeep_out_m.panel = [[1, 1, 1], [0, 2, 2]]",
        "line 4: excitation.active.keep_out_m.panel = [[1.0, 1.0, 1.0], [0.0, 2.0, 2.0]]: must be the corner with the least",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\npayload_box_m = [[-1e160, 0, 0], [1, 1, 1]]",
        "line 4: excitation.active.payload_box_m = [[-1e160, 0.0, 0.0], [1.0, 1.0, 1.0]]: must be the corner with the least",
    ),
    (
        "[excitation]\nkind = 'active'\n[excitation.active]\nmass = 3",
        "line 4: unknown field `mass`, expected one of `within`",
    ),
];

/// Fields that do not fit are refused with their line.
#[test]
fn faults_are_refused() {
    for (text, expected) in FAULTS {
        let message = Experiment::from_toml(text).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{text}: {message}");
    }
}

/// Keep-out boxes are at most a hundred, and their names short.
#[test]
fn keep_out_boxes_are_few_and_their_names_short() {
    let boxes = |names: &mut dyn Iterator<Item = String>| {
        let mut experiment = example();
        let unit = [[1.0; 3], [2.0; 3]];
        let active = experiment.excitation.active.as_mut().unwrap();
        active.keep_out_m = names.map(|name| (name, unit)).collect();
        Experiment::from_toml(&experiment.to_toml().unwrap()).map_err(|error| error.to_string())
    };
    assert!(boxes(&mut (0..100).map(|k| k.to_string())).is_ok());
    let error = boxes(&mut (0..101).map(|k| k.to_string())).unwrap_err();
    assert!(
        error.contains("excitation.active.keep_out_m = 101: must be at most 100 boxes"),
        "{error}"
    );
    let error = boxes(&mut std::iter::once("n".repeat(201))).unwrap_err();
    assert!(
        error.contains("must be names of at most 200 bytes"),
        "{error}"
    );
}

/// A joint without a limit of its velocity is refused by its name.
#[test]
fn a_joint_without_a_velocity_limit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("arm.urdf");
    std::fs::write(&urdf, BUILT_IN_URDF.replace(" velocity=\"3.14\"", "")).unwrap();
    let mut experiment = example();
    experiment.robot.urdf = Some(urdf);
    let error = Simulation::new(&experiment).map(|_| ()).unwrap_err();
    let expected = "robot: joint `joint_1` has no positive velocity limit in the URDF";
    assert!(error.to_string().starts_with(expected), "{error}");
}

/// Returns the error of the example with a table that a change has made.
fn error_with(change: impl FnOnce(&mut ActiveExcitation)) -> Option<String> {
    let mut experiment = example();
    change(experiment.excitation.active.as_mut().unwrap());
    let error = Simulation::new(&experiment).err();
    error.map(|error| error.to_string())
}

/// Boxes are in the frame of the base, and a payload in the tool frame: the errors name what
/// touches at the start.
#[test]
fn boxes_around_the_robot_are_limits() {
    let (everywhere, payload) = ([[-9.0; 3], [9.0; 3]], [[-0.1, -0.1, 0.05], [0.6, 0.4, 0.4]]);
    let error = error_with(|active| active.keep_out_m = [("panel".to_owned(), everywhere)].into());
    let error = error.unwrap();
    assert!(error.contains("the keep-out box panel"), "{error}");
    let error = error_with(|active| active.workspace_m = Some([[8.0; 3], [9.0; 3]])).unwrap();
    assert!(
        error.contains("the position of the tool along x in the workspace"),
        "{error}"
    );
    let around_payload = error_with(|active| {
        active.payload_box_m = Some(payload);
        active.workspace_m = Some(everywhere);
    });
    assert_eq!(around_payload, None);
}

/// Meshes are not read, which the report says of each, unless collisions are not tested at all.
#[test]
fn meshes_are_not_tested_for_collisions() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("arm.urdf");
    let cylinder = "<geometry><cylinder radius=\"0.05\" length=\"0.425\"/></geometry>";
    let mesh = "<geometry><mesh filename=\"arm.stl\"/></geometry>";
    assert!(BUILT_IN_URDF.contains(cylinder));
    std::fs::write(&urdf, BUILT_IN_URDF.replace(cylinder, mesh)).unwrap();
    for collisions in [true, false] {
        let mut experiment = example();
        experiment.robot.urdf = Some(urdf.clone());
        experiment.excitation.active.as_mut().unwrap().collisions = collisions;
        let mut simulation = Simulation::new(&experiment).unwrap();
        simulation.step().unwrap();
        let report = simulation.active_report();
        let untested = report.unwrap().untested_shapes;
        assert_eq!(untested.len(), usize::from(collisions), "{untested:?}");
        assert!(
            untested
                .iter()
                .all(|shape| shape.contains("`arm.stl`") && shape.contains("no meshes")),
            "{untested:?}"
        );
    }
}

/// A run in which the heaviest possible payload would slip even at rest does not move, and ends
/// with the name of the limit.
#[test]
fn a_run_that_cannot_move_ends() {
    let mut experiment = example();
    experiment.robot.base = BaseMount::Fixed;
    experiment.payload.mass_kg = 5.0;
    experiment.excitation.active = Some(ActiveExcitation::default());
    let mut simulation = Simulation::new(&experiment).unwrap();
    let start = simulation.step().unwrap().joint_position.clone();
    while !simulation.is_finished() {
        simulation.step().unwrap();
    }
    let report = simulation.active_report().unwrap();
    assert!(simulation.time_s() < experiment.duration_s, "{report:?}");
    assert!(
        report.out_of_reach && report.interval_ratio.is_none() && report.plans == 0,
        "{report:?}"
    );
    let binding = report.binding.unwrap();
    assert!(
        binding.contains("grip") || binding.contains("effort"),
        "{binding}"
    );
    let moved = simulation.sample().joint_position.iter().zip(&start);
    assert!(moved.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-3);
}

/// The table that the paper's file documents in comments is the default.
#[test]
fn the_documented_table_is_the_default() {
    let (_, table) = PAPER_TOML.split_once("# [excitation.active]").unwrap();
    let (table, _) = table.split_once("\n\n").unwrap();
    let lines = table.lines().filter(|line| line.contains(" = "));
    let lines: Vec<&str> = lines.map(|line| line.trim_start_matches("# ")).collect();
    let text = format!(
        "[excitation]\nkind = 'active'\n[excitation.active]\n{}",
        lines.join("\n")
    );
    let experiment = Experiment::from_toml(&text).unwrap();
    assert_eq!(experiment.excitation.kind, ExcitationKind::Active);
    let expected = ActiveExcitation {
        base_attitude_deg: Some(0.1),
        base_position_m: Some(0.05),
        payload_box_m: Some([[-0.1, -0.1, 0.0], [0.5, 0.3, 0.2]]),
        workspace_m: Some([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]]),
        keep_out_m: [("panel".to_owned(), [[0.8, -3.0, -0.1], [4.0, 3.0, 0.1]])].into(),
        ..ActiveExcitation::default()
    };
    assert_eq!(experiment.excitation.active, Some(expected));
    let again = Experiment::from_toml(&experiment.to_toml().unwrap()).unwrap();
    assert_eq!(again, experiment);
}
