//! Requests: what to identify from a recording, and how. Every option is declared here, once.

use std::collections::BTreeMap;
use std::path::PathBuf;

use tactid_calibrate::CalibrationSettings;
use tactid_dynamics::{InertialParameters, Urdf};
use tactid_identify::{
    ActsOn, BoundingBox, EffortContent, EquationSettings, KnownMass, Method, Range, SubtractedLoad,
    Unknowns,
};
use tactid_options::{About, Kind, options};

use crate::arm_calibration::ArmCalibration;
use crate::choices::{
    ConfiguredPayload, EstimatorKind, GravityChoice, OffsetChoice, SensorFrame, WrenchIs,
};
use crate::clock::LONGEST_STAMP_DELAY_S;
use crate::known_shape::{LN_DENSITY, POSITION_STD_DEV, ROTATION_STD_DEV, ShapePose, UNIT_M};
use crate::known_tool::GivenTool;
use crate::paper::PaperSettings;
use crate::uses::{
    ALL, DELAY, EFFORT_CONTENT, EFFORTS, FRAME, LEAST_SQUARES, LOG, LOGS, METHODS, MODEL, OFFSET,
    PAPER, RECORDING, SAMPLES, SHAPE, STREAM, TOOL, WEIGHT, WRENCHES,
};

/// Range of gravity, m/s²: up to twice that of Jupiter. A larger one is in another unit.
const GRAVITY: Range = Range {
    contains: |entry| entry.abs() <= 50.0,
    expected: "between -50 and 50 m/s²",
};

/// Range of a delay, s.
const DELAY_S: Range = Range {
    contains: |delay_s| delay_s.abs() <= LONGEST_STAMP_DELAY_S,
    expected: "between -60 and 60",
};

const ROBOT: &str = "Robot";
const TOPICS: &str = "Topics";
const MEASUREMENTS: &str = "Measurements";
const SIGNS: &str = "Signs";
const PRIOR: &str = "Prior knowledge";
const NOISE: &str = "Noise and filter";
/// Group of the options that only the paper's filter has.
pub(crate) const FILTER: &str = "Paper's filter";

options! {
    /// What to identify from a recording, and how. Every field is optional, and this is the only
    /// place where an option is declared; what is left open is chosen from the recording, in one
    /// place for logs and arrays.
    ///
    /// The documentation of a field is that of the keyword in Python and of the flag on the command
    /// line, which have the name of the field.
    pub struct Request {
        /// The robot's URDF file. Its base is fixed, unless the motion of the base is measured.
        #[option(
            ROBOT, MODEL,
            default = "the robot description in the log",
            python = "A text that begins with ``<`` is the URDF itself."
        )]
        pub urdf: Option<Urdf>,
        /// End-effector frame, a link of the robot.
        #[option(
            ROBOT, FRAME,
            default = "tool0, or the frame of the sensor where there is no robot",
            placeholder = "LINK"
        )]
        pub tip: Option<String>,
        /// Joints that have another name in the log than in the URDF: the name in the log, then
        /// that in the URDF.
        #[option(
            ROBOT, LOGS,
            default = "none; where no name in the log fits, joints whose names are the same \
                behind a prefix"
        )]
        pub rename_joints: Option<BTreeMap<String, String>>,
        /// Frame of the only wrench sensor, where it is no link of the robot or to replace it: the
        /// link that it is fixed to, then its origin x, y, z and its quaternion qx, qy, qz, qw in
        /// the frame of this link.
        #[option(
            ROBOT, WRENCHES,
            unit = "m",
            default = "the frame that the messages name; for arrays, the links of the sensors",
            range = Range::FINITE,
            about = About::Wrenches
        )]
        pub sensor_frame: Option<SensorFrame>,
        /// Link along whose axes the wrenches are expressed, or `world` for those of the world,
        /// such as the base of a controller that gives the wrench on the tool in the axes of the
        /// base. The moments are about the origin of the sensor's frame in any case.
        #[option(
            ROBOT, SAMPLES,
            default = "the sensor's own; where the messages are in a frame that does not move with \
                the tip, those of this frame, about the origin of the tip",
            placeholder = "LINK",
            about = About::Wrenches
        )]
        pub wrench_axes: Option<String>,
        /// Topic of joint states; several where each has some of the joints.
        #[option(TOPICS, LOGS, default = "found by its type")]
        pub joint_topic: Option<Vec<String>>,
        /// Topic of wrenches, or of points with forces; the sum of several acts on the payload.
        #[option(
            TOPICS, LOG,
            default = "found by its type; several only where each is of another finger, a link \
                that joints beyond the tip move",
            about = About::Wrenches
        )]
        pub wrench_topic: Option<Vec<String>>,
        /// Topic of the odometry of the base, or of the sensor itself where there are no joints.
        #[option(TOPICS, LOG, default = "found by its type")]
        pub odometry_topic: Option<String>,
        /// Topic of an inertial unit: on the sensor where there are neither joints nor odometry, or
        /// on a moving base, in its frame.
        #[option(TOPICS, LOG, default = "found by its type on a sensor; none on a base")]
        pub imu_topic: Option<String>,
        /// Topic of the accelerations of the body that the odometry moves.
        #[option(
            TOPICS, LOG,
            default = "found by its type, and used where it is better than the derived \
                accelerations"
        )]
        pub acceleration_topic: Option<String>,
        /// Measurements that the payload is identified from: wrenches (tactile); joint efforts
        /// beyond those that the arm itself needs (effort); the motion of a free-floating base,
        /// from which the known gripper is subtracted (joint-sensing); or all that is measured,
        /// each channel weighted by its own residuals (combined).
        #[option(
            MEASUREMENTS, METHODS,
            default = "tactile where there are wrenches, else effort; tactile online and for a design"
        )]
        pub method: Option<Method>,
        /// An unloaded recording of the same motion, whose joint efforts are subtracted by the
        /// effort method. With a calibration: one of the same day and any motion, which updates it.
        #[option(
            MEASUREMENTS, RECORDING,
            python = "That of a log is a log; that of arrays is a dict of the arrays ``time``, \
                (M,), and ``q`` and ``effort``, (M, n)."
        )]
        pub unloaded: Option<PathBuf>,
        /// Calibration of the arm, which tactid calibrate wrote: the effort method then identifies
        /// the payload together with what is known of the arm. It sets the tip, gravity, cutoff and
        /// gains.
        #[option(
            MEASUREMENTS, RECORDING,
            python = "The path of its file, or what ``tactid.calibrate`` returned."
        )]
        pub calibration: Option<ArmCalibration>,
        /// Delay of the wrenches' stamps relative to the motion.
        #[option(
            MEASUREMENTS, DELAY,
            unit = "s",
            default = "estimated by the tactile method with least squares, and corrected where it \
                is significant; else 0",
            range = DELAY_S,
            about = About::Wrenches
        )]
        pub delay_s: Option<f64>,
        /// Time from which on the recording is used. It counts from the first sample, or from the
        /// first message on a topic that is used, on the clock of the stamps.
        #[option(
            MEASUREMENTS, RECORDING,
            unit = "s",
            default = "its beginning",
            range = Range::FINITE
        )]
        pub begin_s: Option<f64>,
        /// Time up to which the recording is used, since the same first sample or message.
        #[option(
            MEASUREMENTS, RECORDING,
            unit = "s",
            default = "its end",
            range = Range::FINITE
        )]
        pub end_s: Option<f64>,
        /// Longest time between two samples that is bridged.
        #[option(
            MEASUREMENTS, STREAM,
            unit = "s",
            default = "five periods of the slowest stream; 0.1 online and for the paper's filter",
            range = Range::GAP_S
        )]
        pub max_gap_s: Option<f64>,
        /// Whether the sum of the wrenches has an unknown constant offset, a sensor zero that was
        /// not set: six more unknowns. It is identified where the data of a recording show one
        /// (auto; for samples one by one, in any case), in any case (yes), or never (no).
        #[option(
            MEASUREMENTS, OFFSET,
            default = "auto for a recording with least squares; yes for poses at rest and live topics; else no",
            about = About::Wrenches
        )]
        pub wrench_offset: Option<OffsetChoice>,
        /// Gravitational acceleration in world axes, (3,), pointing down; or unknown, where least
        /// squares is to identify its direction from the wrenches of a recording together with the
        /// payload (two more unknowns, its size is 9.81); or auto.
        #[option(
            SIGNS, FRAME,
            unit = "m/s²",
            default = "auto: 0,0,0 for a floating base, 0,0,-9.81 for a fixed one, for a sensor \
                without a robot and for poses at rest; wrenches that show another one are reported",
            range = GRAVITY
        )]
        pub gravity: Option<GravityChoice>,
        /// What the driver of the sensor has subtracted from the wrenches: nothing but a constant
        /// (raw); the weight of the configured payload, but not the forces that accelerate it
        /// (without-weight), which is then added again, or, where no configured payload is given,
        /// identified as four more unknowns; or both the weight and these forces (contact), which
        /// the data cannot show: what is left of the wrenches is that of a lighter payload.
        #[option(SIGNS, WEIGHT, default = "raw", about = About::Wrenches)]
        pub wrench_is: Option<WrenchIs>,
        /// Payload that is configured in the controller, which subtracts it from the wrenches
        /// (wrench_is): mass and centre of mass in the tip's frame, and its inertia about it where
        /// that is known.
        #[option(
            SIGNS, WEIGHT,
            unit = "kg, m, kg m²",
            range = Range::FINITE,
            about = About::Wrenches
        )]
        pub configured_payload: Option<ConfiguredPayload>,
        /// Body on which the measured wrenches act. Most force-torque sensors report the wrench on
        /// the sensor.
        #[option(SIGNS, WRENCHES, default = "payload", about = About::Wrenches)]
        pub wrench_acts_on: Option<ActsOn>,
        /// What the joint efforts contain: all that moves and holds arm and payload (measured), all
        /// but what holds the arm itself against gravity (without-gravity), or what the payload
        /// needs alone, as in external torques (external).
        #[option(SIGNS, EFFORT_CONTENT, default = "measured", about = About::Efforts)]
        pub efforts_are: Option<EffortContent>,
        /// Effort of each joint for one unit of the recorded value, in the robot's order.
        #[option(
            SIGNS, EFFORTS,
            unit = "N m (N) per unit",
            default = "1",
            range = Range::FINITE,
            about = About::Efforts
        )]
        pub effort_gain: Option<Vec<f64>>,
        /// Standard deviation of the relative error of each gain, for all joints or for each: a
        /// fraction in Python, 0.05, and a percentage on the command line, 5%. The intervals
        /// contain it for the methods that use efforts; the paper's filter has none.
        #[option(
            SIGNS, RECORDING,
            default = "5 % where gains are given, else 0",
            kind = Kind::Fractions,
            range = Range::GAIN_STD_DEV,
            about = About::Efforts
        )]
        pub effort_gain_std_dev: Option<Vec<f64>>,
        /// A known body that the measured load contains besides the payload, such as a gripper, in
        /// the tip's frame: it is subtracted. It is an earlier result, whose uncertainty is then
        /// part of that of the payload: the path of its JSON file. Or it is ten numbers: mass,
        /// centre of mass, and inertia about it, Ixx, Ixy, Ixz, Iyy, Iyz, Izz.
        #[option(
            PRIOR, TOOL,
            unit = "kg, m, kg m²",
            range = Range::FINITE,
            python = "A ``tactid.MassProperties``, ten numbers, a result or its estimate, or the path of its JSON file."
        )]
        pub known_tool: Option<GivenTool>,
        /// Standard deviation of the values of a known tool that is given as numbers, relative to
        /// the largest value of their kind (mass, centre of mass, inertia): a fraction in Python,
        /// 0.01, and a percentage on the command line, 1%.
        #[option(
            PRIOR, TOOL,
            default = "1 %",
            kind = Kind::Percentage,
            range = Range::GAIN_STD_DEV
        )]
        pub known_tool_std_dev: Option<f64>,
        /// Mass of the payload from a scale: it improves the other values, too.
        #[option(PRIOR, RECORDING, unit = "kg")]
        pub known_mass_kg: Option<f64>,
        /// Standard deviation of the known mass.
        #[option(PRIOR, RECORDING, unit = "kg", default = "0, an exact mass")]
        pub known_mass_std_dev_kg: Option<f64>,
        /// Least and largest corner of a box that contains the whole payload, in the tip's frame,
        /// (2, 3): the result is a body that fits into it.
        #[option(PRIOR, RECORDING, unit = "m")]
        pub bounding_box: Option<BoundingBox>,
        /// File of the payload's shape: a solid in STL, OBJ or PLY, or a point cloud of its surface
        /// in PLY. What the shape says of the centre of mass and the inertia is part of the
        /// estimate. The density inside is not known and may differ from part to part.
        #[option(PRIOR, SHAPE, placeholder = "FILE")]
        pub shape: Option<PathBuf>,
        /// Pose of the frame of the shape's file in the tip's frame: its origin x, y, z and its
        /// quaternion qx, qy, qz, qw.
        #[option(PRIOR, SHAPE, unit = "m", default = "that of the tip", range = Range::FINITE)]
        pub shape_pose: Option<ShapePose>,
        /// Length of one unit of the shape's file: 0.001 for millimetres.
        #[option(PRIOR, SHAPE, unit = "m", default = "1", range = UNIT_M)]
        pub shape_scale: Option<f64>,
        /// Standard deviation of the position of the shape along each axis.
        #[option(PRIOR, SHAPE, unit = "m", default = "0.003", range = POSITION_STD_DEV)]
        pub shape_position_std_dev_m: Option<f64>,
        /// Standard deviation of the orientation of the shape about each axis: in rad in Python, and
        /// in degrees on the command line.
        #[option(
            PRIOR, SHAPE,
            default = "3 degrees",
            kind = Kind::Degrees,
            range = ROTATION_STD_DEV
        )]
        pub shape_rotation_std_dev: Option<f64>,
        /// Standard deviation of the size of the shape along each axis of its file: a fraction in
        /// Python, 0.03, and a percentage on the command line, 3%.
        #[option(
            PRIOR, SHAPE,
            default = "3 %",
            kind = Kind::Percentage,
            range = Range::GAIN_STD_DEV
        )]
        pub shape_size_std_dev: Option<f64>,
        /// Standard deviation of the natural logarithm of the density from place to place: 1.4 for
        /// parts of steel, wood and plastic, 2 where parts may be hollow, 0.1 for a solid that is
        /// known to be uniform.
        #[option(PRIOR, SHAPE, default = "1.4", range = LN_DENSITY)]
        pub shape_ln_density_std_dev: Option<f64>,
        /// Robust least squares over the whole recording, or the paper's filter (nlms).
        #[option(NOISE, RECORDING, default = "least-squares")]
        pub estimator: Option<EstimatorKind>,
        /// Cutoff of the low-pass on both sides of the equations (-3 dB).
        #[option(
            NOISE, ALL,
            unit = "Hz",
            default = "chosen from the data of a recording; 10 online, for the paper's filter and \
                for a design; 2 for a calibration",
            range = Range::CUTOFF_HZ
        )]
        pub cutoff_hz: Option<f64>,
        /// Standard deviations of the white noise of one wrench, (6,), or (S, 6) for S sensors; on
        /// the command line, once for all sensors or once for each. Their ratios weight the
        /// channels; the intervals follow from the residuals.
        #[option(
            NOISE, LEAST_SQUARES,
            unit = "N and N m",
            default = "estimated from the residuals; for a design 0.5 N and 0.05 N m",
            range = Range::NOISE_STD_DEV,
            about = About::Wrenches
        )]
        pub wrench_noise: Option<Vec<[f64; 6]>>,
        /// Standard deviation of the white noise of one joint effort, for all joints or for each.
        #[option(
            NOISE, LEAST_SQUARES,
            unit = "N m or N",
            default = "estimated from the residuals; for a design 0.5",
            range = Range::NOISE_STD_DEV,
            about = About::Efforts
        )]
        pub effort_noise: Option<Vec<f64>>,
        /// Step size of the paper's filter, in (0, 2).
        #[option(FILTER, PAPER, default = "1.8, as in the paper")]
        pub alpha: Option<f64>,
        /// Regularisation of the paper's filter, in (0, 1).
        #[option(FILTER, PAPER, default = "0.9, as in the paper")]
        pub beta: Option<f64>,
        /// The estimate of the paper's filter is the mean over this last time, or the latest value
        /// for 0.
        #[option(FILTER, PAPER, unit = "s", default = "10, as in the paper")]
        pub average_s: Option<f64>,
        /// Number of times that the recording is presented to the paper's filter.
        #[option(FILTER, RECORDING, default = "2")]
        pub epochs: Option<u32>,
    }
}

impl Request {
    /// The paper's filter with the paper's settings, on a recording whose clocks agree.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            estimator: Some(EstimatorKind::Nlms),
            ..Self::default()
        }
    }

    /// Returns the settings of the paper's filter.
    #[must_use]
    pub fn paper_settings(&self) -> PaperSettings {
        let defaults = PaperSettings::default();
        PaperSettings {
            alpha: self.alpha.unwrap_or(defaults.alpha),
            beta: self.beta.unwrap_or(defaults.beta),
            average_s: self.average_s.unwrap_or(defaults.average_s),
            epochs: self.epochs.unwrap_or(defaults.epochs),
        }
    }

    /// Returns the payload's mass from a scale, which is exact unless its standard deviation is
    /// given.
    #[must_use]
    pub fn known_mass(&self) -> Option<KnownMass> {
        self.known_mass_kg.map(|mass_kg| KnownMass {
            mass_kg,
            std_dev_kg: self.known_mass_std_dev_kg.unwrap_or(0.0),
        })
    }

    /// Returns the settings of the equations for a method, with their own defaults for what is left
    /// open.
    #[must_use]
    pub fn equation_settings(&self, method: Method) -> EquationSettings {
        let defaults = EquationSettings::default();
        EquationSettings {
            method,
            gravity: self.gravity.and_then(GravityChoice::vector),
            subtracted: self.subtracted_load(),
            unknowns: self.unknowns(),
            cutoff_hz: self.cutoff_hz.unwrap_or(defaults.cutoff_hz),
            max_gap_s: self.max_gap_s.unwrap_or(defaults.max_gap_s),
            wrench_offset: self.wrench_offset == Some(OffsetChoice::Yes),
            wrench_axes: self.wrench_axes.clone(),
            effort_content: self.efforts_are.unwrap_or_default(),
            wrench_noise: self.wrench_noise.clone().unwrap_or_default(),
            effort_noise: self.effort_noise.clone().unwrap_or_default(),
            ..defaults
        }
    }

    /// Returns what the controller has subtracted from the wrenches, where it is known.
    fn subtracted_load(&self) -> Option<SubtractedLoad> {
        self.configured_payload.map(|payload| SubtractedLoad {
            body: InertialParameters::from(payload.0),
            with_inertia: self.wrench_is == Some(WrenchIs::Contact),
        })
    }

    /// Returns what is to be identified beside the payload and an offset.
    fn unknowns(&self) -> Unknowns {
        Unknowns {
            weight: self.wrench_is == Some(WrenchIs::WithoutWeight)
                && self.configured_payload.is_none(),
            gravity: self.gravity == Some(GravityChoice::Unknown),
        }
    }

    /// Returns the request for window means of joint efforts, from a recording without a subtracted
    /// reference.
    pub(crate) fn for_efforts(&self, settings: &CalibrationSettings) -> Self {
        Self {
            method: Some(Method::Effort),
            gravity: settings.gravity.map(GravityChoice::Given),
            cutoff_hz: Some(settings.cutoff_hz),
            unloaded: None,
            ..self.clone()
        }
    }
}
