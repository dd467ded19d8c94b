//! What to identify from a recording, and how.

use std::path::PathBuf;

use tactid_dynamics::MassProperties;

use crate::{BoundingBox, EstimatorKind, IdentifyError, KnownMass, Settings, Way};

/// Which topics of a log to read. What is left empty is found by its type.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topics {
    /// `sensor_msgs/msg/JointState`; several where each has a part of the joints.
    pub joints: Vec<String>,
    /// `geometry_msgs/msg/WrenchStamped`; their sum acts on the payload.
    pub wrenches: Vec<String>,
    /// `nav_msgs/msg/Odometry` of the base, or of the sensor itself where there are no joints.
    pub odometry: Option<String>,
    /// `geometry_msgs/msg/AccelStamped` of what the odometry moves.
    pub acceleration: Option<String>,
    /// `sensor_msgs/msg/Imu` on the tool, where there are neither joints nor odometry.
    pub imu: Option<String>,
}

/// On which body a measured wrench acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ActsOn {
    /// What the robot exerts on the payload.
    #[default]
    Payload,
    /// What the payload exerts on the sensor, as most force-torque sensors report it.
    Sensor,
}

/// What to identify from a recording, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// How; its way, its cutoff and its gap give way to what is said here.
    pub settings: Settings,
    /// Default (`None`): tactile where there are wrenches, else effort.
    pub way: Option<Way>,
    /// The end-effector frame. Default: `tool0`, or the wrench's frame where there is no robot.
    pub tool: Option<String>,
    /// The URDF as text. Default: the robot description in the log.
    pub urdf: Option<String>,
    /// Which topics to read.
    pub topics: Topics,
    /// Default: the payload.
    pub wrench_acts_on: ActsOn,
    /// A known body that the measured load holds besides the payload, in the tool frame: it is taken
    /// off.
    pub known_tool: Option<MassProperties>,
    /// The payload's mass where it was weighed: a row of its own in least squares.
    pub known_mass: Option<KnownMass>,
    /// Where the whole payload is: least squares then gives a body that fits in.
    pub bounding_box: Option<BoundingBox>,
    /// By how much later than the motion wrenches are stamped, s. Default: estimated, and corrected
    /// where it is significant.
    pub delay_s: Option<f64>,
    /// Default: chosen from the data.
    pub cutoff_hz: Option<f64>,
    /// Default: five periods of the slowest stream.
    pub max_gap_s: Option<f64>,
    /// A recording of the same motion without the payload, whose efforts are taken off.
    pub bare: Option<PathBuf>,
    /// What a unit of effort is in N m (N), a joint each in the robot's order. Default: 1.
    pub effort_gain: Vec<f64>,
}

impl Request {
    /// The paper's filter with the paper's settings, on a recording whose clocks agree.
    #[must_use]
    pub fn paper() -> Self {
        let settings = Settings::paper();
        Self {
            cutoff_hz: Some(settings.cutoff_hz),
            max_gap_s: Some(settings.max_gap_s),
            delay_s: Some(0.0),
            settings,
            ..Self::default()
        }
    }

    /// That what is known of the payload makes sense, and can be used.
    pub(crate) fn check_knowledge(&self) -> Result<(), IdentifyError> {
        let given = [
            (self.known_mass.is_some(), "a known mass"),
            (self.bounding_box.is_some(), "a bounding box"),
        ];
        match given.into_iter().find(|(given, _)| *given) {
            Some((_, what)) if !self.is_least_squares() => {
                return Err(IdentifyError::KnowledgeNeedsLeastSquares(what));
            }
            _ => {}
        }
        self.known_mass.map_or(Ok(()), |mass| mass.check())?;
        self.bounding_box
            .map_or(Ok(()), |bounding| bounding.check())
    }

    pub(crate) fn is_least_squares(&self) -> bool {
        self.settings.estimator == EstimatorKind::Rls
    }
}

impl Default for Request {
    /// Robust least squares, all else found in the log.
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            way: None,
            tool: None,
            urdf: None,
            topics: Topics::default(),
            wrench_acts_on: ActsOn::Payload,
            known_tool: None,
            known_mass: None,
            bounding_box: None,
            delay_s: None,
            cutoff_hz: None,
            max_gap_s: None,
            bare: None,
            effort_gain: Vec::new(),
        }
    }
}
