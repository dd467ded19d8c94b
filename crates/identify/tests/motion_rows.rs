//! Rows of planned motions against those of the equation stream.

use crate::arm::{Run, TOOL, arm, body};
use nalgebra::Isometry3;
use tactid_dynamics::{BaseKind, FrameMotion, JointMotion};
use tactid_identify::{EquationSettings, EquationStream, Method, MotionRows};

/// For a motion that hardly changes within a window, the rows at an instant are those of the window
/// around it, for each method, with the same channels and known noise.
#[test]
fn rows_are_those_of_the_stream() {
    let run = Run {
        base: BaseKind::Fixed,
        rate_hz: 1000.0,
        payloads: vec![(0.0, body(3.0, [0.05, -0.02, 0.1], [0.3, 0.2, 0.1]))],
        duration_s: 0.5,
        gap_s: None,
        motion_seed: 4,
    };
    for method in [
        Method::Tactile,
        Method::Effort,
        Method::Combined { effort: true },
    ] {
        let settings = EquationSettings {
            method,
            cutoff_hz: 50.0,
            wrench_noise: vec![[1.0, 2.0, 3.0, 0.1, 0.2, 0.3]],
            effort_noise: vec![0.5],
            ..EquationSettings::default()
        };
        let robot = arm(BaseKind::Fixed);
        let mut planned = MotionRows::new(&robot, TOOL, &[TOOL], &settings).unwrap();
        let mut stream = EquationStream::new(&robot, TOOL, &[TOOL], &settings).unwrap();
        let base = FrameMotion::at_rest(Isometry3::identity());
        let instants = run.instants();
        let mut compared = 0;
        for instant in &instants {
            let wrenches = [instant.wrench];
            let mut sample = instant.sample(&wrenches);
            sample.joint_effort = &[0.0; 6];
            let (_, Some(equation)) = stream.push(&sample).unwrap() else {
                continue;
            };
            let middle = &instants[(equation.time_s * run.rate_hz).round() as usize];
            let [position, velocity, acceleration] = &middle.joints;
            let joints = JointMotion {
                position,
                velocity,
                acceleration,
            };
            let rows = planned.at(&base, joints).unwrap();
            assert_eq!(rows.len(), equation.rows.len());
            for (row, mean) in rows.iter().zip(&equation.rows) {
                let size = 1.0 + mean.regressor.norm();
                assert!((row.regressor - mean.regressor).norm() < 5e-3 * size);
            }
            compared += 1;
        }
        assert!(compared > 50, "{compared}");
        let (planned, streamed) = (planned.channels(), stream.channels());
        assert_eq!(planned.channels, streamed.channels);
        assert!(!planned.known_noise.is_empty());
        assert_eq!(planned.known_noise.len(), streamed.known_noise.len());
        let covariances = planned.known_noise.iter().zip(&streamed.known_noise);
        for (planned, streamed) in covariances {
            assert_eq!(planned.covariance, streamed.covariance);
        }
    }
}
