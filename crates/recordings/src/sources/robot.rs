//! The robot of a log, by its URDF.

use tactid_dynamics::{BaseKind, Manipulator, Urdf};
use tactid_logs::messages::{Odometry, StringMsg};
use tactid_logs::{LogReader, Topic};

use super::topics::{first, topic_names};
use crate::RecordingError;

/// Returns the robot of a URDF, or of the robot description in the log. Its base is fixed, or the
/// link that the odometry moves.
pub(crate) fn robot(
    log: &LogReader,
    urdf: Option<&Urdf>,
    odometry: Option<&String>,
) -> Result<Manipulator, RecordingError> {
    let described;
    let urdf = match urdf {
        Some(urdf) => urdf,
        None => {
            described = Urdf::from_xml(&description(log)?)?;
            &described
        }
    };
    let Some(odometry) = odometry else {
        return Ok(urdf.manipulator(BaseKind::Fixed)?);
    };
    let moved = first::<Odometry>(log, odometry)?.child_frame_id;
    let base = (!moved.is_empty()).then_some(moved.as_str());
    Ok(urdf.manipulator_below(BaseKind::Floating, base)?)
}

fn description(log: &LogReader) -> Result<String, RecordingError> {
    let topics: Vec<&Topic> = log.topics_of::<StringMsg>().collect();
    let mut named = topics.iter();
    match named.find(|topic| topic.name.ends_with("robot_description")) {
        Some(topic) => Ok(first::<StringMsg>(log, &topic.name)?.data),
        None => Err(RecordingError::data_of(
            "urdf",
            format!(
                "the log has no robot description: give a URDF; its topics are: {}; `urdf` names its file",
                topic_names(log, "")
            ),
        )),
    }
}
