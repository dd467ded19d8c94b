//! The online identifier: one sample at a time, asked at any time.

use nalgebra::Vector3;
use tactid_dynamics::{InertialParameters, Manipulator};

use crate::equation::Equation;
use crate::estimate::{self, values};
use crate::excitation::Excitation;
use crate::front::Front;
use crate::information::Matrix;
use crate::latest::{Latest, is_physical};
use crate::method::Method;
use crate::noise::Channels;
use crate::physical::Follower;
use crate::recent::RecentMean;
use crate::uncertainty::identifiable;
use crate::{IdentifyError, PayloadEstimate, Sample, Settings, SingularValues};

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pushed {
    /// It was added to the windows that are open, and gave rows if it ended one.
    Used,
    /// The same, and it shows that the payload is another than before, or the noise far larger: the
    /// estimate begins anew. Least squares alone tells.
    Changed,
    /// It starts anew: it is the first, or comes after a gap.
    Started,
    /// It was not finite, or not later than the one before, and changed nothing.
    Refused,
}

/// What is left to do of the last window, a stage a sample: no sample then takes much longer than others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Estimate,
    Aim,
    Step,
    Look,
    /// Nearer to the nearest possible body.
    Approach,
}

/// With fewer samples to a window, all is done with the one that ends it.
const DENSE: u32 = 16;

/// Identifies the payload of one robot from its samples, online.
///
/// Both sides of the equations pass the same low-pass, [`Settings::cutoff_hz`], in its causal form:
/// wrench and acceleration belong to each other exactly, whatever the sample rate.
///
/// By least squares ([`EstimatorKind::Rls`]) it tells its uncertainty, too, a possible body wherever the
/// mass is positive, and a payload that is another than before: rows count by the noise that they
/// show, and the bias that noise in the motion makes is taken off. It assumes that noise is white within
/// a window, or as slow as its residuals show, and that the payload is rigid. The first 32 windows,
/// 1 s at 10 Hz, teach it the noise; before, its intervals are rough and no change is seen.
///
/// Nothing is allocated after construction. What a window says is computed with the eight samples that
/// follow its end, and is then told as a whole: no sample takes much longer than others, but for the three
/// of the first second that teach the noise. Cost: `cargo bench -p tactid-identify`.
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
/// let mut identifier = Identifier::new(&robot, "tool0", &["tool0"], Settings::paper())?;
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
    possible: Follower,
    stage: Stage,
    /// Samples since a window ended.
    samples: u32,
    /// The links below the tool, where the estimator finds them with the payload; at the window's end.
    gripper: Option<InertialParameters>,
    /// What a user reads, as of the last window whose stages are done.
    latest: Latest,
    /// Windows that gave rows.
    intervals: u64,
    changes: u64,
    since_s: f64,
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
        settings.check(robot, sensors)?;
        let front = Front::new(robot, tool, sensors, &settings)?;
        let mut identifier = Self {
            method: Method::new(settings.estimator, &front.model.grouping())?,
            gripper: front.model.gripper_to_subtract(),
            front,
            excitation: Excitation::new(),
            recent: (settings.average_s > 0.0).then(|| RecentMean::new(settings.average_s)),
            settings,
            possible: Follower::new(),
            stage: Stage::Estimate,
            samples: 0,
            latest: Latest::nothing(),
            intervals: 0,
            changes: 0,
            since_s: f64::NEG_INFINITY,
        };
        identifier.finish();
        Ok(identifier)
    }

    /// The gravitational acceleration that is assumed, in the inertial frame, m/s².
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        self.front.model.gravity()
    }

    /// Takes one sample.
    ///
    /// Cost: one pass over the robot's bodies, and one of eight stages of what the last window says; no
    /// allocation.
    ///
    /// # Errors
    /// Where a slice does not fit the robot or the sensors. Bad data are no error: see [`Pushed`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<Pushed, IdentifyError> {
        let mut ended = None;
        let pushed = self.filter(sample, |method, equation| {
            ended = Some((method.update(equation), equation.time_s));
        })?;
        self.samples = self.samples.saturating_add(1);
        let Some((changed, time_s)) = ended else {
            self.proceed();
            return Ok(pushed);
        };
        if changed {
            self.begin_anew(time_s);
        }
        self.stage = Stage::Estimate;
        self.gripper = self.front.model.gripper_to_subtract();
        let is_dense = std::mem::take(&mut self.samples) >= DENSE;
        // A change is told with the estimate that begins anew; the paper's filter has no stages.
        if changed || !is_dense || matches!(self.method, Method::TwoStage(_)) {
            self.finish();
        }
        Ok(if changed { Pushed::Changed } else { pushed })
    }

    /// Does at once what the last window has left to do, so that [`estimate`](Self::estimate) counts it: after
    /// the last sample of a recording. The samples that follow would do the same.
    pub fn finish(&mut self) {
        while self.stage != Stage::Approach {
            self.proceed();
        }
    }

    /// Gives the equation that the sample completed to `learn`, and learns nothing itself but how the
    /// motion excites: for those who solve all equations together.
    pub(crate) fn filter(
        &mut self,
        sample: &Sample<'_>,
        learn: impl FnOnce(&mut Method, &Equation),
    ) -> Result<Pushed, IdentifyError> {
        self.front.check_lengths(sample)?;
        let begins_with_wrench = self.front.model.begins_with_wrench();
        let (pushed, equation) = self.front.push(sample)?;
        if let Some(equation) = equation {
            self.intervals += 1;
            if begins_with_wrench {
                self.excitation.update(equation);
            }
            learn(&mut self.method, equation);
        }
        Ok(pushed)
    }

    /// Another payload: means and excitation are those of the new one.
    fn begin_anew(&mut self, time_s: f64) {
        self.changes += 1;
        self.since_s = time_s;
        self.excitation = Excitation::new();
        self.recent =
            (self.settings.average_s > 0.0).then(|| RecentMean::new(self.settings.average_s));
    }

    fn proceed(&mut self) {
        match self.stage {
            Stage::Estimate => {
                if !self.method.proceed() {
                    self.stage = Stage::Aim;
                }
            }
            Stage::Aim => {
                self.aim();
                self.stage = Stage::Step;
            }
            Stage::Step => {
                self.possible.step();
                self.stage = Stage::Look;
            }
            Stage::Look => {
                self.look();
                self.stage = Stage::Approach;
            }
            Stage::Approach if self.possible.is_settled() => {}
            Stage::Approach => {
                let was_far = self.possible.is_far();
                self.possible.step();
                if was_far && !self.possible.is_far() {
                    self.latest = self.knowledge();
                } else {
                    self.latest.move_to(&self.possible);
                }
            }
        }
    }

    /// Sets the possible body on its way to what the estimator has found.
    fn aim(&mut self) {
        if let Method::OneStage(estimator) = &self.method {
            let gripper = self.gripper.unwrap_or_else(InertialParameters::zero);
            let payload = estimator.parameters() - gripper.as_vector();
            self.possible.aim(&payload, &estimator.information());
        }
    }

    /// Updates what a user reads.
    fn look(&mut self) {
        self.latest = self.knowledge();
        if let Some(recent) = self.recent.as_mut().filter(|_| self.intervals > 0) {
            recent.push(self.front.time_s(), &values(&self.latest.body));
        }
    }

    /// What the estimator knows of the payload, in the terms that a user reads.
    fn knowledge(&self) -> Latest {
        let gripper = self.gripper.as_ref();
        match &self.method {
            Method::TwoStage(filters) => Latest::of_filters(&filters.body(), gripper),
            Method::OneStage(estimator) => {
                Latest::of_least_squares(estimator, &self.possible, gripper)
            }
        }
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

    /// Prepares for the same samples once more: what was learnt stays, times begin anew. It is for the
    /// paper's filter: least squares would take the samples for new ones, and be too sure.
    pub fn rewind(&mut self) {
        self.front.rewind();
        self.excitation = Excitation::new();
        (self.intervals, self.since_s) = (0, f64::NEG_INFINITY);
        if let Some(recent) = &mut self.recent {
            *recent = RecentMean::new(self.settings.average_s);
        }
    }

    /// The payload as known now: the mean over the last [`Settings::average_s`], or the latest. A window counts
    /// from the eighth sample after its end on, or once [finished](Self::finish).
    #[must_use]
    pub fn estimate(&self) -> PayloadEstimate {
        let mean = self.recent.as_ref().and_then(RecentMean::mean);
        let (body, is_physical) =
            mean.map_or((self.latest.body, self.latest.is_physical), |values| {
                let body = estimate::body(&values);
                (body, is_physical(&body))
            });
        let certainty = self.latest.certainty.as_ref();
        let (singular_values, identifiable) = match certainty {
            Some(certainty) => (None, identifiable(&values(&body), &certainty.deviations)),
            None => {
                let (singular_values, identifiable) = self.excitation.assess();
                (Some(singular_values), identifiable)
            }
        };
        PayloadEstimate {
            body,
            composite: self.latest.composite,
            identifiable,
            singular_values,
            is_physical,
            deviations: certainty.map(|certainty| certainty.deviations),
            intervals: self.intervals,
            changes: self.changes,
            since_s: self.since_s,
            refused: self.front.refused,
            gaps: self.front.gaps,
        }
    }

    /// Covariance of the payload's linear parameters, 10x10, in the order and units of
    /// [`InertialParameters`]; `None` for the paper's filter.
    ///
    /// A direction that the motion does not determine has the variance of a parameter of plausible size:
    /// one whose load alone would be all that is measured, or that is as large as the estimate before the
    /// last change. Before eight windows nothing is known, and all entries are zero.
    #[must_use]
    pub fn covariance(&self) -> Option<Matrix> {
        self.latest.certainty.map(|certainty| certainty.covariance)
    }

    /// What the wrenches are off by, in the end-effector's frame and about its origin: force in N, then
    /// moment in N m. `None` unless [`Settings::wrench_offset`] asks for it.
    #[must_use]
    pub fn wrench_offset(&self) -> Option<[f64; 6]> {
        match &self.method {
            Method::TwoStage(_) => None,
            Method::OneStage(estimator) => estimator.offsets(),
        }
    }

    /// How strongly the motion excited mass and inertia. Cost: two eigenvalue problems.
    #[must_use]
    pub fn singular_values(&self) -> SingularValues {
        self.excitation.assess().0
    }

    /// The latest values, not averaged, in the order of [`VALUE_NAMES`](crate::VALUE_NAMES).
    #[must_use]
    pub fn latest_values(&self) -> [f64; 10] {
        values(&self.latest.body)
    }
}
