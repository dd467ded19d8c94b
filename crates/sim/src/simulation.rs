//! The experiment step by step, without a log.

use nalgebra::Isometry3;
use tactid_dynamics::{InertialParameters, MassProperties};

use crate::checks::{Checks, Monitor};
use crate::contact::ContactPoint;
use crate::excitation::Commands;
use crate::gripper;
use crate::robot::Robot;
use crate::sample::Sample;
use crate::scene::{Scene, State};
use crate::sensors::{Sensors, StepRecord};
use crate::{Experiment, SimError};

/// A running experiment, from the moment the payload is held.
///
/// ```
/// use tactid_sim::{Experiment, Simulation};
///
/// let mut simulation = Simulation::new(&Experiment::paper())?;
/// for _ in 0..100 {
///     let sample = simulation.step()?;
///     let _force_on_payload = sample.fingers[0].wrench.force; // N, in the finger's frame
/// }
/// assert!(simulation.checks().grasp_drift_m < 1e-4);
/// # Ok::<(), tactid_sim::SimError>(())
/// ```
pub struct Simulation {
    experiment: Experiment,
    scene: Scene,
    sensors: Sensors,
    commands: Commands,
    monitor: Monitor,
    joint_names: Vec<String>,
    grip_force_n: f64,
    payload_in_tool: MassProperties,
    /// Steps taken.
    steps: u64,
    before: State,
    after: State,
    contacts: [Vec<ContactPoint>; 2],
    efforts: Vec<f64>,
    sample: Sample,
}

impl Simulation {
    /// Builds the scene and closes the gripper.
    ///
    /// # Errors
    /// What is wrong with the experiment or its robot, or why the grasp failed.
    pub fn new(experiment: &Experiment) -> Result<Self, SimError> {
        experiment.check()?;
        let dt = experiment.step_s;
        let mut scene = Scene::new(experiment)?;
        let grip_force_n = gripper::grasp(&mut scene, &experiment.gripper, dt)?;
        let robot = scene.robot();
        let tool = robot.link(&experiment.robot.tool)?.clone();
        let (noise, seed) = (&experiment.noise, experiment.seed);
        noise.check_joints(robot.joints().count())?;
        let sensors = Sensors::new(robot, tool, scene.finger_bodies(), noise, seed, dt);
        let mut start = State::new(robot.bodies.len());
        scene.read(&mut start);
        let world_from_tool = sensors.tool_pose(&start);
        let payload = experiment.payload.mass_properties();
        let bounds = &experiment.bounds;
        let monitor = Monitor::new(bounds, robot, payload, dt, &start, &world_from_tool);
        let joint_names: Vec<_> = robot
            .joints()
            .map(|(_, joint)| joint.name.clone())
            .collect();
        let drives: Vec<_> = scene
            .drives()
            .iter()
            .map(|&body| &*joint_names[body - 1])
            .collect();
        Ok(Self {
            commands: Commands::new(experiment, &drives)?,
            efforts: vec![0.0; drives.len()],
            sample: Sample::new(joint_names.len()),
            payload_in_tool: as_it_sits(payload, &(world_from_tool.inverse() * start.payload.pose)),
            experiment: experiment.clone(),
            sensors,
            monitor,
            joint_names,
            grip_force_n,
            steps: 0,
            before: start.clone(),
            after: start,
            contacts: [Vec::new(), Vec::new()],
            scene,
        })
    }

    /// One step with the experiment's excitation, and what the sensors say of it.
    ///
    /// # Errors
    /// When a check exceeds its bound, see [`Bounds`](crate::Bounds), or the payload is lost.
    pub fn step(&mut self) -> Result<&Sample, SimError> {
        let velocities = self.commands.step(self.time_s());
        self.scene.drive(velocities);
        self.finish_step()
    }

    /// As [`Self::step`], but the joints of the arm are driven with these accelerations, rad/s² (m/s² for a prismatic
    /// joint).
    ///
    /// # Errors
    /// As [`Self::step`], or if there is not one acceleration for each joint of the arm.
    pub fn step_with(&mut self, accelerations: &[f64]) -> Result<&Sample, SimError> {
        let velocities = self.commands.accelerate(accelerations)?;
        self.scene.drive(velocities);
        self.finish_step()
    }

    fn finish_step(&mut self) -> Result<&Sample, SimError> {
        let time_s = self.time_s();
        std::mem::swap(&mut self.before, &mut self.after);
        self.scene.step();
        self.scene.read(&mut self.after);
        self.scene
            .contacts(&self.before.payload, &mut self.contacts);
        let commanded = self.commands.velocity();
        self.scene
            .drive_efforts(commanded, &self.after, &mut self.efforts);
        let record = StepRecord {
            before: &self.before,
            after: &self.after,
            contacts: &self.contacts,
            efforts: &self.efforts,
            drives: self.scene.drives(),
        };
        self.sample.time_s = time_s;
        self.sensors.measure(&record, &mut self.sample);
        let tool = self.sample.truth.tool;
        let states = (&self.before, &self.after);
        self.monitor
            .look(self.steps, time_s, states, &self.contacts, &tool)?;
        self.steps += 1;
        Ok(&self.sample)
    }

    /// Time since the start of the excitation, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * self.experiment.step_s
    }

    /// Steps taken since then.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Steps that the experiment takes.
    #[must_use]
    pub fn total_steps(&self) -> u64 {
        (self.experiment.duration_s / self.experiment.step_s).round() as u64
    }

    /// The experiment that runs.
    #[must_use]
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// How well the run has kept to physics so far.
    #[must_use]
    pub fn checks(&self) -> Checks {
        self.monitor.checks()
    }

    /// All moving joints, fingers included, in the order of the samples.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// The joints of the arm, in the order of [`Self::step_with`].
    pub fn arm_joint_names(&self) -> impl Iterator<Item = &str> {
        self.scene
            .drives()
            .iter()
            .map(|&body| self.joint_names[body - 1].as_str())
    }

    /// The force with which each finger presses, N.
    #[must_use]
    pub fn grip_force_n(&self) -> f64 {
        self.grip_force_n
    }

    /// The payload in the tool frame, as it really sits in the grasp.
    #[must_use]
    pub fn payload_in_tool(&self) -> &MassProperties {
        &self.payload_in_tool
    }

    /// The URDF of the robot that runs, with the experiment's base.
    #[must_use]
    pub fn urdf(&self) -> &str {
        &self.scene.robot().urdf
    }

    pub(crate) fn robot(&self) -> &Robot {
        self.scene.robot()
    }

    /// The bodies of the fingers.
    pub(crate) fn finger_bodies(&self) -> [usize; 2] {
        self.scene.finger_bodies()
    }

    /// What the sensors said of the last step.
    #[must_use]
    pub fn sample(&self) -> &Sample {
        &self.sample
    }

    /// The state at the time of the last sample.
    pub(crate) fn state(&self) -> &State {
        &self.before
    }
}

/// The payload's frame stands at its centre of mass.
fn as_it_sits(nominal: MassProperties, tool_from_payload: &Isometry3<f64>) -> MassProperties {
    let own = MassProperties {
        center_of_mass: nalgebra::Vector3::zeros(),
        ..nominal
    };
    let in_tool = InertialParameters::from(own).expressed_in(tool_from_payload);
    in_tool.mass_properties().unwrap_or(nominal)
}
