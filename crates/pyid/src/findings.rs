//! Findings as plain Python values: a kind, and a dictionary of the numbers and names that belong to it.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tactid_identify::WrenchOffset;
use tactid_recordings::{Finding, NotUsedBecause, TwistAxes, VelocityCause};

use crate::keywords::{keyword_of, option_of};

/// The kind of a finding, and its data.
pub(crate) type FindingData = (&'static str, Py<PyDict>);

/// A dictionary of the listed entries.
macro_rules! data {
    ($py:expr $(, $name:literal: $value:expr)*) => {{
        let data = PyDict::new($py);
        $(data.set_item($name, $value)?;)*
        data.unbind()
    }};
}

/// Returns what Python's `tactid.identification.Finding` is made from.
pub(crate) fn finding_data(py: Python<'_>, finding: &Finding) -> PyResult<FindingData> {
    Ok(match finding {
        Finding::Data(finding) => return data_finding(py, finding),
        Finding::AccelerationNotUsed {
            topic,
            explains_better,
            residual_ratio,
            power_ratio,
        } => (
            "acceleration_not_used",
            data!(py, "topic": topic, "explains_better": explains_better,
                "residual_ratio": residual_ratio, "power_ratio": power_ratio),
        ),
        Finding::OptionNotUsed { option, because } => {
            let (because, method) = match because {
                NotUsedBecause::Method(method) => ("method", Some(method.name())),
                NotUsedBecause::OtherMotion => ("other_motion", None),
                NotUsedBecause::GravityIsMeasured => ("gravity_is_measured", None),
            };
            (
                "option_not_used",
                data!(py, "option": option_of(option), "because": because, "method": method),
            )
        }
        Finding::FrameAssumed { topic, frame } => {
            ("frame_assumed", data!(py, "topic": topic, "frame": frame))
        }
        Finding::WrenchesSummed { topics } => ("wrenches_summed", data!(py, "topics": topics)),
        Finding::UnknownJoints { joints } => ("unknown_joints", data!(py, "joints": joints)),
        Finding::AbsentJoints { joints } => ("absent_joints", data!(py, "joints": joints)),
        Finding::LateStart { topic, late_s } => {
            ("late_start", data!(py, "topic": topic, "late_s": late_s))
        }
        Finding::EarlyEnd {
            topic,
            end_s,
            early_s,
        } => (
            "early_end",
            data!(py, "topic": topic, "end_s": end_s, "early_s": early_s),
        ),
        Finding::VelocitiesContradicted {
            joints,
            relative_difference,
            cause,
        } => {
            let (cause, other) = match cause {
                None => (None, None),
                Some(VelocityCause::OppositeSign) => (Some("opposite_sign"), None),
                Some(VelocityCause::Degrees) => (Some("degrees"), None),
                Some(VelocityCause::PositionsInDegrees) => (Some("positions_in_degrees"), None),
                Some(VelocityCause::OtherJoint(other)) => (Some("other_joint"), Some(other)),
            };
            (
                "velocities_contradicted",
                data!(py, "joints": joints, "relative_difference": relative_difference,
                    "cause": cause, "other": other),
            )
        }
        Finding::TwistContradicted {
            source,
            relative_difference,
            better_axes,
        } => {
            let better_axes = better_axes.map(|axes| match axes {
                TwistAxes::World => "world",
                TwistAxes::Body => "body",
            });
            (
                "twist_contradicted",
                data!(py, "source": keyword_of(source), "relative_difference": relative_difference,
                    "better_axes": better_axes),
            )
        }
        Finding::ConstantChannels {
            source,
            frame,
            channels,
            is_zero,
        } => (
            "constant_channels",
            data!(py, "source": keyword_of(source), "frame": frame, "channels": channels,
                "is_zero": is_zero),
        ),
        Finding::DelayDoubtful {
            delay_s,
            residual_ratio,
            is_at_end,
        } => (
            "delay_doubtful",
            data!(py, "delay_s": delay_s, "residual_ratio": residual_ratio.sqrt(),
                "is_at_end": is_at_end),
        ),
        Finding::NoStamps => ("no_stamps", data!(py)),
        Finding::DelayCorrected {
            applied_s,
            estimated,
        } => (
            "delay_corrected",
            data!(py, "applied_s": applied_s, "estimated_s": estimated.delay_s,
                "std_dev_s": estimated.std_dev_s),
        ),
    })
}

/// What the data say about the assumptions of the identification.
pub(crate) fn data_finding(
    py: Python<'_>,
    finding: &tactid_identify::Finding,
) -> PyResult<FindingData> {
    use tactid_identify::Finding as Found;
    Ok(match finding {
        Found::GravityContradicted {
            better,
            residual_ratio,
            method,
        } => (
            "gravity_contradicted",
            data!(py, "better": [better.x, better.y, better.z],
                "residual_ratio": residual_ratio, "method": method.name()),
        ),
        Found::NegativeMass { method, or_gravity } => (
            "negative_mass",
            data!(py, "method": method.name(), "or_gravity": or_gravity),
        ),
        Found::KnownBodiesTooHeavy { known_kg, load_kg } => (
            "known_bodies_too_heavy",
            data!(py, "known_kg": known_kg, "load_kg": load_kg),
        ),
        Found::OffsetSuspected { offset } => offset_suspected(py, offset)?,
        Found::LoadUnexplained {
            unit,
            residual_rms,
            load_rms,
            noise_rms,
            method,
        } => (
            "load_unexplained",
            data!(py, "unit": unit, "residual_rms": residual_rms, "load_rms": load_rms,
                "noise_rms": noise_rms, "method": method.name()),
        ),
        Found::MassContradicted {
            known,
            found_kg,
            std_dev_kg,
            distance,
        } => (
            "mass_contradicted",
            data!(py, "known_kg": known.mass_kg, "known_std_dev_kg": known.std_dev_kg,
                "found_kg": found_kg, "std_dev_kg": std_dev_kg, "distance": distance),
        ),
        Found::KnownMassNotKept {
            known,
            estimated_kg,
            within_box,
        } => (
            "known_mass_not_kept",
            data!(py, "known_kg": known.mass_kg, "known_std_dev_kg": known.std_dev_kg,
                "estimated_kg": estimated_kg, "within_box": within_box),
        ),
        Found::Inconsistent {
            distance,
            within_box,
        } => (
            "inconsistent",
            data!(py, "distance": distance, "within_box": within_box),
        ),
        Found::Outliers { outliers, windows } => (
            "outliers",
            data!(py, "outliers": outliers, "windows": windows),
        ),
    })
}

fn offset_suspected(py: Python<'_>, offset: &WrenchOffset) -> PyResult<FindingData> {
    let values = data!(py, "frame": &*offset.frame, "values": offset.values(),
        "std_devs": offset.std_devs);
    Ok(("offset_suspected", values))
}
