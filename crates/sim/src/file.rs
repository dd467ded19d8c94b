//! Reading an experiment's file together with its robot.

use std::path::Path;

use crate::experiment::{read, with_line};
use crate::roles::robot_with_roles;
use crate::{Experiment, SimError};

impl Experiment {
    /// Reads an experiment file, and checks it against the robot that it names. A relative path of a URDF refers to the
    /// file's folder.
    ///
    /// # Errors
    /// Returns [`SimError::File`] if the file or the URDF cannot be read, and [`SimError::InFile`] with [`SimError::Syntax`] or
    /// [`SimError::Value`] with the line, or [`SimError::Model`] or [`SimError::Robot`] for a URDF that cannot be simulated.
    pub fn from_file(path: &Path) -> Result<Self, SimError> {
        let text = read(path)?;
        Self::from_text(&text, path).map_err(|error| match error {
            SimError::File { .. } => error,
            other => SimError::InFile {
                path: path.to_owned(),
                source: Box::new(other),
            },
        })
    }

    fn from_text(text: &str, path: &Path) -> Result<Self, SimError> {
        let mut experiment = Self::from_toml(text)?;
        if let (Some(urdf), Some(folder)) = (&mut experiment.robot.urdf, path.parent()) {
            *urdf = folder.join(&*urdf);
        }
        robot_with_roles(&experiment).map_err(|error| with_line(error, text))?;
        Ok(experiment)
    }
}
