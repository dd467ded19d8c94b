//! Reading an experiment's file together with its robot.

use std::path::Path;

use crate::experiment::{is_given, read, with_line};
use crate::roles::{arm_motion, robot_with_roles};
use crate::{ExcitationKind, Experiment, Posture, SimError};

impl Experiment {
    /// Reads an experiment file, and checks it against the robot that it names. Relative paths of a
    /// URDF and of a motion refer to the file's folder. A posture and a duration that the file
    /// leaves out come from its motion.
    ///
    /// # Errors
    /// Returns [`SimError::File`] if the file or the URDF cannot be read, and [`SimError::InFile`]
    /// with [`SimError::Syntax`] or [`SimError::Value`] with the line, or [`SimError::Model`] or
    /// [`SimError::Robot`] for a URDF that cannot be simulated.
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
        let files = [&mut experiment.robot.urdf, &mut experiment.excitation.file];
        for file in files.into_iter().flatten() {
            if let Some(folder) = path.parent() {
                *file = folder.join(&*file);
            }
        }
        experiment
            .begin_with_motion(|field| is_given(field, text))
            .and_then(|()| robot_with_roles(&experiment))
            .map_err(|error| with_line(error, text))?;
        Ok(experiment)
    }

    /// Lets the arm follow the motion in a CSV file
    /// ([`Excitation::file`](crate::Excitation::file)): the experiment begins in its first posture
    /// and lasts as long as the motion.
    ///
    /// # Errors
    /// Returns [`SimError::File`] or [`SimError::Motion`] for a file that is not such a table or
    /// lacks a joint of the arm, and the errors of reading the robot.
    pub fn follow(&mut self, file: &Path) -> Result<(), SimError> {
        self.excitation.kind = ExcitationKind::Designed;
        self.excitation.file = Some(file.to_owned());
        self.excitation.active = None;
        self.begin_with_motion(|_| false)
    }

    /// Takes posture and duration from the motion that the arm follows, if there is one, unless
    /// they are given.
    fn begin_with_motion(&mut self, is_given: impl Fn(&str) -> bool) -> Result<(), SimError> {
        let Some(motion) = arm_motion(self)? else {
            return Ok(());
        };
        if !is_given("posture") {
            self.posture = Posture::Joints(motion.start());
        }
        if !is_given("duration_s") {
            // The quotient of two multiples of the step is whole up to rounding.
            let steps = (motion.duration_s() / self.step_s - 1e-6).ceil();
            self.duration_s = steps * self.step_s;
        }
        Ok(())
    }
}
