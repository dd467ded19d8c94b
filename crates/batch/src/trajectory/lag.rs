//! Motion and payload at once, while samples come.

use std::sync::Arc;

use tactid_dynamics::Manipulator;
use tactid_identify::equations::{EquationSettings, PushOutcome, Sample};
use tactid_identify::solve::NullSpace;
use tactid_identify::{
    BoundingBox, Identifier, IdentifyError, OnlineSettings, PayloadEstimate, Range,
};

use super::MotionEstimate;
use super::bins::{SampleBins, check_suited};
use super::estimate::Estimate;
use super::fixed_lag::FixedLagSmoother;
use crate::PriorKnowledge;
use crate::diagnosis::nearest_consistent;
use crate::solve::Posterior;

/// Range of [`LagSettings::lag_s`]: from two intervals between knots, s.
const LAG_S: Range = Range {
    contains: |lag_s| (0.1..=10.0).contains(&lag_s),
    expected: "between 0.1 and 10",
};

/// Settings of a [`LagIdentifier`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LagSettings {
    /// Time before the last sample in which the motion may still change, s, from 0.1 to 10.
    /// Rounded up to intervals of 0.05 s. Time and memory grow with it. Default: 0.1 s.
    pub lag_s: f64,
    /// A known body in the load, and the sign and the delay of the wrenches, as the online
    /// identifier has them. Default: none, on the payload, 0 s.
    pub online: OnlineSettings,
    /// A box in the end-effector frame that contains the whole payload: the estimate is projected
    /// onto bodies that fit into it. Default: none.
    pub bounding_box: Option<BoundingBox>,
}

impl Default for LagSettings {
    fn default() -> Self {
        Self {
            lag_s: 0.1,
            online: OnlineSettings::default(),
            bounding_box: None,
        }
    }
}

/// Estimates the motion of a free-floating robot together with its payload, while samples come: the
/// estimate of [`BatchIdentifier`](crate::BatchIdentifier) for [`MotionEstimate::WithPayload`],
/// with a memory that does not grow.
///
/// # Method
/// It is a fixed-lag smoother: the motion that is older than the lag is marginalised out. Later
/// samples do not change it, and what it says of the payload is kept. An online identifier of its
/// own, [`online`](Self::online), gives the first parameters and detects payload changes, after
/// which everything begins again. The first estimate needs 0.8 s, or the lag and 0.05 s where that is
/// longer, also after a gap, and every 0.05 s it is renewed with the samples until then.
///
/// The estimate differs from that of a recording in three ways. Rows have the weights that follow
/// from the samples until they were marginalised, so that those of the first second are less
/// precise. Residuals, and with them the intervals, are those of the motion at that time. Wrong
/// assumptions are not looked for, but where residuals are larger than noise: see
/// [`online_findings`](crate::online_findings).
///
/// A gap of the samples, and a motion that splines do not follow, end the motion, and what is known
/// of the payload stays. Residuals that are larger than noise, of all samples or of any stretch of
/// 1.2 s (72 samples where they are rarer than 60 Hz), discard it. There is no estimate where that
/// of the online identifier is as precise.
///
/// # Assumptions
/// Those of [`Identifier`], and velocities of the joints and of the base that are measured, not
/// differentiated from positions and poses.
///
/// # Cost
/// It allocates, and the sample that completes 0.05 s takes some 8 ms for a robot with eight joints
/// and all sources, that of the first estimate 60 ms (measured in the profile of the tests): it
/// belongs in a thread beside the control loop, which gets copies of the samples.
///
/// # Source
/// Dong-Si and Mourikis 2011 for the marginalisation; the normal equations are those of a recording.
///
/// # Example
/// ```no_run
/// use tactid_batch::{LagIdentifier, LagSettings};
/// use tactid_dynamics::{BaseKind, Manipulator};
/// use tactid_identify::{EquationSettings, Method, Sample};
///
/// # fn samples() -> Vec<Sample<'static>> { Vec::new() }
/// let urdf = std::fs::read_to_string("robot.urdf")?;
/// let robot = Manipulator::from_urdf(&urdf, BaseKind::Floating)?;
/// let equations = EquationSettings {
///     method: Method::Combined { effort: true },
///     ..EquationSettings::default()
/// };
/// let sensors = ["finger_left_link", "finger_right_link"];
/// let settings = LagSettings::default();
/// let mut identifier = LagIdentifier::new(&robot, "tool0", &sensors, &equations, settings)?;
/// for sample in samples() {
///     identifier.push(&sample)?;
/// }
/// // Where it has none, the estimate of windows is the right one, and `motion` says why.
/// let estimate = identifier.estimate().unwrap_or_else(|| identifier.online().estimate());
/// println!("{} kg ({:?})", estimate.body.mass_kg, identifier.motion());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct LagIdentifier {
    frame: Arc<str>,
    bounding_box: Option<BoundingBox>,
    /// Whether the identified body contains links of the robot.
    has_gripper: bool,
    online: Identifier,
    smoother: FixedLagSmoother,
}

impl LagIdentifier {
    /// Creates an identifier for a robot whose end-effector frame is the link `tool` and whose
    /// wrenches are measured in the links `sensors`.
    ///
    /// # Errors
    /// Returns the errors of [`Identifier::with_settings`], and [`IdentifyError::Option`] for a lag
    /// that is out of its range, for a box without volume, and for a robot or settings for which
    /// there is never such an estimate: a fixed base, no joints, an unknown offset, channels of
    /// the wrenches that are not measured or interpolated, or uncertain gains of efforts.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        equations: &EquationSettings,
        settings: LagSettings,
    ) -> Result<Self, IdentifyError> {
        let LagSettings {
            lag_s,
            bounding_box,
            online,
        } = settings;
        LAG_S.check("lag_s", &[lag_s])?;
        bounding_box.map_or(Ok(()), |given| given.check("bounding_box"))?;
        let online = Identifier::with_settings(robot, tool, sensors, equations, &online)?;
        check_suited(robot, equations)?;
        let stream = online.snapshot().stream;
        let bins = SampleBins::new(robot, sensors.len(), equations, None);
        Ok(Self {
            frame: tool.into(),
            bounding_box,
            has_gripper: stream.gripper_to_subtract().is_some(),
            online,
            smoother: FixedLagSmoother::new(stream.model().clone(), bins, lag_s),
        })
    }

    /// Adds one sample, in the frames and units of [`Sample`], and reports a payload change as
    /// [`Identifier::push`] does.
    ///
    /// # Errors
    /// Returns the errors of [`Identifier::push`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        let Self {
            online, smoother, ..
        } = self;
        online.push_with(sample, |online, sample, outcome| {
            smoother.push(online, sample, outcome);
        })
    }

    /// Completes the update of the [`online`](Self::online) identifier that later samples would
    /// complete, as [`Identifier::finish`] does. More samples may follow.
    pub fn finish_windows(&mut self) {
        self.online.finish();
    }

    /// Uses the samples of the open bin; to be called after the last sample of a run.
    ///
    /// Motion is estimated up to the end of an interval of 0.05 s, so that up to that time of the
    /// last samples stays unused.
    pub fn finish(&mut self) {
        self.online.finish();
        self.smoother.finish(&self.online);
    }

    /// Returns the estimate of the payload in the end-effector frame, in the units of
    /// [`PayloadEstimate`], with its covariance; `None` where [`motion`](Self::motion) says why.
    ///
    /// Cost: a projection onto physically consistent parameters.
    #[must_use]
    pub fn estimate(&self) -> Option<PayloadEstimate> {
        let found = self.smoother.found().ok()?;
        Some(self.reported(found))
    }

    /// Returns that the motion is estimated together with the payload, or why it is not. While
    /// samples come, the reasons are:
    ///
    /// | reason | meaning |
    /// |---|---|
    /// | [`Smoothed`](MotionEstimate::Smoothed) | the windows determine not all values yet (their cutoff may let too much noise through), or samples had other accelerations of the base than before |
    /// | [`NoVelocities`](MotionEstimate::NoVelocities) | the last samples had no velocities |
    /// | [`TooFew`](MotionEstimate::TooFew) | fewer than 0.8 s, or than the lag and 0.05 s, since the begin, a payload change, or a gap before which there was no estimate, or fewer than 40 samples in a second |
    /// | [`TooFast`](MotionEstimate::TooFast) | the last second had frequencies that splines do not follow |
    /// | [`Unexplained`](MotionEstimate::Unexplained) | residuals were larger than their noise, of all samples or of any stretch of 1.2 s: everything begins again |
    /// | [`Exact`](MotionEstimate::Exact) | the estimate of the online identifier is at least as precise, so far |
    #[must_use]
    pub fn motion(&self) -> MotionEstimate {
        let reason = self.smoother.found().err();
        reason.unwrap_or(MotionEstimate::WithPayload)
    }

    /// Returns the time until which samples are in the last estimate, s: it stays behind where a
    /// gap or a fast motion interrupts them. Minus infinity before the first.
    #[must_use]
    pub fn until_s(&self) -> f64 {
        self.smoother.until_s()
    }

    /// Returns the online identifier, which has the same samples: its estimate, and the
    /// [`Snapshot`](tactid_identify::Snapshot) of which findings are computed.
    #[must_use]
    pub fn online(&self) -> &Identifier {
        &self.online
    }

    /// Returns what a user reads of an estimate.
    fn reported(&self, found: &Estimate) -> PayloadEstimate {
        let known = self.online.known_bodies();
        let (payload, metric) = known.payload(&found.parameters, &found.metric, None);
        let scales = found.of_white_noise.diagonal().map(f64::sqrt);
        let bounding_box = self.bounding_box;
        let consistent = nearest_consistent(payload, &metric, &scales, bounding_box.as_ref());
        let null_space = NullSpace::new(scales, std::iter::empty());
        let posterior = Posterior::of_load(
            (&found.parameters, &found.covariance, None),
            &known,
            (consistent.parameters, consistent.widening),
            &null_space,
        );
        let prior = PriorKnowledge {
            bounding_box,
            known_mass: None,
        };
        let online = self.online.estimate();
        PayloadEstimate {
            composite: posterior.composite(&known).filter(|_| self.has_gripper),
            windows: online.windows,
            payload_changes: online.payload_changes,
            since_s: online.since_s,
            rejected: online.rejected,
            gaps: online.gaps,
            ..posterior.report(&self.frame, &prior).estimate
        }
    }
}
