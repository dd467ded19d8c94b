//! What the ranges of the channels show, in a recording and online.

use tactid_identify::checks::{EffortRanges, RangeMonitor, WRENCH_CHANNELS};

use crate::Finding;

/// Returns the channels that are saturated and the joints whose efforts nobody measured.
///
/// Each wrench sensor has the name of its topic or array, and the limits of its channels are values
/// times `sign`. The efforts have one name.
#[must_use]
pub fn range_findings<'a>(
    wrenches: impl Iterator<Item = (&'a str, &'a RangeMonitor)>,
    sign: f64,
    (efforts_name, efforts): (&str, &[EffortRanges]),
) -> Vec<Finding> {
    let channel = |channel: usize| WRENCH_CHANNELS.get(channel).copied();
    let of_wrenches =
        wrenches.filter_map(|(name, ranges)| Some((name, ranges.saturation(channel, sign)?)));
    let of_efforts = efforts.iter().filter_map(EffortRanges::saturation);
    let saturated = of_wrenches.chain(of_efforts.map(|saturation| (efforts_name, saturation)));
    let saturated = saturated.map(|(source, saturation)| Finding::Saturated {
        source: source.to_owned(),
        saturation,
    });
    let unmeasured = efforts.iter().map(EffortRanges::unmeasured);
    let unmeasured = unmeasured.filter(|joints| !joints.is_empty());
    let unmeasured = unmeasured.map(|joints| Finding::EffortsUnmeasured {
        source: efforts_name.to_owned(),
        joints,
    });
    saturated.chain(unmeasured).collect()
}
