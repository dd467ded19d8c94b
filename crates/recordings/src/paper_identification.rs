//! A recording that is presented to the paper's filter, and what the filter finds in it.

use schemars::JsonSchema;
use serde::Serialize;
use tactid_dynamics::{InertialParameters, MassProperties};
use tactid_identify::solve::body_of;
use tactid_identify::{Sample, is_physical, values_of_body};

use crate::paper::{PaperEstimate, PaperFilter, PaperSettings, SingularValues};
use crate::plan::Plan;
use crate::run::{Receiver, Run};
use crate::shortage::check_windows;
use crate::{Finding, RecordingError, RecordingReport};

/// Time between two points of the history, s.
const HISTORY_STEP_S: f64 = 0.1;
/// Time between two points near the end of the recording, where figures show the filter's ripple,
/// s.
const FINE_STEP_S: f64 = 0.01;
/// Length of the fine part of the history, s.
const FINE_SPAN_S: f64 = 10.0;

/// The payload that the paper's filter identified from a recording, with how it was found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[schemars(extend("x-base" = "RecordingReport"))]
pub struct PaperIdentification {
    /// Payload at the end of the recording, in the frame `estimate.frame`.
    pub estimate: PaperEstimate,
    /// Principal moments of inertia of the payload, ascending, kg m²; `None` where its inertia is
    /// not finite.
    pub principal_moments: Option<[f64; 3]>,
    /// Estimate over time, with a point at least every 0.1 s of each presentation.
    #[schemars(extend("kept" = "file"))]
    pub history: PaperHistory,
    /// Strength with which the motion excited mass and inertia.
    pub singular_values: SingularValues,
    /// Settings of the filter.
    pub settings: PaperSettings,
    /// What was assumed of the recording, and what was noticed about it.
    #[serde(flatten)]
    pub recording: RecordingReport,
}

/// The estimate of the paper's filter over time, H points.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct PaperHistory {
    /// Index of the presentation of the recording that each point belongs to, without a unit, (H,).
    pub epoch: Vec<u32>,
    /// Times on the clock of the samples, s, (H,). They begin again with each epoch.
    pub times_s: Vec<f64>,
    /// The ten values at each point, in the order and the units of the estimate's, (H, 10); not
    /// averaged.
    pub values: Vec<[f64; 10]>,
}

/// The paper's filter, which is presented with a recording.
pub(crate) struct PaperRun {
    filter: PaperFilter,
    history: PaperHistory,
    settings: PaperSettings,
    /// A body that is subtracted from all estimates.
    known_tool: Option<MassProperties>,
    epoch: u32,
    next_point_s: f64,
    /// Time of the last event, s.
    end_s: f64,
}

impl PaperRun {
    /// Creates the filter of a plan.
    pub(crate) fn new(plan: &Plan<'_>) -> Result<Self, RecordingError> {
        let (robot, sensors) = (&plan.sources.robot, plan.sensors());
        let settings = plan.request.paper_settings();
        Ok(Self {
            filter: PaperFilter::new(robot, &plan.tip, &sensors, &plan.equations, settings)?,
            history: PaperHistory::default(),
            settings,
            known_tool: plan.request.known_tool.as_ref().map(|tool| tool.body),
            epoch: 0,
            next_point_s: f64::NEG_INFINITY,
            end_s: plan.sources.end_s,
        })
    }

    /// Returns the result of a recording that was run through.
    ///
    /// # Errors
    /// Returns the errors of [`check_windows`].
    pub(crate) fn finish(
        self,
        plan: Plan<'_>,
        run: Run,
    ) -> Result<PaperIdentification, RecordingError> {
        let whole = self.filter.estimate();
        check_windows(whole.windows, self.filter.stream(), &plan, &run)?;
        let known_bodies_kg = self.known_tool.map_or(0.0, |tool| tool.mass_kg);
        let findings = self.filter.findings(known_bodies_kg).into_iter();
        let gripper = self.filter.stream().gripper_to_subtract();
        let body = self.without_tool(whole.body);
        let moments = InertialParameters::from(body).principal_moments();
        Ok(PaperIdentification {
            estimate: PaperEstimate {
                body,
                is_physical: is_physical(&body),
                ..whole
            },
            principal_moments: moments.map(Into::into),
            history: self.history,
            singular_values: self.filter.singular_values(),
            settings: self.settings,
            recording: RecordingReport::new(plan, run, gripper, findings.map(Finding::Data)),
        })
    }

    /// Returns a body without the known tool that it contains.
    fn without_tool(&self, body: MassProperties) -> MassProperties {
        let tool = self.known_tool.map(InertialParameters::from);
        tool.map_or(body, |tool| {
            body_of((InertialParameters::from(body) - tool).as_vector())
        })
    }
}

impl Receiver for PaperRun {
    fn epochs(&self) -> u32 {
        self.settings.epochs
    }

    fn push(&mut self, sample: &Sample<'_>) -> Result<(), RecordingError> {
        self.filter.push(sample)?;
        let time_s = sample.time_s;
        if time_s >= self.next_point_s {
            let is_fine = time_s > self.end_s - FINE_SPAN_S;
            self.next_point_s = time_s + if is_fine { FINE_STEP_S } else { HISTORY_STEP_S };
            self.history.epoch.push(self.epoch);
            self.history.times_s.push(time_s);
            let body = self.without_tool(self.filter.latest_body());
            self.history.values.push(values_of_body(&body));
        }
        Ok(())
    }

    fn rewind(&mut self, end_s: f64) {
        self.filter.rewind();
        self.epoch += 1;
        self.next_point_s = f64::NEG_INFINITY;
        self.end_s = end_s;
    }
}
