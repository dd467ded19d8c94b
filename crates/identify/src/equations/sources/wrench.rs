//! The wrenches of the fingers or of a wrist sensor, (47): the payload alone.

use nalgebra::{DMatrix, Isometry3, SMatrix, SVector};
use tactid_dynamics::{FrameId, Manipulator, ModelError, StateError, Wrench};

use super::regressor::{columns_expressed_in, set_wrench};
use super::source::{MeasurementSource, RobotState};
use crate::IdentifyError;
use crate::equations::channels::{Channel, wrench_channels};
use crate::equations::instant::Instant;
use crate::equations::settings::{EquationSettings, expand};

/// The sum of the wrenches that all sensors exert on the payload.
#[derive(Clone, Debug)]
pub(crate) struct WrenchSource {
    sensors: Vec<Sensor>,
    /// Standard deviations of one sample of each sensor, in its frame: forces in N, moments in N m. Empty
    /// where they are unknown.
    noise: Vec<SVector<f64, 6>>,
    has_offsets: bool,
}

/// Where a sensor is.
#[derive(Clone, Copy, Debug)]
enum Sensor {
    /// Pose in the tool frame, which no joint changes: that of a wrist sensor.
    Fixed(Isometry3<f64>),
    /// Frame of a sensor that joints move relative to the tool: that of a finger.
    Moving(FrameId),
}

impl Sensor {
    /// Returns `tool_from_sensor`.
    fn pose_in_tool(self, robot: &RobotState<'_>) -> Isometry3<f64> {
        match self {
            Self::Fixed(tool_from_sensor) => tool_from_sensor,
            Self::Moving(frame) => robot
                .world_from_tool()
                .inv_mul(&robot.workspace.pose(frame)),
        }
    }
}

impl WrenchSource {
    /// Creates the source for the links in which the wrenches are measured.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Model`] if the robot does not have one of the links.
    pub(crate) fn new(
        robot: &Manipulator,
        tool: FrameId,
        sensors: &[&str],
        settings: &EquationSettings,
    ) -> Result<Self, IdentifyError> {
        let sensor = |name: &&str| {
            let frame = robot.frame(name)?;
            let tool_from_sensor = robot.fixed_transform(tool, frame);
            Ok::<_, ModelError>(tool_from_sensor.map_or(Sensor::Moving(frame), Sensor::Fixed))
        };
        let frames = sensors.iter().map(sensor);
        let noise = expand(&settings.wrench_noise, sensors.len());
        Ok(Self {
            sensors: frames.collect::<Result<_, _>>()?,
            noise: noise.into_iter().map(SVector::from).collect(),
            has_offsets: settings.wrench_offset,
        })
    }
}

impl MeasurementSource for WrenchSource {
    fn channels(&self) -> Vec<Channel> {
        wrench_channels("")
    }

    fn fill(
        &mut self,
        instant: &Instant,
        robot: &RobotState<'_>,
        targets: &mut [f64],
        entries: &mut [f64],
    ) -> Result<(), StateError> {
        let wrenches = self.sensors.iter().zip(&instant.wrenches);
        // (47): f_U and n_U are the sums over all fingers.
        let sum = wrenches.fold(Wrench::zero(), |sum, (sensor, wrench)| {
            sum + wrench.expressed_in(&sensor.pose_in_tool(robot))
        });
        set_wrench(targets, &sum);
        entries.copy_from_slice(robot.terms.as_slice());
        Ok(())
    }

    /// The covariance of the sum of independent sensors, in `Σ_U` and about its origin.
    fn known_noise(&self, robot: &RobotState<'_>) -> Option<DMatrix<f64>> {
        if self.noise.is_empty() {
            return None;
        }
        let mut covariance = SMatrix::<f64, 6, 6>::zeros();
        for (sensor, std_devs) in self.sensors.iter().zip(&self.noise) {
            let tool_from_sensor = sensor.pose_in_tool(robot);
            let root = columns_expressed_in(&SMatrix::from_diagonal(std_devs), &tool_from_sensor);
            covariance += root * root.transpose();
        }
        Some(DMatrix::from_column_slice(6, 6, covariance.as_slice()))
    }

    fn has_offsets(&self) -> bool {
        self.has_offsets
    }
}
