//! The kinematics of the robot once per instant, from which each measurement source computes its
//! entries.

use std::iter;

use nalgebra::{UnitQuaternion, Vector3};
use tactid_dynamics::{
    FrameId, InertialParameters, JointMotion, Manipulator, ModelError, ModelFinding, StateError,
    Workspace, inverse_dynamics, motion_under_gravity,
};

use super::channels::{Channels, KnownNoise, WRENCH};
use super::equation::{Equation, Row};
use super::geometry;
use super::instant::Instant;
use super::offset_frame::OffsetFrame;
use super::sample::Sample;
use super::settings::{EffortContent, EquationSettings, SubtractedLoad};
use super::sources::{MOTION_TERMS, RobotState, Source, sources_of};
use super::window::WindowMean;
use crate::{IdentifyError, Method};

/// A robot and the sources of its measurements.
#[derive(Clone, Debug)]
pub struct Model {
    gravity: Vector3<f64>,
    /// Gravitational acceleration in the efforts of the arm, m/s².
    arm_gravity: Vector3<f64>,
    method: Method,
    /// What is known to have been subtracted from the wrenches.
    subtracted: Option<SubtractedLoad>,
    sensor_count: usize,
    sources: Vec<Source>,
    /// Number of rows of each source.
    row_counts: Vec<usize>,
    offset_frame: OffsetFrame,
    /// Whether the rows hold for the links below the tool and the payload as one body.
    includes_gripper: bool,
    robot: Manipulator,
    tool: FrameId,
    /// State of the bodies whose parameters are known. Where no mass matters, joints that move
    /// neither the tool nor a sensor are locked.
    workspace: Workspace,
    /// Entries of an instant: the targets of all rows, then the other entries of each source, then
    /// those of the geometry.
    entries: Vec<f64>,
    /// Number of the entries of the geometry; zero where it is not kept.
    geometry_entries: usize,
    /// Number of rows of all sources.
    row_count: usize,
}

impl Model {
    /// Creates the model of a robot at its zero posture.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`](super::EquationStream::new).
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        settings.check(robot, sensors)?;
        let offset_frame = OffsetFrame::new(robot, tool, sensors, &settings.unmeasured)?;
        let tool = robot.frame(tool)?;
        let sources = sources_of(robot, tool, sensors, settings, offset_frame.projection())?;
        check_masses(robot, tool, &sources).map_err(|error| {
            IdentifyError::Method(format!(
                "the {} method needs the masses of the robot: {error}; or use the tactile method, which needs none",
                settings.method.name()
            ))
        })?;
        let row_counts: Vec<usize> = sources.iter().map(|s| s.channels().len()).collect();
        let row_count = row_counts.iter().sum();
        let others = sources.iter().map(|source| source.entries());
        let includes_gripper = sources.iter().any(|source| source.includes_gripper());
        let known = if includes_gripper {
            robot.without_subtree(tool)
        } else if sources.iter().any(|source| source.needs_masses()) {
            robot.clone()
        } else {
            let sensors = sensors.iter().map(|name| robot.frame(name));
            let axes = settings.axes_link(robot)?.map(Ok);
            let frames: Result<Vec<_>, ModelError> =
                iter::once(Ok(tool)).chain(sensors).chain(axes).collect();
            robot.locked_beyond(&frames?)
        };
        let gravity = settings.gravity_for(robot.base_kind());
        let mut model = Self {
            gravity,
            arm_gravity: match settings.effort_content {
                EffortContent::WithoutGravity if settings.method.uses_effort() => Vector3::zeros(),
                _ => gravity,
            },
            method: settings.method,
            subtracted: settings.subtracted,
            sensor_count: sensors.len(),
            entries: vec![0.0; row_count + others.sum::<usize>()],
            geometry_entries: 0,
            row_count,
            sources,
            row_counts,
            offset_frame,
            includes_gripper,
            robot: robot.clone(),
            tool,
            workspace: Workspace::new(&known),
        };
        if settings.unknowns.gravity {
            model.keep_geometry();
        }
        // The poses of the sensors must be valid before the first sample: the known noise needs
        // them.
        model.entries(&Instant::new(robot.dof(), sensors.len()))?;
        Ok(model)
    }

    /// Keeps the geometry of the windows where wrenches are measured.
    pub fn keep_geometry(&mut self) {
        if self.sensor_count > 0 && self.method.uses_wrench() && self.geometry_entries == 0 {
            self.geometry_entries = geometry::entry_count(self.robot.dof());
            let count = self.entries.len() + self.geometry_entries;
            self.entries.resize(count, 0.0);
        }
    }

    /// The frame in which a constant offset of the wrenches is stated.
    pub fn offset_frame(&self) -> &OffsetFrame {
        &self.offset_frame
    }

    /// Gravitational acceleration in the inertial frame, m/s².
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// The known load that was subtracted from the wrenches.
    pub fn subtracted(&self) -> Option<&SubtractedLoad> {
        self.subtracted.as_ref()
    }

    /// What is wrong in the description of the robot, as far as the method uses it.
    pub fn findings(&self) -> impl Iterator<Item = ModelFinding> {
        let uses_masses = self.sources.iter().any(|source| source.needs_masses());
        let findings = self.robot.findings().into_iter();
        findings.filter(move |finding| uses_masses || !finding.concerns_masses())
    }

    /// Returns the robot.
    pub(crate) fn robot(&self) -> &Manipulator {
        &self.robot
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.row_count
    }

    /// Number of entries of an instant, of which the targets of the rows are the first.
    pub fn entry_count(&self) -> usize {
        self.entries.len()
    }

    /// Number of wrench sensors.
    pub(crate) fn sensor_count(&self) -> usize {
        self.sensor_count
    }

    /// The measurements that are used.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The channels of the rows, with the known noise at the posture of the last instant.
    pub fn channels(&self) -> Channels {
        let state = self.state();
        let mut known_noise = Vec::new();
        let mut first_channel = 0;
        for (source, count) in self.sources.iter().zip(&self.row_counts) {
            let noise = source.known_noise(&state).map(|covariance| KnownNoise {
                first_channel,
                covariance,
            });
            known_noise.extend(noise);
            first_channel += count;
        }
        let sources = self.sources.iter();
        let channels = Channels {
            channels: sources.clone().flat_map(|s| s.channels()).collect(),
            kinds: sources.flat_map(|s| s.kinds()).collect(),
            sources: self.row_counts.clone(),
            offsets: 0,
            known_noise,
            projection: self.offset_frame.projection(),
        };
        let first = self.sources.first();
        channels.with_offsets(first.is_some_and(|source| source.has_offsets()))
    }

    /// Whether a sensor beside those of the motion measures each channel.
    pub fn are_measured(&self) -> Vec<bool> {
        let counts = self.sources.iter().zip(&self.row_counts);
        let channels =
            counts.flat_map(|(source, &count)| iter::repeat_n(source.has_sensor(), count));
        channels.collect()
    }

    /// Checks that a sample's slices fit the robot and the sensors.
    pub fn check_lengths(&self, sample: &Sample<'_>) -> Result<(), IdentifyError> {
        let robot = &self.robot;
        robot.check_length("joint_position", sample.joint_position)?;
        if !sample.joint_velocity.is_empty() {
            robot.check_length("joint_velocity", sample.joint_velocity)?;
        }
        if self.method.uses_effort() || !sample.joint_effort.is_empty() {
            robot.check_length("joint_effort", sample.joint_effort)?;
        }
        if sample.wrenches.len() == self.sensor_count {
            return Ok(());
        }
        let (given, expected) = (sample.wrenches.len(), self.sensor_count);
        Err(IdentifyError::Wrenches { given, expected })
    }

    /// Computes the entries of an instant, which enter means over windows: the targets of all rows,
    /// then what their regressors are linear in. Cost: one pass over the known bodies; no
    /// allocation.
    pub fn entries(&mut self, instant: &Instant) -> Result<&[f64], StateError> {
        let joints = JointMotion {
            position: &instant.joint_position,
            velocity: &instant.joint_velocity,
            acceleration: &instant.joint_acceleration,
        };
        if self.sources.iter().any(|source| source.needs_forces()) {
            inverse_dynamics(
                &mut self.workspace,
                &instant.base,
                joints,
                &self.arm_gravity,
            )?; // (1)-(41)
        } else {
            motion_under_gravity(&mut self.workspace, &instant.base, joints, &self.gravity)?; // (1)-(20)
        }
        let state = RobotState::new(&self.workspace, self.tool, &self.gravity);
        let (mut targets, mut entries) = self.entries.split_at_mut(self.row_count);
        for (source, &count) in self.sources.iter_mut().zip(&self.row_counts) {
            let (own_targets, other_targets) = targets.split_at_mut(count);
            let (own_entries, other_entries) = entries.split_at_mut(source.entries());
            source.fill(instant, &state, own_targets, own_entries)?;
            (targets, entries) = (other_targets, other_entries);
        }
        if self.geometry_entries > 0 {
            geometry::fill(instant, &self.workspace, self.tool, entries);
        }
        Ok(&self.entries)
    }

    /// Sets an equation to the rows whose mean [entries](Self::entries) a window has. Allocates
    /// nothing.
    pub fn set_equation(&self, equation: &mut Equation, window: &WindowMean) {
        self.set_rows(&mut equation.rows, &window.means);
        self.set_rows(&mut equation.differences, &window.differences);
        equation.rates.copy_from_slice(&window.rates);
        let of_noise = &window.rate_differences;
        equation.rate_differences.copy_from_slice(of_noise);
        let first = window.means.len() - self.geometry_entries;
        equation.geometry.clear();
        equation.geometry.extend_from_slice(&window.means[first..]);
        (equation.time_s, equation.instants) = (window.time_s, window.instants);
    }

    /// Sets rows from the entries of an instant, or from means of entries.
    pub fn set_rows(&self, mut rows: &mut [Row], entries: &[f64]) {
        let (targets, mut entries) = entries.split_at(self.row_count);
        for (row, target) in rows.iter_mut().zip(targets) {
            row.target = *target;
        }
        for (source, &count) in self.sources.iter().zip(&self.row_counts) {
            let (own_rows, other_rows) = rows.split_at_mut(count);
            let (own_entries, other_entries) = entries.split_at(source.entries());
            source.set_rows(own_entries, own_rows);
            (rows, entries) = (other_rows, other_entries);
        }
    }

    /// The entries of the last instant.
    pub fn last_entries(&self) -> &[f64] {
        &self.entries
    }

    /// The sum of the wrenches at the last instant in the tool frame, the terms of its motion, and
    /// the rotation of the tool in the inertial frame; `None` where the method uses no wrenches.
    pub(crate) fn wrench_terms(&self) -> Option<(&[f64], &[f64], UnitQuaternion<f64>)> {
        if !matches!(self.sources.first(), Some(Source::Wrench(_))) {
            return None;
        }
        let terms = &self.entries[self.row_count..self.row_count + MOTION_TERMS];
        Some((
            &self.entries[..WRENCH],
            terms,
            self.workspace.rotation(self.tool),
        ))
    }

    /// Inertial parameters of the known links below the tool, at the posture of the last instant
    /// and in the tool frame, where the rows hold for them and the payload as one body.
    pub(crate) fn gripper_to_subtract(&self) -> Option<InertialParameters> {
        let gripper = || self.workspace.subtree_parameters(self.tool);
        self.includes_gripper.then(gripper)
    }

    fn state(&self) -> RobotState<'_> {
        RobotState::new(&self.workspace, self.tool, &self.gravity)
    }
}

/// Checks that the robot has the masses without which its sources mean nothing: some mass between
/// the base and the tool, and that of a floating base whose motion is measured.
fn check_masses(robot: &Manipulator, tool: FrameId, sources: &[Source]) -> Result<(), ModelError> {
    if sources.iter().any(|source| source.needs_masses()) {
        robot.check_masses(Some(tool))?;
    }
    if sources.iter().any(|source| source.needs_base_mass()) {
        robot.check_base_mass()?;
    }
    Ok(())
}
