//! How to identify, as Python says it.

use std::path::PathBuf;

use nalgebra::Vector3;
use pyo3::prelude::*;
use tactid_identify::{
    ActsOn, BoundingBox, EstimatorKind, KnownMass, Request, Settings, Topics, Way,
};

use crate::arrays::{Series, common_length};
use crate::errors::ArgumentError;
use crate::inertia::MassProperties;

pub(crate) type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// The settings as Python gives them; `None` where there is a default.
pub(crate) struct Given<'a, 'py> {
    pub(crate) way: Option<&'a str>,
    /// Whether there are joint efforts, for the combined way.
    pub(crate) effort: bool,
    pub(crate) estimator: &'a str,
    pub(crate) alpha: f64,
    pub(crate) beta: f64,
    pub(crate) gravity: Argument<'a, 'py>,
    pub(crate) average: Option<f64>,
    pub(crate) cutoff: Option<f64>,
    pub(crate) epochs: Option<u32>,
    pub(crate) max_gap: Option<f64>,
    pub(crate) wrench_offset: bool,
    pub(crate) wrench_noise: Argument<'a, 'py>,
    pub(crate) effort_noise: Argument<'a, 'py>,
}

impl Given<'_, '_> {
    pub(crate) fn settings(&self) -> PyResult<Settings> {
        let defaults = match self.estimator {
            "nlms" => Settings {
                estimator: EstimatorKind::Nlms {
                    alpha: self.alpha,
                    beta: self.beta,
                },
                ..Settings::paper()
            },
            "rls" => Settings::default(),
            _ => return Err(unknown("estimator", self.estimator, "\"nlms\" or \"rls\"")),
        };
        let gravity = match self.gravity {
            None => None,
            Some(given) => {
                let gravity = Series::read(given, "gravity", &[3])?;
                Some(Vector3::from_column_slice(gravity.single()?))
            }
        };
        Ok(Settings {
            way: self.way()?.unwrap_or_default(),
            gravity,
            average_s: self.average.unwrap_or(defaults.average_s),
            cutoff_hz: self.cutoff.unwrap_or(defaults.cutoff_hz),
            epochs: self.epochs.unwrap_or(defaults.epochs),
            max_gap_s: self.max_gap.unwrap_or(defaults.max_gap_s),
            wrench_offset: self.wrench_offset,
            wrench_noise: read_each(self.wrench_noise, "wrench_noise", &[6], |six| {
                std::array::from_fn(|k| six[k])
            })?,
            effort_noise: read_each(self.effort_noise, "effort_noise", &[], |one| one[0])?,
            ..defaults
        })
    }

    fn way(&self) -> PyResult<Option<Way>> {
        let Some(name) = self.way else {
            return Ok(None);
        };
        let ways = [
            Way::Tactile,
            Way::Effort,
            Way::JointSensing,
            Way::Combined {
                effort: self.effort,
            },
        ];
        match ways.into_iter().find(|way| way.name() == name) {
            Some(way) => Ok(Some(way)),
            None => Err(unknown(
                "way",
                name,
                "\"tactile\", \"effort\", \"joint-sensing\" or \"combined\"",
            )),
        }
    }

    /// A request with these settings and nothing else.
    pub(crate) fn request(&self) -> PyResult<Request> {
        let settings = self.settings()?;
        let defaults = if self.estimator == "nlms" {
            Request::paper()
        } else {
            Request::default()
        };
        Ok(Request {
            way: self.way()?,
            cutoff_hz: self.cutoff.or(defaults.cutoff_hz),
            max_gap_s: self.max_gap.or(defaults.max_gap_s),
            settings,
            ..defaults
        })
    }
}

/// What else Python says of a recording.
pub(crate) struct Recorded<'a> {
    pub(crate) tool: Option<String>,
    pub(crate) urdf: Option<String>,
    pub(crate) topics: Topics,
    pub(crate) wrench_acts_on: &'a str,
    pub(crate) delay: Option<f64>,
    pub(crate) bare: Option<PathBuf>,
    pub(crate) effort_gain: Vec<f64>,
}

impl Recorded<'_> {
    pub(crate) fn add_to(self, request: &mut Request) -> PyResult<()> {
        request.wrench_acts_on = match self.wrench_acts_on {
            "payload" => ActsOn::Payload,
            "sensor" => ActsOn::Sensor,
            other => {
                return Err(unknown(
                    "wrench_acts_on",
                    other,
                    "\"payload\" or \"sensor\"",
                ));
            }
        };
        request.tool = self.tool;
        request.urdf = self.urdf;
        request.topics = self.topics;
        request.delay_s = self.delay.or(request.delay_s);
        request.bare = self.bare;
        request.effort_gain = self.effort_gain;
        Ok(())
    }
}

/// What Python knows of tool and payload.
pub(crate) struct Known<'a, 'py> {
    pub(crate) tool: Option<&'a MassProperties>,
    pub(crate) mass: Option<f64>,
    pub(crate) mass_deviation: f64,
    pub(crate) bounding_box: Argument<'a, 'py>,
}

impl Known<'_, '_> {
    pub(crate) fn add_to(&self, request: &mut Request) -> PyResult<()> {
        if self.mass.is_none() && self.mass_deviation != 0.0 {
            return Err(ArgumentError::new_err(
                "`known_mass_deviation` is given without `known_mass`",
            ));
        }
        request.known_tool = self.tool.map(|body| body.0);
        request.known_mass = self.mass.map(|mass_kg| KnownMass {
            mass_kg,
            deviation_kg: self.mass_deviation,
        });
        if let Some(given) = self.bounding_box {
            let corners = Series::read(given, "bounding_box", &[2, 3])?;
            let corners = corners.single()?;
            request.bounding_box = Some(BoundingBox {
                min: Vector3::from_column_slice(&corners[..3]),
                max: Vector3::from_column_slice(&corners[3..]),
            });
        }
        Ok(())
    }
}

/// What is given once for all, or for each; nothing where it is not given.
fn read_each<T>(
    given: Argument<'_, '_>,
    name: &'static str,
    item: &[usize],
    of: impl Fn(&[f64]) -> T,
) -> PyResult<Vec<T>> {
    let Some(given) = given else {
        return Ok(Vec::new());
    };
    let each = Series::read(given, name, item)?;
    let count = common_length(&[&each])?.unwrap_or(1);
    Ok((0..count).map(|k| of(each.at(k))).collect())
}

fn unknown(name: &str, given: &str, expected: &str) -> PyErr {
    ArgumentError::new_err(format!("`{name}` is {given:?}: expected {expected}"))
}
