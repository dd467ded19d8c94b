//! Requests: what to identify from a recording, and how. Every option is declared here, once.

use std::path::PathBuf;

use nalgebra::{Isometry3, Quaternion, Translation3, Vector3, Vector4};
use tactid_dynamics::{InertialParameters, Manipulator, MassProperties, Urdf};
use tactid_identify::calibration::CalibrationSettings;
use tactid_identify::{
    BatchSettings, BoundingBox, EquationSettings, IdentifyError, KnownMass, Method, PaperSettings,
    equations::{GAIN_STD_DEV, NOISE_STD_DEV, is_gain_std_dev, is_noise_std_dev},
};

use crate::arm_calibration::ArmCalibration;
use crate::clock::LONGEST_STAMP_DELAY_S;
use crate::{RecordingError, unit_quaternion};

/// Largest entry of gravity, m/s²: twice that of Jupiter. A larger one is in another unit.
const LARGEST_GRAVITY: f64 = 50.0;

/// What gravity must be.
const GRAVITY_RANGE: &str = "between -50 and 50 m/s²";

/// How equations become parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Estimator {
    /// Robust weighted least squares over the whole recording.
    #[default]
    LeastSquares,
    /// The paper's two-stage NLMS filter.
    Paper(PaperSettings),
}

/// Body on which a measured wrench acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ActsOn {
    /// The payload: the wrench that the robot exerts on it.
    #[default]
    Payload,
    /// The sensor: the wrench that the payload exerts on it, as most force-torque sensors report it.
    Sensor,
}

/// Where the frame of the only wrench sensor stands: fixed to a link of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorFrame {
    /// The link; without a robot, the body whose motion is measured.
    pub parent: String,
    /// Pose of the sensor's frame in the frame of the link.
    pub parent_from_sensor: Isometry3<f64>,
}

impl SensorFrame {
    /// Creates the frame with its origin, m, and its orientation, the quaternion `[x, y, z, w]`, in the frame of the
    /// link `parent`.
    ///
    /// # Errors
    /// Returns [`RecordingError::SensorFrameNorm`] if the norm of the quaternion is not one to within 0.1, as for the
    /// orientations of a recording.
    pub fn new(
        parent: &str,
        origin_m: [f64; 3],
        quaternion: [f64; 4],
    ) -> Result<Self, RecordingError> {
        let quaternion = Quaternion::from(Vector4::from(quaternion));
        let rotation = unit_quaternion(quaternion)
            .ok_or_else(|| RecordingError::SensorFrameNorm(quaternion.norm()))?;
        Ok(Self {
            parent: parent.to_owned(),
            parent_from_sensor: Isometry3::from_parts(Translation3::from(origin_m), rotation),
        })
    }
}

/// Which topics of a log to read. What is left empty is found by its type.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topics {
    /// `sensor_msgs/msg/JointState`; several where each has some of the joints.
    pub joints: Vec<String>,
    /// `geometry_msgs/msg/WrenchStamped`; their sum acts on the payload. Several that are not named must be those of
    /// fingers: links that joints beyond the end-effector frame move, none of which carries another.
    pub wrenches: Vec<String>,
    /// `nav_msgs/msg/Odometry` of the base, or of the sensor itself where there are no joints.
    pub odometry: Option<String>,
    /// `geometry_msgs/msg/AccelStamped` of the body that the odometry moves.
    pub acceleration: Option<String>,
    /// `sensor_msgs/msg/Imu` on the tool, where there are neither joints nor odometry; or on a moving base,
    /// in its frame.
    pub imu: Option<String>,
}

/// What to identify from a recording, and how. Every field is optional, and this is the only place where an
/// option is declared; what is left open is chosen from the recording, in one place for logs and arrays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    /// Measurements that the payload is identified from. Default: tactile where there are wrenches, else
    /// effort. Whether [`Method::Combined`] uses efforts is decided by the recording.
    pub method: Option<Method>,
    /// Estimator. Default: [`Estimator::LeastSquares`].
    pub estimator: Option<Estimator>,
    /// End-effector frame, a link of the robot. Default: `tool0`; without a robot, the frame of the first wrench
    /// (`sensor` for arrays).
    pub tip: Option<String>,
    /// The robot's URDF as text. Default: the robot description in the log; the robot of the arrays. Its base is
    /// fixed, unless the motion of the base is measured.
    pub urdf: Option<String>,
    /// Topics to read, for logs.
    pub topics: Topics,
    /// Frame of the only wrench sensor, where it is no link of the robot or to replace it. Default: for logs the frame
    /// that the messages name; for arrays [`Arrays::sensors`](crate::Arrays::sensors).
    pub sensor_frame: Option<SensorFrame>,
    /// Body on which the measured wrenches act. Default: the payload.
    pub wrench_acts_on: Option<ActsOn>,
    /// Gravitational acceleration in the world, m/s², pointing down. Default: zero for a floating base, 9.81
    /// along -z for a fixed one and for a sensor alone. Not used with an inertial unit on the sensor, whose
    /// accelerations contain gravity.
    pub gravity: Option<Vector3<f64>>,
    /// Cutoff of the low-pass on both sides of the equations, Hz. Default: chosen from the data; 10 for the
    /// paper's filter.
    pub cutoff_hz: Option<f64>,
    /// Longest time between two samples that is bridged, s. Default: five periods of the slowest stream; 0.1
    /// for the paper's filter.
    pub max_gap_s: Option<f64>,
    /// Delay of the wrenches' stamps relative to the motion, s. Default: estimated by the tactile method, and
    /// corrected where it is significant; 0 for other methods and for the paper's filter. At most 60 in either
    /// direction.
    pub delay_s: Option<f64>,
    /// Whether the sum of the wrenches may have an unknown constant offset. Default: false.
    pub wrench_offset: Option<bool>,
    /// Standard deviations of one sample of each wrench sensor, N and N m: one entry for all, or one each.
    /// Default: estimated from the residuals.
    pub wrench_noise: Option<Vec<[f64; 6]>>,
    /// Standard deviation of one sample of each joint effort, N m or N: one entry for all, or one each.
    /// Default: estimated from the residuals.
    pub effort_noise: Option<Vec<f64>>,
    /// Effort of a joint in N m (N) for one unit of the recorded value, one entry for each joint in the
    /// robot's order. Default: 1.
    pub effort_gain: Option<Vec<f64>>,
    /// Standard deviation of the relative error of each gain of [`effort_gain`](Self::effort_gain), 0.05 for 5 %: one
    /// entry for all joints, or one each. It widens the intervals of the methods that use efforts, and the paper's filter
    /// has none. Default: 0.05 where gains are given, else 0.
    pub effort_gain_std_dev: Option<Vec<f64>>,
    /// Log of the same motion without the payload, whose efforts are subtracted by the effort method; for logs, as
    /// [`Arrays::unloaded`](crate::Arrays::unloaded) is for arrays.
    pub unloaded: Option<PathBuf>,
    /// Calibration of the arm, for the effort method with least squares. It sets gravity, cutoff and effort gains, and
    /// the unloaded recording then updates it: any motion of the same day, which is not subtracted.
    pub calibration: Option<ArmCalibration>,
    /// Names of joints in the log with those of the robot, where they differ, for logs. Default: none, or joints whose
    /// names are the same behind a prefix if no name fits.
    pub joint_names: Vec<(String, String)>,
    /// A known body that the measured load contains besides the payload, in the tool frame: it is
    /// subtracted.
    pub known_tool: Option<MassProperties>,
    /// The payload's mass from a scale.
    pub known_mass: Option<KnownMass>,
    /// A box that contains the whole payload, along the axes of the tool frame.
    pub bounding_box: Option<BoundingBox>,
}

impl Request {
    /// The paper's filter with the paper's settings, on a recording whose clocks agree.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            estimator: Some(Estimator::Paper(PaperSettings::default())),
            ..Self::default()
        }
    }

    /// Returns the settings of the equations for a method, with their own defaults for what is left open.
    pub(crate) fn equation_settings(&self, method: Method) -> EquationSettings {
        let defaults = EquationSettings::default();
        EquationSettings {
            method,
            gravity: self.gravity,
            cutoff_hz: self.cutoff_hz.unwrap_or(defaults.cutoff_hz),
            max_gap_s: self.max_gap_s.unwrap_or(defaults.max_gap_s),
            wrench_offset: self.wrench_offset.unwrap_or(defaults.wrench_offset),
            wrench_noise: self.wrench_noise.clone().unwrap_or_default(),
            effort_noise: self.effort_noise.clone().unwrap_or_default(),
            ..defaults
        }
    }

    /// Returns the request for window means of joint efforts, from a recording without a subtracted reference.
    pub(crate) fn for_efforts(&self, settings: &CalibrationSettings) -> Self {
        Self {
            method: Some(Method::Effort),
            gravity: settings.gravity,
            cutoff_hz: Some(settings.cutoff_hz),
            unloaded: None,
            ..self.clone()
        }
    }

    /// Checks that nothing is given that a calibration sets or excludes.
    ///
    /// # Errors
    /// Returns [`RecordingError::NotWithCalibration`] with the first such field.
    pub(crate) fn check_calibration(&self) -> Result<(), RecordingError> {
        let is_other_method = self.method.is_some_and(|method| method != Method::Effort);
        let given = [
            ("method", is_other_method),
            (
                "estimator",
                matches!(self.estimator, Some(Estimator::Paper(_))),
            ),
            ("effort_gain", self.effort_gain.is_some()),
            ("effort_gain_std_dev", self.effort_gain_std_dev.is_some()),
            ("effort_noise", self.effort_noise.is_some()),
            ("gravity", self.gravity.is_some()),
            ("cutoff_hz", self.cutoff_hz.is_some()),
        ];
        match given.into_iter().find(|(_, is_given)| *is_given) {
            Some((name, _)) => Err(RecordingError::NotWithCalibration { name }),
            None => Ok(()),
        }
    }

    /// Checks the values that can be judged without a recording.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Value`], [`IdentifyError::Setting`] or [`IdentifyError::Box`] with the name of a field
    /// whose value is out of range, [`IdentifyError::Model`] for a URDF that is none, and [`IdentifyError::PriorNeedsLeastSquares`] if a known mass or a bounding box is given to the
    /// paper's filter.
    pub(crate) fn check(&self) -> Result<(), IdentifyError> {
        if let Some(urdf) = &self.urdf {
            Urdf::from_xml(urdf)?;
        }
        if let Some(Estimator::Paper(settings)) = &self.estimator {
            settings.check()?;
            if self.known_mass.is_some() {
                return Err(IdentifyError::PriorNeedsLeastSquares("a known mass"));
            }
            if self.bounding_box.is_some() {
                return Err(IdentifyError::PriorNeedsLeastSquares("a bounding box"));
            }
        }
        let knowledge = BatchSettings {
            known_mass: self.known_mass,
            bounding_box: self.bounding_box,
            ..BatchSettings::default()
        };
        knowledge.check()?;
        self.check_numbers()
    }

    /// Checks how many values are given for the joints of a robot and for its `sensors`, those that the method uses.
    ///
    /// # Errors
    /// Returns [`RecordingError::EffortGains`] if the gains are not as many as the joints, and
    /// [`IdentifyError::NoiseCount`] if noise is given neither once for all nor once for each.
    pub(crate) fn check_counts(
        &self,
        robot: &Manipulator,
        sensors: usize,
    ) -> Result<(), RecordingError> {
        let joints = robot.joint_names();
        if let Some(gains) = &self.effort_gain
            && gains.len() != joints.len()
        {
            return Err(RecordingError::EffortGains {
                given: gains.len(),
                count: joints.len(),
                joints: joints.join(", "),
            });
        }
        let (wrench, effort) = (&self.wrench_noise, &self.effort_noise);
        let of_gain = &self.effort_gain_std_dev;
        let counts = [
            (
                "wrench_noise",
                wrench.as_ref().map(Vec::len),
                "sensors",
                sensors,
            ),
            (
                "effort_noise",
                effort.as_ref().map(Vec::len),
                "joints",
                joints.len(),
            ),
            (
                "effort_gain_std_dev",
                of_gain.as_ref().map(Vec::len),
                "joints",
                joints.len(),
            ),
        ];
        for (name, given, of, expected) in counts {
            let Some(given) = given.filter(|_| expected > 0) else {
                continue;
            };
            if ![1, expected].contains(&given) {
                return Err(RecordingError::Identify(IdentifyError::NoiseCount {
                    name,
                    given,
                    of,
                    expected,
                }));
            }
        }
        Ok(())
    }

    /// Checks that each number of the request is in the range of its field.
    fn check_numbers(&self) -> Result<(), IdentifyError> {
        let wrench_noise = self.wrench_noise.iter().flatten().flatten();
        let is_positive: IsValid = |value| value > 0.0 && value.is_finite();
        let is_gap: IsValid = |gap_s| gap_s > 0.0;
        let is_delay: IsValid = |delay_s| delay_s.abs() <= LONGEST_STAMP_DELAY_S;
        let (cutoff_hz, gap_s) = (one(self.cutoff_hz), one(self.max_gap_s));
        let (effort_noise, gains) = (flat(&self.effort_noise), flat(&self.effort_gain));
        let is_gravity: IsValid = |entry| entry.abs() <= LARGEST_GRAVITY;
        let gravity: Field = ("gravity", flat(&self.gravity), is_gravity, GRAVITY_RANGE);
        let of_time: [Field; 3] = [
            ("cutoff_hz", cutoff_hz, is_positive, "more than zero"),
            ("max_gap_s", gap_s, is_gap, "more than zero"),
            ("delay_s", one(self.delay_s), is_delay, "between -60 and 60"),
        ];
        let noise = wrench_noise.copied().collect();
        let of_gain = flat(&self.effort_gain_std_dev);
        let of_noise: [Field; 3] = [
            ("wrench_noise", noise, is_noise_std_dev, NOISE_STD_DEV),
            (
                "effort_noise",
                effort_noise,
                is_noise_std_dev,
                NOISE_STD_DEV,
            ),
            (
                "effort_gain_std_dev",
                of_gain,
                is_gain_std_dev,
                GAIN_STD_DEV,
            ),
        ];
        let finite = [
            ("effort_gain", gains),
            ("known_tool", self.tool_numbers()),
            ("sensor_frame", self.frame_numbers()),
        ];
        let finite =
            finite.map(|(name, values)| -> Field { (name, values, f64::is_finite, "finite") });
        let fields = of_time.into_iter().chain(of_noise).chain(finite);
        let fields = fields.chain([gravity]);
        for (name, values, is_valid, expected) in fields {
            if let Some(given) = values.into_iter().find(|value| !is_valid(*value)) {
                return Err(IdentifyError::Value {
                    name,
                    given,
                    expected,
                });
            }
        }
        let is_possible = |tool| InertialParameters::from(tool).is_physical_within(ROUNDED);
        if !self.known_tool.is_none_or(is_possible) {
            return Err(IdentifyError::ImpossibleTool);
        }
        Ok(())
    }

    fn tool_numbers(&self) -> Vec<f64> {
        let numbers = self.known_tool.iter().flat_map(|tool| {
            let vectors = tool.center_of_mass.iter().chain(&tool.inertia);
            std::iter::once(&tool.mass_kg).chain(vectors)
        });
        numbers.copied().collect()
    }

    fn frame_numbers(&self) -> Vec<f64> {
        let numbers = self.sensor_frame.iter().flat_map(|frame| {
            let pose = &frame.parent_from_sensor;
            let origin = pose.translation.vector.iter();
            origin.chain(pose.rotation.coords.iter())
        });
        numbers.copied().collect()
    }
}

/// Violation of the triangle inequality of a tool's principal moments that is tolerated, a fraction: those of a data sheet are rounded.
const ROUNDED: f64 = 0.02;

/// Whether a number is in the range of its field.
type IsValid = fn(f64) -> bool;

/// Name of a field, its numbers, and their range, as a function and in words.
type Field = (&'static str, Vec<f64>, IsValid, &'static str);

/// Returns the entries of a field; none if it is not given.
fn flat<'a, T>(given: &'a Option<T>) -> Vec<f64>
where
    &'a T: IntoIterator<Item = &'a f64>,
{
    given.iter().flatten().copied().collect()
}

/// Returns the number of a field; none if it is not given.
fn one(given: Option<f64>) -> Vec<f64> {
    given.into_iter().collect()
}
