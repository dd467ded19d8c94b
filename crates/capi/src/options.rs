//! Options of an identifier, and what they mean for the crates below.

use std::ffi::c_char;

use tactid_identify::dynamics::InertialParameters;
use tactid_identify::nalgebra::Vector3;
use tactid_identify::{
    ActsOn, BaseKind, EffortContent, EquationSettings, Identifier, KnownTool, Method,
    OnlineSettings, SubtractedLoad, WrenchFrame, body_of_values,
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

/// Wrenches are those on the payload: the default.
pub const TACTID_ACTS_ON_PAYLOAD: u32 = 0;
/// Wrenches are those on the sensor, which most force-torque sensors report.
pub const TACTID_ACTS_ON_SENSOR: u32 = 1;

/// Nothing but a constant was subtracted from the wrenches: the default.
pub const TACTID_WRENCH_RAW: u32 = 0;
/// The weight of the configured payload was subtracted, but not the forces that accelerate it.
pub const TACTID_WRENCH_WITHOUT_WEIGHT: u32 = 1;
/// The weight of the configured payload and the forces that accelerate it were subtracted.
pub const TACTID_WRENCH_CONTACT: u32 = 2;

/// How samples are measured and used. Zero in any member but `size` means its default. Names are
/// those of the options of tactid in Python where both have one, and so are those in findings.
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
    pub efforts_are: u32,
    /// Name of the link along whose axes the wrenches are expressed, or `world`. Default: the axes
    /// of each sensor's own frame. Moments are about the origin of the sensor's frame in any case.
    pub wrench_axes: *const c_char,
    /// Standard deviations of the white noise of one sample of each wrench sensor: three forces, N,
    /// three moments, N m. Default: estimated from the data.
    pub wrench_noise: *const f64,
    /// Standard deviation of the white noise of one sample of each joint effort, N m or N. Default:
    /// estimated from the data.
    pub effort_noise: f64,
    /// The payload that is configured in the controller, which subtracts it from the wrenches as
    /// `wrench_is` says, in the tip's frame: mass, kg; centre of mass, m; inertia about it, kg m²
    /// (xx, xy, xz, yy, yz, zz). Default: none.
    pub configured_payload: *const f64,
    /// What was subtracted from the wrenches: one of `TACTID_WRENCH_...`. All but the default need
    /// `configured_payload`.
    pub wrench_is: u32,
    /// Channels of the only wrench sensor that measure nothing: bit k is channel k of three forces,
    /// then three moments.
    pub unmeasured: u32,
    /// Name of the link about whose origin the moments of load and contact are; it does not move
    /// relative to the tip. Default: the tip.
    pub contact_point: *const c_char,
    /// Name of the link along whose axes load and contact are expressed, or `world`; it does not
    /// move relative to the tip or to the ground. Default: the link of `contact_point`.
    pub contact_axes: *const c_char,
    /// Body on which the wrenches of the samples act: one of `TACTID_ACTS_ON_...`. Wrenches that
    /// calls return have the sign of those of the samples.
    pub wrench_acts_on: u32,
    /// Delay of the wrenches relative to the joints of the same sample, s, between -1 and 1: it is
    /// subtracted from their times, and estimates lag the samples by as much. Default: 0.
    pub delay_s: f64,
    /// A known body that the measured load contains besides the payload, as a gripper beyond the
    /// sensor, in the tip's frame: ten numbers as those of `configured_payload`. Default: none.
    pub known_tool: *const f64,
    /// Standard deviations of the ten numbers of `known_tool`, which are part of those of the
    /// payload. Default: it is exact.
    pub known_tool_std_devs: *const f64,
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
        let point = unsafe { border::optional_text(self.contact_point) }?;
        // SAFETY: the caller's promise.
        let axes = unsafe { border::optional_text(self.contact_axes) }?;
        let frame = identifier.wrench_frame(point.unwrap_or(tip), axes);
        frame.map_err(|error| {
            let mut failure = Failure::from(error);
            let members = [("`point`", "`contact_point`"), ("`axes`", "`contact_axes`")];
            for (argument, member) in members {
                failure.text = failure.text.replace(argument, member);
            }
            failure
        })
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
        let subtracted = unsafe { self.subtracted() }?;
        // SAFETY: the caller's promise.
        let wrench_noise = unsafe { border::optional::<6>(self.wrench_noise) };
        // SAFETY: the caller's promise.
        let wrench_axes = unsafe { border::optional_text(self.wrench_axes) }?;
        Ok(EquationSettings {
            method: method(self.method)?,
            gravity: gravity.map(Vector3::from),
            cutoff_hz: or_default(self.cutoff_hz, defaults.cutoff_hz),
            max_gap_s: or_default(self.max_gap_s, defaults.max_gap_s),
            effort_content: effort_content(self.efforts_are)?,
            wrench_axes: wrench_axes.map(str::to_owned),
            wrench_offset: self.wrench_offset != 0,
            subtracted,
            wrench_noise: wrench_noise.into_iter().collect(),
            effort_noise: (self.effort_noise != 0.0)
                .then_some(self.effort_noise)
                .into_iter()
                .collect(),
            unmeasured: std::array::from_fn(|channel| self.unmeasured & (1 << channel) != 0),
            ..defaults
        })
    }

    /// Returns what the identifier knows beside the settings of the equations.
    ///
    /// # Safety
    /// As for [`settings`](Self::settings).
    pub(crate) unsafe fn online_settings(&self) -> Result<OnlineSettings, Failure> {
        // SAFETY: the caller's promise.
        let tool = unsafe { numbers::<10>(self.known_tool, "known_tool") }?;
        // SAFETY: the caller's promise.
        let std_devs = unsafe { numbers::<10>(self.known_tool_std_devs, "known_tool_std_devs") }?;
        let known_tool = tool.map(|values| match std_devs {
            Some(std_devs) => KnownTool::with_std_devs(body_of_values(&values), &std_devs),
            None => KnownTool::from(body_of_values(&values)),
        });
        Ok(OnlineSettings {
            known_tool,
            wrench_acts_on: acts_on(self.wrench_acts_on)?,
            delay_s: self.delay_s,
        })
    }

    /// Returns what the controller has subtracted from the wrenches.
    ///
    /// # Safety
    /// As for [`settings`](Self::settings).
    unsafe fn subtracted(&self) -> Result<Option<SubtractedLoad>, Failure> {
        // SAFETY: the caller's promise.
        let configured = unsafe { numbers::<10>(self.configured_payload, "configured_payload") }?;
        let with_inertia = match self.wrench_is {
            TACTID_WRENCH_RAW => None,
            TACTID_WRENCH_WITHOUT_WEIGHT => Some(false),
            TACTID_WRENCH_CONTACT => Some(true),
            _ => {
                return Err(Failure::option(
                    "`wrench_is` is none of `TACTID_WRENCH_...`",
                ));
            }
        };
        match (configured, with_inertia) {
            (None, None) => Ok(None),
            (Some(values), Some(with_inertia)) => Ok(Some(SubtractedLoad {
                body: InertialParameters::from(body_of_values(&values)),
                with_inertia,
            })),
            (Some(_), None) => Err(Failure::option(
                "`configured_payload` is what the controller has subtracted from the wrenches, but `wrench_is` says that \
                 they are raw",
            )),
            (None, Some(_)) => Err(Failure::option(
                "`configured_payload` is missing: `wrench_is` says that the controller has subtracted it from the wrenches",
            )),
        }
    }
}

/// Returns an array of known length that may be absent, and whose numbers are finite.
///
/// # Safety
/// The pointer is null, or points to `N` numbers.
unsafe fn numbers<const N: usize>(
    pointer: *const f64,
    option: &str,
) -> Result<Option<[f64; N]>, Failure> {
    // SAFETY: the caller's promise.
    let numbers = unsafe { border::optional::<N>(pointer) };
    if numbers.is_some_and(|numbers| !numbers.iter().all(|number| number.is_finite())) {
        let what = format!("`{option}` has a number that is not finite");
        return Err(Failure::option(&what));
    }
    Ok(numbers)
}

fn acts_on(number: u32) -> Result<ActsOn, Failure> {
    match number {
        TACTID_ACTS_ON_PAYLOAD => Ok(ActsOn::Payload),
        TACTID_ACTS_ON_SENSOR => Ok(ActsOn::Sensor),
        _ => Err(Failure::option(
            "`wrench_acts_on` is none of `TACTID_ACTS_ON_...`",
        )),
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
                "`efforts_are` is none of `TACTID_EFFORT_...`",
            ));
        }
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// Returns the settings of options whose pointers are valid.
    fn settings(options: &tactid_options) -> EquationSettings {
        // SAFETY: the pointers of the tests are null, or point to arrays of the test.
        unsafe { options.settings() }.unwrap()
    }

    #[test]
    fn options_of_zeros_are_the_defaults() {
        let options = tactid_options::default();
        assert_eq!(settings(&options), EquationSettings::default());
        // SAFETY: all pointers are null.
        let online = unsafe { options.online_settings() }.unwrap();
        assert_eq!(online, OnlineSettings::default());
    }

    #[test]
    fn every_option_has_its_setting() {
        let body = [2.0, 0.01, 0.02, 0.03, 0.004, 0.0, 0.0, 0.005, 0.0, 0.006];
        let (gravity, noise, std_devs) = ([0.0, 9.81, 0.0], [0.3; 6], [0.01; 10]);
        let options = tactid_options {
            method: TACTID_METHOD_EFFORT,
            gravity: gravity.as_ptr(),
            cutoff_hz: 5.0,
            max_gap_s: 0.2,
            wrench_offset: 1,
            efforts_are: TACTID_EFFORT_EXTERNAL,
            wrench_axes: c"base".as_ptr(),
            wrench_noise: noise.as_ptr(),
            effort_noise: 0.5,
            configured_payload: body.as_ptr(),
            wrench_is: TACTID_WRENCH_CONTACT,
            unmeasured: 0b10_0100,
            wrench_acts_on: TACTID_ACTS_ON_SENSOR,
            delay_s: 0.012,
            known_tool: body.as_ptr(),
            known_tool_std_devs: std_devs.as_ptr(),
            ..tactid_options::default()
        };
        let payload = body_of_values(&body);
        let expected = EquationSettings {
            method: Method::Effort,
            gravity: Some(Vector3::from(gravity)),
            cutoff_hz: 5.0,
            max_gap_s: 0.2,
            wrench_offset: true,
            effort_content: EffortContent::External,
            wrench_axes: Some("base".to_owned()),
            wrench_noise: vec![noise],
            effort_noise: vec![0.5],
            subtracted: Some(SubtractedLoad {
                body: InertialParameters::from(payload),
                with_inertia: true,
            }),
            unmeasured: [false, false, true, false, false, true],
            ..EquationSettings::default()
        };
        assert_eq!(settings(&options), expected);
        // SAFETY: as for `settings`.
        let online = unsafe { options.online_settings() }.unwrap();
        let expected = OnlineSettings {
            known_tool: Some(KnownTool::with_std_devs(payload, &std_devs)),
            wrench_acts_on: ActsOn::Sensor,
            delay_s: 0.012,
        };
        assert_eq!(online, expected);
    }
}
