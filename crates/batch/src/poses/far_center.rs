//! A centre of mass that shows another unit of the moments.

use tactid_identify::KINDS;
use tactid_identify::solve::HALF_WIDTH_95;

use super::fit::RestFit;
use crate::finding::{FarCenter, is_out_of_reach};

/// Returns the centre of mass, where it is certainly farther from the origin of the tool frame,
/// which is called `frame`, than that of anything that an arm holds.
pub(super) fn far_center(fit: &RestFit, frame: &str) -> Option<FarCenter> {
    let std_devs = fit.value_std_devs();
    let center = fit.parameters.fixed_rows::<3>(1) / fit.parameters[0];
    let squares = std_devs[KINDS[1].clone()].iter().map(|each| each.powi(2));
    let half_width_m = HALF_WIDTH_95 * squares.sum::<f64>().sqrt();
    let distance_m = center.norm();
    is_out_of_reach(distance_m, half_width_m).then(|| FarCenter {
        distance_m,
        half_width_m,
        frame: frame.to_owned(),
    })
}
