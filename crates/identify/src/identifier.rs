//! The online identifier: one sample at a time, asked at any time.

use nalgebra::Vector3;
use tactid_dynamics::{BaseKind, InertialParameters, Manipulator, MassProperties};

use crate::equation::Equation;
use crate::estimate::{self, values, without};
use crate::excitation::Excitation;
use crate::front::Front;
use crate::method::Method;
use crate::noise::Channels;
use crate::recent::RecentMean;
use crate::{EstimatorKind, IdentifyError, PayloadEstimate, Sample, Settings, Way};

/// By how much of its largest principal moment an estimate may miss the triangle inequality and still
/// count as possible: plates and rods lie on the border, and no estimate is exact.
const BORDER: f64 = 0.01;

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pushed {
    /// It was added to the windows that are open, and gave rows if it ended one.
    Used,
    /// It starts anew: it is the first, or comes after a gap.
    Started,
    /// It was not finite, or not later than the one before, and changed nothing.
    Refused,
}

/// Identifies the payload of one robot from its samples, online.
///
/// Both sides of the equations pass the same low-pass, [`Settings::cutoff_hz`], in its causal form:
/// wrench and acceleration belong to each other exactly, whatever the sample rate. Nothing is
/// allocated after construction.
///
/// ```
/// use tactid_dynamics::{BaseKind, Manipulator};
/// use tactid_identify::{Identifier, Settings};
///
/// # let urdf = r#"<robot name="arm"><link name="base"><inertial><mass value="9"/>
/// #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
/// #   <link name="tool0"><inertial><mass value="1"/>
/// #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
/// #   <joint name="hinge" type="continuous"><parent link="base"/><child link="tool0"/></joint></robot>"#;
/// let robot = Manipulator::from_urdf(urdf, BaseKind::Floating)?;
/// let mut identifier = Identifier::new(&robot, "tool0", &["tool0"], Settings::default())?;
/// // for each sample: identifier.push(&sample)?;
/// let estimate = identifier.estimate();
/// assert_eq!(estimate.intervals, 0);
/// assert_eq!(estimate.not_identifiable().count(), 10); // nothing is known yet
/// # Ok::<(), tactid_identify::IdentifyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Identifier {
    settings: Settings,
    front: Front,
    method: Method,
    excitation: Excitation,
    recent: Option<RecentMean>,
}

impl Identifier {
    /// For a robot whose end-effector frame is the link `tool` and whose wrenches are measured in the
    /// links `sensors`.
    ///
    /// # Errors
    /// A link that the robot does not have, a setting out of range, or a way that this robot does
    /// not allow.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        settings: Settings,
    ) -> Result<Self, IdentifyError> {
        check(robot, sensors, &settings)?;
        Ok(Self {
            front: Front::new(robot, tool, sensors, &settings)?,
            method: Method::new(settings.estimator)?,
            excitation: Excitation::new(),
            recent: (settings.average_s > 0.0).then(|| RecentMean::new(settings.average_s)),
            settings,
        })
    }

    /// The gravitational acceleration that is assumed, in the inertial frame, m/s².
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        self.front.model.gravity()
    }

    /// Takes one sample.
    ///
    /// Cost: one pass over the robot's bodies, and one update of the estimator for each window that
    /// ends; no allocation.
    ///
    /// # Errors
    /// Where a slice does not fit the robot or the sensors. Bad data are no error: see [`Pushed`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<Pushed, IdentifyError> {
        self.push_with(sample, &mut |_| ())
    }

    /// The same, showing the equation that the sample completed.
    pub(crate) fn push_with(
        &mut self,
        sample: &Sample<'_>,
        sink: &mut dyn FnMut(&Equation),
    ) -> Result<Pushed, IdentifyError> {
        self.front.check_lengths(sample)?;
        let begins_with_wrench = self.front.model.begins_with_wrench();
        let (pushed, equation) = self.front.push(sample)?;
        let Some(equation) = equation else {
            return Ok(pushed);
        };
        sink(equation);
        self.method.update(equation);
        if begins_with_wrench {
            self.excitation.update(equation);
        }
        if let Some(recent) = &mut self.recent {
            let now = values(&payload(&self.settings, &self.front, &self.method.body()));
            recent.push(sample.time_s, &now);
        }
        Ok(pushed)
    }

    /// What each row of an equation is measured in: name and unit.
    pub(crate) fn channels(&self) -> Vec<(String, &'static str)> {
        self.front.model.channels()
    }

    /// How the channels belong together.
    pub(crate) fn grouping(&self) -> Channels {
        self.front.model.grouping()
    }

    /// The known links below the tool, at the posture of the last sample.
    pub(crate) fn gripper(&self) -> InertialParameters {
        self.front.model.gripper()
    }

    /// Prepares for the same samples once more: what was learnt stays, times begin anew.
    pub fn rewind(&mut self) {
        self.front.rewind();
        self.excitation = Excitation::new();
        if let Some(recent) = &mut self.recent {
            *recent = RecentMean::new(self.settings.average_s);
        }
    }

    /// The payload as known now: the mean over the last [`Settings::average_s`], or the latest.
    #[must_use]
    pub fn estimate(&self) -> PayloadEstimate {
        let latest = self.method.body();
        let mean = self.recent.as_ref().and_then(RecentMean::mean);
        let body = mean.map_or_else(
            || payload(&self.settings, &self.front, &latest),
            |values| estimate::body(&values),
        );
        let (singular_values, identifiable) = self.excitation.assess();
        PayloadEstimate {
            body,
            composite: (self.settings.way == Way::JointSensing).then_some(latest),
            identifiable,
            singular_values,
            is_physical: is_physical(&body),
            deviations: None,
            intervals: self.excitation.intervals(),
            refused: self.front.refused,
            gaps: self.front.gaps,
        }
    }

    /// The latest values, not averaged, in the order of [`VALUE_NAMES`](crate::VALUE_NAMES).
    #[must_use]
    pub fn latest_values(&self) -> [f64; 10] {
        values(&payload(&self.settings, &self.front, &self.method.body()))
    }
}

/// Whether a body can have these properties, within what an estimate may miss.
pub(crate) fn is_physical(body: &MassProperties) -> bool {
    InertialParameters::from(*body).is_physical_within(BORDER)
}

/// The identified body less the gripper, where the way of measuring includes it.
fn payload(settings: &Settings, front: &Front, identified: &MassProperties) -> MassProperties {
    match settings.way {
        Way::Tactile | Way::Effort | Way::Combined { .. } => *identified,
        Way::JointSensing => without(identified, &front.model.gripper()),
    }
}

fn check(robot: &Manipulator, sensors: &[&str], settings: &Settings) -> Result<(), IdentifyError> {
    match settings.way {
        Way::Tactile if sensors.is_empty() => return Err(IdentifyError::NoWrench),
        Way::Effort | Way::Combined { .. }
            if matches!(settings.estimator, EstimatorKind::Nlms { .. }) =>
        {
            return Err(IdentifyError::NeedsLeastSquares(settings.way.name()));
        }
        Way::Combined { effort: false }
            if sensors.is_empty() && robot.base_kind() == BaseKind::Fixed =>
        {
            return Err(IdentifyError::NoWrench);
        }
        Way::JointSensing if robot.base_kind() == BaseKind::Fixed => {
            return Err(IdentifyError::FixedBase);
        }
        _ => {}
    }
    let refuse = |name, given, wanted| {
        Err(IdentifyError::Value {
            name,
            given,
            wanted,
        })
    };
    if !(settings.average_s >= 0.0 && settings.average_s.is_finite()) {
        return refuse("average_s", settings.average_s, "zero or more");
    }
    if !(settings.cutoff_hz > 0.0 && settings.cutoff_hz.is_finite()) {
        return refuse("cutoff_hz", settings.cutoff_hz, "more than zero");
    }
    if settings.epochs == 0 {
        return refuse("epochs", 0.0, "one or more");
    }
    if settings.max_gap_s.is_nan() || settings.max_gap_s <= 0.0 {
        return refuse("max_gap_s", settings.max_gap_s, "more than zero");
    }
    let gravity = settings.gravity_for(robot.base_kind());
    match gravity.iter().find(|entry| !entry.is_finite()) {
        Some(&entry) => refuse("gravity", entry, "finite"),
        None => Ok(()),
    }
}
