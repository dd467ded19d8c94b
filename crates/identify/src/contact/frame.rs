//! The point and the axes in which a wrench is stated.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use tactid_dynamics::{BaseKind, Manipulator};

use crate::IdentifyError;
use crate::equations::WORLD;

/// Point about which the moment of a wrench is, and axes along which it is expressed: see
/// [`Identifier::wrench_frame`](crate::Identifier::wrench_frame).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchFrame {
    /// Pose of the point and of the axes in the tool frame. Its rotation is not used where the axes
    /// are fixed to the world.
    tool_from_frame: Isometry3<f64>,
    /// Rotation from the axes of the world to those of the frame, where these do not move with the
    /// tool.
    frame_from_world: Option<UnitQuaternion<f64>>,
}

impl WrenchFrame {
    /// Finds the frame at the origin of the link `point`, along the axes of the link `axes` or of
    /// [`WORLD`], or of `point` where they are `None`, for a robot with the payload in its link
    /// `tool`.
    ///
    /// # Errors
    /// Returns the errors of [`Identifier::wrench_frame`](crate::Identifier::wrench_frame), and
    /// [`IdentifyError::Model`] if the robot does not have the link `tool`.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        point: &str,
        axes: Option<&str>,
    ) -> Result<Self, IdentifyError> {
        let tool = robot.frame(tool)?;
        let unfit = |option, what| IdentifyError::Option {
            option,
            what: format!("`{option}`: {what}"),
        };
        let frame_of = |option, link| {
            let found = robot.frame(link);
            found.map_err(|error| unfit(option, error.to_string()))
        };
        let moves = |option, link| {
            unfit(
                option,
                format!("the link `{link}` moves relative to the end-effector"),
            )
        };
        let tool_from_point = robot
            .fixed_transform(tool, frame_of("point", point)?)
            .ok_or_else(|| moves("point", point))?;
        let fixed_to_tool = |rotation| Self {
            tool_from_frame: Isometry3::from_parts(tool_from_point.translation, rotation),
            frame_from_world: None,
        };
        let fixed_to_world = |rotation| Self {
            frame_from_world: Some(rotation),
            ..fixed_to_tool(UnitQuaternion::identity())
        };
        let Some(link) = axes else {
            return Ok(fixed_to_tool(tool_from_point.rotation));
        };
        if link == WORLD && robot.frame(WORLD).is_err() {
            return Ok(fixed_to_world(UnitQuaternion::identity()));
        }
        let frame = frame_of("axes", link)?;
        if let Some(tool_from_link) = robot.fixed_transform(tool, frame) {
            return Ok(fixed_to_tool(tool_from_link.rotation));
        }
        let fixed = robot
            .fixed_transform(frame, robot.base_frame())
            .filter(|_| robot.base_kind() == BaseKind::Fixed);
        Ok(fixed_to_world(
            fixed.ok_or_else(|| moves("axes", link))?.rotation,
        ))
    }

    /// Returns the pose of the tool in this frame, given the rotation from the tool to the world.
    pub(super) fn frame_from_tool(&self, world_from_tool: &UnitQuaternion<f64>) -> Isometry3<f64> {
        let mut frame_from_tool = self.tool_from_frame.inverse();
        if let Some(frame_from_world) = self.frame_from_world {
            let rotation = frame_from_world * world_from_tool;
            let point = rotation * -self.tool_from_frame.translation.vector;
            frame_from_tool = Isometry3::from_parts(Translation3::from(point), rotation);
        }
        frame_from_tool
    }
}
