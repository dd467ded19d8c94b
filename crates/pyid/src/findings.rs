//! Findings as plain Python values: a kind, and a dictionary of the numbers and names that belong to it.

use nalgebra::Vector3;
use pyo3::prelude::*;
use tactid_dynamics::{IgnoredPart, MimicFault, ModelFinding};
use tactid_identify::checks::{
    EffortsBeyondLimits, PositionsBeyondLimits, TwistAxes, TwistContradiction, VelocityCause,
    VelocityContradiction,
};
use tactid_identify::{
    Disagreement, Finding as Found, KnownMass, Method, Sampling, UnexplainedLoad, ValueDifference,
    WrenchOffset,
};
use tactid_recordings::{Delay, Finding, NotUsedBecause};

use crate::calibration_findings::{
    arm_changed, calibration_contradicted, effort_noisier, joint_zero_moved, recording_calibrated,
    unloaded_left_out,
};
use crate::finding_data::{FindingData, data, fields};

/// Returns what Python's `tactid.findings.Finding` is made from. `has_unloaded` is whether the efforts of an unloaded
/// recording were subtracted.
pub(crate) fn finding_data(
    py: Python<'_>,
    finding: &Finding,
    has_unloaded: bool,
) -> PyResult<FindingData> {
    Ok(match finding {
        Finding::Data(finding) => return data_finding(py, finding, has_unloaded),
        Finding::AccelerationNotUsed {
            topic,
            explains_better,
            residual_ratio,
            power_ratio,
        } => (
            "acceleration_not_used",
            fields!(py, topic, explains_better, residual_ratio, power_ratio),
        ),
        Finding::OptionNotUsed { option, because } => return option_not_used(py, option, *because),
        Finding::FrameAssumed { topic, frame } => ("frame_assumed", fields!(py, topic, frame)),
        Finding::WrenchesSummed { topics } => ("wrenches_summed", fields!(py, topics)),
        Finding::JointsRenamed { names } => ("joints_renamed", fields!(py, names)),
        Finding::EffortNoisier { joint, noise_ratio } => effort_noisier(py, joint, *noise_ratio)?,
        Finding::ArmChanged(changed) => return arm_changed(py, changed),
        Finding::CalibrationContradicted(found) => return calibration_contradicted(py, found),
        Finding::JointZeroMoved(found) => return joint_zero_moved(py, found),
        Finding::UnloadedLeftOut { noise_ratio } => unloaded_left_out(py, *noise_ratio)?,
        Finding::RecordingCalibrated(used) => return recording_calibrated(py, *used),
        Finding::JointUncalibrated { joint } => ("joint_uncalibrated", fields!(py, joint)),
        Finding::UnknownJoints { joints } => ("unknown_joints", fields!(py, joints)),
        Finding::AbsentJoints { joints } => ("absent_joints", fields!(py, joints)),
        Finding::LateStart { topic, late_s } => ("late_start", fields!(py, topic, late_s)),
        Finding::EarlyEnd {
            topic,
            end_s,
            early_s,
        } => ("early_end", fields!(py, topic, end_s, early_s)),
        Finding::TwistContradicted {
            source,
            contradiction,
        } => return twist_contradicted(py, source, contradiction),
        Finding::ConstantChannels {
            source,
            frame,
            channels,
            is_zero,
        } => return constant_channels(py, source, frame, channels, *is_zero),
        Finding::DelayDoubtful {
            delay_s,
            residual_ratio,
            is_at_end,
        } => return delay_doubtful(py, *delay_s, *residual_ratio, *is_at_end),
        Finding::NoStamps => ("no_stamps", data!(py)),
        Finding::DelayCorrected {
            applied_s,
            estimated,
        } => return delay_corrected(py, *applied_s, *estimated),
    })
}

/// Returns the data of a delay that is in doubt.
fn delay_doubtful(
    py: Python<'_>,
    delay_s: f64,
    residual_ratio: f64,
    is_at_end: bool,
) -> PyResult<FindingData> {
    let data = fields!(py, delay_s, residual_ratio, is_at_end);
    Ok(("delay_doubtful", data))
}

/// Returns the data of a delay that was corrected.
fn delay_corrected(py: Python<'_>, applied_s: f64, estimated: Delay) -> PyResult<FindingData> {
    let (estimated_s, std_dev_s) = (estimated.delay_s, estimated.std_dev_s);
    let data = fields!(py, applied_s, estimated_s, std_dev_s);
    Ok(("delay_corrected", data))
}

/// Returns the data of an option that has no effect.
fn option_not_used(
    py: Python<'_>,
    option: &'static str,
    because: NotUsedBecause,
) -> PyResult<FindingData> {
    let (because, method) = match because {
        NotUsedBecause::Method(method) => ("method", Some(method.name())),
        NotUsedBecause::OtherMotion => ("other_motion", None),
        NotUsedBecause::GravityIsMeasured => ("gravity_is_measured", None),
    };
    Ok(("option_not_used", fields!(py, option, because, method)))
}

/// Returns the data of joint velocities that are not the derivatives of the positions.
fn velocities_contradicted(
    py: Python<'_>,
    contradiction: &VelocityContradiction,
) -> PyResult<FindingData> {
    let joints = &contradiction.joints;
    let relative_difference = contradiction.relative_difference;
    let (cause, other) = match &contradiction.cause {
        None => (None, None),
        Some(VelocityCause::OppositeSign) => (Some("opposite_sign"), None),
        Some(VelocityCause::Degrees) => (Some("degrees"), None),
        Some(VelocityCause::PositionsInDegrees) => (Some("positions_in_degrees"), None),
        Some(VelocityCause::OtherJoint(other)) => (Some("other_joint"), Some(other)),
    };
    let data = fields!(py, joints, relative_difference, cause, other);
    Ok(("velocities_contradicted", data))
}

/// Returns the data of joint positions beyond their limits.
fn positions_beyond_limits(
    py: Python<'_>,
    beyond: &PositionsBeyondLimits,
) -> PyResult<FindingData> {
    let PositionsBeyondLimits {
        joints,
        position,
        limits: (lower, upper),
        are_degrees,
    } = beyond;
    let data = fields!(py, joints, position, lower, upper, are_degrees);
    Ok(("positions_beyond_limits", data))
}

/// Returns the data of joint efforts far beyond their limits.
fn efforts_beyond_limits(py: Python<'_>, beyond: &EffortsBeyondLimits) -> PyResult<FindingData> {
    let EffortsBeyondLimits {
        joints,
        effort,
        limit,
        limits_are_equal,
    } = beyond;
    let data = fields!(py, joints, effort, limit, limits_are_equal);
    Ok(("efforts_beyond_limits", data))
}

/// Returns the data of samples of which none is in a window.
fn no_equations(py: Python<'_>, counts: &Sampling) -> PyResult<FindingData> {
    let data = data!(py, "samples": counts.samples, "rejected": counts.rejected, "gaps": counts.gaps,
        "max_gap_s": counts.max_gap_s, "period_s": counts.period_s, "window_s": counts.window_s,
        "min_samples": counts.min_samples);
    Ok(("no_equations", data))
}

/// Returns the data of channels of a wrench sensor that never change.
fn constant_channels(
    py: Python<'_>,
    source: &str,
    frame: &str,
    channels: &[&'static str],
    is_zero: bool,
) -> PyResult<FindingData> {
    let data = fields!(py, source, frame, channels, is_zero);
    Ok(("constant_channels", data))
}

/// Returns the data of a twist that is not the derivative of the pose.
fn twist_contradicted(
    py: Python<'_>,
    source: &str,
    contradiction: &TwistContradiction,
) -> PyResult<FindingData> {
    let relative_difference = contradiction.relative_difference;
    let better_axes = contradiction.better_axes.map(|axes| match axes {
        TwistAxes::World => "world",
        TwistAxes::Body => "body",
    });
    let data = fields!(py, source, relative_difference, better_axes);
    Ok(("twist_contradicted", data))
}

/// Returns the data of a finding about the assumptions of the identification. `has_unloaded` is whether the efforts of an
/// unloaded recording were subtracted.
pub(crate) fn data_finding(
    py: Python<'_>,
    finding: &Found,
    has_unloaded: bool,
) -> PyResult<FindingData> {
    Ok(match finding {
        Found::VelocitiesContradicted(found) => velocities_contradicted(py, found)?,
        Found::PositionsBeyondLimits(found) => positions_beyond_limits(py, found)?,
        Found::EffortsBeyondLimits(found) => efforts_beyond_limits(py, found)?,
        Found::TwistContradicted(contradiction) => twist_contradicted(py, "twist", contradiction)?,
        Found::ConstantChannels {
            frame,
            channels,
            is_zero,
        } => constant_channels(py, "wrench", frame, channels, *is_zero)?,
        Found::NoEquations(counts) => no_equations(py, counts)?,
        Found::RunsDisagree(found) => runs_disagree(py, found)?,
        Found::GravityContradicted {
            better,
            residual_ratio,
            method,
        } => gravity_contradicted(py, better, *residual_ratio, *method)?,
        Found::NothingHeld {
            mass_kg,
            std_dev_kg,
        } => ("nothing_held", fields!(py, mass_kg, std_dev_kg)),
        Found::NegativeMass { method, or_gravity } => negative_mass(py, *method, *or_gravity)?,
        Found::KnownBodiesTooHeavy {
            known_bodies_kg,
            load_kg,
        } => (
            "known_bodies_too_heavy",
            fields!(py, known_bodies_kg, load_kg),
        ),
        Found::OffsetSuspected {
            offset,
            load_force_rms_n,
        } => offset_suspected(py, offset, *load_force_rms_n)?,
        Found::LoadUnexplained(load) => load_unexplained(py, load, has_unloaded)?,
        Found::MassContradicted {
            known,
            found_kg,
            std_dev_kg,
            distance,
        } => mass_contradicted(py, known, *found_kg, *std_dev_kg, *distance)?,
        Found::KnownMassNotKept {
            known,
            estimated_kg,
            within_box,
        } => known_mass_not_kept(py, known, *estimated_kg, *within_box)?,
        Found::Inconsistent {
            distance,
            within_box,
        } => ("inconsistent", fields!(py, distance, within_box)),
        Found::Model(finding) => return model_finding(py, finding),
        Found::Outliers { outliers, windows } => ("outliers", fields!(py, outliers, windows)),
    })
}

/// Returns the data of a load that the model does not explain.
fn load_unexplained(
    py: Python<'_>,
    load: &UnexplainedLoad,
    has_unloaded: bool,
) -> PyResult<FindingData> {
    let data = data!(py, "unit": load.unit, "residual_rms": load.residual_rms,
        "load_rms": load.load_rms, "noise_rms": load.noise_rms, "method": load.method.name(),
        "has_unloaded": has_unloaded, "joint": load.joint.as_deref());
    Ok(("load_unexplained", data))
}

/// Returns the data of a negative mass.
fn negative_mass(py: Python<'_>, method: Method, or_gravity: bool) -> PyResult<FindingData> {
    let method = method.name();
    Ok(("negative_mass", fields!(py, method, or_gravity)))
}

/// Returns the data of another gravity that explains the load far better.
fn gravity_contradicted(
    py: Python<'_>,
    better: &Vector3<f64>,
    residual_ratio: f64,
    method: Method,
) -> PyResult<FindingData> {
    let (better, method) = ([better.x, better.y, better.z], method.name());
    let data = fields!(py, better, residual_ratio, method);
    Ok(("gravity_contradicted", data))
}

/// Returns the data of a result that does not have the known mass.
fn known_mass_not_kept(
    py: Python<'_>,
    known: &KnownMass,
    estimated_kg: f64,
    within_box: bool,
) -> PyResult<FindingData> {
    let data = data!(py, "known_mass_kg": known.mass_kg, "known_mass_std_dev_kg": known.std_dev_kg,
        "estimated_kg": estimated_kg, "within_box": within_box);
    Ok(("known_mass_not_kept", data))
}

/// Returns the data of recordings that disagree. They are named by their indices, and by their names in Python.
fn runs_disagree(py: Python<'_>, found: &Disagreement) -> PyResult<FindingData> {
    let largest = found.largest.as_ref();
    let data = data!(py, "runs": found.runs, "run": found.run, "others_agree": found.others_agree,
        "chi_square": found.chi_square, "degrees_of_freedom": found.degrees_of_freedom,
        "noise_degrees_of_freedom": found.noise_degrees_of_freedom, "p_value": found.p_value,
        "least_probable": found.least_probable, "least_p_value": found.least_p_value, "value": largest.map(|largest| largest.value),
        "difference": largest.map(|largest| largest.difference),
        "of_others": largest.map(|largest| largest.others),
        "sigmas": largest.map(ValueDifference::sigmas));
    Ok(("runs_disagree", data))
}

/// Returns the data of a known mass that the data contradict.
fn mass_contradicted(
    py: Python<'_>,
    known: &KnownMass,
    found_kg: f64,
    std_dev_kg: f64,
    distance: f64,
) -> PyResult<FindingData> {
    let data = data!(py, "known_mass_kg": known.mass_kg, "known_mass_std_dev_kg": known.std_dev_kg,
        "found_kg": found_kg, "std_dev_kg": std_dev_kg, "distance": distance);
    Ok(("mass_contradicted", data))
}

/// Returns the data of a finding about the description of a robot.
pub(crate) fn model_finding(py: Python<'_>, finding: &ModelFinding) -> PyResult<FindingData> {
    Ok(match finding {
        ModelFinding::ImpossibleInertia { link, moments } => {
            ("impossible_inertia", fields!(py, link, moments))
        }
        ModelFinding::ImpossibleMass { link, mass_kg } => {
            ("impossible_mass", fields!(py, link, mass_kg))
        }
        ModelFinding::UnknownNumbers {
            link,
            element,
            attributes,
        } => ("unknown_numbers", fields!(py, link, element, attributes)),
        ModelFinding::Massless { links } => ("massless", fields!(py, links)),
        ModelFinding::JointTakenAsFixed { joint, joint_type } => {
            ("joint_taken_as_fixed", fields!(py, joint, joint_type))
        }
        ModelFinding::MimicNotFollowed {
            joint,
            leader,
            because,
        } => {
            let because = match because {
                MimicFault::NoSuchJoint => "no_such_joint",
                MimicFault::LeaderIsFixed => "leader_is_fixed",
                MimicFault::Circular => "circular",
                MimicFault::Numbers => "numbers",
            };
            ("mimic_not_followed", fields!(py, joint, leader, because))
        }
        ModelFinding::PartIgnored {
            part,
            name,
            inside,
            owners,
        } => {
            let part = match part {
                IgnoredPart::UnknownElement => "unknown_element",
                IgnoredPart::RepeatedElement => "repeated_element",
                IgnoredPart::UnknownAttribute => "unknown_attribute",
            };
            ("part_ignored", fields!(py, part, name, inside, owners))
        }
    })
}

/// Returns the data of a suspected offset of the wrenches.
fn offset_suspected(
    py: Python<'_>,
    offset: &WrenchOffset,
    load_force_rms_n: f64,
) -> PyResult<FindingData> {
    let frame = &*offset.frame;
    let (values, std_devs) = (offset.values(), offset.std_devs);
    Ok((
        "offset_suspected",
        fields!(py, frame, values, std_devs, load_force_rms_n),
    ))
}
