//! An offset of the wrenches that the data have shown.

use tactid_identify::equations::OffsetFrame;

use crate::finding::WrongAssumption;
use crate::fit::Fit;

/// Returns a shown offset as a fit has identified it, in a frame; `None` where the motion does not
/// distinguish it from the weight of the payload.
pub(super) fn identified(
    shown: &WrongAssumption,
    fit: &Fit,
    frame: &OffsetFrame,
) -> Option<WrongAssumption> {
    let offset = fit.wrench_offset(frame)?;
    fit.mass_std_dev_kg().is_finite().then_some(())?;
    Some(WrongAssumption {
        values: offset.values().to_vec(),
        std_devs: offset.std_devs?.to_vec(),
        is_applied: true,
        ..shown.clone()
    })
}
