//! Checks of how an experiment moves its joints.

use tactid_excitation::{LARGEST_SIZE_M, MAX_KEEP_OUT};

use super::super::{ActiveExcitation, BaseMount, ExcitationKind, Experiment, JointExcitation};
use super::{not_negative, positive, refuse};
use crate::SimError;

/// Checks the table `excitation`.
pub(super) fn check(e: &Experiment) -> Result<(), SimError> {
    let excitation = &e.excitation;
    let kind = excitation.kind;
    if let (ExcitationKind::Designed, None) = (kind, &excitation.file) {
        let why = "needs the motion: give excitation.file, the CSV file of a designed motion";
        return Err(refuse("excitation.kind", "designed", why));
    }
    if let (ExcitationKind::Cosine | ExcitationKind::Active, Some(file)) = (kind, &excitation.file)
    {
        let why = "is used only with excitation.kind = \"designed\"";
        return Err(refuse("excitation.file", file, why));
    }
    if let (ExcitationKind::Cosine | ExcitationKind::Designed, Some(active)) =
        (kind, &excitation.active)
    {
        let why = "is used only with excitation.kind = \"active\"";
        return Err(refuse("excitation.active.within", active.within, why));
    }
    match kind {
        ExcitationKind::Cosine => cosines(e),
        ExcitationKind::Designed => Ok(()),
        ExcitationKind::Active => active(e),
    }
}

/// Checks the table of active excitation.
fn active(e: &Experiment) -> Result<(), SimError> {
    let settings = e.excitation.active.clone().unwrap_or_default();
    let ActiveExcitation {
        within,
        mass_kg: [least, most],
        ..
    } = settings;
    for (name, value) in [
        ("within", within),
        ("mass_kg[0]", least),
        ("mass_kg[1]", most),
        ("center_of_mass_m", settings.center_of_mass_m),
        ("half_diagonal_m", settings.half_diagonal_m),
        ("acceleration_rad_s2", settings.acceleration_rad_s2),
        ("friction_used", settings.friction_used),
        ("cutoff_hz", settings.cutoff_hz),
    ] {
        positive(field(name), value)?;
    }
    if most < least {
        let why = "must be the least and the largest mass, in this order";
        return Err(refuse(field("mass_kg"), settings.mass_kg, why));
    }
    if settings.friction_used > 1.0 {
        let why = "must be at most 1, the whole friction";
        return Err(refuse(field("friction_used"), settings.friction_used, why));
    }
    boxes(&settings)?;
    base_bounds(e, &settings)
}

/// Returns the full name of a field of active excitation.
fn field(name: &str) -> String {
    format!("excitation.active.{name}")
}

/// Checks the boxes of the payload and around the robot.
fn boxes(settings: &ActiveExcitation) -> Result<(), SimError> {
    let boxes = [
        ("payload_box_m".to_owned(), settings.payload_box_m),
        ("workspace_m".to_owned(), settings.workspace_m),
    ];
    if settings.keep_out_m.len() > MAX_KEEP_OUT {
        let why = format!("must be at most {MAX_KEEP_OUT} boxes");
        return Err(refuse(field("keep_out_m"), settings.keep_out_m.len(), &why));
    }
    if let Some(name) = settings.keep_out_m.keys().find(|name| name.len() > 200) {
        let why = "must be names of at most 200 bytes";
        return Err(refuse(
            field("keep_out_m"),
            format!("{} bytes", name.len()),
            why,
        ));
    }
    let keep_out = settings.keep_out_m.iter();
    let keep_out = keep_out.map(|(name, &corners)| (format!("keep_out_m.{name}"), Some(corners)));
    for (name, corners) in boxes.into_iter().chain(keep_out) {
        let Some([low, high]) = corners else { continue };
        let is_box = |k: usize| {
            let is_near = low[k] >= -LARGEST_SIZE_M && high[k] <= LARGEST_SIZE_M;
            is_near && high[k] - low[k] >= 1e-6
        };
        if !(0..3).all(is_box) {
            let why = "must be the corner with the least coordinates and the one with the largest, [[x, y, z], [x, y, z]], \
                       with sides from 1e-6 m on and within 1e6 m";
            return Err(refuse(field(&name), [low, high], why));
        }
    }
    Ok(())
}

/// Checks the bounds on the motion of the base.
fn base_bounds(e: &Experiment, settings: &ActiveExcitation) -> Result<(), SimError> {
    for (name, bound, largest) in [
        ("base_attitude_deg", settings.base_attitude_deg, 180.0),
        ("base_position_m", settings.base_position_m, f64::INFINITY),
    ] {
        let Some(bound) = bound else { continue };
        if e.robot.base == BaseMount::Fixed {
            let why = "bounds the motion of a base that is fixed: leave it out, or set robot.base = \"floating\"";
            return Err(refuse(field(name), bound, why));
        }
        positive(field(name), bound)?;
        if bound > largest {
            let why = "must be at most 180, the largest angle of a rotation";
            return Err(refuse(field(name), bound, why));
        }
    }
    Ok(())
}

fn cosines(e: &Experiment) -> Result<(), SimError> {
    let joints = &e.excitation.joints;
    not_negative("excitation.command_noise", e.excitation.command_noise)?;
    if joints.is_empty() {
        let names: [&str; 0] = [];
        return Err(refuse(
            "excitation.joints",
            names,
            "at least one joint must move",
        ));
    }
    for (i, joint) in joints.iter().enumerate() {
        let JointExcitation {
            name,
            amplitude_rad_s2,
            frequency_hz,
        } = joint;
        not_negative(
            format!("excitation.joints[{i}].amplitude_rad_s2"),
            *amplitude_rad_s2,
        )?;
        let field = format!("excitation.joints[{i}].frequency_hz");
        positive(&field, *frequency_hz)?;
        if *frequency_hz * e.step_s > 0.05 {
            let why = "must leave 20 steps or more to a period; make step_s shorter";
            return Err(refuse(field, frequency_hz, why));
        }
        if joints[..i].iter().any(|other| other.name == *name) {
            let why = "is driven twice";
            return Err(refuse(format!("excitation.joints[{i}].name"), name, why));
        }
        if e.robot.fingers.contains(name) {
            let why = "is a finger, which the grasp locks";
            return Err(refuse(format!("excitation.joints[{i}].name"), name, why));
        }
    }
    Ok(())
}
