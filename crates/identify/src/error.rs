use tactid_dynamics::{ModelError, StateError};
use tactid_nlms::SettingError;
use thiserror::Error;

/// Why a payload cannot be identified.
#[derive(Debug, Error)]
pub enum IdentifyError {
    /// The model of the robot is invalid, or has no link for the tool or a sensor.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The method needs the masses of the robot's links, and nothing that moves between the base and the tool has any, or
    /// the floating base whose motion is measured has none.
    #[error(
        "the {method} method needs the masses of the robot: {source}; or use the tactile method, which needs none"
    )]
    NoMasses {
        /// Name of the method.
        method: &'static str,
        /// Where mass is missing.
        source: ModelError,
    },
    /// A sample does not fit the robot.
    #[error(transparent)]
    State(#[from] StateError),
    /// A setting of a filter is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A setting of the identification is out of range.
    #[error("{name} is {}, but must be {expected}", digits(*given))]
    Value {
        /// Name of the setting.
        name: &'static str,
        /// The given value.
        given: f64,
        /// The range of the setting, as a phrase.
        expected: &'static str,
    },
    /// No body has the mass and the inertia that are given for the known tool.
    #[error(
        "known_tool is no body that can exist: its mass must be more than zero, and each principal moment of inertia about its centre \
         of mass at most the sum of the two others"
    )]
    ImpossibleTool,
    /// A box has a side that is not positive, or a corner that is not finite.
    #[error(
        "the box goes from {min} to {max} m along {axis}: its upper end must be larger than its lower end"
    )]
    Box {
        /// Name of the setting.
        name: &'static str,
        /// Axis of its frame.
        axis: &'static str,
        /// Lower end of the box, m.
        min: f64,
        /// Upper end of the box, m.
        max: f64,
    },
    /// A known mass, a bounding box, an unknown offset or known noise is given to the paper's filter.
    #[error(
        "{0} needs least squares: the paper's filter estimates ten parameters and nothing else"
    )]
    PriorNeedsLeastSquares(&'static str),
    /// Noise is given neither once for all sensors or joints nor once for each.
    #[error("{name} has {given} entries: give one for all, or one for each of the {expected} {of}")]
    NoiseCount {
        /// Name of the setting.
        name: &'static str,
        /// Number of entries of the setting.
        given: usize,
        /// What each entry belongs to, in the plural.
        of: &'static str,
        /// Number of sensors or joints.
        expected: usize,
    },
    /// The number of wrenches of a sample is not the number of sensors.
    #[error("a sample has {given} wrenches, but there are {expected} sensors")]
    WrenchCount {
        /// Number of wrenches in the sample.
        given: usize,
        /// Number of sensors.
        expected: usize,
    },
    /// No measurement remains: the tactile method without a sensor, or the combined method without sensors and
    /// efforts on a fixed base.
    #[error(
        "the method needs at least one wrench: name a sensor, or use the joint-sensing or the effort method"
    )]
    NoWrench,
    /// The joint-sensing method is used on a fixed base.
    #[error(
        "the joint-sensing method needs a free-floating base, because a fixed base exchanges momentum with the ground: \
         use the tactile or the effort method, or give the motion of the base if it is not fixed"
    )]
    FixedBase,
    /// The paper's filter is used with a method whose rows are not a force and a moment.
    #[error(
        "the paper's filter needs the force and the moment on the end-effector, which the {0} method does \
             not compute: use least squares"
    )]
    NeedsLeastSquares(&'static str),
    /// There is no recording to combine.
    #[error("there is no recording to combine")]
    NoRuns,
    /// The estimate of a recording to combine is not a point with an information and a covariance.
    #[error("the information or the covariance of recording {} {problem}", run + 1)]
    Information {
        /// Index of the recording; the message counts from one.
        run: usize,
        /// What is wrong with it, as a predicate.
        problem: &'static str,
    },
    /// The same recording was given twice to combine: its noise would count as agreement.
    #[error(
        "recordings {} and {} have the same data: their noise would count as agreement",
        runs[0] + 1,
        runs[1] + 1
    )]
    SameRunTwice {
        /// Indices of both, of which the message counts from one.
        runs: [usize; 2],
    },
    /// The recording has too few windows without a gap: it is too short for the cutoff.
    #[error(
        "too few windows: {windows} of {} s without a gap were found; record longer, or raise the cutoff",
        three_digits(*window_s)
    )]
    TooFewWindows {
        /// Number of windows.
        windows: usize,
        /// Length of a window, s.
        window_s: f64,
    },
    /// Most windows have too few samples: the cutoff is too high for the sample rate.
    #[error(
        "too few samples: most windows of {} s have fewer than {min_samples}; lower the cutoff, or raise the \
         sample rate",
        three_digits(*window_s)
    )]
    TooFewSamples {
        /// Length of a window, s.
        window_s: f64,
        /// Fewest samples of a window.
        min_samples: u32,
    },
    /// A calibration needs efforts, and no sample has any.
    #[error("the samples have no joint efforts, which a calibration needs")]
    NoEfforts,
    /// The caller stopped the work.
    #[error("the calibration was interrupted")]
    Interrupted,
    /// The effort of a joint is constant while the joint moves.
    #[error(
        "the effort of the joint `{joint}` never changes, although it moves: record its effort, too"
    )]
    EffortConstant {
        /// Name of the joint.
        joint: String,
    },
    /// The efforts of a joint have the opposite sign of those that the robot's description and friction need.
    #[error(
        "the effort of the joint `{joint}` has the opposite sign of the torque that moves it: give it a negative effort gain"
    )]
    EffortReversed {
        /// Name of the joint.
        joint: String,
    },
    /// The efforts of a joint have the opposite sign of those that calibrated the arm.
    #[error(
        "the effort of the joint `{joint}` has the opposite sign of that in the calibration: negate it, or calibrate anew"
    )]
    EffortSignChanged {
        /// Name of the joint.
        joint: String,
    },
    /// Joints whose gain comes out negative or infinite: their efforts have nothing to do with the torques that the
    /// robot's description, gravity and the payloads need.
    #[error(
        "the efforts of {} do not fit the motion, because their gains come out negative: check their signs and units, the \
         units of positions, the order of the joints, the direction of gravity, the mass and the centre of mass (m) of each \
         payload, and that no recordings are exchanged",
        listed(joints)
    )]
    GainsNotPositive {
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// The gain of a joint is far from what was known of it before a calibration.
    #[error(
        "the gain of `{joint}` comes out as {}, where 1 ± {} was expected: give the effort gain of this joint, or check that it is this joint's effort, that masses are in kg and centres of mass in m, and the direction of gravity",
        three_digits(*gain),
        three_digits(*std_dev)
    )]
    GainUnexpected {
        /// Name of the joint.
        joint: String,
        /// The gain, relative to the one that was given.
        gain: f64,
        /// Standard deviation that was given, a fraction.
        std_dev: f64,
        /// Gains of all joints, relative to the given ones: those that were found, and for the others their geometric mean.
        gains: Vec<f64>,
    },
    /// The gains of all joints are far from what was known of them before a calibration, by the same factor.
    #[error(
        "the gains of all joints are about {} times what was expected: check that the masses of the payloads are in kg, that the recordings without payload hold none, and the effort gains",
        three_digits(*factor)
    )]
    GainsUnexpected {
        /// Their geometric mean, relative to the given ones.
        factor: f64,
        /// Gains of all joints, relative to the given ones: those that were found, and for the others their geometric mean.
        gains: Vec<f64>,
    },
    /// A recording without payload, which should update a calibration, shows one.
    #[error(
        "the unloaded recording holds a payload of {} ± {} kg: give one of the empty arm",
        three_digits(*mass_kg),
        three_digits(*half_width_kg)
    )]
    UnloadedHolds {
        /// Mass of the payload, kg.
        mass_kg: f64,
        /// Half width of its 95 % interval, kg.
        half_width_kg: f64,
    },
    /// One of several unloaded recordings of a calibration holds a payload that the others do not have.
    #[error(
        "the unloaded recording holds a payload that the other ones do not have: give those of the empty arm only"
    )]
    UnloadedDiffers,
    /// Efforts lag or lead the motion by more than a calibration can correct.
    #[error(
        "the efforts {} the motion by {} ms, but windows of {} s allow for {} ms at most: correct the stamps of the efforts",
        if *delay_s < 0.0 { "lead" } else { "lag" },
        three_digits(1e3 * delay_s.abs()),
        three_digits(*window_s),
        three_digits(1e3 * longest_s)
    )]
    EffortDelay {
        /// Delay of the efforts, s; negative where they lead.
        delay_s: f64,
        /// Longest delay that can be corrected, s.
        longest_s: f64,
        /// Length of a window, s.
        window_s: f64,
    },
    /// A calibration is asked of a robot that it does not exist for: its base floats, or no joint moves the tool.
    #[error("a calibration of joint efforts needs a fixed base and joints that move the tool: {0}")]
    CalibrationBase(&'static str),
    /// No joint moves in the recordings for a calibration.
    #[error(
        "no joint moves in the recordings (the fastest reaches {} rad/s or m/s): record a motion of all joints in both directions",
        three_digits(*max_velocity)
    )]
    NoMotion {
        /// Largest velocity of any joint, rad/s or m/s.
        max_velocity: f64,
    },
    /// The known inertia of a payload is not symmetric, or one of its principal moments exceeds the sum of the others.
    #[error(
        "payload_inertia is that of no body: it must be symmetric, with no principal moment above the sum of the others"
    )]
    PayloadInertia,
    /// A calibration or a recording is of another robot.
    #[error(
        "the calibration is of {}, where the robot has {}: use a calibration of this robot to this tip",
        named(what, expected),
        if found.is_empty() { "none".to_owned() } else { format!("`{found}`") }
    )]
    CalibrationRobot {
        /// What differs: `joint`, `link` or `tool`.
        what: &'static str,
        /// Name in the calibration, or in the first recording; empty where there is none.
        expected: String,
        /// Name in the robot, or in the other recording; empty where there is none.
        found: String,
    },
    /// A calibration is of another robot, whose joints and links have the same names.
    #[error(
        "the calibration is of another robot, whose link `{link}` has the {property} {expected} instead of {found}"
    )]
    CalibrationLink {
        /// The first link that differs, from the base outwards.
        link: String,
        /// What differs: its mass, centre of mass or inertia about it, the origin or the roll, pitch and yaw (rpy) of its frame
        /// in that of the moving link before, the axis of its joint, or gravity in its frame where the base is mounted at
        /// another angle.
        property: &'static str,
        /// Its value in the calibration.
        expected: String,
        /// Its value in the robot.
        found: String,
    },
    /// Recordings are of different robots, whose joints and links have the same names.
    #[error(
        "the recordings are of different robots: the link `{link}` has the {property} {first} in the first one, and {other} in another"
    )]
    RecordingLink {
        /// The first link that differs, from the base outwards.
        link: String,
        /// What differs, as in [`Self::CalibrationLink`].
        property: &'static str,
        /// Its value in the first recording.
        first: String,
        /// Its value in the other recording.
        other: String,
    },
    /// Recordings have different settings.
    #[error("recordings with different {what} cannot be combined: {expected} and {found}")]
    CalibrationMismatch {
        /// Name of the setting: `cutoff_hz` or `gravity`.
        what: &'static str,
        /// Its value in the calibration, or in the first recording.
        expected: String,
        /// Its value in the other recording.
        found: String,
    },
    /// An unloaded recording that is to update a calibration is one of those that it is from.
    #[error(
        "the unloaded recording has calibrated the arm, and its noise would count twice: give another one of the day, or none"
    )]
    UnloadedCalibrated,
    /// The equations of a calibration cannot be solved: numbers of the recordings are too large.
    #[error("the arm cannot be calibrated: check the units of positions, velocities and efforts")]
    CalibrationFailed,
    /// The data of a calibration do not fit together.
    #[error("`{field}` of the calibration is not valid: {reason}")]
    CalibrationData {
        /// Name of the field.
        field: &'static str,
        /// What is wrong, as a phrase.
        reason: String,
    },
}

/// Returns the names of joints as a sentence has them.
fn listed(joints: &[String]) -> String {
    let named: Vec<String> = joints.iter().map(|joint| format!("`{joint}`")).collect();
    match named.split_last() {
        None => String::new(),
        Some((only, [])) => format!("the joint {only}"),
        Some((last, most)) => format!("the joints {} and {last}", most.join(", ")),
    }
}

/// Returns what an object with a name is called in a message.
fn named(what: &str, name: &str) -> String {
    if name.is_empty() {
        format!("no further {what}")
    } else {
        format!("the {what} `{name}`")
    }
}

/// Returns all digits of a number for a message, with an exponent where it is very large or very small.
#[must_use]
pub fn digits(value: f64) -> String {
    let size = value.abs();
    if value.is_finite() && size != 0.0 && !(1e-5..1e16).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// Returns a number rounded to three significant digits, for a message.
#[must_use]
pub fn three_digits(value: f64) -> f64 {
    // Every float in this format is a number again.
    format!("{value:.2e}").parse().unwrap_or(value)
}
