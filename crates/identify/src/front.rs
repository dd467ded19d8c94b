//! From samples to equations: what every estimator, online or over a log, has before it.

use std::f64::consts::TAU;

use tactid_dynamics::Manipulator;

use crate::equation::Equation;
use crate::model::Model;
use crate::sample::{Instant, Node, SPAN};
use crate::window::Windows;
use crate::{IdentifyError, Pushed, Sample, Settings};

/// Samples that are held: as many as derivatives over every second one need.
const HELD: usize = 2 * SPAN - 1;

/// Derivatives are over every second sample while a step of two is no longer than this, in radians at
/// the cutoff; their error is then below 3e-4 there, and falls with the fourth power of frequency.
const SHORT_STEP: f64 = 0.3;

/// Takes samples one at a time and gives the filtered equations of motion, without allocation.
///
/// An equation lags its last sample by four, which the derivatives need to their right. They are over
/// every second sample where these are dense: neighbours then have no noise in common, which lets
/// the noise be told from the motion (see [`Equation::differences`]).
#[derive(Clone, Debug)]
pub(crate) struct Front {
    pub(crate) model: Model,
    max_gap_s: f64,
    /// The last samples without a gap, the newest at `newest`.
    nodes: [Node; HELD],
    /// The longest step of two samples that derivatives may be over, s.
    longest_step_s: f64,
    newest: usize,
    /// How many of them there are.
    held: usize,
    instant: Instant,
    windows: Windows,
    pub(crate) refused: u64,
    pub(crate) gaps: u64,
}

impl Front {
    pub(crate) fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: &Settings,
    ) -> Result<Self, IdentifyError> {
        let model = Model::new(robot, tool, sensors, settings)?;
        let (joints, wrenches) = (robot.dof(), sensors.len());
        Ok(Self {
            max_gap_s: settings.max_gap_s,
            nodes: std::array::from_fn(|_| Node::new(joints, wrenches)),
            longest_step_s: SHORT_STEP / (TAU * settings.cutoff_hz),
            newest: 0,
            held: 0,
            instant: Instant::new(joints, wrenches),
            windows: Windows::new(settings.cutoff_hz, model.row_count()),
            refused: 0,
            gaps: 0,
            model,
        })
    }

    /// Forgets the samples and the counts, for the same samples once more.
    pub(crate) fn rewind(&mut self) {
        self.held = 0;
        self.nodes[self.newest].time_s = f64::NEG_INFINITY;
        self.windows.clear();
        (self.refused, self.gaps) = (0, 0);
    }

    /// The time of the last sample, s.
    pub(crate) fn time_s(&self) -> f64 {
        self.nodes[self.newest].time_s
    }

    /// Takes a sample whose slices fit, and gives the equation that it completes.
    pub(crate) fn push(
        &mut self,
        sample: &Sample<'_>,
    ) -> Result<(Pushed, Option<&Equation>), IdentifyError> {
        let passed_s = sample.time_s - self.time_s();
        if !sample.is_finite() || passed_s <= 0.0 {
            self.refused += 1;
            return Ok((Pushed::Refused, None));
        }
        let started = passed_s > self.max_gap_s;
        if started {
            self.gaps += u64::from(passed_s.is_finite());
            self.held = 0;
            self.windows.clear();
        }
        self.newest = (self.newest + 1) % HELD;
        self.nodes[self.newest].set(sample);
        self.held = HELD.min(self.held + 1);
        if self.held < HELD {
            let pushed = if started {
                Pushed::Started
            } else {
                Pushed::Used
            };
            return Ok((pushed, None));
        }
        let oldest = self.newest + 1;
        let at = |k: usize| &self.nodes[(oldest + k) % HELD];
        let length_s = at(HELD - 1).time_s - at(0).time_s;
        let steps = if length_s <= (SPAN - 1) as f64 * self.longest_step_s {
            2
        } else {
            1
        };
        let first = HELD / 2 - steps * (SPAN / 2);
        let nodes = std::array::from_fn(|k| at(first + steps * k));
        self.instant.set(&nodes);
        let rows = self.model.rows(&self.instant)?;
        Ok((Pushed::Used, self.windows.push(self.instant.time_s, rows)))
    }

    /// That a sample's slices fit the robot and the sensors.
    pub(crate) fn check_lengths(&self, sample: &Sample<'_>) -> Result<(), IdentifyError> {
        let robot = self.model.robot();
        robot.check_length("joint_position", sample.joint_position)?;
        if !sample.joint_velocity.is_empty() {
            robot.check_length("joint_velocity", sample.joint_velocity)?;
        }
        if self.model.needs_effort() || !sample.joint_effort.is_empty() {
            robot.check_length("joint_effort", sample.joint_effort)?;
        }
        if sample.wrenches.len() == self.model.sensor_count() {
            return Ok(());
        }
        Err(IdentifyError::WrenchCount {
            given: sample.wrenches.len(),
            expected: self.model.sensor_count(),
        })
    }
}
