//! Settings of the equation stream, and their checks against a robot.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::{BaseKind, FrameId, InertialParameters, Manipulator};

use super::sample::is_measurable;
use crate::{IdentifyError, Method, Range};

/// Range of gravity, in units of any size.
const MEASURABLE: Range = Range {
    contains: is_measurable,
    expected: "finite, and below 1e30",
};

/// Name of the axes of the inertial frame, unless a link has it.
pub const WORLD: &str = "world";

/// What measured joint efforts contain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EffortContent {
    /// All that moves and holds arm and payload: `measured`.
    #[default]
    Measured,
    /// All but what holds the arm itself against gravity: `without-gravity`.
    WithoutGravity,
    /// What the payload needs alone, without the arm's own efforts: `external`.
    External,
}

/// How samples become equations: the measurements that are used, gravity, the filter, and what is
/// known of the sensors. Every solver takes these settings; those of one solver are in a type of
/// its own.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationSettings {
    /// The measurements that the payload is identified from. Default: [`Method::Tactile`].
    pub method: Method,
    /// Gravitational acceleration in the inertial frame, m/s², pointing down. Default (`None`):
    /// zero for a floating base, 9.81 along -z for a fixed one.
    pub gravity: Option<Vector3<f64>>,
    /// Frequency at which the low-pass on both sides of the equations has lost 3 dB, Hz. The filter
    /// is a weighted mean over a window of 0.926 / `cutoff_hz` seconds. It filters equations and
    /// not measurements, so it adds no bias. Default: 10.
    pub cutoff_hz: f64,
    /// Longest time between two samples across which the motion is differentiated, s. A longer time
    /// is a gap. Default: 0.1.
    pub max_gap_s: f64,
    /// What the efforts of the samples contain. Used by [`Method::Effort`] and
    /// [`Method::Combined`]. Default: [`EffortContent::Measured`].
    pub effort_content: EffortContent,
    /// The link along whose axes the wrenches of all sensors are expressed, or [`WORLD`] for the
    /// axes of the inertial frame. Their moments are about the origin of the sensor's frame in any
    /// case. Default (`None`): the axes of each sensor's own frame.
    pub wrench_axes: Option<String>,
    /// Whether the sum of the sensors' wrenches has an unknown constant offset in the tool frame,
    /// such as a sensor zero that was not set. Least squares then has six more unknowns, so the
    /// motion must distinguish the payload from them: by its accelerations, or by turning the
    /// payload under gravity. Default: false.
    pub wrench_offset: bool,
    /// A known load that was subtracted from the sum of the wrenches before they were recorded, as
    /// controllers do for their configured payload; it is added again. Default: none.
    pub subtracted: Option<SubtractedLoad>,
    /// What else of the wrenches is unknown, for `BatchIdentifier` and
    /// [`Method::Tactile`] alone. Default: nothing.
    pub unknowns: Unknowns,
    /// Standard deviations of the white noise of one sample of each wrench sensor, in the sensor's
    /// frame: three forces in N, three moments in N m. One entry for all sensors, or one each.
    /// Empty (the default): the noise is estimated from the residuals. Known noise sets the
    /// relative weights of the channels in least squares, which improves the first second of an
    /// estimate. The reported standard deviations still follow the residuals.
    pub wrench_noise: Vec<[f64; 6]>,
    /// Time during which the wrenches of samples have noise in common, s, because they are
    /// interpolated between those of a slower sensor. The noise of the equations is that of
    /// differences between the samples of such times. Default: 0.
    pub shared_noise_s: f64,
    /// Channels of the sum of the wrenches that are not measured: three forces, then three moments.
    /// Their rows are left out. They are channels in the frame of the sensor where there is one,
    /// which does not move relative to the tool, and in the tool frame otherwise. Default: none.
    pub unmeasured: [bool; 6],
    /// Standard deviation of the white noise of one sample of each joint effort, N m or N: one
    /// entry for all joints, or one each in the robot's order. Empty (the default): the noise is
    /// estimated from the residuals.
    pub effort_noise: Vec<f64>,
    /// Standard deviation of the relative error of the gain of each joint effort, 0.05 for 5 %: one
    /// entry for all joints, or one each in the robot's order. The errors of different joints are
    /// independent. Empty (the default): the gains are exact. A gain is wrong at all times alike,
    /// so its error never averages out; `BatchIdentifier` adds it to the
    /// intervals, and [`Identifier`](crate::Identifier) does not use it.
    pub effort_gain_std_dev: Vec<f64>,
}

/// Unknowns that an identification from wrenches may have beside the parameters and an offset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unknowns {
    /// Whether the weight of an unknown body was subtracted from the wrenches, but not the forces
    /// that accelerate it: four unknowns, its mass and its first moments. The mass of the payload
    /// then follows from accelerations alone.
    pub weight: bool,
    /// Whether the direction of gravity is unknown: two unknowns. Its size is that of the given
    /// one.
    pub gravity: bool,
}

impl Unknowns {
    /// Returns whether there is any.
    #[must_use]
    pub fn any(self) -> bool {
        self.weight || self.gravity
    }

    /// Number of unknowns.
    pub fn count(self) -> usize {
        4 * usize::from(self.weight) + 2 * usize::from(self.gravity)
    }
}

/// A known load that was subtracted from the wrenches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubtractedLoad {
    /// The body whose load was subtracted, in the tool frame.
    pub body: InertialParameters,
    /// Whether the forces that accelerate the body were subtracted beside its weight.
    pub with_inertia: bool,
}

impl Default for EquationSettings {
    fn default() -> Self {
        Self {
            method: Method::Tactile,
            gravity: None,
            cutoff_hz: 10.0,
            max_gap_s: 0.1,
            effort_content: EffortContent::Measured,
            wrench_axes: None,
            wrench_offset: false,
            subtracted: None,
            unknowns: Unknowns::default(),
            wrench_noise: Vec::new(),
            shared_noise_s: 0.0,
            unmeasured: [false; 6],
            effort_noise: Vec::new(),
            effort_gain_std_dev: Vec::new(),
        }
    }
}

impl EquationSettings {
    /// Returns the gravitational acceleration for a kind of base, in the inertial frame, m/s².
    #[must_use]
    pub fn gravity_for(&self, base: BaseKind) -> Vector3<f64> {
        self.gravity.unwrap_or_else(|| base.default_gravity())
    }

    /// Checks the settings against a robot and its sensors.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] if a value is out of range, and [`IdentifyError::Method`]
    /// if this robot does not allow the method.
    pub(crate) fn check(&self, robot: &Manipulator, sensors: &[&str]) -> Result<(), IdentifyError> {
        self.check_method(robot, sensors)?;
        self.check_values(robot)?;
        self.check_noise(robot, sensors)
    }

    /// Checks that nothing is unknown that only a whole recording can show, as an
    /// [`Identifier`](crate::Identifier) does.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] with what is unknown.
    pub fn check_known(&self) -> Result<(), IdentifyError> {
        let (option, what) = match self.unknowns {
            Unknowns { gravity: true, .. } => (
                "gravity",
                "the direction of gravity: identify it from a recording first, and give the gravity that it shows",
            ),
            Unknowns { weight: true, .. } => (
                "wrench_is",
                "a subtracted weight that is unknown: identify the weight from a recording first, and give it \
                 as `configured_payload`",
            ),
            _ => return Ok(()),
        };
        Err(IdentifyError::Option {
            option,
            what: format!("`{option}`: only a whole recording shows {what}"),
        })
    }

    fn check_method(&self, robot: &Manipulator, sensors: &[&str]) -> Result<(), IdentifyError> {
        if self.unknowns.any() && self.method != Method::Tactile {
            let what = if self.unknowns.gravity {
                "a direction of gravity that is unknown"
            } else {
                "a weight that was subtracted from the wrenches and is unknown"
            };
            return Err(IdentifyError::Method(format!(
                "{what} needs the tactile method and not the {} method",
                self.method.name()
            )));
        }
        let is_fixed = robot.base_kind() == BaseKind::Fixed;
        match self.method {
            Method::Tactile if sensors.is_empty() => Err(no_wrench()),
            Method::Combined { effort: false } if sensors.is_empty() && is_fixed => {
                Err(no_wrench())
            }
            Method::JointSensing if is_fixed => Err(IdentifyError::Method(
                "the joint-sensing method needs a free-floating base, because a fixed base exchanges momentum with the \
                 ground: use the tactile or the effort method, or give the motion of the base if it is not fixed"
                    .to_owned(),
            )),
            // The forces on the base contain gravity.
            Method::Combined { effort: true }
                if !is_fixed
                    && self.effort_content == EffortContent::WithoutGravity
                    && self.gravity_for(robot.base_kind()) != Vector3::zeros() =>
            {
                Err(IdentifyError::Method(
                    "the combined method of a floating base under gravity needs efforts with gravity: use another \
                     method"
                        .to_owned(),
                ))
            }
            _ => Ok(()),
        }
    }

    /// Returns the link along whose axes the wrenches are expressed; `None` for those of the
    /// sensors or of the inertial frame.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Model`] if the robot does not have it.
    pub(crate) fn axes_link(&self, robot: &Manipulator) -> Result<Option<FrameId>, IdentifyError> {
        match self.wrench_axes.as_deref() {
            None => Ok(None),
            Some(WORLD) if robot.frame(WORLD).is_err() => Ok(None),
            Some(link) => Ok(Some(robot.frame(link)?)),
        }
    }

    fn check_values(&self, robot: &Manipulator) -> Result<(), IdentifyError> {
        Range::CUTOFF_HZ.check("cutoff_hz", &[self.cutoff_hz])?;
        Range::GAP_S.check("max_gap_s", &[self.max_gap_s])?;
        MEASURABLE.check("gravity", self.gravity_for(robot.base_kind()).as_slice())
    }

    fn check_noise(&self, robot: &Manipulator, sensors: &[&str]) -> Result<(), IdentifyError> {
        let (wrench, effort) = (self.wrench_noise.as_flattened(), &self.effort_noise);
        let of_gain = &self.effort_gain_std_dev;
        check_count(
            "wrench_noise",
            self.wrench_noise.len(),
            "sensors",
            sensors.len(),
        )?;
        check_count("effort_noise", effort.len(), "joints", robot.dof())?;
        check_count("effort_gain_std_dev", of_gain.len(), "joints", robot.dof())?;
        Range::NOISE_STD_DEV.check("wrench_noise", wrench)?;
        Range::NOISE_STD_DEV.check("effort_noise", effort)?;
        Range::GAIN_STD_DEV.check("effort_gain_std_dev", of_gain)
    }
}

fn no_wrench() -> IdentifyError {
    IdentifyError::Method(
        "the method needs at least one wrench: name a sensor, or use the joint-sensing or the effort method".to_owned(),
    )
}

/// Returns a setting that is given once for all, once for each, or not at all, for each of `count`:
/// `count` entries, or none.
pub(crate) fn expand<T: Clone>(given: &[T], count: usize) -> Vec<T> {
    let count = if given.is_empty() { 0 } else { count };
    given.iter().cloned().cycle().take(count).collect()
}

/// Checks that standard deviations are given once for all, once for each, or not at all.
fn check_count(
    name: &'static str,
    given: usize,
    of: &'static str,
    expected: usize,
) -> Result<(), IdentifyError> {
    if [0, 1, expected].contains(&given) {
        return Ok(());
    }
    Err(IdentifyError::miscounted(name, given, expected, of))
}
