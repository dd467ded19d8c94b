//! The estimate over time as a log of its own, to be opened beside the one it came from.

use std::path::Path;

use tactid_logs::messages::{
    Float64MultiArray, Header, Inertia, InertiaStamped, MultiArrayDimension, MultiArrayLayout, Time,
};
use tactid_logs::{Durability, LogWriter};

use super::outcome::Identification;
use crate::uncertainty::HALF_WIDTH_95;
use crate::{IdentifyError, VALUE_NAMES};

/// `geometry_msgs/msg/InertiaStamped`.
const INERTIA_TOPIC: &str = "/tactid/payload";
/// `std_msgs/msg/Float64MultiArray`: half the width of the 95 % interval of each value.
const INTERVAL_TOPIC: &str = "/tactid/payload_half_width_95";

/// Writes the estimate over time as `geometry_msgs/msg/InertiaStamped` on `/tactid/payload`, in the
/// frame of the tool, and the half width of each value's 95 % interval beside it. Stamps are those of
/// the recording; the last message is the final estimate.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_estimates(path: &Path, found: &Identification) -> Result<(), IdentifyError> {
    let mut log = LogWriter::create(path)?;
    let inertia = log.channel::<InertiaStamped>(INERTIA_TOPIC, Durability::Volatile)?;
    let intervals = log.channel::<Float64MultiArray>(INTERVAL_TOPIC, Durability::Volatile)?;
    let epoch = found.history.last().map_or(0, |point| point.epoch);
    let points = found.history.iter().filter(|point| point.epoch == epoch);
    let end_s = found.history.last().map_or(0.0, |point| point.time_s);
    let over_time = points.map(|point| (point.time_s, point.values, point.std_devs));
    let last = (end_s, found.estimate.values(), found.estimate.std_devs);
    let count = found
        .history
        .iter()
        .filter(|p| p.epoch == epoch)
        .count()
        .saturating_sub(1);
    for (time_s, values, std_devs) in over_time.take(count).chain([last]) {
        let stamp_ns = found.start_ns.saturating_add((time_s * 1e9).round() as i64);
        let time_ns = u64::try_from(stamp_ns).unwrap_or(0);
        let header = Header {
            stamp: Time::from_ns(time_ns),
            frame_id: found.tool.clone(),
        };
        let [m, x, y, z, ixx, ixy, ixz, iyy, iyz, izz] = values;
        let message = InertiaStamped {
            header,
            inertia: Inertia {
                m,
                com: [x, y, z].into(),
                ixx,
                ixy,
                ixz,
                iyy,
                iyz,
                izz,
            },
        };
        log.write(&inertia, time_ns, &message)?;
        if let Some(std_devs) = std_devs {
            log.write(&intervals, time_ns, &half_widths(&std_devs))?;
        }
    }
    log.finish()?;
    Ok(())
}

fn half_widths(std_devs: &[f64; 10]) -> Float64MultiArray {
    let dimension = MultiArrayDimension {
        label: VALUE_NAMES.join(" "),
        size: 10,
        stride: 10,
    };
    Float64MultiArray {
        layout: MultiArrayLayout {
            dim: vec![dimension],
            data_offset: 0,
        },
        data: std_devs.iter().map(|d| HALF_WIDTH_95 * d).collect(),
    }
}
