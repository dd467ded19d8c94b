//! From an instant to its row equations: which load, and whose motion.

use nalgebra::{DMatrix, DVector, Isometry3, SMatrix, SVector, Vector3, Vector6};
use tactid_dynamics::{
    BaseKind, FrameId, InertialParameters, JointKind, JointMotion, Manipulator, StateError,
    ToolMotion, Workspace, Wrench, forces, motion, wrench_on_end_effector, wrench_regressor,
};

use super::channels::{Channel, Channels, GivenNoise, wrench_channels};
use super::equation::Row;
use super::sample::Instant;
use super::settings::EquationSettings;
use crate::{IdentifyError, Method};

/// What some rows come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// The sensors' wrenches.
    Sensors,
    /// The motion of all but the end-effector.
    Rest,
    /// What the joints exert.
    Efforts,
    /// The motion of the free-floating base, end-effector included.
    Base,
}

impl Source {
    fn rows(self, loaded: &[usize]) -> usize {
        match self {
            Self::Efforts => loaded.len(),
            Self::Sensors | Self::Rest | Self::Base => 6,
        }
    }
}

/// The robot, and the way in which its measurements become rows.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    method: Method,
    sources: Vec<Source>,
    gravity: Vector3<f64>,
    effort_is_net: bool,
    wrench_offset: bool,
    /// Deviations of a sample of each sensor, and of each joint's effort; none where they are not known.
    wrench_noise: Vec<SVector<f64, 6>>,
    effort_noise: Vec<f64>,
    robot: Manipulator,
    /// The robot as the equations know it: without its end-effector for the joint-sensing method.
    known: Manipulator,
    tool: FrameId,
    sensors: Vec<FrameId>,
    /// The joints that feel the payload.
    loaded: Vec<usize>,
    workspace: Workspace,
    jacobian: Vec<Vector6<f64>>,
    rows: Vec<Row>,
}

impl Model {
    pub(crate) fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        let tool = robot.frame(tool)?;
        let sensors = sensors
            .iter()
            .map(|name| robot.frame(name))
            .collect::<Result<Vec<_>, _>>()?;
        let loaded: Vec<usize> = (0..robot.dof()).filter(|&j| robot.moves(j, tool)).collect();
        let sources = match settings.method {
            Method::Tactile => vec![Source::Sensors],
            Method::JointSensing => vec![Source::Rest],
            Method::Effort => vec![Source::Efforts],
            Method::Combined { effort } => [
                (!sensors.is_empty(), Source::Sensors),
                (effort, Source::Efforts),
                (robot.base_kind() == BaseKind::Floating, Source::Base),
            ]
            .into_iter()
            .filter_map(|(is_there, source)| is_there.then_some(source))
            .collect(),
        };
        let rows: usize = sources.iter().map(|source| source.rows(&loaded)).sum();
        let mut model = Self {
            method: settings.method,
            gravity: settings.gravity_for(robot.base_kind()),
            effort_is_net: settings.effort_is_net,
            wrench_offset: settings.wrench_offset,
            wrench_noise: each(&settings.wrench_noise, sensors.len())
                .map(SVector::from)
                .collect(),
            effort_noise: each(&settings.effort_noise, robot.dof()).collect(),
            known: match settings.method {
                Method::Tactile | Method::Effort | Method::Combined { .. } => robot.clone(),
                Method::JointSensing => robot.without_subtree(tool),
            },
            sources,
            robot: robot.clone(),
            tool,
            sensors,
            loaded,
            workspace: Workspace::new(robot),
            jacobian: vec![Vector6::zeros(); robot.dof()],
            rows: vec![Row::zero(); rows],
        };
        // Where the sensors are before the first sample says so.
        let still = Instant::new(robot.dof(), model.sensors.len());
        model.rows(&still)?;
        Ok(model)
    }

    pub(crate) fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    pub(crate) fn robot(&self) -> &Manipulator {
        &self.robot
    }

    /// How many rows an instant gives.
    pub(crate) fn row_count(&self) -> usize {
        self.rows.len()
    }

    /// How the rows belong together.
    pub(crate) fn channels(&self) -> Channels {
        let sources = self.sources.iter();
        let kinds = sources.clone().flat_map(|source| match source {
            Source::Efforts => vec![self.loaded.len()],
            Source::Sensors | Source::Rest | Source::Base => vec![3, 3],
        });
        let channels = Channels {
            channels: self.named_channels(),
            kinds: kinds.collect(),
            sources: sources.map(|source| source.rows(&self.loaded)).collect(),
            offsets: 0,
            given: self.given_noise(),
        };
        let feels = self.sources.first() == Some(&Source::Sensors);
        channels.with_offsets(self.wrench_offset && feels)
    }

    /// What the settings say of the sensors, in the channels' frames, at the posture of the last instant.
    fn given_noise(&self) -> Vec<GivenNoise> {
        let mut given = Vec::new();
        let mut first = 0;
        for &source in &self.sources {
            match source {
                Source::Sensors if !self.wrench_noise.is_empty() => {
                    let covariance = self.wrench_covariance();
                    let covariance = DMatrix::from_column_slice(6, 6, covariance.as_slice());
                    given.push(GivenNoise::new(first, covariance));
                }
                Source::Efforts if !self.effort_noise.is_empty() => {
                    let loaded = self.loaded.iter();
                    let variances = loaded.map(|&joint| self.effort_noise[joint].powi(2));
                    let variances = DVector::from_iterator(self.loaded.len(), variances);
                    given.push(GivenNoise::new(first, DMatrix::from_diagonal(&variances)));
                }
                Source::Sensors | Source::Efforts | Source::Rest | Source::Base => {}
            }
            first += source.rows(&self.loaded);
        }
        given
    }

    /// Of the noise of a sample of the sensors' sum, in `Σ_U` and about its origin.
    fn wrench_covariance(&self) -> SMatrix<f64, 6, 6> {
        let tool_from_world = self.workspace.pose(&self.known, self.tool).inverse();
        let mut covariance = SMatrix::zeros();
        for (&sensor, std_devs) in self.sensors.iter().zip(&self.wrench_noise) {
            let tool_from_sensor = tool_from_world * self.workspace.pose(&self.known, sensor);
            let root = moved(&SMatrix::from_diagonal(std_devs), &tool_from_sensor);
            covariance += root * root.transpose();
        }
        covariance
    }

    /// Whether the first six rows are the force and the moment on the end-effector, in its frame.
    pub(crate) fn begins_with_wrench(&self) -> bool {
        matches!(self.sources.first(), Some(Source::Sensors | Source::Rest))
    }

    pub(crate) fn needs_effort(&self) -> bool {
        self.method.uses_effort()
    }

    pub(crate) fn sensor_count(&self) -> usize {
        self.sensors.len()
    }

    /// What each row is measured in: name and unit.
    fn named_channels(&self) -> Vec<Channel> {
        let effort = |&joint: &usize| Channel {
            name: format!("effort {}", self.robot.joint_names()[joint]),
            unit: match self.robot.joint_kind(joint) {
                Some(JointKind::Prismatic) => "N",
                Some(JointKind::Revolute) | None => "N m",
            },
        };
        let channels = self.sources.iter().flat_map(|source| match source {
            Source::Sensors | Source::Rest => wrench_channels(""),
            Source::Efforts => self.loaded.iter().map(effort).collect(),
            Source::Base => wrench_channels("base "),
        });
        channels.collect()
    }

    /// The rows of an instant.
    pub(crate) fn rows(&mut self, instant: &Instant) -> Result<&[Row], StateError> {
        let joints = JointMotion {
            position: &instant.joint_position,
            velocity: &instant.joint_velocity,
            acceleration: &instant.joint_acceleration,
        };
        motion(&self.known, &mut self.workspace, &instant.base, joints)?;
        let frame = self.workspace.frame_motion(&self.known, self.tool);
        let regressor = wrench_regressor(&frame.in_frame(&self.gravity));
        let gravity =
            gravity_regressor(&frame.pose.rotation.inverse_transform_vector(&self.gravity));
        let needs_forces = |source| match source {
            Source::Efforts => !self.effort_is_net,
            Source::Base => true,
            Source::Sensors | Source::Rest => false,
        };
        if self.sources.iter().copied().any(needs_forces) {
            forces(&self.known, &mut self.workspace, &self.gravity);
        }
        let mut first = 0;
        for k in 0..self.sources.len() {
            let source = self.sources[k];
            let count = source.rows(&self.loaded);
            match source {
                Source::Efforts => self.effort_rows(first, instant, &regressor, &gravity),
                Source::Sensors | Source::Rest => {
                    let wrench = self.wrench_on_end_effector(source, instant);
                    fill(&mut self.rows[first..], &wrench, &regressor, &gravity);
                }
                Source::Base => self.base_rows(first, &instant.base.pose, &regressor, &gravity),
            }
            first += count;
        }
        Ok(&self.rows)
    }

    /// `Jᵀ Y π = τ - τ_arm`.
    fn effort_rows(
        &mut self,
        first: usize,
        instant: &Instant,
        regressor: &SMatrix<f64, 6, 10>,
        gravity: &SMatrix<f64, 6, 4>,
    ) {
        let workspace = &mut self.workspace;
        workspace.jacobian(&self.known, self.tool, &mut self.jacobian);
        for (row, &joint) in self.rows[first..].iter_mut().zip(&self.loaded) {
            let column = &self.jacobian[joint];
            row.regressor = regressor.tr_mul(column);
            row.gravity = gravity.tr_mul(column);
            row.target = instant.joint_effort[joint];
            if !self.effort_is_net {
                row.target -= workspace.joint_torques()[joint];
            }
        }
    }

    /// What moves the payload comes from the robot's own momentum: both wrenches on a base that floats
    /// freely, in its frame and about its origin, sum to zero, (21)-(44).
    ///
    /// In the base's frame, not at the tool: there the noise of the base's motion stays in the
    /// channel it belongs to.
    fn base_rows(
        &mut self,
        first: usize,
        world_from_base: &Isometry3<f64>,
        regressor: &SMatrix<f64, 6, 10>,
        gravity: &SMatrix<f64, 6, 4>,
    ) {
        let on_known = self.workspace.base_wrench();
        let base_from_world = world_from_base.rotation.inverse();
        let target = Wrench {
            force: base_from_world * -on_known.force,
            moment: base_from_world * -on_known.moment,
        };
        let base_from_tool = world_from_base.inv_mul(&self.workspace.pose(&self.known, self.tool));
        let (regressor, gravity) = (
            moved(regressor, &base_from_tool),
            moved(gravity, &base_from_tool),
        );
        fill(&mut self.rows[first..], &target, &regressor, &gravity);
    }

    /// On the body that is sought, in `Σ_U` and about its origin.
    fn wrench_on_end_effector(&self, source: Source, instant: &Instant) -> Wrench {
        if source == Source::Rest {
            return wrench_on_end_effector(&self.known, &self.workspace, self.tool);
        }
        // (47): f_U and n_U are the sums over all fingers.
        let tool_from_world = self.workspace.pose(&self.known, self.tool).inverse();
        let wrenches = self.sensors.iter().zip(&instant.wrenches);
        wrenches.fold(Wrench::zero(), |sum, (&sensor, wrench)| {
            let world_from_sensor = self.workspace.pose(&self.known, sensor);
            sum + wrench.expressed_in(&(tool_from_world * world_from_sensor))
        })
    }

    /// The [gripper](Self::gripper), where its parameters are found with the payload's.
    pub(crate) fn gripper_to_subtract(&self) -> Option<InertialParameters> {
        (self.method == Method::JointSensing).then(|| self.gripper())
    }

    /// The links below the tool, at the posture of the last instant.
    pub(crate) fn gripper(&self) -> InertialParameters {
        self.robot.subtree_parameters(&self.workspace, self.tool)
    }
}

/// What is given once for all, or for each of so many, or not at all.
fn each<T: Clone>(given: &[T], count: usize) -> impl Iterator<Item = T> {
    let count = if given.is_empty() { 0 } else { count };
    given.iter().cloned().cycle().take(count)
}

/// Writes the six rows of a wrench.
fn fill(
    rows: &mut [Row],
    wrench: &Wrench,
    regressor: &SMatrix<f64, 6, 10>,
    gravity: &SMatrix<f64, 6, 4>,
) {
    let target = wrench.force.iter().chain(wrench.moment.iter());
    for (k, (row, &target)) in rows.iter_mut().zip(target).enumerate() {
        row.regressor = regressor.row(k).transpose();
        row.target = target;
        row.gravity = gravity.row(k).transpose();
    }
}

/// The wrenches that are the columns, in another frame and about its origin.
fn moved<const N: usize>(
    columns: &SMatrix<f64, 6, N>,
    other_from_this: &Isometry3<f64>,
) -> SMatrix<f64, 6, N> {
    let mut moved = *columns;
    for mut column in moved.column_iter_mut() {
        let wrench = Wrench {
            force: column.fixed_rows::<3>(0).into_owned(),
            moment: column.fixed_rows::<3>(3).into_owned(),
        }
        .expressed_in(other_from_this);
        column.fixed_rows_mut::<3>(0).copy_from(&wrench.force);
        column.fixed_rows_mut::<3>(3).copy_from(&wrench.moment);
    }
    moved
}

/// The entries of mass and first moments for an acceleration alone, 6x4.
fn gravity_regressor(acceleration: &Vector3<f64>) -> SMatrix<f64, 6, 4> {
    let motion = ToolMotion {
        acceleration: *acceleration,
        angular_velocity: Vector3::zeros(),
        angular_acceleration: Vector3::zeros(),
    };
    wrench_regressor(&motion).fixed_columns::<4>(0).into_owned()
}
