//! From samples to equations: what every estimator, online or over a log, has before it.

use std::f64::consts::TAU;

use tactid_dynamics::Manipulator;

use crate::equation::Equation;
use crate::model::Model;
use crate::sample::{Instant, Node};
use crate::stencil::{FEWEST, MOST};
use crate::window::Windows;
use crate::{IdentifyError, Pushed, Sample, Settings};

/// Samples that are held at most: polynomials are over every second one of them.
const HELD: usize = 2 * MOST - 1;
/// And at least.
const FEWEST_HELD: usize = 2 * FEWEST - 1;

/// Polynomials reach so far to each side, in radians at the cutoff; the error of a derivative is then
/// below 4e-4 there, and falls with the fourth power of frequency.
const REACH: f64 = 0.65;

/// Takes samples one at a time and gives the filtered equations of motion, without allocation.
///
/// An equation lags its last sample by four to ten, which the polynomials need to their right. They
/// are over every second sample where these are dense: neighbours then have no noise in common, which
/// lets the noise be told from the motion (see [`Equation::differences`]).
#[derive(Clone, Debug)]
pub(crate) struct Front {
    pub(crate) model: Model,
    max_gap_s: f64,
    /// The last samples without a gap, the newest at `newest`.
    nodes: [Node; HELD],
    /// How far polynomials reach to each side, s.
    reach_s: f64,
    newest: usize,
    /// How many of them there are.
    held: usize,
    /// By how many samples an instant lags the newest; none before the first of a stretch.
    lag: Option<usize>,
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
            reach_s: REACH / (TAU * settings.cutoff_hz),
            newest: 0,
            held: 0,
            lag: None,
            instant: Instant::new(joints, wrenches),
            windows: Windows::new(settings.cutoff_hz, model.row_count()),
            refused: 0,
            gaps: 0,
            model,
        })
    }

    /// Forgets the samples and the counts, for the same samples once more.
    pub(crate) fn rewind(&mut self) {
        self.begin();
        self.nodes[self.newest].time_s = f64::NEG_INFINITY;
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
            self.begin();
        }
        self.newest = (self.newest + 1) % HELD;
        self.nodes[self.newest].set(sample);
        self.held = HELD.min(self.held + 1);
        if !self.set_instant() {
            let pushed = if started {
                Pushed::Started
            } else {
                Pushed::Used
            };
            return Ok((pushed, None));
        }
        let rows = self.model.rows(&self.instant)?;
        Ok((Pushed::Used, self.windows.push(self.instant.time_s, rows)))
    }

    /// Forgets the samples before a gap.
    fn begin(&mut self) {
        self.held = 0;
        self.lag = None;
        self.windows.clear();
    }

    /// The instant that the newest sample completes, if there is one.
    fn set_instant(&mut self) -> bool {
        let newest = self.newest;
        let back = |k: usize| (newest + HELD - k) % HELD;
        let nodes = &self.nodes;
        let span_s =
            |first: usize, last: usize| nodes[back(last)].time_s - nodes[back(first)].time_s;
        let is_wide = |first, last| span_s(first, last) > 2.0 * self.reach_s;
        let lag = match self.lag {
            Some(lag) => lag,
            None if self.held < FEWEST_HELD => return false,
            None if self.held < HELD && !is_wide(self.held - 1, 0) => return false,
            // The same number of whole steps to both sides.
            None => *self.lag.insert((self.held - 1) / 4 * 2),
        };
        let mut side = lag / 2;
        while side > FEWEST / 2 && is_wide(lag + 2 * side, lag - 2 * side) {
            side -= 1;
        }
        let step = if is_wide(lag + 2 * side, lag - 2 * side) {
            1
        } else {
            2
        };
        let mut near = [&nodes[back(lag)]; MOST];
        for (k, node) in near[..=2 * side].iter_mut().enumerate() {
            *node = &nodes[back(lag + step * side - step * k)];
        }
        self.instant.set(&near[..=2 * side]);
        true
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
