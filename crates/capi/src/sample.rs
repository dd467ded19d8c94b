//! Samples: what a robot measures at one time.

use tactid_identify::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tactid_identify::{BaseKind, BaseState, Manipulator, Sample, Wrench};

use crate::border::{self, Extensible};
use crate::status::{Failure, tactid_status};

/// What a robot measures at one time. Arrays of joints are in the order of the names that the
/// identifier was created with.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct tactid_sample {
    /// `sizeof(tactid_sample)`.
    pub size: usize,
    /// Time on one clock for all samples, s.
    pub time_s: f64,
    /// Number of joints in each array of joints: that of the names.
    pub joint_count: usize,
    /// Positions of the joints, rad, or m for a prismatic joint.
    pub position: *const f64,
    /// Velocities of the joints, rad/s or m/s. Default: differentiated from the positions of
    /// neighbouring samples.
    pub velocity: *const f64,
    /// Efforts of the joint motors, N m or N, gravity and payload included. Only methods with
    /// efforts use them.
    pub effort: *const f64,
    /// Number of wrenches: that of the sensors.
    pub wrench_count: usize,
    /// Wrench of each sensor in its frame and about its origin: three forces, N, then three
    /// moments, N m. It acts on the payload unless the option `wrench_acts_on` says otherwise.
    pub wrenches: *const f64,
    /// State of a floating base in the inertial frame, 13 numbers: position, m; orientation as a
    /// quaternion x, y, z, w, from the base to the inertial frame; velocity of its origin, m/s;
    /// angular velocity, rad/s. Null for a fixed base.
    pub base: *const f64,
    /// Acceleration of the base's origin without gravity, m/s², and angular acceleration, rad/s²,
    /// in the inertial frame: six numbers. Default: differentiated from the velocities of
    /// neighbouring samples.
    pub base_acceleration: *const f64,
}

// SAFETY: it is repr(C), begins with its size, and has numbers and pointers alone.
unsafe impl Extensible for tactid_sample {}

/// Arrays of samples in the robot's order of joints, allocated once.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    base: BaseKind,
    /// Number of joints in the caller's order.
    named: usize,
    /// Place of each joint of the robot in the caller's order; `None` for one that stays at zero.
    order: Vec<Option<usize>>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
    wrenches: Vec<Wrench>,
}

impl Samples {
    /// Prepares for samples with the joints of these names. Joints that move neither tip nor
    /// sensors may lack one, and stay at zero; names that the robot does not have are allowed, and
    /// their joints are ignored.
    ///
    /// # Errors
    /// Returns [`tactid_status::InvalidRobot`] for a joint that lacks its name or has it twice.
    pub(crate) fn new(
        robot: &Manipulator,
        names: &[&str],
        tip: &str,
        sensors: &[&str],
        needs_all: bool,
    ) -> Result<Self, Failure> {
        let frames = std::iter::once(&tip)
            .chain(sensors)
            .map(|frame| robot.frame(frame));
        let frames = frames.collect::<Result<Vec<_>, _>>();
        let frames = frames.map_err(|error| Failure::robot(error.to_string()))?;
        let moves = |joint| needs_all || frames.iter().any(|&frame| robot.moves(joint, frame));
        let place = |(joint, name): (usize, &String)| {
            let mut places = (0..names.len()).filter(|&place| names[place] == name);
            match (places.next(), places.next()) {
                (Some(_), Some(_)) => Err(Failure::robot(format!(
                    "the joint names have `{name}` twice"
                ))),
                (None, _) if moves(joint) => Err(Failure::robot(format!(
                    "the joint names lack `{name}`, which moves the tip or a sensor; the robot's joints are {}",
                    robot.joint_names().join(", ")
                ))),
                (place, _) => Ok(place),
            }
        };
        let order = robot.joint_names().iter().enumerate().map(place);
        Ok(Self {
            base: robot.base_kind(),
            named: names.len(),
            order: order.collect::<Result<_, _>>()?,
            position: vec![0.0; robot.dof()],
            velocity: vec![0.0; robot.dof()],
            effort: vec![0.0; robot.dof()],
            wrenches: vec![Wrench::zero(); sensors.len()],
        })
    }

    /// Returns a sample of the caller in the robot's order.
    ///
    /// # Safety
    /// Each array of the sample is null or has as many numbers as its member documents.
    pub(crate) unsafe fn fill(
        &mut self,
        from: &tactid_sample,
    ) -> Result<Sample<'_>, tactid_status> {
        if from.joint_count != self.named || from.wrench_count != self.wrenches.len() {
            return Err(tactid_status::WrongCount);
        }
        // SAFETY: the caller's promise.
        let base = unsafe { self.base_state(from) }?;
        // SAFETY: the caller's promise.
        let position = unsafe { border::slice(from.position, self.named) }?;
        // SAFETY: the caller's promise.
        let velocity = unsafe { optional_slice(from.velocity, self.named) };
        // SAFETY: the caller's promise.
        let effort = unsafe { optional_slice(from.effort, self.named) };
        // SAFETY: the caller's promise; counts are of arrays that exist, so that the product is one
        // of an array, too.
        let wrenches =
            unsafe { border::slice(from.wrenches.cast::<[f64; 6]>(), from.wrench_count) }?;
        for (wrench, [fx, fy, fz, nx, ny, nz]) in self.wrenches.iter_mut().zip(wrenches) {
            wrench.force = Vector3::new(*fx, *fy, *fz);
            wrench.moment = Vector3::new(*nx, *ny, *nz);
        }
        let order = &self.order;
        Ok(Sample {
            time_s: from.time_s,
            base,
            joint_position: ordered(order, Some(position), &mut self.position),
            joint_velocity: ordered(order, velocity, &mut self.velocity),
            joint_effort: ordered(order, effort, &mut self.effort),
            wrenches: &self.wrenches,
        })
    }

    /// Returns the state of the base.
    ///
    /// # Safety
    /// As for [`fill`](Self::fill).
    unsafe fn base_state(&self, from: &tactid_sample) -> Result<BaseState, tactid_status> {
        // SAFETY: the caller's promise.
        let state = unsafe { border::optional::<13>(from.base) };
        // SAFETY: the caller's promise.
        let acceleration = unsafe { border::optional::<6>(from.base_acceleration) };
        match (self.base, state) {
            (BaseKind::Fixed, None) if acceleration.is_none() => Ok(BaseState::fixed()),
            (BaseKind::Fixed, _) => Err(tactid_status::WrongCount),
            (BaseKind::Floating, None) => Err(tactid_status::NullPointer),
            (BaseKind::Floating, Some([x, y, z, qx, qy, qz, qw, vx, vy, vz, wx, wy, wz])) => {
                let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
                let halves = acceleration
                    .map(|[x, y, z, rx, ry, rz]| (Vector3::new(x, y, z), Vector3::new(rx, ry, rz)));
                Ok(BaseState {
                    pose: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
                    velocity: Vector3::new(vx, vy, vz),
                    angular_velocity: Vector3::new(wx, wy, wz),
                    acceleration: halves.map(|(linear, _)| linear),
                    angular_acceleration: halves.map(|(_, angular)| angular),
                })
            }
        }
    }
}

/// Returns an array that may be absent.
///
/// # Safety
/// The pointer is null, or points to `count` numbers.
unsafe fn optional_slice<'a>(pointer: *const f64, count: usize) -> Option<&'a [f64]> {
    // SAFETY: the caller's promise. Null is the only error.
    unsafe { border::slice(pointer, count) }.ok()
}

/// Copies numbers of the caller's joints into the robot's order; without numbers, the result is
/// empty.
fn ordered<'a>(order: &[Option<usize>], from: Option<&[f64]>, into: &'a mut [f64]) -> &'a [f64] {
    let Some(from) = from else { return &[] };
    for (number, place) in into.iter_mut().zip(order) {
        *number = place.map_or(0.0, |place| from[place]);
    }
    into
}
