//! Events: what one message or one sample measured.

use nalgebra::Vector3;
use tactid_dynamics::{BaseAcceleration, Wrench};
use tactid_identify::BaseState;

use crate::fault::{FaultKind, check};

/// Names of the quantities of [`JointValues`], as [`Arrays`](crate::Arrays) has them.
const JOINT_POSITION: &str = "q";
pub(crate) const JOINT_VELOCITY: &str = "qd";
const JOINT_EFFORT: &str = "effort";

/// Values of some joints at one time. Velocity and effort are empty where they are not known.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct JointValues {
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) effort: Vec<f64>,
}

impl JointValues {
    /// Checks that the values can be used, and applies `gains` to the efforts. `places` are the
    /// indices of the joints among those of the robot, for which `names` and `gains` have an entry
    /// each.
    ///
    /// Velocities that are not finite are removed, with a fault: they follow from the positions.
    ///
    /// # Errors
    /// Returns the name of the quantity with the fault of another value that is not finite or out
    /// of range.
    pub(crate) fn check(
        mut self,
        places: &[usize],
        names: &[String],
        gains: &[f64],
    ) -> Result<(Self, Option<FaultKind>), (&'static str, FaultKind)> {
        check(&self.position).map_err(|kind| (JOINT_POSITION, kind))?;
        let mut fault = None;
        if self.velocity.iter().any(|velocity| !velocity.is_finite()) {
            self.velocity.clear();
            fault = Some(FaultKind::VelocityNotFinite);
        }
        check(&self.velocity).map_err(|kind| (JOINT_VELOCITY, kind))?;
        if let Some(at) = self.effort.iter().position(|effort| !effort.is_finite()) {
            let joint = names[places[at]].clone();
            return Err((JOINT_EFFORT, FaultKind::EffortNotFinite { joint }));
        }
        check(&self.effort).map_err(|kind| (JOINT_EFFORT, kind))?;
        for (effort, &place) in self.effort.iter_mut().zip(places) {
            *effort *= gains[place];
        }
        Ok((self, fault))
    }
}

/// Measurement of an inertial unit, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpecificForce {
    /// `p̈ - g`, m/s².
    pub(crate) linear: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub(crate) angular_velocity: Vector3<f64>,
}

/// A measurement with its time on the recording's clock.
#[derive(Clone, Debug)]
pub(crate) struct Event {
    pub(crate) time_s: f64,
    pub(crate) measured: Measured,
}

/// A measurement of one stream.
#[derive(Clone, Debug)]
pub(crate) enum Measured {
    /// Joints of the publisher to whose times all streams are aligned, in the robot's order.
    /// Entries of the joints of other publishers are filled in by the alignment.
    Joints(JointValues),
    /// Joints of another publisher, by its index in [`Streams::more_joints`].
    MoreJoints(usize, JointValues),
    /// State of the base, in a box because all events have the size of the largest.
    Base(Box<BaseState>),
    /// Acceleration of the base, expressed in its own frame.
    Acceleration(BaseAcceleration),
    /// Wrench on the payload by the sensor of this index, in the sensor's frame.
    Wrench(usize, Wrench),
    /// Measurement of an inertial unit on the base.
    BaseImu(SpecificForce),
    /// Joints of the unloaded recording, on this recording's clock.
    Unloaded(JointValues),
}

/// Which streams there are to align.
#[derive(Clone, Debug, Default)]
pub(crate) struct Streams {
    /// For each further publisher of joints: indices of its joints among the robot's.
    pub(crate) more_joints: Vec<Vec<usize>>,
    pub(crate) base: bool,
    pub(crate) acceleration: bool,
    /// Gravitational acceleration, m/s², where there is an inertial unit on the base.
    pub(crate) base_imu: Option<Vector3<f64>>,
    /// Number of wrench sensors.
    pub(crate) wrenches: usize,
    pub(crate) unloaded: bool,
    /// Whether the velocities of joints are not measured, though they are given.
    pub(crate) without_velocities: bool,
    /// Which of them are averaged.
    pub(crate) averaging: Averaging,
}

/// Returns the indices of the joints of the first publisher among the joints of a robot, `count`:
/// those that no further publisher measures.
pub(crate) fn first_joints(count: usize, more_joints: &[Vec<usize>]) -> Vec<usize> {
    let is_first = |joint: &usize| !more_joints.iter().flatten().any(|other| other == joint);
    (0..count).filter(is_first).collect()
}

/// For each stream that is faster than the joints the period of the joints, s, over which it is
/// averaged.
#[derive(Clone, Debug, Default)]
pub(crate) struct Averaging {
    pub(super) more_joints: Vec<Option<f64>>,
    pub(super) base: Option<f64>,
    pub(super) acceleration: Option<f64>,
    pub(super) base_imu: Option<f64>,
    pub(super) wrenches: Vec<Option<f64>>,
    /// Standard deviation of white noise in an average of each wrench, relative to that of a
    /// sample.
    pub(super) noise_ratios: Vec<f64>,
    /// Period of the slowest wrench where the joints are faster, s; else zero.
    pub(super) slower_wrench_s: f64,
}
