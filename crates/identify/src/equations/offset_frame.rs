//! The frame in which a constant offset of the wrenches is stated, and in which channels may be
//! missing.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6, Vector6};
use tactid_dynamics::{Manipulator, Wrench};

use super::channels::WRENCH;
use super::equation::Row;
use super::sources::columns_expressed_in;
use crate::IdentifyError;
use crate::result::WrenchOffset;

/// The frame in which a constant offset of the wrenches is stated: that of the sensor, where there
/// is one sensor that does not move relative to the tool; otherwise the tool frame, in which the
/// wrenches are summed.
#[derive(Clone, Debug)]
pub struct OffsetFrame {
    name: Arc<str>,
    /// Whether it is the frame of the only sensor.
    is_of_sensor: bool,
    /// Maps a wrench in the tool frame, force then moment, to this frame.
    map: Matrix6<f64>,
    /// Maps a wrench in this frame to the tool frame.
    inverse: Matrix6<f64>,
    /// One for each channel in this frame that is measured, zero for others.
    measured: Vector6<f64>,
}

impl OffsetFrame {
    /// Finds the frame for wrenches that are measured in the links `sensors` and summed in the link
    /// `tool`. Channels that are `unmeasured` are those in this frame.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Model`] if the robot does not have one of the links.
    pub(crate) fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        unmeasured: &[bool; 6],
    ) -> Result<Self, IdentifyError> {
        let tool_frame = robot.frame(tool)?;
        let of_sensor = match sensors {
            [sensor] => {
                let sensor_from_tool = robot.fixed_transform(robot.frame(sensor)?, tool_frame);
                sensor_from_tool.map(|transform| (*sensor, transform))
            }
            _ => None,
        };
        let (name, frame_from_tool) = of_sensor.unwrap_or((tool, Isometry3::identity()));
        Ok(Self {
            name: name.into(),
            is_of_sensor: of_sensor.is_some(),
            map: columns_expressed_in(&Matrix6::identity(), &frame_from_tool),
            inverse: columns_expressed_in(&Matrix6::identity(), &frame_from_tool.inverse()),
            measured: Vector6::from_fn(|k, _| f64::from(u8::from(!unmeasured[k]))),
        })
    }

    /// Name of the frame.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Whether it is the frame of the only sensor, which does not move relative to the tool.
    pub fn is_of_sensor(&self) -> bool {
        self.is_of_sensor
    }

    /// The matrix that maps a wrench in the tool frame, force then moment, to this frame.
    pub fn map(&self) -> &Matrix6<f64> {
        &self.map
    }

    /// One for each channel that is measured, zero for others.
    pub fn measured(&self) -> &Vector6<f64> {
        &self.measured
    }

    /// Returns the projection of a wrench in the tool frame onto the measured channels; `None`
    /// where all is measured.
    pub fn projection(&self) -> Option<Matrix6<f64>> {
        let is_whole = self.measured.iter().all(|channel| *channel == 1.0);
        let measured = Matrix6::from_diagonal(&self.measured);
        (!is_whole).then(|| self.inverse * measured * self.map)
    }

    /// Returns the rows of a wrench in the tool frame, force then moment, in this frame: zero for
    /// channels that are not measured.
    pub fn mapped_rows(&self, rows: &[Row; WRENCH]) -> [Row; WRENCH] {
        std::array::from_fn(|channel| {
            let mut mapped = Row::zero();
            for (row, factor) in rows.iter().zip(&self.map.row(channel)) {
                mapped.add(row, self.measured[channel] * *factor);
            }
            mapped
        })
    }

    /// Returns the offset with these values, which are expressed in this frame.
    pub fn offset(&self, values: &Vector6<f64>, std_devs: Option<[f64; 6]>) -> WrenchOffset {
        WrenchOffset {
            frame: self.name.clone(),
            wrench: Wrench {
                force: values.fixed_rows::<3>(0).into_owned(),
                moment: values.fixed_rows::<3>(3).into_owned(),
            },
            std_devs,
        }
    }
}
