//! The simulation satisfies the conservation laws, and the sensors are consistent with it.

use crate::common;
use nalgebra::{Isometry3, Matrix4, Rotation3, Vector3};
use tactid_dynamics::{BaseKind, FrameMotion, JointMotion, Manipulator, Workspace, motion};
use tactid_sim::{
    BUILT_IN_URDF, ExcitationMode, Experiment, NamedPosture, Posture, Sample, Simulation, StdDev,
};

/// Returns an experiment of three seconds in which every driven joint moves.
fn short() -> Experiment {
    let mut experiment = Experiment::paper();
    experiment.duration_s = 3.0;
    experiment.set_frequency(1.0);
    experiment
}

fn run(experiment: &Experiment) -> (Simulation, Vec<Sample>) {
    let mut simulation = Simulation::new(experiment).unwrap();
    let samples = (0..simulation.total_steps())
        .map(|_| simulation.step().unwrap().clone())
        .collect();
    (simulation, samples)
}

/// Returns the force on the payload in the world frame.
fn force_in_world(sample: &Sample) -> Vector3<f64> {
    sample
        .fingers
        .iter()
        .map(|finger| finger.pose.rotation * finger.wrench.force)
        .sum()
}

/// Without external wrench, linear and angular momentum of the whole system are constant, and the
/// payload stays in the grasp.
#[test]
fn momentum_and_grasp_are_kept() {
    for mode in [ExcitationMode::Sequence, ExcitationMode::Together] {
        let mut experiment = short();
        experiment.excitation.mode = mode;
        let (simulation, _) = run(&experiment);
        let checks = simulation.checks();
        assert!(checks.linear_momentum_drift.unwrap() < 2e-4, "{checks:?}");
        assert!(checks.angular_momentum_drift.unwrap() < 2e-4, "{checks:?}");
        assert!(checks.grasp_drift_m < 1e-4, "{checks:?}");
        assert!(checks.grasp_drift_rad < 1e-4, "{checks:?}");
    }
}

/// Between any two samples, the payload's mass times the change of its velocity equals the mean
/// contact force times the step up to the solver's precision. An impulse that counts twice would
/// double the force.
#[test]
fn mean_force_is_mass_times_change_of_velocity() {
    let (simulation, samples) = run(&short());
    let mass = simulation.experiment().payload.mass_kg;
    let largest = samples
        .iter()
        .map(|s| force_in_world(s).norm())
        .fold(0.0, f64::max);
    assert!(
        largest > 10.0,
        "the payload must have been moved: {largest} N"
    );
    for pair in samples.windows(2) {
        let force = (force_in_world(&pair[0]) + force_in_world(&pair[1])) * 0.5;
        let change = pair[1].truth.payload_velocity - pair[0].truth.payload_velocity;
        let inertial = mass * change / (pair[1].time_s - pair[0].time_s);
        let error = (force - inertial).norm();
        assert!(error < 1e-9 * largest, "at {} s: {error} N", pair[0].time_s);
    }
    let checks = simulation.checks();
    assert!(checks.newton_residual < 1e-9, "{checks:?}");
    assert!(checks.euler_residual < 1e-4, "{checks:?}");
}

/// The wrench of a finger is the sum of its contact forces, and the contacts lie on the pad.
#[test]
fn wrench_is_the_sum_of_contacts() {
    let (simulation, samples) = run(&short());
    for sample in samples.iter().step_by(100) {
        for finger in &sample.fingers {
            let force: Vector3<f64> = finger.contacts.iter().map(|c| c.force).sum();
            let moment: Vector3<f64> = finger
                .contacts
                .iter()
                .map(|c| c.position.cross(&c.force))
                .sum();
            assert!((force - finger.wrench.force).norm() < 1e-9);
            assert!((moment - finger.wrench.moment).norm() < 1e-9);
            assert_eq!(finger.contacts.len(), 4);
            for contact in &finger.contacts {
                let [x, y, z] = contact.position.into();
                assert!(
                    x.abs() < 0.0601 && y.abs() < 0.0601 && z.abs() < 1e-3,
                    "{contact:?}"
                );
            }
            // The z axis of a finger's frame is the closing direction, of the push on the payload.
            assert!(finger.wrench.force.z > 0.5 * simulation.grip_force_n());
        }
    }
    let asked = simulation.experiment().grip_force_n();
    assert!((simulation.grip_force_n() - asked).abs() < 0.02 * asked);
}

/// The payload is where the experiment places it, at every posture.
#[test]
fn the_payload_is_at_its_nominal_pose() {
    for posture in [
        Posture::Named(NamedPosture::Identifiable),
        Posture::Named(NamedPosture::Table1),
        Posture::Joints(vec![0.4, -1.0, 1.3, 0.7, -1.1, 2.0]),
    ] {
        let experiment = Experiment {
            posture,
            ..Experiment::paper()
        };
        let simulation = Simulation::new(&experiment).unwrap();
        let (actual, nominal) = (
            simulation.payload_in_tool(),
            experiment.payload.mass_properties(),
        );
        assert!(
            (actual.center_of_mass - nominal.center_of_mass).norm() < 1e-6,
            "{actual:?}"
        );
        assert!(
            (actual.inertia - nominal.inertia).norm() < 1e-4,
            "{actual:?}"
        );
    }
}

/// `tool0` is frame 6 of the paper's Table 1 at every posture, and the simulation has the frames of
/// the URDF.
#[test]
fn tool_is_frame_6_of_table_1() {
    let (simulation, samples) = run(&Experiment {
        duration_s: 0.3,
        ..short()
    });
    let robot = Manipulator::from_urdf(BUILT_IN_URDF, BaseKind::Floating).unwrap();
    assert_eq!(robot.joint_names(), simulation.joint_names());
    let mut workspace = Workspace::new(&robot);
    for sample in samples.iter().step_by(50) {
        let base_from_arm = Isometry3::translation(-0.95, 0.0, 0.75).to_homogeneous();
        let tool = sample.base.pose.to_homogeneous()
            * base_from_arm
            * table_1(&sample.joint_position[..6]);
        assert!((tool - sample.truth.tool.to_homogeneous()).norm() < 1e-9);

        let joints = JointMotion {
            position: &sample.joint_position,
            velocity: &sample.joint_velocity,
            acceleration: &sample.joint_velocity,
        };
        motion(
            &mut workspace,
            &FrameMotion::at_rest(sample.base.pose),
            joints,
        )
        .unwrap();
        for (name, pose) in [
            ("tool0", sample.truth.tool),
            ("finger_left_link", sample.fingers[0].pose),
            ("finger_right_link", sample.fingers[1].pose),
        ] {
            let by_urdf = workspace.pose(robot.frame(name).unwrap());
            assert!(
                (by_urdf.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-9,
                "{name}"
            );
        }
    }
}

/// Table 1 in standard Denavit-Hartenberg form: `Rz(θ) Tz(d) Tx(a) Rx(α)`.
fn table_1(positions: &[f64]) -> Matrix4<f64> {
    let half = std::f64::consts::FRAC_PI_2;
    let rows = [
        (0.0, 0.089159, half),
        (-0.425, 0.0, 0.0),
        (-0.39225, 0.0, 0.0),
        (0.0, 0.10915, half),
        (0.0, 0.09465, -half),
        (0.0, 0.0823, 0.0),
    ];
    let step = |transform: Matrix4<f64>, ((a, d, alpha), theta): ((f64, f64, f64), &f64)| {
        transform
            * Rotation3::from_axis_angle(&Vector3::z_axis(), *theta).to_homogeneous()
            * Matrix4::new_translation(&Vector3::new(a, 0.0, d))
            * Rotation3::from_axis_angle(&Vector3::x_axis(), alpha).to_homogeneous()
    };
    rows.into_iter()
        .zip(positions)
        .fold(Matrix4::identity(), step)
}

/// Least squares on the samples determines all ten parameters by contact forces and by joint
/// sensing, and the joint torques agree with the inverse dynamics. An error of frame, sign or time
/// of any sensor would violate this.
#[test]
fn the_samples_identify_the_payload() {
    let mut experiment = Experiment::paper();
    experiment.duration_s = 9.0;
    experiment.set_frequency(0.5);
    let mut simulation = Simulation::new(&experiment).unwrap();
    let mut identifier = common::Identifier::new(&simulation).unwrap();
    for _ in 0..simulation.total_steps() {
        identifier.push(simulation.step().unwrap()).unwrap();
    }
    let nominal = experiment.payload.mass_properties();
    let tactile = identifier.tactile().unwrap();
    assert!(
        common::worst_percent(&tactile, &nominal) < 0.03,
        "{:?}",
        common::errors_percent(&tactile, &nominal)
    );
    let joints = identifier.joint_sensing().unwrap();
    assert!(
        common::worst_percent(&joints, &nominal) < 0.03,
        "{:?}",
        common::errors_percent(&joints, &nominal)
    );
    assert!(
        identifier.torque_error() < 0.02,
        "{}",
        identifier.torque_error()
    );
}

/// Twist, IMU and pose of the base agree: the pose moves with the twist, the twist with the IMU.
#[test]
fn base_sensors_agree() {
    let mut experiment = short();
    experiment.base = Some(tactid_sim::BaseProperties {
        mass_kg: 200.0,
        center_of_mass_m: [0.1, -0.05, 0.2],
        inertia_kg_m2: [60.0, 1.0, -2.0, 70.0, 3.0, 50.0],
    });
    experiment.excitation.command_noise = 0.0;
    let (simulation, samples) = run(&experiment);
    assert!(
        simulation.urdf().contains("200"),
        "the log's description has the experiment's base"
    );
    for window in samples.windows(3).skip(10).step_by(37) {
        let [a, b, c] = window else { unreachable!() };
        let dt = c.time_s - a.time_s;
        let moved = c.base.pose.translation.vector - a.base.pose.translation.vector;
        assert!(
            (moved / dt - b.base.velocity).norm() < 1e-4,
            "{:?}",
            moved / dt - b.base.velocity
        );
        let turned = (c.base.pose.rotation * a.base.pose.rotation.inverse()).scaled_axis();
        let error = (turned / dt - b.base.angular_velocity).norm();
        assert!(error < 1e-4, "{error} at {}", b.time_s);
        let acceleration = (c.base.velocity - a.base.velocity) / dt;
        let by_imu = b.base.pose.rotation * b.imu.acceleration;
        assert!(
            (acceleration - by_imu).norm() < 0.02 * (0.1 + by_imu.norm()),
            "{acceleration} {by_imu}"
        );
        assert!(
            (b.base.pose.rotation * b.imu.angular_velocity - b.base.angular_velocity).norm()
                < 1e-12
        );
    }
}

/// Each channel has its requested standard deviation and affects no other channel. The motion does
/// not depend on the noise.
#[test]
fn measurement_noise_has_its_standard_deviation() {
    let mut experiment = Experiment {
        duration_s: 2.0,
        ..short()
    };
    let (_, clean) = run(&experiment);
    experiment.noise.joint_position_rad = 1e-3.into();
    experiment.noise.finger_force_n = StdDev::Each(vec![0.0, 0.0, 0.1, 0.2, 0.5, 0.0]);
    experiment.noise.imu_acceleration_m_s2 = StdDev::Each(vec![0.0, 0.0, 0.02]);
    let (_, noisy) = run(&experiment);
    let rms = |error: &dyn Fn(&Sample, &Sample) -> f64| {
        let sum: f64 = clean
            .iter()
            .zip(&noisy)
            .map(|(a, b)| error(a, b).powi(2))
            .sum();
        (sum / clean.len() as f64).sqrt()
    };
    let position = rms(&|a, b| b.joint_position[3] - a.joint_position[3]);
    assert!((position / 1e-3 - 1.0).abs() < 0.1, "{position}");
    let force = rms(&|a, b| b.fingers[1].wrench.force.y - a.fingers[1].wrench.force.y);
    assert!((force / 0.5 - 1.0).abs() < 0.1, "{force}");
    let other = rms(&|a, b| b.fingers[0].wrench.force.z - a.fingers[0].wrench.force.z);
    assert!((other / 0.1 - 1.0).abs() < 0.1, "{other}");
    let acceleration = rms(&|a, b| b.imu.acceleration.z - a.imu.acceleration.z);
    assert!((acceleration / 0.02 - 1.0).abs() < 0.1, "{acceleration}");
    let none = rms(&|a, b| b.fingers[1].wrench.force.z - a.fingers[1].wrench.force.z);
    assert_eq!(none, 0.0);
    assert_eq!(rms(&|a, b| b.joint_velocity[3] - a.joint_velocity[3]), 0.0);
    assert_eq!(
        rms(&|a, b| b.truth.payload_velocity.x - a.truth.payload_velocity.x),
        0.0
    );
}

/// A list for the joints that is too short is refused before the simulation starts.
#[test]
fn noise_of_each_joint_is_for_all_joints() {
    let mut experiment = short();
    experiment.noise.joint_torque_nm = StdDev::Each(vec![0.1; 6]);
    let error = Simulation::new(&experiment).err().unwrap().to_string();
    assert_eq!(
        error,
        "noise.joint_torque_nm = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1]: has 6 values, but the robot has 8 moving joints: give \
         one number, or one for each"
    );
}

/// The accelerations of a controller drive the joints.
#[test]
fn joints_follow_a_controller() {
    let mut simulation = Simulation::new(&short()).unwrap();
    assert_eq!(simulation.arm_joint_names().count(), 6);
    for _ in 0..200 {
        simulation
            .step_with(&[0.0, 0.5, 0.0, 0.0, 0.0, -0.5])
            .unwrap();
    }
    let velocity = &simulation.sample().joint_velocity;
    for (joint, expected) in [(0, 0.0), (1, 0.1), (5, -0.1)] {
        assert!(
            (velocity[joint] - expected).abs() < 1e-3,
            "joint {joint}: {}",
            velocity[joint]
        );
    }
    let error = simulation.step_with(&[0.0]).unwrap_err().to_string();
    assert_eq!(
        error,
        "1 joint accelerations were given, but the arm has 6 joints"
    );
}
