//! The wrenches of the fingers or of a wrist sensor, (47): the payload alone.

use nalgebra::{DMatrix, Matrix6, SMatrix, SVector, UnitQuaternion, Vector6};
use tactid_dynamics::{FrameId, Manipulator, StateError, Workspace, Wrench};

use super::regressor::{MotionTerms, WrenchRegressor, columns_expressed_in, set_wrench};
use super::source::{MeasurementSource, RobotState};
use crate::IdentifyError;
use crate::equations::channels::{Channel, wrench_channels};
use crate::equations::equation::Row;
use crate::equations::instant::Instant;
use crate::equations::settings::{EquationSettings, SubtractedLoad, expand};

/// The sum of the wrenches that all sensors exert on the payload.
#[derive(Clone, Debug)]
pub(crate) struct WrenchSource {
    /// Frames in which the wrenches are measured.
    sensors: Vec<FrameId>,
    /// Standard deviations of one sample of each sensor, in its frame: forces in N, moments in N m.
    /// Empty where they are unknown.
    noise: Vec<SVector<f64, 6>>,
    has_offsets: bool,
    /// Axes of the wrenches; `None` for those of the sensors.
    axes: Option<Axes>,
    subtracted: Option<SubtractedLoad>,
    /// Projection of a wrench in the tool frame onto the measured channels; `None` where all are.
    projection: Option<Matrix6<f64>>,
}

/// Axes of wrenches, other than those of the sensors.
#[derive(Clone, Copy, Debug)]
enum Axes {
    Link(FrameId),
    World,
}

impl Axes {
    /// Returns the rotation from these axes to those of a sensor.
    fn to_sensor(self, workspace: &Workspace, sensor: FrameId) -> UnitQuaternion<f64> {
        match self {
            Self::Link(link) => workspace.relative_pose(sensor, link).rotation,
            Self::World => workspace.pose(sensor).rotation.inverse(),
        }
    }
}

impl WrenchSource {
    /// Creates the source for the links in which the wrenches are measured. `projection` is that of
    /// a wrench in the tool frame onto the measured channels.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Model`] if the robot does not have one of the links.
    pub(crate) fn new(
        robot: &Manipulator,
        sensors: &[&str],
        settings: &EquationSettings,
        projection: Option<Matrix6<f64>>,
    ) -> Result<Self, IdentifyError> {
        let frames = sensors.iter().map(|name| robot.frame(name));
        let noise = expand(&settings.wrench_noise, sensors.len());
        let axes = match settings.axes_link(robot)? {
            Some(link) => Some(Axes::Link(link)),
            None => settings.wrench_axes.as_ref().map(|_| Axes::World),
        };
        Ok(Self {
            axes,
            sensors: frames.collect::<Result<_, _>>()?,
            noise: noise.into_iter().map(SVector::from).collect(),
            has_offsets: settings.wrench_offset,
            subtracted: settings.subtracted,
            projection,
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
        let (workspace, tool) = (robot.workspace, robot.tool);
        let sum = wrenches.fold(Wrench::zero(), |sum, (&sensor, wrench)| {
            let mut wrench = *wrench;
            if let Some(axes) = self.axes {
                let rotation = axes.to_sensor(workspace, sensor);
                wrench.force = rotation * wrench.force;
                wrench.moment = rotation * wrench.moment;
            }
            sum + workspace.wrench_in_frame(tool, sensor, &wrench)
        });
        set_wrench(targets, &sum);
        if let Some(load) = &self.subtracted {
            let subtracted = WrenchRegressor::new(&robot.terms).load(load);
            for (target, subtracted) in targets.iter_mut().zip(&subtracted) {
                *target += subtracted;
            }
        }
        if let Some(projection) = &self.projection {
            let measured = projection * Vector6::from_column_slice(targets);
            targets.copy_from_slice(measured.as_slice());
        }
        entries.copy_from_slice(robot.terms.as_slice());
        Ok(())
    }

    fn set_rows(&self, entries: &[f64], rows: &mut [Row]) {
        WrenchRegressor::new(&MotionTerms::from_column_slice(entries)).set_rows(rows);
        if let Some(projection) = &self.projection {
            let whole = SMatrix::<f64, 6, 10>::from_fn(|k, column| rows[k].regressor[column]);
            let gravity = SMatrix::<f64, 6, 4>::from_fn(|k, column| rows[k].gravity[column]);
            let (measured, of_gravity) = (projection * whole, projection * gravity);
            for (k, row) in rows.iter_mut().enumerate() {
                row.regressor = measured.row(k).transpose();
                row.gravity = of_gravity.row(k).transpose();
            }
        }
    }

    /// The covariance of the sum of independent sensors, in `Σ_U` and about its origin.
    fn known_noise(&self, robot: &RobotState<'_>) -> Option<DMatrix<f64>> {
        if self.noise.is_empty() {
            return None;
        }
        let mut covariance = SMatrix::<f64, 6, 6>::zeros();
        for (&sensor, std_devs) in self.sensors.iter().zip(&self.noise) {
            let mut tool_from_axes = robot.workspace.relative_pose(robot.tool, sensor);
            if let Some(axes) = self.axes {
                tool_from_axes.rotation *= axes.to_sensor(robot.workspace, sensor);
            }
            let root = columns_expressed_in(&SMatrix::from_diagonal(std_devs), &tool_from_axes);
            covariance += root * root.transpose();
        }
        Some(DMatrix::from_column_slice(6, 6, covariance.as_slice()))
    }

    fn has_offsets(&self) -> bool {
        self.has_offsets
    }
}
