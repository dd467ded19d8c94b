//! The shape of a request: its uncertainty, and checks.

use nalgebra::Isometry3;
use tactid_shapes::Tolerance;

use crate::known_shape::{GivenShape, of_shape};
use crate::{RecordingError, Request};

impl Request {
    /// Reads the shape of the payload, where there is one.
    ///
    /// # Errors
    /// Returns the errors of [`GivenShape::read`].
    pub(crate) fn read_shape(&self) -> Result<Option<GivenShape>, RecordingError> {
        let Some(path) = &self.shape else {
            return Ok(None);
        };
        let pose = self.shape_pose.map(|pose| pose.tip_from_shape());
        let default = Tolerance::default();
        let tolerance = Tolerance {
            position_m: self.shape_position_std_dev_m.unwrap_or(default.position_m),
            rotation_rad: self.shape_rotation_std_dev.unwrap_or(default.rotation_rad),
            size: self.shape_size_std_dev.unwrap_or(default.size),
            ln_density: self.shape_ln_density_std_dev.unwrap_or(default.ln_density),
        };
        let pose = pose.unwrap_or_else(|| Ok(Isometry3::identity()))?;
        let unit_m = self.shape_scale.unwrap_or(1.0);
        GivenShape::read(path, pose, unit_m, tolerance).map(Some)
    }

    /// Checks that a pose is one, and that nothing is given of a shape that is not.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] if it is not.
    pub(crate) fn check_shape(&self) -> Result<(), RecordingError> {
        if let Some(pose) = &self.shape_pose {
            pose.tip_from_shape()?;
        }
        let mut names = self.given().map(|given| given.option.name);
        match names.find(|name| self.shape.is_none() && name.starts_with("shape_")) {
            Some(given) => Err(of_shape(format!(
                "`shape` is missing, but `{given}` is given"
            ))),
            None => Ok(()),
        }
    }
}
