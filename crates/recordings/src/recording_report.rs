//! What every result of a recording reports about the recording itself.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use tactid_batch::Finding as DataFinding;
use tactid_dynamics::{InertialParameters, Notice, Severity};
use tactid_identify::{Method, serial};

use crate::plan::Plan;
use crate::run::Run;
use crate::steps::{are_mixed, without_explained};
use crate::{Clock, DataFault, EstimatorKind, Finding, Setup};

/// What was assumed of a recording, what was noticed about it, and what could not be used.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RecordingReport {
    /// Which measurements were read, where the sensors are, and what was subtracted.
    pub setup: Setup,
    /// Measurements that were used.
    pub method: Method,
    /// Estimator that was used.
    pub estimator: EstimatorKind,
    /// Cutoff of the low-pass on both sides of the equations, Hz.
    pub cutoff_hz: f64,
    /// Longest time between two samples that was bridged, s.
    pub max_gap_s: f64,
    /// Gravitational acceleration that was assumed, or identified where its direction was unknown,
    /// in the inertial frame, m/s².
    #[serde(with = "serial::vector")]
    #[schemars(with = "[f64; 3]")]
    pub gravity_m_s2: Vector3<f64>,
    /// Delay of the wrenches' stamps that was corrected, s; positive where they are later than the
    /// motion.
    pub delay_s: f64,
    /// Where the times came from.
    pub clock: Clock,
    /// Time zero of the recording, ns since the epoch of its clock; 0 for arrays.
    pub start_ns: i64,
    /// Time from the first aligned sample to the last, s.
    pub duration_s: f64,
    /// Messages and samples that could not be used, counted by topic and kind.
    #[serde(serialize_with = "added_later")]
    #[schemars(with = "Vec<OpaqueFault>")]
    pub faults: Vec<DataFault>,
    /// What a reader of the result should know.
    #[serde(serialize_with = "added_later")]
    #[schemars(with = "Vec<OpaqueFinding>")]
    pub findings: Vec<Finding>,
    /// Whether the observer stopped the reading before the end.
    pub interrupted: bool,
    /// Where the log could not be read further, and why: an entry for each file that ends early.
    pub damage: Vec<String>,
}

impl RecordingReport {
    /// Reports on a recording that was run through, with the gripper that the estimator subtracted
    /// and what it noticed in the end.
    pub(crate) fn new(
        plan: Plan<'_>,
        run: Run,
        gripper: Option<InertialParameters>,
        noticed: impl IntoIterator<Item = Finding>,
    ) -> Self {
        let mut findings = run.noticed(&plan);
        if are_mixed(&findings) || are_unmeasured(&findings) {
            findings.extend(without_explained(noticed));
        } else {
            findings.extend(noticed);
        }
        let sources = plan.sources;
        Self {
            setup: Setup::new(sources, plan.request, plan.beginning, gripper),
            method: plan.equations.method,
            estimator: plan.estimator,
            cutoff_hz: plan.equations.cutoff_hz,
            max_gap_s: plan.equations.max_gap_s,
            gravity_m_s2: plan.equations.gravity_for(sources.robot.base_kind()),
            delay_s: plan.delay_s,
            clock: sources.clock,
            start_ns: sources.start_ns,
            duration_s: run.duration_s,
            faults: run.faults.to_vec(),
            findings,
            interrupted: run.interrupted,
            damage: run.damage,
        }
    }
}

/// Returns whether so much of the load was not measured that this explains whatever else the data
/// contradict.
fn are_unmeasured(findings: &[Finding]) -> bool {
    findings.iter().any(|finding| {
        let is_of_load = matches!(
            finding,
            Finding::Data(DataFinding::Saturated { .. } | DataFinding::EffortsUnmeasured { .. })
        );
        is_of_load && finding.severity() == Severity::Contradicts
    })
}

/// A finding, in a schema.
#[derive(JsonSchema)]
#[schemars(rename = "Finding")]
struct OpaqueFinding {}

/// A fault, in a schema.
#[derive(JsonSchema)]
#[schemars(rename = "DataFault")]
struct OpaqueFault {}

/// Serialises nothing.
fn added_later<T, S: Serializer>(_: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(std::iter::empty::<()>())
}
