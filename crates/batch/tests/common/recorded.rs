//! Recorded samples of an arm on the ground with noise on the wrist sensor, which a test can
//! change.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{BatchIdentifier, BatchResult, BatchSettings, Finding, online_findings};
use tactid_dynamics::{BaseKind, Manipulator, MassProperties, Wrench};
use tactid_identify::{BaseState, EquationSettings, Identifier, Sample};

use crate::arm::{JOINTS, Run, TOOL, body};

/// Standard deviations of white noise on force, N, and moment, N m.
pub(crate) const NOISE: [f64; 2] = [0.3, 0.02];

/// Recorded samples of 10 s at 200 Hz, which a test can change.
pub(crate) struct Recorded {
    pub(crate) times_s: Vec<f64>,
    pub(crate) joints: Vec<[[f64; JOINTS]; 2]>,
    pub(crate) efforts: Vec<[f64; JOINTS]>,
    pub(crate) wrenches: Vec<Wrench>,
}

pub(crate) fn payload() -> MassProperties {
    body(2.1, [0.03, -0.02, 0.08], [0.2, 0.12, 0.16])
}

pub(crate) fn run(seed: u64) -> Run {
    Run {
        base: BaseKind::Fixed,
        rate_hz: 200.0,
        payloads: vec![(0.0, payload())],
        duration_s: 10.0,
        gap_s: None,
        motion_seed: seed,
    }
}

pub(crate) fn recorded(seed: u64) -> Recorded {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut draw =
        |std_dev: f64| Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal));
    let instants = run(seed).instants();
    Recorded {
        times_s: instants.iter().map(|instant| instant.time_s).collect(),
        joints: instants
            .iter()
            .map(|instant| [instant.joints[0], instant.joints[1]])
            .collect(),
        efforts: Vec::new(),
        wrenches: instants
            .iter()
            .map(|instant| Wrench {
                force: instant.wrench.force + draw(NOISE[0]),
                moment: instant.wrench.moment + draw(NOISE[1]),
            })
            .collect(),
    }
}

impl Recorded {
    pub(crate) fn sensors(&self) -> &[&str] {
        if self.wrenches.is_empty() {
            &[]
        } else {
            &[TOOL]
        }
    }

    pub(crate) fn samples(&self) -> impl Iterator<Item = Sample<'_>> {
        self.times_s.iter().enumerate().map(|(k, &time_s)| Sample {
            time_s,
            base: BaseState::fixed(),
            joint_position: &self.joints[k][0],
            joint_velocity: &self.joints[k][1],
            joint_effort: self.efforts.get(k).map_or(&[], |efforts| efforts),
            wrenches: self.wrenches.get(k..=k).unwrap_or(&[]),
        })
    }

    /// Solves for the payload in the frame `tip` of a robot.
    pub(crate) fn identify(
        &self,
        robot: &Manipulator,
        tip: &str,
        settings: &EquationSettings,
    ) -> BatchResult {
        self.identify_with(robot, tip, settings, BatchSettings::default())
    }

    pub(crate) fn identify_with(
        &self,
        robot: &Manipulator,
        tip: &str,
        settings: &EquationSettings,
        batch: BatchSettings,
    ) -> BatchResult {
        let sensors = self.sensors();
        let mut batch = BatchIdentifier::new(robot, tip, sensors, settings.clone(), batch).unwrap();
        for sample in self.samples() {
            batch.push(&sample).unwrap();
        }
        batch.solve().unwrap()
    }

    /// Returns the findings of the online identifier after all samples.
    pub(crate) fn online_findings(
        &self,
        robot: &Manipulator,
        tip: &str,
        settings: &EquationSettings,
    ) -> Vec<Finding> {
        let mut online = Identifier::new(robot, tip, self.sensors(), settings).unwrap();
        for sample in self.samples() {
            online.push(&sample).unwrap();
        }
        online_findings(&online.snapshot())
    }

    pub(crate) fn with_offset(mut self, force: Vector3<f64>, moment: Vector3<f64>) -> Self {
        for wrench in &mut self.wrenches {
            wrench.force += force;
            wrench.moment += moment;
        }
        self
    }
}
