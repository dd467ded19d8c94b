//! Channels of a wrench sensor that measure nothing: zero or no number in all samples, as drivers fill what a sensor with three
//! axes or one does not have.

use tactid_identify::Finding as DataFinding;
use tactid_identify::checks::{ChannelMonitor, ConstantChannels};

use crate::Finding;
use crate::alignment::{Event, Measured};
use crate::recording::Sources;

/// Returns which channels, but not all, have no finite number in any of some wrenches.
pub(crate) fn without_numbers(wrenches: impl Iterator<Item = [f64; 6]>) -> [bool; 6] {
    in_all(wrenches, |value| !value.is_finite())
}

/// Returns the channels of the only sensor, but not all, that are zero or no number in every one of
/// some wrenches. The equations can be without them where the sensor does not move relative to the
/// frame `tip`.
pub(crate) fn unmeasured_in_all(
    sources: &Sources,
    tip: &str,
    wrenches: impl Iterator<Item = [f64; 6]>,
) -> [bool; 6] {
    if has_fixed_sensor(sources, tip) {
        in_all(wrenches, |value| value == 0.0 || !value.is_finite())
    } else {
        [false; 6]
    }
}

/// Returns which channels, but not all, measure nothing in every one of some wrenches.
fn in_all(
    wrenches: impl Iterator<Item = [f64; 6]>,
    measures_nothing: impl Fn(f64) -> bool,
) -> [bool; 6] {
    let mut in_all = [true; 6];
    for wrench in wrenches {
        for (channel, value) in in_all.iter_mut().zip(wrench) {
            *channel &= measures_nothing(value);
        }
    }
    if in_all == [true; 6] {
        [false; 6]
    } else {
        in_all
    }
}

/// Returns the channels of the only sensor that are zero in the beginning of a recording, but not
/// all. The equations can be without them where the sensor does not move relative to the frame
/// `tip`.
pub(crate) fn unmeasured_channels(sources: &Sources, tip: &str, events: &[Event]) -> [bool; 6] {
    if !has_fixed_sensor(sources, tip) {
        return [false; 6];
    }
    let mut monitor = ChannelMonitor::new(1);
    for event in events {
        if let Measured::Wrench(sensor, wrench) = &event.measured {
            monitor.push(*sensor, event.time_s, wrench);
        }
    }
    let constant = monitor.constant_channels(f64::INFINITY).into_iter();
    let mut zero = constant.filter(|channels| channels.is_zero && channels.channels.len() < 6);
    zero.next().map_or([false; 6], |zero| zero.mask())
}

/// Returns whether there is one sensor, which does not move relative to the frame `tip`.
fn has_fixed_sensor(sources: &Sources, tip: &str) -> bool {
    let ([sensor], robot) = (&sources.sensors[..], &sources.robot) else {
        return false;
    };
    match (robot.frame(sensor), robot.frame(tip)) {
        (Ok(sensor), Ok(tip)) => robot.fixed_transform(sensor, tip).is_some(),
        _ => false,
    }
}

/// Reports the channels of each sensor that never changed, and those of the only sensor that were
/// left out because they measured nothing in the beginning.
pub(crate) fn constant_channels(
    monitor: &ChannelMonitor,
    left_out: &[bool; 6],
    sources: &Sources,
) -> Vec<Finding> {
    let constant = monitor.constant_channels(f64::INFINITY);
    let zero = constant.iter().find(|each| each.is_zero);
    let zero = zero.map_or([false; 6], ConstantChannels::mask);
    let of_left_out = [true, false].map(|is_zero| {
        let mask = std::array::from_fn(|k| left_out[k] && zero[k] == is_zero);
        (ConstantChannels::new(0, mask, is_zero), true)
    });
    let others = constant.into_iter().map(|each| {
        let mask = each.mask();
        let mask = std::array::from_fn(|k| mask[k] && !left_out[k]);
        let others = ConstantChannels::new(each.sensor, mask, each.is_zero);
        (others, false)
    });
    let reported = of_left_out.into_iter().chain(others);
    reported
        .filter(|(channels, _)| !channels.channels.is_empty())
        .map(|(channels, is_left_out)| finding(channels, is_left_out, sources))
        .collect()
}

/// Reports channels that were left out because they are zero, or no number, in all wrenches.
pub(crate) fn left_out_channels(left_out: &[bool; 6], sources: &Sources) -> Option<Finding> {
    let channels = ConstantChannels::new(0, *left_out, true);
    (!channels.channels.is_empty()).then(|| finding(channels, true, sources))
}

fn finding(of: ConstantChannels, is_left_out: bool, sources: &Sources) -> Finding {
    Finding::Data(DataFinding::ConstantChannels {
        source: sources.wrench_names[of.sensor].clone(),
        frame: sources.sensors[of.sensor].clone(),
        channels: of.channels.into_iter().map(Into::into).collect(),
        is_zero: of.is_zero,
        is_left_out,
    })
}
