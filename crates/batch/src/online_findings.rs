//! What an online identifier has noticed.

use tactid_identify::Snapshot;
use tactid_identify::checks::{
    EffortMonitor, FEWEST_SAMPLES, SampleChecks, TwistRates, grouped_by_cause,
};

use crate::Finding;
use crate::diagnosis::findings_without_prior;
use crate::range_findings::range_findings;

/// Returns what the most recent samples show about the assumptions, from a
/// [`Snapshot`] of the online identifier.
///
/// The samples of the last 10 s show joint velocities or a twist that are not the derivatives of
/// the positions or the pose, and channels of a sensor that never change. All samples show channels
/// that are at a limit, and joints without efforts. The windows show a wrong
/// sign of gravity or of the load, an offset of the wrench sensor, a load that the model does not
/// explain, and outliers: the findings that [`BatchIdentifier`](crate::BatchIdentifier) has for the
/// same samples without prior information. Samples of which none is in a window are reported, too.
/// What is wrong in the robot's description is reported as far as the method uses it.
///
/// The windows are at most the last 324 (10 s at a cutoff of 10 Hz) since the last payload change.
///
/// Cost: several least-squares fits, some 10 ms, with allocation: outside of the control loop.
#[must_use]
pub fn online_findings(snapshot: &Snapshot) -> Vec<Finding> {
    let mut findings = sample_findings(&snapshot.checks);
    findings.extend(of_ranges(snapshot));
    let sampling = snapshot.sampling;
    if snapshot.windows == 0 && sampling.samples + sampling.rejected >= FEWEST_SAMPLES {
        findings.push(Finding::NoEquations(sampling));
    }
    let equations = snapshot.recent.in_order();
    findings.extend(findings_without_prior(
        &equations,
        &snapshot.stream,
        &snapshot.known,
    ));
    if snapshot.is_negated {
        findings.iter_mut().for_each(Finding::negate_wrenches);
    }
    findings
}

/// Returns what the samples themselves show.
fn sample_findings(checks: &SampleChecks) -> Vec<Finding> {
    let names: Vec<&str> = checks.joint_names.iter().map(String::as_str).collect();
    let joints = grouped_by_cause(checks.joints.contradictions(&names)).into_iter();
    let jumps = checks.steps.jumps("q", SampleChecks::SPAN_S);
    let jumps = jumps.map(Finding::PositionsJump);
    let mut findings: Vec<Finding> = jumps.into_iter().collect();
    let starts = checks.steps.starts(SampleChecks::SPAN_S);
    findings.extend(starts.map(|(joints, count)| Finding::AnglesContinued { joints, count }));
    findings.extend(joints.map(Finding::VelocitiesContradicted));
    let beyond = checks.positions.beyond_limits(SampleChecks::SPAN_S);
    findings.extend(beyond.map(Finding::PositionsBeyondLimits));
    let efforts = checks.efforts.as_ref();
    let beyond = efforts.and_then(EffortMonitor::beyond_limits);
    findings.extend(beyond.map(Finding::EffortsBeyondLimits));
    let twist = checks.twist.as_ref().and_then(TwistRates::contradiction);
    findings.extend(twist.map(|contradiction| Finding::TwistContradicted {
        source: "twist".to_owned(),
        contradiction,
    }));
    let constant = checks.channels.constant_channels(SampleChecks::SPAN_S);
    findings.extend(
        constant
            .into_iter()
            .map(|constant| Finding::ConstantChannels {
                source: "wrench".to_owned(),
                frame: checks.sensors[constant.sensor].clone(),
                channels: constant.channels.into_iter().map(Into::into).collect(),
                is_zero: constant.is_zero,
                is_left_out: false,
                without_moments: false,
                since_s: None,
                is_most: false,
            }),
    );
    findings
}

/// Returns what the ranges of the channels show.
fn of_ranges(snapshot: &Snapshot) -> Vec<Finding> {
    let checks = &snapshot.checks;
    let sign = if snapshot.is_negated { -1.0 } else { 1.0 };
    let wrenches = checks.wrench_ranges.iter().map(|ranges| ("wrench", ranges));
    range_findings(wrenches, sign, ("effort", checks.effort_ranges.as_slice()))
}
