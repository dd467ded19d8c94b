//! What an online solver is created from.

use tactid_batch::{LagIdentifier, LagSettings};
use tactid_dynamics::{BaseKind, Manipulator};
use tactid_identify::{EquationSettings, Identifier, IdentifyError, Method, OnlineSettings};

use crate::defaults::DEFAULT_TIP;
use crate::paper::{PaperFilter, PaperSettings};
use crate::sources::{SENSOR_FRAME, place_sensor};
use crate::{EstimatorKind, OffsetChoice, RecordingError, Request};

/// What an online solver is created from, with the defaults of a request for what it leaves open.
///
/// Nothing is chosen from data. Fields of a request that an online solver does not have are not
/// used.
#[derive(Clone, Debug)]
pub struct OnlineSetup {
    /// The robot, or the body of a sensor alone, whose motion is that of its base.
    pub robot: Manipulator,
    /// End-effector frame, in which the payload is expressed.
    pub tip: String,
    /// Links in whose frames the wrenches of a sample are.
    pub sensors: Vec<String>,
    /// Settings of the equations.
    pub settings: EquationSettings,
    /// What is known of load and wrenches.
    pub online: OnlineSettings,
}

impl OnlineSetup {
    /// Resolves a request for samples of a robot, or of a sensor alone where `robot` is `None`.
    ///
    /// `sensors` are the links of the wrench sensors; where they are `None`, the tactile method has
    /// one in the end-effector frame, and other methods have none. `effort` says whether the
    /// samples of [`Method::Combined`] have efforts. A sensor alone is on the ground: its gravity
    /// is 9.81 m/s² along -z by default, and its frame is called `sensor`, unless the request names
    /// it as the tip.
    ///
    /// # Errors
    /// Returns [`RecordingError::Identify`] if a value of the request is out of range, and
    /// [`RecordingError::Option`] for a quaternion of `sensor_frame` without the norm 1.
    pub fn new(
        request: &Request,
        robot: Option<&Manipulator>,
        sensors: Option<&[&str]>,
        effort: bool,
    ) -> Result<Self, RecordingError> {
        request.check_values()?;
        let method = match request.method.unwrap_or_default() {
            Method::Combined { .. } => Method::Combined { effort },
            other => other,
        };
        let mut settings = request.equation_settings(method);
        // Nothing is chosen from data, and what an unknown offset costs is in the intervals.
        settings.wrench_offset |= request.wrench_offset == Some(OffsetChoice::Auto);
        if robot.is_none() {
            let on_the_ground = BaseKind::Fixed.default_gravity();
            settings.gravity.get_or_insert(on_the_ground);
        }
        let default_tip = if robot.is_some() {
            DEFAULT_TIP
        } else {
            SENSOR_FRAME
        };
        let tip = request.tip.as_deref().unwrap_or(default_tip);
        request.tool_at(tip, EstimatorKind::LeastSquares)?;
        let at_the_tip = if method == Method::Tactile {
            &[tip][..]
        } else {
            &[]
        };
        let sensors = sensors.unwrap_or(at_the_tip).iter();
        let mut sensors: Vec<String> = sensors.map(|&name| name.to_owned()).collect();
        let mut robot = robot.map_or_else(|| Manipulator::lone_body(tip), Clone::clone);
        if let Some(given) = &request.sensor_frame {
            let (placed, sensor) = place_sensor(&robot, given, &sensors)?;
            (robot, sensors) = (placed, vec![sensor]);
        }
        Ok(Self {
            robot,
            sensors,
            online: OnlineSettings {
                known_tool: request.known_tool(),
                wrench_acts_on: request.wrench_acts_on.unwrap_or_default(),
                delay_s: request.delay_s.unwrap_or(0.0),
            },
            tip: tip.to_owned(),
            settings,
        })
    }

    /// Creates the identifier by least squares.
    ///
    /// # Errors
    /// Returns the errors of [`Identifier::with_settings`].
    pub fn identifier(&self) -> Result<Identifier, IdentifyError> {
        let sensors = self.sensor_names();
        let (settings, online) = (&self.settings, &self.online);
        Identifier::with_settings(&self.robot, &self.tip, &sensors, settings, online)
    }

    /// Creates the identifier of motion and payload at once, with a lag in s.
    ///
    /// # Errors
    /// Returns the errors of [`LagIdentifier::new`].
    pub fn lag_identifier(&self, lag_s: f64) -> Result<LagIdentifier, IdentifyError> {
        let sensors = self.sensor_names();
        let settings = LagSettings {
            lag_s,
            online: self.online,
            ..LagSettings::default()
        };
        LagIdentifier::new(&self.robot, &self.tip, &sensors, &self.settings, settings)
    }

    /// Creates the paper's filter.
    ///
    /// # Errors
    /// Returns the errors of [`PaperFilter::new`].
    pub fn paper_filter(&self, paper: PaperSettings) -> Result<PaperFilter, IdentifyError> {
        let sensors = self.sensor_names();
        PaperFilter::new(&self.robot, &self.tip, &sensors, &self.settings, paper)
    }

    fn sensor_names(&self) -> Vec<&str> {
        self.sensors.iter().map(String::as_str).collect()
    }
}
