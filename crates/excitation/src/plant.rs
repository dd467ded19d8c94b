//! Outputs of the robot model at one state of the joints: regressor rows, torques, wrench on the
//! payload, twist of the base, and distances of bodies.

use nalgebra::{DMatrix, DVector, Isometry3, Vector3, Vector6};
use tactid_dynamics::{
    BaseKind, FrameId, FrameMotion, FreeRobot, InertialParameters, Workspace, free_base_motion,
    inverse_dynamics, motion, wrench_regressor,
};
use tactid_identify::MotionRows;
use tactid_identify::equations::Row;

use crate::ExcitationError;
use crate::collisions::Distances;
use crate::motion::JointStates;
use crate::problem::Problem;
use crate::whitening::{PARAMETERS, covariance, whiten, whitening};
use crate::workspace_bounds::Confined;

/// Number of entries of a wrench or a twist.
const WRENCH_ENTRIES: usize = 6;

/// Number of axes of a box.
const AXES: usize = 3;

/// Places of the quantities in the vector of outputs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Number of rows.
    pub(crate) channels: usize,
    dof: usize,
    pub(crate) payloads: usize,
    pub(crate) floats: bool,
    /// Number of pairs with a limited distance.
    pub(crate) pairs: usize,
    /// Number of bodies that must stay in a box.
    confined: usize,
}

impl Layout {
    /// Place of a row's ten entries, whitened by the noise of one second of samples.
    pub(crate) fn row(&self, channel: usize) -> usize {
        channel * PARAMETERS
    }

    /// Place of the effort of a joint with a payload, N m or N.
    pub(crate) fn effort(&self, payload: usize, joint: usize) -> usize {
        self.of_payload(payload) + joint
    }

    /// Place of an entry of the wrench on a payload in the tool frame, N and N m.
    pub(crate) fn wrench(&self, payload: usize, entry: usize) -> usize {
        self.of_payload(payload) + self.dof + entry
    }

    /// Place of an entry of the base's twist in its own frame with a payload: angular velocity,
    /// then velocity, rad/s and m/s. A fixed base has none.
    pub(crate) fn twist(&self, payload: usize, entry: usize) -> usize {
        self.of_payload(payload) + self.dof + WRENCH_ENTRIES + entry
    }

    fn of_payload(&self, payload: usize) -> usize {
        let each = self.dof + WRENCH_ENTRIES + if self.floats { WRENCH_ENTRIES } else { 0 };
        self.channels * PARAMETERS + payload * each
    }

    /// Place of the distance of a pair, m.
    pub(crate) fn distance(&self, pair: usize) -> usize {
        self.of_payload(self.payloads) + pair
    }

    /// Place of the fraction of a box that a body uses along an axis.
    pub(crate) fn confined(&self, body: usize, axis: usize) -> usize {
        self.distance(self.pairs) + AXES * body + axis
    }

    /// Number of outputs.
    pub(crate) fn count(&self) -> usize {
        self.confined(self.confined, 0)
    }
}

/// A robot with each payload of a problem.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    rows: MotionRows,
    loaded: Vec<(Workspace, InertialParameters)>,
    /// Columns of the Jacobian of the tool, as workspace of an evaluation.
    jacobian: Vec<Vector6<f64>>,
    tool: FrameId,
    gravity: Vector3<f64>,
    whitening: DMatrix<f64>,
    layout: Layout,
    /// Number of leading channels that have an unknown constant offset.
    pub(crate) offsets: usize,
    pub(crate) distances: Distances,
    pub(crate) confined: Vec<Confined>,
}

impl Plant {
    /// Creates the plant of a problem with checked numbers.
    pub(crate) fn new(problem: &Problem) -> Result<Self, ExcitationError> {
        let (robot, sensing) = (&problem.robot, &problem.sensing);
        let tool = robot.frame(&problem.tool)?;
        let load = |payload: &InertialParameters| {
            let loaded = robot.with_payload(tool, payload);
            (Workspace::new(&loaded), *payload)
        };
        let loaded: Vec<_> = problem.payloads.iter().map(load).collect();
        let states = JointStates::at_rest(&problem.start);
        let base = FrameMotion::at_rest(Isometry3::identity());
        let mut unloaded = Workspace::new(robot);
        motion(&mut unloaded, &base, states.joints())?;
        let distances = Distances::new(problem, &unloaded)?;
        let inside = problem.workspace.inside;
        let confined = inside.map(|inside| Confined::to_box(inside, tool, problem.payload_box));
        let confined = confined.unwrap_or_default();
        let mut plant = Self {
            rows: motion_rows(problem)?,
            loaded,
            jacobian: vec![Vector6::zeros(); robot.dof()],
            tool,
            gravity: problem.gravity(),
            whitening: DMatrix::zeros(0, 0),
            layout: Layout {
                channels: 0,
                dof: robot.dof(),
                payloads: problem.payloads.len(),
                floats: robot.base_kind() == BaseKind::Floating,
                pairs: distances.count(),
                confined: confined.len(),
            },
            offsets: 0,
            distances,
            confined,
        };
        let base = plant.base_motion(0, &Isometry3::identity(), &states)?;
        plant.rows.at(&base, states.joints())?;
        let channels = plant.rows.channels();
        plant.layout.channels = channels.count();
        plant.offsets = channels.offsets;
        let covariance = covariance(&channels, sensing)?;
        plant.whitening = whitening(covariance, &channels)? * sensing.rate_hz.sqrt();
        Ok(plant)
    }

    /// Adds noise of the joints' accelerations to the noise of the sensors: an error of the
    /// acceleration is one of the load of the first payload, in all channels at once. `std_devs`
    /// describe white noise of one sample of each joint, rad/s² or m/s².
    pub(crate) fn add_acceleration_noise(
        &mut self,
        problem: &Problem,
        std_devs: &[f64],
    ) -> Result<(), ExcitationError> {
        let channels = self.rows.channels();
        let mut covariance = covariance(&channels, &problem.sensing)?;
        let mut states = JointStates::at_rest(&problem.start);
        let at_rest = self.load(&states)?;
        for (joint, std_dev) in std_devs.iter().enumerate() {
            states.acceleration[joint] = 1.0;
            let change = (self.load(&states)? - &at_rest) * *std_dev;
            states.acceleration[joint] = 0.0;
            covariance.ger(1.0, &change, &change, 1.0);
        }
        self.whitening = whitening(covariance, &channels)? * problem.sensing.rate_hz.sqrt();
        Ok(())
    }

    /// Returns the load of the first payload in each channel.
    fn load(&mut self, states: &JointStates) -> Result<DVector<f64>, ExcitationError> {
        let base = self.base_motion(0, &Isometry3::identity(), states)?;
        let rows = self.rows.at(&base, states.joints())?;
        let (_, payload) = &self.loaded[0];
        let of_row = |row: &Row| {
            let pairs = row.regressor.iter().zip(payload.as_vector());
            pairs.map(|(a, b)| a * b).sum()
        };
        Ok(DVector::from_iterator(rows.len(), rows.iter().map(of_row)))
    }

    /// Returns the places of the outputs.
    pub(crate) fn layout(&self) -> Layout {
        self.layout
    }

    /// Returns the product of the whitening of one second of samples with rows.
    pub(crate) fn whitened(&self, rows: &[Row]) -> Vec<[f64; PARAMETERS]> {
        let mut white = vec![[0.0; PARAMETERS]; rows.len()];
        whiten(&self.whitening, rows, white.as_flattened_mut());
        white
    }

    /// Returns the motion of the base with one of the payloads. The workspace of this payload then
    /// holds the motion of the whole robot and its forces.
    pub(crate) fn base_motion(
        &mut self,
        payload: usize,
        pose: &Isometry3<f64>,
        states: &JointStates,
    ) -> Result<FrameMotion, ExcitationError> {
        let (workspace, _) = &mut self.loaded[payload];
        if self.layout.floats {
            return Ok(free_base_motion(workspace, pose, states.joints())?);
        }
        let base = FrameMotion::at_rest(Isometry3::identity());
        inverse_dynamics(workspace, &base, states.joints(), &self.gravity)?;
        Ok(base)
    }

    /// Computes all outputs at one state of the joints. A floating base has the velocity for which
    /// the momentum vanishes.
    pub(crate) fn evaluate(
        &mut self,
        states: &JointStates,
        outputs: &mut [f64],
    ) -> Result<(), ExcitationError> {
        self.evaluate_dynamics(states, outputs)?;
        let (workspace, _) = &self.loaded[0];
        let distances = &mut outputs[self.layout.distance(0)..];
        self.distances.measure(workspace, distances);
        Ok(())
    }

    /// Computes all outputs at a state close to the one that was evaluated last, where distances
    /// are those along the direction between the points that were the closest there.
    pub(crate) fn evaluate_near(
        &mut self,
        states: &JointStates,
        outputs: &mut [f64],
    ) -> Result<(), ExcitationError> {
        self.evaluate_dynamics(states, outputs)?;
        let (workspace, _) = &self.loaded[0];
        let distances = &mut outputs[self.layout.distance(0)..];
        self.distances.follow(workspace, distances);
        Ok(())
    }

    /// Computes the distances of some pairs at positions of the joints, m.
    pub(crate) fn distances_at(
        &mut self,
        states: &JointStates,
        pairs: &[usize],
    ) -> Result<Vec<f64>, ExcitationError> {
        let (workspace, _) = &mut self.loaded[0];
        let base = FrameMotion::at_rest(Isometry3::identity());
        motion(workspace, &base, states.joints())?;
        Ok(self.distances.measure_some(workspace, pairs))
    }

    /// Computes all outputs except for the distances of pairs.
    fn evaluate_dynamics(
        &mut self,
        states: &JointStates,
        outputs: &mut [f64],
    ) -> Result<(), ExcitationError> {
        let layout = self.layout;
        let base = if layout.floats {
            self.evaluate_floating(states, outputs)?
        } else {
            let base = self.base_motion(0, &Isometry3::identity(), states)?;
            self.write_loads(0, &base, outputs)?;
            if self.loaded.len() > 1 {
                self.write_others_on_ground(outputs)?;
            }
            base
        };
        let rows = self.rows.at(&base, states.joints())?;
        whiten(
            &self.whitening,
            rows,
            &mut outputs[..layout.row(layout.channels)],
        );
        for (body, confined) in self.confined.iter().enumerate() {
            let first = layout.confined(body, 0);
            outputs[first..first + AXES].copy_from_slice(&confined.used(&self.loaded[0].0));
        }
        Ok(())
    }

    /// Computes the efforts, the wrench and the twist of a floating base with each payload, and
    /// returns the motion of the base with the first.
    fn evaluate_floating(
        &mut self,
        states: &JointStates,
        outputs: &mut [f64],
    ) -> Result<FrameMotion, ExcitationError> {
        let (joints, pose) = (states.joints(), Isometry3::identity());
        let (workspace, first) = &mut self.loaded[0];
        let first = *first;
        let robot = FreeRobot::new(workspace, joints)?;
        let tool = workspace.frame_motion(self.tool);
        let of_first = robot.base_motion(workspace, &pose, joints)?;
        self.write_loads(0, &of_first, outputs)?;
        for payload in 1..self.loaded.len() {
            let (workspace, parameters) = &mut self.loaded[payload];
            let difference =
                InertialParameters::from_vector(parameters.as_vector() - first.as_vector());
            let base = robot
                .with_body(&tool, &difference)
                .base_motion(workspace, &pose, joints)?;
            self.write_loads(payload, &base, outputs)?;
        }
        Ok(of_first)
    }

    /// Writes the efforts, the wrench and the twist of the base with one payload, of which the
    /// workspace holds the motion.
    fn write_loads(
        &self,
        payload: usize,
        base: &FrameMotion,
        outputs: &mut [f64],
    ) -> Result<(), ExcitationError> {
        let layout = self.layout;
        let (workspace, parameters) = &self.loaded[payload];
        let first = layout.effort(payload, 0);
        outputs[first..first + layout.dof].copy_from_slice(workspace.joint_torques()?);
        let regressor = wrench_regressor(&workspace.tool_motion(self.tool, &self.gravity));
        let wrench = regressor * parameters.as_vector();
        let first = layout.wrench(payload, 0);
        outputs[first..first + WRENCH_ENTRIES].copy_from_slice(wrench.as_slice());
        if layout.floats {
            let first = layout.twist(payload, 0);
            let twist = base.angular_velocity.iter().chain(&base.velocity);
            for (output, entry) in outputs[first..].iter_mut().zip(twist) {
                *output = *entry;
            }
        }
        Ok(())
    }

    /// Writes the efforts and the wrench of all payloads but the first, on a fixed base. All move
    /// alike there, so that the efforts differ by what the difference of their wrenches needs:
    /// `τ - τ₀ = Jᵀ (w - w₀)`.
    fn write_others_on_ground(&mut self, outputs: &mut [f64]) -> Result<(), ExcitationError> {
        let layout = self.layout;
        let (workspace, _) = &self.loaded[0];
        workspace.jacobian(self.tool, &mut self.jacobian)?;
        let regressor = wrench_regressor(&workspace.tool_motion(self.tool, &self.gravity));
        let wrench_of_first = layout.wrench(0, 0);
        let first =
            Vector6::from_column_slice(&outputs[wrench_of_first..wrench_of_first + WRENCH_ENTRIES]);
        for (payload, (_, parameters)) in self.loaded.iter().enumerate().skip(1) {
            let wrench: Vector6<f64> = regressor * parameters.as_vector();
            let place = layout.wrench(payload, 0);
            outputs[place..place + WRENCH_ENTRIES].copy_from_slice(wrench.as_slice());
            let difference = wrench - first;
            for (joint, column) in self.jacobian.iter().enumerate() {
                let effort = outputs[layout.effort(0, joint)] + column.dot(&difference);
                outputs[layout.effort(payload, joint)] = effort;
            }
        }
        Ok(())
    }
}

/// Returns the rows of a problem's method.
fn motion_rows(problem: &Problem) -> Result<MotionRows, ExcitationError> {
    let sensing = &problem.sensing;
    let sensors: Vec<&str> = sensing.sensors.iter().map(String::as_str).collect();
    let rows = MotionRows::new(&problem.robot, &problem.tool, &sensors, &sensing.equations)?;
    Ok(rows)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    use super::*;
    use crate::common::{in_orbit, on_ground};

    /// Each payload has the efforts, wrench and twist of the base of the whole dynamics with it.
    #[test]
    fn payloads_share_a_computation() {
        for mut problem in [on_ground(), in_orbit()] {
            let first = problem.payloads[0];
            let more = [0.0, 0.3, 2.0].map(|factor| first.as_vector() * factor);
            problem
                .payloads
                .extend(more.map(InertialParameters::from_vector));
            let mut plant = Plant::new(&problem).unwrap();
            let mut random = StdRng::seed_from_u64(1);
            let mut outputs = vec![0.0; plant.layout().count()];
            let mut alone = outputs.clone();
            for _ in 0..20 {
                let states = random_states(&problem, &mut random);
                plant.evaluate(&states, &mut outputs).unwrap();
                for payload in 0..problem.payloads.len() {
                    let base = plant
                        .base_motion(payload, &Isometry3::identity(), &states)
                        .unwrap();
                    plant.write_loads(payload, &base, &mut alone).unwrap();
                }
                let layout = plant.layout();
                let of_payloads = layout.effort(0, 0)..layout.distance(0);
                for (found, expected) in
                    outputs[of_payloads.clone()].iter().zip(&alone[of_payloads])
                {
                    let tolerance = 1e-9 * (1.0 + expected.abs());
                    assert!((found - expected).abs() < tolerance, "{found} {expected}");
                }
            }
        }
    }

    fn random_states(problem: &Problem, random: &mut StdRng) -> JointStates {
        let mut states = JointStates::at_rest(&problem.start);
        for numbers in [
            &mut states.position,
            &mut states.velocity,
            &mut states.acceleration,
        ] {
            for number in numbers {
                *number += random.random_range(-1.0..1.0);
            }
        }
        states
    }
}
