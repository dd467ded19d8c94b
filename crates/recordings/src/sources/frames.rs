//! Frames of sensors: links of the robot, or fixed to one by `/tf_static`.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use tactid_dynamics::{Manipulator, list_similar};
use tactid_logs::LogReader;
use tactid_logs::messages::TFMessage;

use crate::{RecordingError, SensorFrame};

/// Name of a frame that a request places, where the sensor has none of its own.
const PLACED_FRAME: &str = "sensor_frame";

/// Returns the robot with the frame of its only wrench sensor as a request places it, and the name of this frame:
/// `named`, unless it is empty or a link already.
///
/// # Errors
/// Returns [`RecordingError::Option`] if there is more than one sensor, and [`ModelError::UnknownFrame`] if
/// the robot does not have the link.
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

/// Static transforms of a log: the parent of each frame, and `parent_from_frame`.
pub(crate) struct StaticTransforms(BTreeMap<String, (String, Isometry3<f64>)>);

impl StaticTransforms {
    pub(crate) fn read(log: &LogReader) -> Result<Self, RecordingError> {
        let mut transforms = BTreeMap::new();
        let topics = log.topics_of::<TFMessage>();
        let names: Vec<&str> = topics
            .map(|topic| topic.name.as_str())
            .filter(|name| name.ends_with("tf_static"))
            .collect();
        for message in log.messages_on(names)? {
            for stamped in message?.decode::<TFMessage>()?.transforms {
                let (t, q) = (stamped.transform.translation, stamped.transform.rotation);
                let pose = Isometry3::from_parts(
                    Translation3::new(t.x, t.y, t.z),
                    UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z)),
                );
                transforms.insert(stamped.child_frame_id, (stamped.header.frame_id, pose));
            }
        }
        Ok(Self(transforms))
    }

    /// Returns the robot with a frame, which is one of its links already or is fixed to one.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`], with the `topic` that names the frame, or [`RecordingError::Tip`] without one, if no
    /// transform leads to it.
    pub(crate) fn place(
        &self,
        robot: Manipulator,
        frame: &str,
        topic: Option<&String>,
    ) -> Result<Manipulator, RecordingError> {
        if robot.frame(frame).is_ok() {
            return Ok(robot);
        }
        let unknown = || {
            let whose = topic.map_or("the end-effector", String::as_str);
            let what = format!(
                "the frame `{frame}` of {whose} is neither a link nor fixed to one by /tf_static; the links are: {}",
                list_similar(frame, robot.frame_names())
            );
            match topic {
                None => RecordingError::Tip(what),
                Some(_) => {
                    let what = what + "; `sensor_frame` places the sensor";
                    RecordingError::data_of("sensor_frame", what)
                }
            }
        };
        let mut ancestor = frame;
        let mut ancestor_from_frame = Isometry3::identity();
        // A chain longer than the number of transforms is a ring.
        for _ in 0..self.0.len() {
            let (parent, parent_from_ancestor) = self.0.get(ancestor).ok_or_else(unknown)?;
            ancestor = parent;
            ancestor_from_frame = parent_from_ancestor * ancestor_from_frame;
            if let Ok(link) = robot.frame(ancestor) {
                return Ok(robot.with_frame(frame, link, &ancestor_from_frame));
            }
        }
        Err(unknown())
    }
}
