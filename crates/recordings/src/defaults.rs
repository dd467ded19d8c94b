//! Defaults of all options, for logs and arrays alike.

use nalgebra::Vector3;
use tactid_dynamics::{BaseKind, Manipulator, list_similar};
use tactid_identify::{EffortContent, EquationSettings, Method};

use crate::{EstimatorKind, Finding, NotUsedBecause, RecordingError, Request};

/// The end-effector frame of a robot where a request names none, as ROS-Industrial names it.
pub const DEFAULT_TIP: &str = "tool0";
/// Number of periods of the slowest stream that are bridged.
const GAP_PERIODS: f64 = 5.0;
/// Period that is assumed where no stream has two messages, s.
const UNKNOWN_PERIOD_S: f64 = 0.01;
/// Standard deviation of the relative error of a given gain: motor catalogues state tolerances of
/// the torque constant of some 10 %, which counts as two standard deviations.
pub(crate) const CLAIMED_GAIN_STD_DEV: f64 = 0.05;
/// Shortest default of the longest bridged gap, s: arrays may have a single sample.
const SHORTEST_GAP_S: f64 = 1e-9;

/// What measures the motion of the end-effector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// The joints of a robot, and its base if that moves.
    Joints,
    /// The pose of the sensor itself, which is carried about on the ground.
    Carried,
    /// An inertial measurement unit on the sensor, whose accelerations contain gravity.
    InertialUnit,
}

/// What a recording contains, as far as the defaults depend on it.
#[derive(Clone, Debug)]
pub(crate) struct Contents {
    pub(crate) motion: Motion,
    pub(crate) has_wrenches: bool,
    pub(crate) has_efforts: bool,
    /// Whether there is an unloaded reference, whose efforts are subtracted.
    pub(crate) has_unloaded: bool,
    /// Frame of the sensor where there is no robot.
    pub(crate) sensor_frame: String,
    /// Period of the slowest stream of joints and base, s; `None` where no stream has two messages.
    pub(crate) motion_period_s: Option<f64>,
    /// Period of the measured accelerations, s.
    pub(crate) acceleration_period_s: Option<f64>,
    /// Period of the slowest wrench sensor, s.
    pub(crate) wrench_period_s: Option<f64>,
}

impl Contents {
    /// Returns the period of the slowest stream that a method uses, s.
    fn slowest_period_s(&self, method: Method) -> f64 {
        let wrench_period_s = self.wrench_period_s.filter(|_| method.uses_wrench());
        let periods = [
            self.motion_period_s,
            self.acceleration_period_s,
            wrench_period_s,
        ];
        let slowest_s = periods.into_iter().flatten().reduce(f64::max);
        slowest_s.unwrap_or(UNKNOWN_PERIOD_S)
    }
}

/// All options of a request, with their defaults. What is still `None` is chosen from the beginning
/// of the recording.
#[derive(Clone, Debug)]
pub(crate) struct Options {
    pub(crate) estimator: EstimatorKind,
    pub(crate) tip: String,
    /// Settings of the equations, complete but for the cutoff where that is still to be chosen.
    pub(crate) equations: EquationSettings,
    /// Whether the cutoff is chosen from the beginning of the recording.
    pub(crate) chooses_cutoff: bool,
    pub(crate) delay_s: Option<f64>,
    /// Period of the slowest stream that is used, s.
    pub(crate) period_s: f64,
    /// 1, or -1 where the measured wrenches act on the sensor.
    pub(crate) wrench_sign: f64,
}

impl Options {
    /// Resolves a request for a recording. This is the only place where defaults are chosen.
    pub(crate) fn resolve(request: &Request, contents: &Contents) -> Self {
        let estimator = request.estimator.unwrap_or_default();
        let method = method(request.method, contents);
        let period_s = contents.slowest_period_s(method);
        // The paper's filter assumes clocks that agree, and has the paper's filter settings.
        let is_paper = estimator == EstimatorKind::Nlms;
        let mut equations = request.equation_settings(method);
        if contents.has_unloaded {
            equations.effort_content = EffortContent::External;
        }
        if !method.uses_wrench() {
            equations.wrench_noise.clear();
            equations.unknowns.weight = false;
        }
        equations.effort_gain_std_dev = effort_gain_std_devs(request);
        match contents.motion {
            Motion::Joints => {}
            Motion::Carried => {
                let on_the_ground = BaseKind::Fixed.default_gravity();
                equations.gravity.get_or_insert(on_the_ground);
            }
            Motion::InertialUnit => {
                equations.gravity = Some(Vector3::zeros());
                equations.unknowns.gravity = false;
            }
        }
        // Only the wrenches determine a delay.
        let has_no_delay = is_paper || method != Method::Tactile;
        Self {
            tip: request
                .tip
                .clone()
                .unwrap_or_else(|| match contents.motion {
                    Motion::Joints => DEFAULT_TIP.to_owned(),
                    Motion::Carried | Motion::InertialUnit => contents.sensor_frame.clone(),
                }),
            chooses_cutoff: request.cutoff_hz.is_none() && !is_paper,
            delay_s: request.delay_s.or(has_no_delay.then_some(0.0)),
            wrench_sign: request.wrench_acts_on.unwrap_or_default().sign(),
            equations,
            estimator,
            period_s,
        }
        .with_period(request, period_s)
    }

    /// Returns the options of the same recording where its measured accelerations are not used.
    pub(crate) fn without_acceleration(self, request: &Request, contents: &Contents) -> Self {
        let contents = Contents {
            acceleration_period_s: None,
            ..contents.clone()
        };
        let period_s = contents.slowest_period_s(self.method());
        self.with_period(request, period_s)
    }

    /// Returns the options for the period of the slowest stream, s, on which the longest bridged
    /// gap depends.
    fn with_period(mut self, request: &Request, period_s: f64) -> Self {
        self.period_s = period_s;
        if self.estimator == EstimatorKind::LeastSquares {
            let gap_s = (GAP_PERIODS * period_s).max(SHORTEST_GAP_S);
            self.equations.max_gap_s = request.max_gap_s.unwrap_or(gap_s);
        }
        self
    }

    /// Reports options that have no effect, because the recording or the method does not use what
    /// they are about.
    pub(crate) fn not_used(&self, request: &Request, contents: &Contents) -> Vec<Finding> {
        let method = self.method();
        let uses_wrenches = method.uses_wrench() && contents.has_wrenches;
        let because = NotUsedBecause::Method(method);
        let options = request.without_effect(uses_wrenches, method.uses_effort());
        let mut findings: Vec<Finding> = options.map(|option| because.of(option)).collect();
        findings.extend(motion_not_used(request, contents.motion));
        findings
    }

    /// Returns the measurements that the payload is identified from.
    pub(crate) fn method(&self) -> Method {
        self.equations.method
    }
}

/// Checks that a robot has the end-effector frame.
///
/// # Errors
/// Returns [`RecordingError::Tip`] if it does not have it.
pub(crate) fn check_tip(robot: &Manipulator, tip: &str) -> Result<(), RecordingError> {
    if robot.frame(tip).is_ok() {
        return Ok(());
    }
    Err(RecordingError::Tip(format!(
        "the robot has no link `{tip}`, which is to be the end-effector frame; its links are: {}",
        list_similar(tip, robot.frame_names())
    )))
}

/// Reports options about the motion that have no effect, because another topic measures it.
fn motion_not_used(request: &Request, motion: Motion) -> impl Iterator<Item = Finding> {
    let is_not_used = [
        (
            "acceleration_topic",
            request.acceleration_topic.is_some() && motion != Motion::Carried,
            NotUsedBecause::OtherMotion,
        ),
        (
            "imu_topic",
            request.imu_topic.is_some() && motion == Motion::Carried,
            NotUsedBecause::OtherMotion,
        ),
        (
            "gravity",
            request.gravity.is_some() && motion == Motion::InertialUnit,
            NotUsedBecause::GravityIsMeasured,
        ),
    ];
    is_not_used
        .into_iter()
        .filter(|(_, is_not_used, _)| *is_not_used)
        .map(|(option, _, because)| because.of(option))
}

/// Tactile where there are wrenches, else effort. The combined method uses efforts where they are
/// measured.
fn method(requested: Option<Method>, contents: &Contents) -> Method {
    match requested {
        Some(Method::Combined { .. }) => Method::Combined {
            effort: contents.has_efforts,
        },
        Some(method) => method,
        None if contents.has_wrenches => Method::Tactile,
        None => Method::Effort,
    }
}

/// Returns the effort of each joint for one unit of its recorded value, N m or N: that of the
/// calibration, of the request, or one.
pub(crate) fn effort_gains(request: &Request, joints: &[String]) -> Vec<f64> {
    if let Some(calibration) = &request.calibration {
        let gain = |joint: &String| calibration.effort_gain_of(joint).unwrap_or(1.0);
        return joints.iter().map(gain).collect();
    }
    let given = request.effort_gain.clone();
    given.unwrap_or_else(|| vec![1.0; joints.len()])
}

/// Returns the standard deviations of the relative errors of the gains, one for all joints or one
/// each; none where the gains are exact.
fn effort_gain_std_devs(request: &Request) -> Vec<f64> {
    let of_claim = request
        .effort_gain
        .is_some()
        .then(|| vec![CLAIMED_GAIN_STD_DEV]);
    let given = request.effort_gain_std_dev.clone();
    given.or(of_claim).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;
    use crate::ActsOn;
    use crate::{GravityChoice, OffsetChoice};

    fn contents(motion: Motion) -> Contents {
        Contents {
            motion,
            has_wrenches: true,
            has_efforts: false,
            has_unloaded: false,
            sensor_frame: "ft_sensor".to_owned(),
            motion_period_s: Some(0.002),
            acceleration_period_s: Some(0.02),
            wrench_period_s: Some(0.004),
        }
    }

    /// The method depends on what is measured, and on a request.
    #[test]
    fn method_follows_the_measurements() {
        let mut contents = contents(Motion::Joints);
        let method =
            |request: &Request, contents: &Contents| Options::resolve(request, contents).method();
        let open = Request::default();
        assert_eq!(method(&open, &contents), Method::Tactile);
        contents.has_wrenches = false;
        assert_eq!(method(&open, &contents), Method::Effort);
        let combined = Request {
            method: Some(Method::Combined { effort: true }),
            ..Request::default()
        };
        assert_eq!(
            method(&combined, &contents),
            Method::Combined { effort: false }
        );
        contents.has_efforts = true;
        assert_eq!(
            method(&combined, &contents),
            Method::Combined { effort: true }
        );
    }

    /// Tip and gravity depend on what moves.
    #[test]
    fn tip_and_gravity_follow_the_motion() {
        let down = Vector3::new(0.0, 0.0, -9.81);
        let given = Vector3::new(0.0, 9.81, 0.0);
        let asks = Request {
            tip: Some("flange".to_owned()),
            gravity: Some(GravityChoice::Given(given)),
            ..Request::default()
        };
        for (motion, tip, gravity, asked) in [
            (Motion::Joints, "tool0", None, Some(given)),
            (Motion::Carried, "ft_sensor", Some(down), Some(given)),
            (
                Motion::InertialUnit,
                "ft_sensor",
                Some(Vector3::zeros()),
                Some(Vector3::zeros()),
            ),
        ] {
            let open = Options::resolve(&Request::default(), &contents(motion));
            assert_eq!((open.tip.as_str(), open.equations.gravity), (tip, gravity));
            let resolved = Options::resolve(&asks, &contents(motion));
            assert_eq!(
                (resolved.tip.as_str(), resolved.equations.gravity),
                ("flange", asked)
            );
        }
    }

    fn not_used_option(finding: Finding) -> (&'static str, NotUsedBecause) {
        match finding {
            Finding::OptionNotUsed {
                option: Cow::Borrowed(option),
                because,
            } => (option, because),
            other => panic!("{other:?}"),
        }
    }

    /// An option about measurements that the method does not use is reported, and no other.
    #[test]
    fn options_without_effect_are_reported() {
        let mut contents = contents(Motion::Joints);
        contents.has_efforts = true;
        let not_used = |method: Method, contents: &Contents| -> Vec<&str> {
            let request = Request {
                method: Some(method),
                wrench_acts_on: Some(ActsOn::Sensor),
                delay_s: Some(0.01),
                wrench_offset: Some(OffsetChoice::Yes),
                wrench_noise: Some(vec![[1.0; 6]]),
                effort_noise: Some(vec![1.0]),
                effort_gain: Some(vec![1.0]),
                effort_gain_std_dev: Some(vec![0.1]),
                ..Request::default()
            };
            let findings = Options::resolve(&request, contents).not_used(&request, contents);
            let parts = findings.into_iter().map(not_used_option);
            let because = NotUsedBecause::Method(method);
            parts
                .inspect(|found| assert_eq!(found.1, because))
                .map(|found| found.0)
                .collect()
        };
        let of_wrench = ["delay_s", "wrench_offset", "wrench_acts_on", "wrench_noise"];
        let of_effort = ["effort_gain", "effort_gain_std_dev", "effort_noise"];
        assert_eq!(not_used(Method::Tactile, &contents), of_effort);
        assert_eq!(not_used(Method::Effort, &contents), of_wrench);
        let (gains, noise) = (&of_effort[..2], &of_effort[2..]);
        let all = [&of_wrench[..3], gains, &of_wrench[3..], noise].concat();
        assert_eq!(not_used(Method::JointSensing, &contents), all);
        let combined = Method::Combined { effort: true };
        assert!(not_used(combined, &contents).is_empty());
        contents.has_wrenches = false;
        assert_eq!(not_used(combined, &contents), of_wrench);
        let open = Request::default();
        let options = Options::resolve(&open, &contents);
        assert_eq!(options.not_used(&open, &contents), []);
    }

    /// Gravity is reported where an inertial unit measures it, and topics of a motion that another
    /// one measures.
    #[test]
    fn options_about_another_motion_are_reported() {
        let request = Request {
            gravity: Some(GravityChoice::Given(Vector3::new(0.0, 0.0, -9.81))),
            wrench_topic: Some(vec!["/wrench".to_owned()]),
            acceleration_topic: Some("/acceleration".to_owned()),
            imu_topic: Some("/imu".to_owned()),
            ..Request::default()
        };
        let not_used = |request: &Request, motion| -> Vec<(&str, NotUsedBecause)> {
            let contents = contents(motion);
            let findings = Options::resolve(request, &contents).not_used(request, &contents);
            findings.into_iter().map(not_used_option).collect()
        };
        let acceleration = ("acceleration_topic", NotUsedBecause::OtherMotion);
        let imu = ("imu_topic", NotUsedBecause::OtherMotion);
        let gravity = ("gravity", NotUsedBecause::GravityIsMeasured);
        assert_eq!(not_used(&request, Motion::Joints), [acceleration]);
        assert_eq!(not_used(&request, Motion::Carried), [imu]);
        assert_eq!(
            not_used(&request, Motion::InertialUnit),
            [acceleration, gravity]
        );
        let effort = Request {
            method: Some(Method::Effort),
            acceleration_topic: None,
            ..request
        };
        let wrenches = ("wrench_topic", NotUsedBecause::Method(Method::Effort));
        assert_eq!(not_used(&effort, Motion::Joints), [wrenches]);
    }

    /// The gap is five periods of the slowest stream that is used; the paper's filter has settings
    /// of its own.
    #[test]
    fn gap_cutoff_and_delay_follow_the_estimator() {
        let contents = contents(Motion::Carried);
        let open = Options::resolve(&Request::default(), &contents);
        assert_eq!((open.chooses_cutoff, open.delay_s), (true, None));
        assert!((open.equations.max_gap_s - 0.1).abs() < 1e-12);
        let without = open.without_acceleration(&Request::default(), &contents);
        assert!((without.equations.max_gap_s - 0.02).abs() < 1e-12);
        let effort = Request {
            method: Some(Method::Effort),
            ..Request::default()
        };
        let effort = Options::resolve(&effort, &contents).without_acceleration(&effort, &contents);
        assert!((effort.equations.max_gap_s - 0.01).abs() < 1e-12);
        assert_eq!(effort.delay_s, Some(0.0));
        let paper = Options::resolve(&Request::paper(), &contents);
        assert!(!paper.chooses_cutoff);
        let equations = &paper.equations;
        assert_eq!(
            (equations.cutoff_hz, equations.max_gap_s, paper.delay_s),
            (10.0, 0.1, Some(0.0))
        );
        let given = Request {
            cutoff_hz: Some(3.0),
            max_gap_s: Some(0.3),
            delay_s: Some(0.01),
            ..Request::paper()
        };
        let given = Options::resolve(&given, &contents);
        assert!(!given.chooses_cutoff);
        let equations = &given.equations;
        assert_eq!(
            (equations.cutoff_hz, equations.max_gap_s, given.delay_s),
            (3.0, 0.3, Some(0.01))
        );
    }
}
