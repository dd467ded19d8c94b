//! Measurement sources: each turns the measurements of an instant into row equations.
//!
//! One file has one source: its rows, the names of its channels, and the known noise of its
//! sensors. A source implements [`MeasurementSource`] and has a variant of [`Source`];
//! [`sources_of`] decides which methods use it.

mod base;
mod effort;
mod momentum;
mod regressor;
mod source;
mod wrench;

use nalgebra::Matrix6;
use tactid_dynamics::{BaseKind, FrameId, Manipulator};

use self::base::BaseSource;
use self::effort::EffortSource;
use self::momentum::MomentumSource;
pub use self::regressor::acceleration_columns;
pub(crate) use self::regressor::{MOTION_TERMS, WrenchRegressor, columns_expressed_in};
pub(crate) use self::source::{MeasurementSource, RobotState};
use self::wrench::WrenchSource;
use super::settings::EquationSettings;
use crate::{IdentifyError, Method};

/// One of the measurement sources.
#[derive(Clone, Debug)]
pub(crate) enum Source {
    /// The wrenches of the sensors, which has the most fields.
    Wrench(Box<WrenchSource>),
    /// The joint efforts.
    Effort(EffortSource),
    /// The motion of all bodies but the end-effector.
    Momentum(MomentumSource),
    /// The motion of a free-floating base.
    Base(BaseSource),
}

impl std::ops::Deref for Source {
    type Target = dyn MeasurementSource;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Wrench(source) => &**source,
            Self::Effort(source) => source,
            Self::Momentum(source) => source,
            Self::Base(source) => source,
        }
    }
}

impl std::ops::DerefMut for Source {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Wrench(source) => &mut **source,
            Self::Effort(source) => source,
            Self::Momentum(source) => source,
            Self::Base(source) => source,
        }
    }
}

/// Returns the sources that the configured method uses, in the order of their rows. `projection`
/// takes what no sensor measures from a wrench in the tool frame.
///
/// # Errors
/// Returns [`IdentifyError::Model`] if the robot does not have the link of a sensor.
pub(crate) fn sources_of(
    robot: &Manipulator,
    tool: FrameId,
    sensors: &[&str],
    settings: &EquationSettings,
    projection: Option<Matrix6<f64>>,
) -> Result<Vec<Source>, IdentifyError> {
    // Also a sensor that the method does not use must be a link of the robot.
    let wrench = WrenchSource::new(robot, sensors, settings, projection)?;
    let wrench = Source::Wrench(Box::new(wrench));
    let effort = || Source::Effort(EffortSource::new(robot, tool, settings));
    Ok(match settings.method {
        Method::Tactile => vec![wrench],
        Method::Effort => vec![effort()],
        Method::JointSensing => vec![Source::Momentum(MomentumSource)],
        Method::Combined { effort: measured } => {
            let floats = robot.base_kind() == BaseKind::Floating;
            let wrench = (!sensors.is_empty()).then_some(wrench);
            let effort = measured.then(effort);
            let base = floats.then_some(Source::Base(BaseSource));
            [wrench, effort, base].into_iter().flatten().collect()
        }
    })
}
