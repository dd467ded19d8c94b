//! A centre of mass that shows another unit of the moments.

use super::fit::RestFit;
use crate::finding::FarCenter;
use crate::result::KINDS;
use crate::solve::subspace::LEVER_ARM_M;
use crate::solve::uncertainty::{HALF_WIDTH_95, value_jacobian};

/// Returns the centre of mass, where it is certainly farther from the origin of the tool frame, which
/// is called `frame`, than that of anything that an arm holds, by two lever arms: 2 m.
pub(super) fn far_center(fit: &RestFit, frame: &str) -> Option<FarCenter> {
    let slopes = value_jacobian(&fit.parameters)?;
    let center = fit.parameters.fixed_rows::<3>(1) / fit.parameters[0];
    let squares = KINDS[1]
        .clone()
        .map(|k| fit.std_dev(&slopes.row(k).into()).powi(2));
    let half_width_m = HALF_WIDTH_95 * squares.sum::<f64>().sqrt();
    let distance_m = center.norm();
    (distance_m - half_width_m > 2.0 * LEVER_ARM_M).then(|| FarCenter {
        distance_m,
        half_width_m,
        frame: frame.to_owned(),
    })
}
