//! The estimate over time as a log of its own.

use std::path::Path;

use tactid_identify::{HALF_WIDTH_95, VALUE_NAMES};
use tactid_logs::messages::{
    Float64MultiArray, Header, Inertia, InertiaStamped, MultiArrayDimension, MultiArrayLayout, Time,
};
use tactid_logs::{Durability, LogWriter};

use crate::RecordingError;

/// Topic of the estimate, `geometry_msgs/msg/InertiaStamped`.
const INERTIA_TOPIC: &str = "/tactid/payload";
/// Topic of half the width of the 95 % interval of each value, `std_msgs/msg/Float64MultiArray`.
const INTERVAL_TOPIC: &str = "/tactid/payload_half_width_95";

/// Writes an estimate over time as a log: `geometry_msgs/msg/InertiaStamped` on `/tactid/payload`,
/// in the frame `frame`, and half the width of the 95 % interval of each value on
/// `/tactid/payload_half_width_95` where standard deviations are known.
///
/// Each point has a time, s, relative to `start_ns`, the time zero of the recording in ns since the
/// epoch; the ten values; and their standard deviations, if the estimator has any.
///
/// # Errors
/// Returns [`RecordingError::Log`] if the file cannot be written.
pub fn write_estimates(
    path: &Path,
    frame: &str,
    start_ns: i64,
    points: impl IntoIterator<Item = (f64, [f64; 10], Option<[f64; 10]>)>,
) -> Result<(), RecordingError> {
    let mut log = LogWriter::create(path)?;
    let inertia = log.channel::<InertiaStamped>(INERTIA_TOPIC, Durability::Volatile)?;
    let intervals = log.channel::<Float64MultiArray>(INTERVAL_TOPIC, Durability::Volatile)?;
    for (time_s, values, std_devs) in points {
        let stamp_ns = start_ns.saturating_add((time_s * 1e9).round() as i64);
        let time_ns = u64::try_from(stamp_ns).unwrap_or(0);
        log.write(&inertia, time_ns, &inertia_message(frame, time_ns, &values))?;
        if let Some(std_devs) = std_devs {
            log.write(&intervals, time_ns, &half_widths(&std_devs))?;
        }
    }
    log.finish()?;
    Ok(())
}

fn inertia_message(frame: &str, time_ns: u64, values: &[f64; 10]) -> InertiaStamped {
    let [m, x, y, z, ixx, ixy, ixz, iyy, iyz, izz] = *values;
    InertiaStamped {
        header: Header {
            stamp: Time::from_ns(time_ns),
            frame_id: frame.to_owned(),
        },
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
    }
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
        data: std_devs
            .iter()
            .map(|std_dev| HALF_WIDTH_95 * std_dev)
            .collect(),
    }
}
