//! Reading an experiment's file together with its robot.

use std::path::Path;

use tactid_dynamics::Urdf;

use crate::experiment::{ExcitationKind, Posture, read, with_line};
use crate::joint_table::JointTable;
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

    /// Returns the experiment with its excitation replaced by a motion: the folder that `tactid excite` wrote, its
    /// `trajectory.mcap` or its `trajectory.csv`. Posture and duration become those of the motion.
    ///
    /// # Errors
    /// Returns [`SimError::File`], [`SimError::Log`] or [`SimError::Motion`] if the motion cannot be read, and
    /// [`SimError::Value`] if the robot does not have its joints.
    pub fn following(mut self, motion: &Path) -> Result<Self, SimError> {
        self.excitation.kind = ExcitationKind::Designed;
        self.excitation.file = Some(motion.to_owned());
        self.begin_with_motion(true, true)?;
        robot_with_roles(&self)?;
        self.check()?;
        Ok(self)
    }

    /// Takes the posture or the duration from the motion of the excitation. Joints that it does not move stay.
    fn begin_with_motion(&mut self, posture: bool, duration: bool) -> Result<(), SimError> {
        let Some(path) = &self.excitation.file else {
            return Ok(());
        };
        let motion = JointTable::read(path)?;
        if duration {
            self.duration_s = motion.duration_s();
        }
        if posture {
            let urdf = Urdf::from_xml(&self.urdf()?)?;
            let robot = urdf.manipulator(self.robot.base.kind())?;
            let all = robot.joint_names().iter();
            let arm: Vec<&String> = all
                .filter(|name| !self.robot.fingers.contains(name))
                .collect();
            let mut positions = self.posture.positions();
            positions.resize(arm.len(), 0.0);
            for (name, start) in motion.names.iter().zip(motion.positions_at(0.0)) {
                if let Some(place) = arm.iter().position(|joint| *joint == name) {
                    positions[place] = start;
                }
            }
            self.posture = Posture::Joints(positions);
        }
        Ok(())
    }

    fn from_text(text: &str, path: &Path) -> Result<Self, SimError> {
        let mut experiment = Self::from_toml(text)?;
        if let (Some(urdf), Some(folder)) = (&mut experiment.robot.urdf, path.parent()) {
            *urdf = folder.join(&*urdf);
        }
        if let (Some(file), Some(folder)) = (&mut experiment.excitation.file, path.parent()) {
            *file = folder.join(&*file);
            let given: toml::Table = text.parse().unwrap_or_default();
            let [posture, duration] =
                ["posture", "duration_s"].map(|field| given.contains_key(field));
            experiment.begin_with_motion(!posture, !duration)?;
        }
        robot_with_roles(&experiment).map_err(|error| with_line(error, text))?;
        Ok(experiment)
    }
}
