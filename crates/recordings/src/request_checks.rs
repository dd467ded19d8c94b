//! Checks of a request: each range and each combination once, before anything is read.

use tactid_batch::BatchSettings;
use tactid_dynamics::Manipulator;
use tactid_identify::{IdentifyError, Method};
use tactid_options::{About, Given, Use};

use crate::choices::{EstimatorKind, GravityChoice, WrenchIs};
use crate::paper::needs_least_squares;
use crate::request::FILTER;
use crate::request_tool::check_body;
use crate::{RecordingError, Request};

impl Request {
    /// Checks that nothing is given that a calibration sets or excludes.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] with the first such field.
    pub(crate) fn check_calibration(&self) -> Result<(), RecordingError> {
        const SET_OR_EXCLUDED: [&str; 6] = [
            "efforts_are",
            "effort_gain",
            "effort_gain_std_dev",
            "effort_noise",
            "gravity",
            "cutoff_hz",
        ];
        let is_excluded = |name| match name {
            "method" => self.method != Some(Method::Effort),
            "estimator" => self.estimator == Some(EstimatorKind::Nlms),
            other => SET_OR_EXCLUDED.contains(&other),
        };
        let mut names = self.given().map(|given| given.option.name);
        match names.find(|name| is_excluded(name)) {
            Some(option) => Err(RecordingError::Option {
                option,
                what: format!(
                    "`{option}` cannot be given together with a calibration, which {}",
                    why_not_with_calibration(option)
                ),
            }),
            None => Ok(()),
        }
    }

    /// Checks that each option that is given applies to arrays.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] with the first that does not.
    pub(crate) fn check_arrays(&self) -> Result<(), RecordingError> {
        // The unloaded reference of arrays is with the arrays.
        if self.unloaded.is_some() {
            return Err(does_not_apply("unloaded", ARRAYS));
        }
        self.check_applies(Use::Arrays, ARRAYS)
    }

    /// Checks that each option that is given applies to poses at rest.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] with the first that does not.
    pub(crate) fn check_poses(&self) -> Result<(), RecordingError> {
        self.check_applies(Use::Poses, "poses at rest")
    }

    /// Checks that each option that is given applies to a live session.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] with the first that does not, and
    /// [`RecordingError::Identify`] for an unknown that only a whole recording shows.
    pub(crate) fn check_live(&self) -> Result<(), RecordingError> {
        self.check_applies(Use::Live, "a live session")?;
        let settings = self.equation_settings(self.method.unwrap_or_default());
        Ok(settings.check_known()?)
    }

    /// Checks that each option that is given applies to a use, which errors call `name`.
    fn check_applies(&self, to: Use, name: &str) -> Result<(), RecordingError> {
        let is_other = |given: &Given| !given.option.uses.contains(&to);
        match self.given().find(is_other) {
            Some(given) => Err(does_not_apply(given.option.name, name)),
            None => Ok(()),
        }
    }

    /// Returns the names of the options that are given and ask for something, but are about
    /// measurements that are not used.
    pub(crate) fn without_effect(
        &self,
        uses_wrenches: bool,
        uses_efforts: bool,
    ) -> impl Iterator<Item = &'static str> {
        let is_used = move |about| match about {
            About::Wrenches => uses_wrenches,
            About::Efforts => uses_efforts,
        };
        let given = self.given().filter(|given| given.is_effective);
        let unused = given.filter(move |given| given.option.about.is_some_and(|a| !is_used(a)));
        unused.map(|given| given.option.name)
    }

    /// Checks the values that can be judged without a recording.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] or [`RecordingError::Option`] with the name of a field
    /// whose value is out of range or does not go with the other options.
    pub fn check(&self) -> Result<(), RecordingError> {
        self.check_estimator()?;
        if self.known_mass_kg.is_none() && self.known_mass_std_dev_kg.is_some() {
            return Err(RecordingError::Option {
                option: "known_mass_kg",
                what: "`known_mass_kg` is missing, but its standard deviation is given".to_owned(),
            });
        }
        if let (Some(begin_s), Some(end_s)) = (self.begin_s, self.end_s)
            && begin_s >= end_s
        {
            return Err(RecordingError::Option {
                option: "end_s",
                what: format!("`end_s` is {end_s}, which is not after `begin_s`, {begin_s}"),
            });
        }
        let knowledge = BatchSettings {
            known_mass: self.known_mass(),
            bounding_box: self.bounding_box,
            ..BatchSettings::default()
        };
        knowledge.check()?;
        self.check_values()
    }

    /// Checks the settings of the paper's filter, and that nothing is given that the estimator does
    /// not have.
    fn check_estimator(&self) -> Result<(), RecordingError> {
        if self.estimator == Some(EstimatorKind::Nlms) {
            self.paper_settings().check()?;
            if self.known_mass_kg.is_some() {
                return Err(needs_least_squares("a known mass").into());
            }
            if self.bounding_box.is_some() {
                return Err(needs_least_squares("a bounding box").into());
            }
            if self.shape.is_some() {
                return Err(needs_least_squares("a shape").into());
            }
            return Ok(());
        }
        match self.given().find(|given| given.option.group == FILTER) {
            Some(given) => Err(RecordingError::Option {
                option: given.option.name,
                what: format!(
                    "`{}` is an option of the paper's filter, and not of least squares",
                    given.option.name
                ),
            }),
            None => Ok(()),
        }
    }

    /// Checks how many values are given for the joints of a robot and for its `sensors`, those that
    /// the method uses.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] if the gains are not as many as the joints, and
    /// [`IdentifyError::Option`] if noise is given neither once for all nor once for each.
    pub(crate) fn check_counts(
        &self,
        robot: &Manipulator,
        sensors: usize,
    ) -> Result<(), RecordingError> {
        let joints = robot.joint_names();
        if let Some(gains) = &self.effort_gain
            && gains.len() != joints.len()
        {
            return Err(RecordingError::Option {
                option: "effort_gain",
                what: format!(
                    "{} effort gains for {} joints: give one for each joint, in the order {}",
                    gains.len(),
                    joints.len(),
                    joints.join(", ")
                ),
            });
        }
        let joints = joints.len();
        let counts = [
            ("wrench_noise", len(&self.wrench_noise), "sensors", sensors),
            ("effort_noise", len(&self.effort_noise), "joints", joints),
            (
                "effort_gain_std_dev",
                len(&self.effort_gain_std_dev),
                "joints",
                joints,
            ),
        ];
        for (name, given, of, expected) in counts {
            let Some(given) = given.filter(|_| expected > 0) else {
                continue;
            };
            if ![1, expected].contains(&given) {
                return Err(IdentifyError::miscounted(name, given, expected, of).into());
            }
        }
        Ok(())
    }

    /// Checks that each number of the request is in the range of its field.
    pub(crate) fn check_values(&self) -> Result<(), RecordingError> {
        self.given().try_for_each(|given| given.check())?;
        if let Some(frame) = &self.sensor_frame {
            frame.parent_from_sensor()?;
        }
        self.check_tool()?;
        self.check_shape()?;
        if let Some(configured) = self.configured_payload {
            check_body("configured_payload", configured.0)?;
        }
        self.check_subtracted()
    }

    /// Checks that a configured payload is given where, and only where, the wrenches lack it.
    fn check_subtracted(&self) -> Result<(), RecordingError> {
        let what = match (self.wrench_is.unwrap_or_default(), self.configured_payload) {
            (WrenchIs::Raw, Some(_)) => {
                "`configured_payload` is what the controller has subtracted from the wrenches, but these are raw: \
                 `wrench_is` says whether it has subtracted the weight alone (without-weight) or also the forces that \
                 accelerate the payload (contact)"
            }
            (WrenchIs::Contact, None) => {
                "`configured_payload` is missing: wrenches of contacts (`wrench_is`) lack the payload that is configured \
                 in the controller, and only with it do they show the payload that is held"
            }
            (_, Some(_)) if self.gravity == Some(GravityChoice::Unknown) => {
                "the direction in which the controller has subtracted the weight of `configured_payload` is that of its \
                 own gravity, which is unknown here: give `gravity`, or leave the payload out, so that `wrench_is` \
                 (without-weight) identifies the weight"
            }
            _ => return Ok(()),
        };
        Err(RecordingError::Option {
            option: "configured_payload",
            what: what.to_owned(),
        })
    }
}

/// Says why an option cannot be combined with a calibration.
fn why_not_with_calibration(option: &str) -> &'static str {
    match option {
        "method" => "is for the effort method",
        "estimator" => "needs least squares",
        "efforts_are" => "is for efforts as they are measured",
        "effort_noise" => "has the noise of the joint efforts",
        _ => "has its own",
    }
}

/// What errors call the use of arrays.
pub(crate) const ARRAYS: &str = "arrays";

/// Returns the error of an option that does not apply to a use.
pub(crate) fn does_not_apply(option: &'static str, to: &str) -> RecordingError {
    RecordingError::Option {
        option,
        what: format!("`{option}` does not apply to {to}"),
    }
}

/// Returns the number of entries of a field; `None` if it is not given.
fn len<T>(given: &Option<Vec<T>>) -> Option<usize> {
    given.as_ref().map(Vec::len)
}
