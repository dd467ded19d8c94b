//! Arrays of the paper's robot and of a sensor alone, which a test can change.

#![allow(dead_code, reason = "each test file uses a part of what is shared")]

use std::ops::ControlFlow;

use crate::common::{Experiment, Instant, SENSORS};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tactid_dynamics::Manipulator;
use tactid_recordings::{
    Arrays, FaultKind, Identification, Identified, PaperIdentification, RecordingError, Request,
    identify_arrays,
};

/// A recording whose arrays a test can change.
#[derive(Clone)]
pub(crate) struct Recording {
    pub(crate) robot: Option<Manipulator>,
    pub(crate) sensors: Option<Vec<&'static str>>,
    pub(crate) times_s: Vec<f64>,
    pub(crate) joint_position: Vec<f64>,
    pub(crate) joint_velocity: Vec<f64>,
    pub(crate) joint_effort: Vec<f64>,
    pub(crate) wrenches: Vec<f64>,
    pub(crate) poses: Vec<Isometry3<f64>>,
    pub(crate) twists: Vec<f64>,
    pub(crate) accelerations: Vec<f64>,
}

impl Recording {
    pub(crate) fn of(instants: &[Instant]) -> Self {
        let flat = |of: &dyn Fn(&Instant) -> Vec<f64>| instants.iter().flat_map(of).collect();
        let wrenches = |instant: &Instant| -> Vec<f64> {
            let wrenches = instant.wrenches.iter();
            let six = wrenches.flat_map(|wrench| wrench.force.iter().chain(&wrench.moment));
            six.copied().collect()
        };
        let twist = |instant: &Instant| -> Vec<f64> {
            let base = &instant.base;
            let six = base.velocity.iter().chain(&base.angular_velocity);
            six.copied().collect()
        };
        Self {
            robot: Some(Experiment::default().robot()),
            sensors: Some(SENSORS.to_vec()),
            times_s: instants.iter().map(|instant| instant.time_s).collect(),
            joint_position: flat(&|instant| instant.position.clone()),
            joint_velocity: flat(&|instant| instant.velocity.clone()),
            joint_effort: vec![],
            wrenches: flat(&wrenches),
            poses: instants.iter().map(|instant| instant.base.pose).collect(),
            twists: flat(&twist),
            accelerations: vec![],
        }
    }

    /// Exchanges the places of two samples of a robot.
    pub(crate) fn swap_samples(&mut self, a: usize, b: usize) {
        let count = self.times_s.len();
        self.times_s.swap(a, b);
        self.poses.swap(a, b);
        for array in [
            &mut self.joint_position,
            &mut self.joint_velocity,
            &mut self.wrenches,
            &mut self.twists,
        ] {
            let columns = array.len() / count;
            (0..columns).for_each(|k| array.swap(columns * a + k, columns * b + k));
        }
    }

    /// The result of least squares.
    pub(crate) fn identify(&self, request: &Request) -> Result<Identification, RecordingError> {
        let found = self.identified(request)?;
        Ok(found.into_least_squares().unwrap())
    }

    /// The result of the paper's filter.
    pub(crate) fn filtered(&self, request: &Request) -> PaperIdentification {
        match self.identified(request).unwrap() {
            Identified::Paper(found) => *found,
            Identified::LeastSquares(_) => panic!("least squares"),
        }
    }

    pub(crate) fn identified(&self, request: &Request) -> Result<Identified, RecordingError> {
        let arrays = Arrays {
            robot: self.robot.as_ref(),
            sensors: self.sensors.as_deref(),
            time: &self.times_s,
            q: &self.joint_position,
            qd: &self.joint_velocity,
            effort: &self.joint_effort,
            wrench: &self.wrenches,
            pose: &self.poses,
            twist: &self.twists,
            acceleration: &self.accelerations,
            unloaded: None,
        };
        identify_arrays(&arrays, request, &mut |_| ControlFlow::Continue(()))
    }

    /// The error of arrays that a test changes.
    pub(crate) fn error(&self, change: impl FnOnce(&mut Self)) -> RecordingError {
        let mut changed = self.clone();
        change(&mut changed);
        changed.identified(&Request::default()).unwrap_err()
    }

    pub(crate) fn count_faults(&self, name: &str, kind: &FaultKind) -> u64 {
        let result = self.identify(&quick()).unwrap();
        let faults = result.recording.faults.iter();
        let of_kind = faults.filter(|fault| fault.topic == name && fault.kind == *kind);
        of_kind.map(|fault| fault.count).sum()
    }
}

/// The paper's robot and payload for 2 s.
pub(crate) fn recorded() -> Recording {
    let experiment = Experiment {
        duration_s: 2.0,
        ..Experiment::default()
    };
    Recording::of(&experiment.run())
}

/// A request that chooses nothing from the beginning of the recording.
pub(crate) fn quick() -> Request {
    Request {
        cutoff_hz: Some(10.0),
        delay_s: Some(0.0),
        max_gap_s: Some(0.1),
        ..Request::default()
    }
}

/// Body that a sensor carries in [`carried`]: kg, and its centre of mass in the sensor's frame, m.
pub(crate) const CARRIED_KG: f64 = 2.0;
pub(crate) const CARRIED_AT: Vector3<f64> = Vector3::new(0.02, -0.03, 0.1);

/// A sensor that is turned and shaken by hand, holding a point mass, on the ground.
pub(crate) fn carried() -> Recording {
    let times_s: Vec<f64> = (0..2000).map(|k| 0.002 * f64::from(k)).collect();
    let pose = |t: f64| {
        let turn =
            UnitQuaternion::from_euler_angles(1.2 * (2.0 * t).sin(), 0.9 * (3.1 * t).sin(), t);
        let at = Vector3::new(
            0.1 * (5.0 * t).sin(),
            0.08 * (6.0 * t).cos(),
            0.1 * (4.0 * t).sin(),
        );
        Isometry3::from_parts(at.into(), turn)
    };
    let wrench = |&t: &f64| -> Vec<f64> {
        // Acceleration of the point mass by central differences of the fourth order.
        let h = 1e-3;
        let at = |t: f64| (pose(t) * nalgebra::Point3::from(CARRIED_AT)).coords;
        let near = at(t + h) + at(t - h);
        let far = at(t + 2.0 * h) + at(t - 2.0 * h);
        let acceleration = (near * 16.0 - far - at(t) * 30.0) / (12.0 * h * h);
        let force = CARRIED_KG * (acceleration + Vector3::new(0.0, 0.0, 9.81));
        let force = pose(t).rotation.inverse() * force;
        let moment = CARRIED_AT.cross(&force);
        force.iter().chain(&moment).copied().collect()
    };
    Recording {
        robot: None,
        sensors: None,
        joint_position: vec![],
        joint_velocity: vec![],
        joint_effort: vec![],
        wrenches: times_s.iter().flat_map(wrench).collect(),
        poses: times_s.iter().map(|&t| pose(t)).collect(),
        twists: vec![],
        accelerations: vec![],
        times_s,
    }
}
