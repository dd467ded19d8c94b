//! The two-stage NLMS filter of the paper, online.

use std::sync::Arc;

use nalgebra::SVector;
use schemars::JsonSchema;
use serde::Serialize;
use tactid_batch::Finding;
use tactid_dynamics::{InertialParameters, Manipulator, MassProperties, symmetric_matrix};
use tactid_identify::equations::{Equation, EquationSettings, EquationStream, PushOutcome, Sample};
use tactid_identify::solve::body_of;
use tactid_identify::{
    IdentifyError, Method, Observability, body_of_values, is_physical, values_of_body,
};
use tactid_nlms::{Estimator, Nlms, PAPER_ALPHA, PAPER_BETA};

use super::estimate::PaperEstimate;
use super::recent_mean::RecentMean;
use super::rows::{inertia_rows, mass_rows};
use super::singular_values::{RowProducts, SingularValues};

/// Settings of the paper's filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PaperSettings {
    /// Step size α of (54), without a unit, in (0, 2). Default: 1.8, as in the paper.
    pub alpha: f64,
    /// Regularisation β of (54), without a unit, in (0, 1). Default: 0.9, as in the paper.
    pub beta: f64,
    /// Time over which the estimate is averaged, up to the last sample, s; 0 for the latest value.
    /// A gradient filter never settles. Default: 10, as in the paper's Table 2.
    pub average_s: f64,
    /// Number of times that a recording is presented to the filter. While the centre of mass is
    /// still wrong, the inertia is, too, and is corrected only where the motion recurs.
    /// [`PaperFilter`] itself does not repeat anything: see [`PaperFilter::rewind`]. Default: 2.
    pub epochs: u32,
}

impl Default for PaperSettings {
    fn default() -> Self {
        Self {
            alpha: PAPER_ALPHA,
            beta: PAPER_BETA,
            average_s: 10.0,
            epochs: 2,
        }
    }
}

impl PaperSettings {
    /// Checks that each setting is in its range.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] with the first setting that is not.
    pub fn check(&self) -> Result<(), IdentifyError> {
        Nlms::<1>::new(self.alpha, self.beta)?;
        if !(self.average_s >= 0.0 && self.average_s.is_finite()) {
            return Err(IdentifyError::out_of_range(
                "average_s",
                self.average_s,
                "zero or more",
            ));
        }
        if self.epochs == 0 {
            return Err(IdentifyError::out_of_range("epochs", 0.0, "one or more"));
        }
        Ok(())
    }

    /// Checks the settings of the equations: the filter has ten parameters and needs the force and
    /// the moment on the end-effector.
    fn check_equations(equations: &EquationSettings) -> Result<(), IdentifyError> {
        let gives_noise = !(equations.wrench_noise.is_empty() && equations.effort_noise.is_empty());
        let beyond_filter = [
            (equations.wrench_offset, "an unknown offset of the wrenches"),
            (gives_noise, "the noise of the sensors"),
            (
                equations.unknowns.weight,
                "an unknown weight that was subtracted from the wrenches",
            ),
            (
                equations.unknowns.gravity,
                "a direction of gravity that is unknown",
            ),
        ];
        if let Some((_, what)) = beyond_filter.into_iter().find(|(given, _)| *given) {
            return Err(needs_least_squares(what));
        }
        match equations.method {
            Method::Effort | Method::Combined { .. } => Err(IdentifyError::Method(format!(
                "the paper's filter needs the force and the moment on the end-effector, which the {} method does not \
                     compute: use least squares, or another method",
                equations.method
            ))),
            Method::Tactile | Method::JointSensing => Ok(()),
        }
    }
}

/// Returns the error of what the paper's filter cannot use.
pub(crate) fn needs_least_squares(what: &str) -> IdentifyError {
    IdentifyError::Option {
        option: "estimator",
        what: format!(
            "{what} needs least squares: the paper's filter estimates ten parameters and nothing else; `estimator` chooses \
             the estimator"
        ),
    }
}

/// The paper's two-stage filter: the normalised LMS filter (54) on the rows of (48), then on those
/// of (46) with the present centre of mass.
///
/// It estimates no uncertainty, detects no payload change and needs exact measurements; for
/// anything but a comparison with the paper use [`Identifier`](tactid_identify::Identifier).
/// Nothing is allocated after construction.
#[derive(Clone, Debug)]
pub struct PaperFilter {
    settings: PaperSettings,
    method: Method,
    frame: Arc<str>,
    stream: EquationStream,
    mass: Nlms<4>,
    inertia: Nlms<6>,
    products: RowProducts,
    /// Moving average; `None` where the latest value is reported.
    recent: Option<RecentMean>,
    latest: Latest,
    windows: u64,
}

/// The estimate after the last window.
#[derive(Clone, Copy, Debug)]
struct Latest {
    /// Properties of the payload alone.
    body: MassProperties,
    /// Properties of gripper and payload as one body, for the joint-sensing method.
    composite: Option<MassProperties>,
}

impl PaperFilter {
    /// Creates a filter for a robot whose end-effector frame is the link `tool` and whose wrenches
    /// are measured in the links `sensors`.
    ///
    /// # Errors
    /// Returns the errors of [`EquationStream::new`], [`IdentifyError::Option`] if a setting of the
    /// filter is out of range or the settings contain what only least squares can use, and
    /// [`IdentifyError::Method`] if the method does not compute the force and the moment on the
    /// end-effector.
    pub fn new(
        robot: &Manipulator,
        tool: &str,
        sensors: &[&str],
        equations: &EquationSettings,
        settings: PaperSettings,
    ) -> Result<Self, IdentifyError> {
        settings.check()?;
        PaperSettings::check_equations(equations)?;
        let mut filter = Self {
            method: equations.method,
            frame: tool.into(),
            stream: EquationStream::new(robot, tool, sensors, equations)?,
            mass: Nlms::new(settings.alpha, settings.beta)?,
            inertia: Nlms::new(settings.alpha, settings.beta)?,
            products: RowProducts::new(),
            recent: recent_mean(&settings),
            latest: Latest {
                body: body_of_values(&[0.0; 10]),
                composite: None,
            },
            windows: 0,
            settings,
        };
        filter.set_latest();
        Ok(filter)
    }

    /// Adds one sample.
    ///
    /// Cost: one pass over the robot's bodies; no allocation.
    ///
    /// # Errors
    /// Returns [`IdentifyError::State`] if a slice does not fit the robot, and
    /// [`IdentifyError::Wrenches`] if the wrenches do not fit the sensors. Bad data are no error:
    /// see [`PushOutcome`].
    pub fn push(&mut self, sample: &Sample<'_>) -> Result<PushOutcome, IdentifyError> {
        let (outcome, equation) = self.stream.push(sample)?;
        if let Some(equation) = equation {
            self.windows += 1;
            self.products.update(equation);
            update(&mut self.mass, &mut self.inertia, equation);
            self.set_latest();
            let time_s = self.stream.time_s();
            if let Some(recent) = &mut self.recent {
                recent.push(time_s, &values_of_body(&self.latest.body));
            }
        }
        Ok(outcome)
    }

    /// Prepares for another presentation of the same samples: the parameters stay, while times,
    /// counts and averages start again.
    pub fn rewind(&mut self) {
        self.stream.rewind();
        self.products = RowProducts::new();
        self.windows = 0;
        self.recent = recent_mean(&self.settings);
    }

    /// Returns the estimate: the mean over the last [`PaperSettings::average_s`], or the latest
    /// value.
    #[must_use]
    pub fn estimate(&self) -> PaperEstimate {
        let mean = self.recent.as_ref().and_then(RecentMean::mean);
        let body = mean.map_or(self.latest.body, |values| body_of_values(&values));
        PaperEstimate {
            frame: self.frame.clone(),
            body,
            composite: self.latest.composite,
            observability: self.products.assess().1,
            is_physical: is_physical(&body),
            windows: self.windows,
            rejected: self.stream.rejected(),
            gaps: self.stream.gaps(),
        }
    }

    /// Returns the latest estimate of the payload alone, not averaged.
    #[must_use]
    pub fn latest_body(&self) -> MassProperties {
        self.latest.body
    }

    /// Returns the strength with which the motion has excited mass and inertia. Cost: two
    /// eigenvalue problems.
    #[must_use]
    pub fn singular_values(&self) -> SingularValues {
        self.products.assess().0
    }

    /// Returns what the filter noticed about the data: a mass that is negative, because of a wrong
    /// sign or of a known body of `known_bodies_kg`, such as a tool changer, that is heavier than
    /// the load; a motion that does not determine the mass says nothing. Other findings about the
    /// data need least squares. What is wrong in the robot's description comes last, as far as the
    /// method uses it.
    #[must_use]
    pub fn findings(&self, known_bodies_kg: f64) -> Vec<Finding> {
        let estimate = self.estimate();
        let gripper_kg = self
            .stream
            .gripper_to_subtract()
            .map_or(0.0, |gripper| gripper.mass());
        let (load_kg, known_bodies_kg) = (
            estimate.body.mass_kg + gripper_kg,
            known_bodies_kg + gripper_kg,
        );
        let finding = if estimate.observability[0] == Observability::Unobservable {
            None
        } else if load_kg < 0.0 {
            Some(Finding::NegativeMass {
                method: self.method,
                or_gravity: self.stream.gravity().norm() > 0.0,
            })
        } else {
            (load_kg < known_bodies_kg).then_some(Finding::KnownBodiesTooHeavy {
                known_bodies_kg,
                load_kg,
            })
        };
        let of_model = self.stream.model_findings().into_iter().map(Finding::Model);
        finding.into_iter().chain(of_model).collect()
    }

    /// The equation stream behind the filter.
    #[must_use]
    pub fn stream(&self) -> &EquationStream {
        &self.stream
    }

    /// Sets the latest estimate from the filters' parameters, less those of the gripper.
    fn set_latest(&mut self) {
        let identified = body(&self.mass, &self.inertia);
        let gripper = self.stream.gripper_to_subtract();
        self.latest = match gripper {
            Some(gripper) => Latest {
                body: body_of((InertialParameters::from(identified) - gripper).as_vector()),
                composite: Some(identified),
            },
            None => Latest {
                body: identified,
                composite: None,
            },
        };
    }
}

/// Returns an empty moving average, if the estimate is averaged.
fn recent_mean(settings: &PaperSettings) -> Option<RecentMean> {
    (settings.average_s > 0.0).then(|| RecentMean::new(settings.average_s))
}

/// Updates both filters with the rows of one equation, (50)-(54): first the mass, then the inertia.
fn update(mass: &mut Nlms<4>, inertia: &mut Nlms<6>, equation: &Equation) {
    // (48)
    for (row, target) in mass_rows(equation).iter() {
        mass.update(&row, target);
    }
    let a_u = mass.parameters().fixed_rows::<3>(1).into_owned();
    // (46)
    for (row, target) in inertia_rows(equation, &a_u).iter() {
        inertia.update(&row, target);
    }
}

/// Returns the body with the filters' parameters, in the tool frame `Σ_U`.
fn body(mass: &Nlms<4>, inertia: &Nlms<6>) -> MassProperties {
    let first: SVector<f64, 4> = mass.parameters();
    MassProperties {
        mass_kg: 1.0 / first[0], // x_3 = [1/m_U; a_U], (32)
        center_of_mass: first.fixed_rows::<3>(1).into_owned(),
        inertia: symmetric_matrix(inertia.parameters().into()), // x_4, (46)
    }
}
