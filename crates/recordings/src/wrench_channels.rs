//! Channels of a wrench sensor that measure nothing: zero or no number in all samples, as drivers fill what a sensor with three
//! axes or one does not have.

use tactid_identify::Finding as DataFinding;
use tactid_identify::checks::{ChannelMonitor, ConstantChannels};

use crate::Finding;
use crate::alignment::{Event, Measured};
use crate::recording::Sources;

/// Fewest wrenches that show a channel to have no number.
const FEWEST_WRENCHES: usize = 10;

/// Returns which channels, but not all, have no finite number in any of some wrenches.
pub(crate) fn without_numbers(wrenches: impl Iterator<Item = [f64; 6]>) -> [bool; 6] {
    let (mut without, mut count) = ([true; 6], 0);
    for wrench in wrenches {
        for (channel, value) in without.iter_mut().zip(wrench) {
            *channel &= !value.is_finite();
        }
        count += 1;
    }
    if count < FEWEST_WRENCHES || without == [true; 6] {
        return [false; 6];
    }
    without
}

/// Returns the channels of the only sensor that are zero in the beginning of a recording, but not all. The equations can be
/// without them where the sensor does not move relative to the tool.
pub(crate) fn unmeasured_channels(sources: &Sources, tip: &str, events: &[Event]) -> [bool; 6] {
    let ([sensor], robot) = (&sources.sensors[..], &sources.robot) else {
        return [false; 6];
    };
    let is_fixed = match (robot.frame(sensor), robot.frame(tip)) {
        (Ok(sensor), Ok(tip)) => robot.fixed_transform(sensor, tip).is_some(),
        _ => false,
    };
    let mut monitor = ChannelMonitor::new(1);
    for event in events {
        if let Measured::Wrench(sensor, wrench) = &event.measured {
            monitor.push(*sensor, event.time_s, wrench);
        }
    }
    let constant = monitor.constant_channels(f64::INFINITY).into_iter();
    let mut zero = constant.filter(|channels| channels.is_zero && channels.channels.len() < 6);
    zero.next()
        .filter(|_| is_fixed)
        .map_or([false; 6], |zero| zero.mask())
}

/// Reports the channels of each sensor that never changed, and whether they are `unmeasured` ones that were left out.
pub(crate) fn constant_channels(
    monitor: &ChannelMonitor,
    unmeasured: &[bool; 6],
    sources: &Sources,
) -> Vec<Finding> {
    let finding = |constant: ConstantChannels| {
        let mask = constant.mask();
        Finding::Data(DataFinding::ConstantChannels {
            source: sources.wrench_names[constant.sensor].clone(),
            frame: sources.sensors[constant.sensor].clone(),
            channels: constant.channels.into_iter().map(Into::into).collect(),
            is_zero: constant.is_zero,
            is_left_out: constant.is_zero && mask == *unmeasured,
        })
    };
    let constant = monitor.constant_channels(f64::INFINITY).into_iter();
    constant.map(finding).collect()
}
