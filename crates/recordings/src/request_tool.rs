//! The known tool of a request: its uncertainty, and checks.

use tactid_dynamics::words::general;
use tactid_dynamics::{InertialParameters, MassProperties};
use tactid_identify::KnownTool;

use crate::choices::EstimatorKind;
use crate::{Finding, RecordingError, Request};

/// Standard deviation of the values of a tool whose uncertainty is not given, relative to the
/// largest of their kind: between the mass of a data sheet, which is good to some tenths of a
/// percent, and the inertia of a CAD model without its cables.
const ASSUMED_STD_DEV: f64 = 0.01;

/// Violation of the triangle inequality of a tool's principal moments that is tolerated, a
/// fraction: those of a data sheet are rounded.
const ROUNDED: f64 = 0.02;

/// Coordinate of a centre of mass from which on it is not in m: no arm carries a body that is as far
/// from its tip, and a centimetre in mm looks like it.
const FARTHEST_M: f64 = 10.0;

impl Request {
    /// Returns the known tool with the uncertainty that is given or assumed.
    pub(crate) fn known_tool(&self) -> Option<KnownTool> {
        let tool = self.known_tool.as_ref()?;
        let std_dev = self.known_tool_std_dev.unwrap_or(ASSUMED_STD_DEV);
        Some(match tool.covariance {
            Some(covariance) => KnownTool {
                body: tool.body,
                covariance,
            },
            None => KnownTool::with_relative_std_dev(tool.body, std_dev),
        })
    }

    /// Reports that least squares assumes the uncertainty of the known tool.
    fn assumed_tool_uncertainty(&self) -> Option<Finding> {
        let is_given = self.known_tool_std_dev.is_some();
        let tool = self.known_tool.as_ref().filter(|_| !is_given)?;
        tool.covariance
            .is_none()
            .then_some(Finding::ToolUncertaintyAssumed {
                std_dev: ASSUMED_STD_DEV,
            })
    }

    /// Checks that a known tool can exist, and that its uncertainty is given once.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] with the option that is wrong.
    pub(crate) fn check_tool(&self) -> Result<(), RecordingError> {
        let error = |option: &'static str, what: &str| {
            Err(RecordingError::Option {
                option,
                what: what.to_owned(),
            })
        };
        let Some(tool) = &self.known_tool else {
            return match self.known_tool_std_dev {
                Some(_) => error(
                    "known_tool",
                    "`known_tool` is missing, but its standard deviation is given",
                ),
                None => Ok(()),
            };
        };
        if tool.covariance.is_some() && self.known_tool_std_dev.is_some() {
            return error(
                "known_tool_std_dev",
                "`known_tool_std_dev` is for a tool without an uncertainty, but `known_tool` is an earlier result, which \
                 has its own",
            );
        }
        // What was identified need not be exactly consistent, and may be known in part.
        if tool.covariance.is_some() && tool.body.mass_kg > 0.0 {
            return check_center("known_tool", tool.body);
        }
        check_body("known_tool", tool.body)
    }

    /// Checks that an earlier result is in the frame `tip`, and reports an uncertainty that is
    /// assumed.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] if it is in another one.
    pub(crate) fn tool_at(
        &self,
        tip: &str,
        estimator: EstimatorKind,
    ) -> Result<Option<Finding>, RecordingError> {
        let frame = self
            .known_tool
            .as_ref()
            .and_then(|tool| tool.frame.as_ref());
        match frame.filter(|frame| *frame != tip) {
            Some(frame) => Err(RecordingError::Option {
                option: "known_tool",
                what: format!(
                    "`known_tool` was identified in the frame `{frame}`, but the payload is in the frame `{tip}`: identify \
                     both with the same `tip`"
                ),
            }),
            None if estimator == EstimatorKind::Nlms => Ok(None),
            None => Ok(self.assumed_tool_uncertainty()),
        }
    }
}

/// Checks that a body that an option gives can exist.
///
/// # Errors
/// Returns [`RecordingError::Option`] if its mass is not positive, its moments of inertia are
/// impossible, or its centre of mass is not in m.
pub(crate) fn check_body(option: &'static str, body: MassProperties) -> Result<(), RecordingError> {
    check_center(option, body)?;
    if InertialParameters::from(body).is_physical_within(ROUNDED) {
        return Ok(());
    }
    Err(RecordingError::Option {
        option,
        what: format!(
            "`{option}` is no body that can exist: its mass must be more than zero, and each principal moment of inertia \
             about its centre of mass at most the sum of the two others"
        ),
    })
}

/// Checks that the centre of mass of a body that an option gives is in m.
///
/// # Errors
/// Returns [`RecordingError::Option`] if it is not.
fn check_center(option: &'static str, body: MassProperties) -> Result<(), RecordingError> {
    let farthest_m = body.center_of_mass.amax();
    if farthest_m < FARTHEST_M {
        return Ok(());
    }
    Err(RecordingError::Option {
        option,
        what: format!(
            "`{option}` has its centre of mass {} m from the origin of its frame: expected m, and less than \
             {FARTHEST_M} m; is it in mm?",
            general(farthest_m, 6)
        ),
    })
}
