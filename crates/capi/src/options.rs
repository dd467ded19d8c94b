//! Options of an identifier, and what they mean for the crates below.

use std::ffi::c_char;

use tactid_identify::dynamics::InertialParameters;
use tactid_identify::nalgebra::Vector3;
use tactid_identify::{
    BaseKind, EffortContent, EquationSettings, Identifier, Method, SubtractedLoad, WrenchFrame,
    body_of_values,
};

use crate::border::{self, Extensible};
use crate::status::{Failure, tactid_status};

/// Wrenches alone: the default.
pub const TACTID_METHOD_TACTILE: u32 = 0;
/// Efforts of the joints alone.
pub const TACTID_METHOD_EFFORT: u32 = 1;
/// The momentum of a floating base, from its motion alone.
pub const TACTID_METHOD_JOINT_SENSING: u32 = 2;
/// All measurements but the efforts.
pub const TACTID_METHOD_COMBINED: u32 = 3;
/// All measurements.
pub const TACTID_METHOD_COMBINED_WITH_EFFORT: u32 = 4;

/// Efforts contain all that moves and holds arm and payload: the default.
pub const TACTID_EFFORT_MEASURED: u32 = 0;
/// Efforts contain all but what holds the arm itself against gravity.
pub const TACTID_EFFORT_WITHOUT_GRAVITY: u32 = 1;
/// Efforts contain what the payload needs alone.
pub const TACTID_EFFORT_EXTERNAL: u32 = 2;

/// How samples are measured and used. Zero in any member but `size` means its default. Names are
/// those of the options of tactid in Python where both have one.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct tactid_options {
    /// `sizeof(tactid_options)`.
    pub size: usize,
    /// The measurements that the payload is identified from: one of `TACTID_METHOD_...`.
    pub method: u32,
    /// Nonzero: the base of the robot floats, and each sample has its state. Default: it is fixed
    /// to the ground.
    pub floating_base: u32,
    /// Names of the links in whose frames the wrenches are measured: `sensor_count` texts. Default:
    /// one sensor in the frame of the tip for the tactile method, none for others.
    pub sensors: *const *const c_char,
    /// Number of wrench sensors.
    pub sensor_count: usize,
    /// Gravitational acceleration in the inertial frame, m/s², pointing down: three numbers.
    /// Default: 9.81 along -z for a fixed base, none for a floating one.
    pub gravity: *const f64,
    /// Frequency at which the low-pass on both sides of the equations has lost 3 dB, Hz.
    /// Default: 10.
    pub cutoff_hz: f64,
    /// Longest time between two samples across which the motion is differentiated, s. Default: 0.1.
    pub max_gap_s: f64,
    /// Nonzero: the wrenches have an unknown constant offset, such as a sensor zero that was not
    /// set, which is estimated, too. Default: they have none.
    pub wrench_offset: u32,
    /// What efforts contain: one of `TACTID_EFFORT_...`.
    pub effort_content: u32,
    /// Name of the link along whose axes the wrenches are expressed, or `world`. Default: the axes
    /// of each sensor's own frame. Moments are about the origin of the sensor's frame in any case.
    pub wrench_axes: *const c_char,
    /// Standard deviations of the white noise of one sample of each wrench sensor: three forces, N,
    /// three moments, N m. Default: estimated from the data.
    pub wrench_noise: *const f64,
    /// Standard deviation of the white noise of one sample of each joint effort, N m or N. Default:
    /// estimated from the data.
    pub effort_noise: f64,
    /// The body whose load was subtracted from the wrenches before they are given here, as
    /// controllers do for their configured payload, in the tip's frame: mass, kg; centre of mass,
    /// m; inertia about it, kg m² (xx, xy, xz, yy, yz, zz). Default: none.
    pub subtracted_body: *const f64,
    /// Nonzero: the forces that accelerate that body were subtracted beside its weight.
    pub subtracted_with_inertia: u32,
    /// Channels of the only wrench sensor that measure nothing: bit k is channel k of three forces,
    /// then three moments.
    pub unmeasured: u32,
    /// Name of the link about whose origin the moments of load and contact are; it does not move
    /// relative to the tip. Default: the tip.
    pub wrench_point: *const c_char,
    /// Name of the link along whose axes load and contact are expressed, or `world`; it does not
    /// move relative to the tip or to the ground. Default: the link of `wrench_point`.
    pub wrench_point_axes: *const c_char,
}

// SAFETY: it is repr(C), begins with its size, and has numbers and pointers alone.
unsafe impl Extensible for tactid_options {}

impl Default for tactid_options {
    fn default() -> Self {
        border::zeroed()
    }
}

impl tactid_options {
    /// Returns whether the base of the robot moves.
    pub(crate) fn base_kind(&self) -> BaseKind {
        if self.floating_base == 0 {
            BaseKind::Fixed
        } else {
            BaseKind::Floating
        }
    }

    /// Returns the names of the sensors.
    ///
    /// # Safety
    /// `sensors` is null or has `sensor_count` texts, which last as long as the names are used.
    pub(crate) unsafe fn sensor_names<'a>(
        &self,
        tip: &'a str,
    ) -> Result<Vec<&'a str>, tactid_status> {
        if self.sensor_count == 0 {
            let is_tactile = self.method == TACTID_METHOD_TACTILE;
            return Ok(if is_tactile { vec![tip] } else { Vec::new() });
        }
        // SAFETY: the caller's promise.
        unsafe { border::texts(self.sensors, self.sensor_count) }
    }

    /// Returns the frame of load and contact.
    ///
    /// # Safety
    /// Each text is null or ends with zero.
    pub(crate) unsafe fn wrench_frame(
        &self,
        identifier: &Identifier,
        tip: &str,
    ) -> Result<WrenchFrame, Failure> {
        // SAFETY: the caller's promise.
        let point = unsafe { border::optional_text(self.wrench_point) }?;
        // SAFETY: the caller's promise.
        let axes = unsafe { border::optional_text(self.wrench_point_axes) }?;
        Ok(identifier.wrench_frame(point.unwrap_or(tip), axes)?)
    }

    /// Returns the settings of the equations.
    ///
    /// # Safety
    /// Each pointer is null, or points to the numbers or the text that its member documents.
    pub(crate) unsafe fn settings(&self) -> Result<EquationSettings, Failure> {
        let defaults = EquationSettings::default();
        let or_default = |given: f64, default| if given == 0.0 { default } else { given };
        // SAFETY: the caller's promise.
        let gravity = unsafe { border::optional::<3>(self.gravity) };
        // SAFETY: the caller's promise.
        let subtracted = unsafe { border::optional::<10>(self.subtracted_body) };
        // SAFETY: the caller's promise.
        let wrench_noise = unsafe { border::optional::<6>(self.wrench_noise) };
        // SAFETY: the caller's promise.
        let wrench_axes = unsafe { border::optional_text(self.wrench_axes) }?;
        if subtracted.is_some_and(|values| !values.iter().all(|value| value.is_finite())) {
            return Err(Failure::option(
                "`subtracted_body` has a number that is not finite",
            ));
        }
        Ok(EquationSettings {
            method: method(self.method)?,
            gravity: gravity.map(Vector3::from),
            cutoff_hz: or_default(self.cutoff_hz, defaults.cutoff_hz),
            max_gap_s: or_default(self.max_gap_s, defaults.max_gap_s),
            effort_content: effort_content(self.effort_content)?,
            wrench_axes: wrench_axes.map(str::to_owned),
            wrench_offset: self.wrench_offset != 0,
            subtracted: subtracted.map(|values| SubtractedLoad {
                body: InertialParameters::from(body_of_values(&values)),
                with_inertia: self.subtracted_with_inertia != 0,
            }),
            wrench_noise: wrench_noise.into_iter().collect(),
            effort_noise: (self.effort_noise != 0.0)
                .then_some(self.effort_noise)
                .into_iter()
                .collect(),
            unmeasured: std::array::from_fn(|channel| self.unmeasured & (1 << channel) != 0),
            ..defaults
        })
    }
}

fn method(number: u32) -> Result<Method, Failure> {
    Ok(match number {
        TACTID_METHOD_TACTILE => Method::Tactile,
        TACTID_METHOD_EFFORT => Method::Effort,
        TACTID_METHOD_JOINT_SENSING => Method::JointSensing,
        TACTID_METHOD_COMBINED => Method::Combined { effort: false },
        TACTID_METHOD_COMBINED_WITH_EFFORT => Method::Combined { effort: true },
        _ => return Err(Failure::option("`method` is none of `TACTID_METHOD_...`")),
    })
}

fn effort_content(number: u32) -> Result<EffortContent, Failure> {
    Ok(match number {
        TACTID_EFFORT_MEASURED => EffortContent::Measured,
        TACTID_EFFORT_WITHOUT_GRAVITY => EffortContent::WithoutGravity,
        TACTID_EFFORT_EXTERNAL => EffortContent::External,
        _ => {
            return Err(Failure::option(
                "`effort_content` is none of `TACTID_EFFORT_...`",
            ));
        }
    })
}
