//! Simulation of an experiment step by step, without a log.

use nalgebra::Isometry3;
use tactid_dynamics::{InertialParameters, MassProperties};

use crate::checks::{BaseExcursion, Checks, Monitor};
use crate::contact::ContactPoint;
use crate::excitation::{ActiveReport, Commands, Start};
use crate::gripper;
use crate::robot::Robot;
use crate::roles::{Roles, joint_names};
use crate::sample::Sample;
use crate::scene::{Scene, State};
use crate::sensors::{Sensors, StepRecord};
use crate::{Experiment, SimError};

/// A running experiment, which starts when the payload is held.
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
    /// Number of steps taken.
    steps: u64,
    before: State,
    after: State,
    contacts: [Vec<ContactPoint>; 2],
    efforts: Vec<f64>,
    sample: Sample,
}

impl Simulation {
    /// Builds the scene and simulates the grasp.
    ///
    /// # Errors
    /// Returns [`SimError::Value`], [`SimError::File`], [`SimError::Model`] or [`SimError::Robot`]
    /// for a fault of the experiment or its robot, [`SimError::Grasp`] if the grasp fails, and
    /// [`SimError::Planning`] if the motion of active excitation cannot be planned.
    pub fn new(experiment: &Experiment) -> Result<Self, SimError> {
        experiment.check()?;
        let mut scene = Scene::new(experiment)?;
        let grip_force_n = gripper::grasp(&mut scene, experiment)?;
        let (robot, roles) = (scene.robot(), scene.roles());
        let sensors = Sensors::new(robot, roles, experiment);
        let mut start = State::new(robot.bodies.len());
        scene.read(&mut start);
        let world_from_tool = sensors.tool_pose(&start);
        let payload = experiment.payload.mass_properties();
        let monitor = Monitor::new(experiment, robot, &start, &world_from_tool);
        let joint_names: Vec<_> = robot
            .joints()
            .map(|(_, joint)| joint.name.clone())
            .collect();
        let joints = roles.arm.len();
        let mut contacts = [Vec::new(), Vec::new()];
        scene.contacts(&start.payload, &mut contacts);
        let held = Start {
            robot,
            roles,
            state: &start,
            contacts: &contacts,
            grip_force_n,
        };
        Ok(Self {
            commands: Commands::new(experiment, &held)?,
            efforts: vec![0.0; joints],
            sample: Sample::new(joint_names.len()),
            payload_in_tool: payload_in_tool(
                payload,
                &(world_from_tool.inverse() * start.payload.pose),
            ),
            experiment: experiment.clone(),
            sensors,
            monitor,
            joint_names,
            grip_force_n,
            steps: 0,
            before: start.clone(),
            after: start,
            contacts,
            scene,
        })
    }

    /// Simulates one step with the experiment's excitation and returns the sample of its sensors.
    ///
    /// # Errors
    /// Returns [`SimError::Bound`] if a check exceeds its bound, [`SimError::Lost`] if no finger
    /// touches the payload, [`SimError::Diverged`] if the state is not finite, and
    /// [`SimError::Planning`] if the motion cannot be planned further.
    pub fn step(&mut self) -> Result<&Sample, SimError> {
        let velocities = self.commands.step(self.time_s())?;
        self.scene.drive(velocities);
        self.finish_step()?;
        self.commands.observe(&self.sample)?;
        Ok(&self.sample)
    }

    /// Simulates one step with the given accelerations of the arm's joints, rad/s² (m/s² for a
    /// prismatic joint), in place of the experiment's excitation, and returns the sample of its
    /// sensors.
    ///
    /// # Errors
    /// Returns the errors of [`Self::step`], and [`SimError::Command`] if there is not one
    /// acceleration for each joint of the arm.
    pub fn step_with(&mut self, accelerations: &[f64]) -> Result<&Sample, SimError> {
        let velocities = self.commands.accelerate(accelerations)?;
        self.scene.drive(velocities);
        self.finish_step()
    }

    /// Steps the physics with the commanded velocities, measures and checks.
    fn finish_step(&mut self) -> Result<&Sample, SimError> {
        let time_s = self.time_s();
        std::mem::swap(&mut self.before, &mut self.after);
        self.scene.step();
        self.scene.read(&mut self.after);
        self.scene
            .contacts(&self.before.payload, &mut self.contacts);
        self.scene.drive_efforts(&self.after, &mut self.efforts);
        let record = StepRecord {
            before: &self.before,
            after: &self.after,
            contacts: &self.contacts,
            efforts: &self.efforts,
            arm: &self.scene.roles().arm,
        };
        self.sample.time_s = time_s;
        self.sensors.measure(&record, &mut self.sample);
        let tool = self.sample.truth.tool;
        let states = (&self.before, &self.after);
        self.monitor
            .check_step(self.steps, time_s, states, &self.contacts, &tool)?;
        self.steps += 1;
        Ok(&self.sample)
    }

    /// Returns the time since the start of the excitation, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * self.experiment.step_s
    }

    /// Returns the number of steps since the start of the excitation.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns whether the experiment is over: its duration has passed, or active excitation has
    /// ended and the arm rests.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.steps >= self.total_steps() || self.commands.is_finished(self.time_s())
    }

    /// Returns what active excitation has reached so far; `None` for another kind of excitation.
    #[must_use]
    pub fn active_report(&self) -> Option<ActiveReport> {
        self.commands.active_report()
    }

    /// Returns the number of steps of the whole experiment: the most, where it can end early.
    #[must_use]
    pub fn total_steps(&self) -> u64 {
        (self.experiment.duration_s / self.experiment.step_s).round() as u64
    }

    /// Returns the experiment.
    #[must_use]
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// Returns the largest violations of conservation laws and of the grasp up to the last step.
    #[must_use]
    pub fn checks(&self) -> Checks {
        self.monitor.checks()
    }

    /// Returns how far a floating base has moved since the excitation began; `None` if it is fixed.
    #[must_use]
    pub fn base_excursion(&self) -> Option<BaseExcursion> {
        self.monitor.base_excursion()
    }

    /// Returns the names of all moving joints, fingers included, in the order of the samples.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Returns the names of the arm's joints in the order of the accelerations of
    /// [`Self::step_with`].
    pub fn arm_joint_names(&self) -> impl Iterator<Item = &str> {
        joint_names(self.scene.robot(), &self.scene.roles().arm).into_iter()
    }

    /// Returns the force of each finger on the payload when the excitation starts, N.
    #[must_use]
    pub fn grip_force_n(&self) -> f64 {
        self.grip_force_n
    }

    /// Returns the payload's mass properties in the tool frame, at its actual pose in the grasp.
    #[must_use]
    pub fn payload_in_tool(&self) -> &MassProperties {
        &self.payload_in_tool
    }

    /// Returns the URDF of the robot with the experiment's base.
    #[must_use]
    pub fn urdf(&self) -> &str {
        &self.scene.robot().urdf
    }

    pub(crate) fn robot(&self) -> &Robot {
        self.scene.robot()
    }

    pub(crate) fn roles(&self) -> &Roles {
        self.scene.roles()
    }

    /// Returns the sample of the last step.
    #[must_use]
    pub fn sample(&self) -> &Sample {
        &self.sample
    }

    /// Returns the state at the time of the last sample.
    pub(crate) fn state(&self) -> &State {
        &self.before
    }
}

/// Returns the payload in the tool frame. The payload's own frame is at its centre of mass.
fn payload_in_tool(nominal: MassProperties, tool_from_payload: &Isometry3<f64>) -> MassProperties {
    let own = MassProperties {
        center_of_mass: nalgebra::Vector3::zeros(),
        ..nominal
    };
    let in_tool = InertialParameters::from(own).expressed_in(tool_from_payload);
    in_tool.mass_properties().unwrap_or(nominal)
}
