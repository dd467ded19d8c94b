//! An offset of the wrenches beside the weight of the payload.

use super::rests::hides_offset;
use crate::equations::{Equation, EquationStream};
use crate::finding::WrongAssumption;
use crate::fit::Fit;
use crate::solve::uncertainty::is_mass_known;

/// Returns whether the motion hardly tells the weight from an offset of the wrenches.
pub(super) fn is_hidden(equations: &[Equation], stream: &EquationStream) -> bool {
    let is_wrench = stream.has_sensors() && stream.method().uses_wrench();
    is_wrench && stream.gravity().norm() > 0.0 && hides_offset(equations)
}

/// Returns whether a fit knows the mass.
pub(super) fn knows_mass(fit: &Fit) -> bool {
    is_mass_known(fit.parameters[0], fit.mass_std_dev_kg())
}

/// Returns a shown offset as a fit has identified it; `None` where the motion does not distinguish
/// it from the weight of the payload.
pub(super) fn identified(
    shown: &WrongAssumption,
    fit: &Fit,
    stream: &EquationStream,
) -> Option<WrongAssumption> {
    let offset = fit.wrench_offset(stream.offset_frame())?;
    knows_mass(fit).then_some(())?;
    Some(WrongAssumption {
        values: offset.values().to_vec(),
        std_devs: offset.std_devs?.to_vec(),
        is_applied: true,
        ..shown.clone()
    })
}
