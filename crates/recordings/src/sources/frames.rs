//! Frames of sensors: links of the robot, or fixed to one by the transforms of a log.

use tactid_dynamics::{BaseKind, Manipulator, list_similar};

use super::moving_frames::find_moving;
use super::transforms::Transforms;
use crate::{Finding, RecordingError, SensorFrame};

/// Name of a frame that a request places, where the sensor has none of its own.
const PLACED_FRAME: &str = "sensor_frame";

/// Returns the robot with the frame of its only wrench sensor as a request places it, and the name
/// of this frame: `named`, unless it is empty or a link already.
///
/// # Errors
/// Returns [`RecordingError::Option`] if there is more than one sensor, and
/// [`ModelError::UnknownFrame`] if the robot does not have the link.
pub(crate) fn place_sensor(
    robot: &Manipulator,
    given: &SensorFrame,
    named: &[String],
) -> Result<(Manipulator, String), RecordingError> {
    let [named] = named else {
        return Err(RecordingError::Option {
            option: "sensor_frame",
            what: format!(
                "the frame of one wrench sensor is given, but there are {} sensors",
                named.len()
            ),
        });
    };
    let is_free = !named.is_empty() && robot.frame(named).is_err();
    let name = if is_free { named } else { PLACED_FRAME };
    let link = robot.frame(&given.parent)?;
    let placed = robot.with_frame(name, link, &given.parent_from_sensor()?);
    Ok((placed, name.to_owned()))
}

/// What a frame belongs to, for an error.
#[derive(Clone, Copy)]
pub(crate) enum FrameOf<'a> {
    /// The end-effector.
    Tip,
    /// The wrenches of a topic.
    Wrenches(&'a str),
    /// The axes of the wrenches, which a request names.
    Axes,
}

/// Returns a robot with a further frame, which is fixed to one of its links, and a finding where
/// only transforms that may change show that.
///
/// # Errors
/// Returns [`RecordingError::Data`] if no transform leads to the frame, or [`RecordingError::Tip`]
/// for that of the end-effector.
pub(super) fn place_frame(
    transforms: &Transforms<'_>,
    robot: &Manipulator,
    frame: &str,
    of: FrameOf<'_>,
) -> Result<(Manipulator, Option<Finding>), RecordingError> {
    if let Some((link, link_from_frame)) = transforms.link_of(robot, frame) {
        return Ok((robot.with_frame(frame, link, &link_from_frame), None));
    }
    let moving = find_moving(transforms, robot, frame)?;
    let moving = moving.ok_or_else(|| unknown(robot, frame, of))?;
    let link = robot.frame(&moving.link)?;
    let placed = robot.with_frame(frame, link, &moving.link_from_frame);
    let finding = Finding::FrameFollowed {
        frame: frame.to_owned(),
        link: moving.link,
        origin_m: moving.link_from_frame.translation.vector.into(),
    };
    Ok((placed, Some(finding)))
}

/// Returns the error of a frame that no transform leads to.
fn unknown(robot: &Manipulator, frame: &str, of: FrameOf<'_>) -> RecordingError {
    let whose = match of {
        FrameOf::Tip => "the end-effector",
        FrameOf::Wrenches(topic) => topic,
        FrameOf::Axes => "the axes of the wrenches",
    };
    let what = format!(
        "the frame `{frame}` of {whose} is neither a link nor fixed to one by /tf_static or /tf; the links are: {}",
        list_similar(frame, robot.frame_names())
    );
    match of {
        FrameOf::Tip => RecordingError::Tip(what),
        FrameOf::Wrenches(_) => {
            RecordingError::data_of("sensor_frame", what + "; `sensor_frame` places the sensor")
        }
        FrameOf::Axes => RecordingError::Option {
            option: "wrench_axes",
            what,
        },
    }
}

/// Returns whether a frame of a robot is fixed to its base, which is fixed to the ground, while the
/// tip moves.
pub(super) fn is_fixed_to_ground(robot: &Manipulator, frame: &str, tip: &str) -> bool {
    let is_fixed = |name: &str| {
        let frame = robot.frame(name).ok();
        frame.is_some_and(|frame| robot.fixed_transform(robot.base_frame(), frame).is_some())
    };
    robot.base_kind() == BaseKind::Fixed && is_fixed(frame) && !is_fixed(tip)
}
