//! Reads the Python object `tactid.options.Options`, the one declaration of options in Python.

use std::path::PathBuf;

use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::PyString;
use tactid_recordings::{
    ActsOn, BoundingBox, Estimator, KnownMass, Method, PaperSettings, Request, SensorFrame, Topics,
};

use crate::arrays::{Series, common_length};
use crate::errors::{IntoPyErr, option_error, with_option};
use crate::inertia::MassProperties;

/// Reads a request. An attribute that is `None` leaves the choice to the identification.
pub(crate) fn request(options: &Bound<'_, PyAny>) -> PyResult<Request> {
    let options = Options(options);
    Ok(Request {
        estimator: options.estimator()?,
        ..without_estimator(&options)?
    })
}

/// Reads a request and the settings of the paper's filter, for the online filter, which has no choice of
/// estimator.
pub(crate) fn paper_request(options: &Bound<'_, PyAny>) -> PyResult<(Request, PaperSettings)> {
    let options = Options(options);
    Ok((without_estimator(&options)?, options.paper_settings()?))
}

fn without_estimator(options: &Options<'_, '_>) -> PyResult<Request> {
    Ok(Request {
        method: options.choice("method", &METHODS)?,
        estimator: None,
        tip: options.get("tip")?,
        urdf: options.get("urdf")?,
        topics: Topics {
            joints: options.one_or_several("joint_topic")?,
            wrenches: options.one_or_several("wrench_topic")?,
            odometry: options.get("odometry_topic")?,
            acceleration: options.get("acceleration_topic")?,
            imu: options.get("imu_topic")?,
        },
        sensor_frame: options.sensor_frame()?,
        wrench_acts_on: options.choice("wrench_acts_on", &ACTS_ON)?,
        gravity: options.vector("gravity")?,
        cutoff_hz: options.get("cutoff")?,
        max_gap_s: options.get("max_gap")?,
        delay_s: options.get("delay")?,
        wrench_offset: options.get("wrench_offset")?,
        wrench_noise: options.each("wrench_noise", &[6], |six| std::array::from_fn(|k| six[k]))?,
        effort_noise: options.each("effort_noise", &[], |one| one[0])?,
        effort_gain: options.each("effort_gain", &[], |one| one[0])?,
        unloaded: options.get::<PathBuf>("unloaded")?,
        known_tool: options.known_tool()?,
        known_mass: options.known_mass()?,
        bounding_box: options.bounding_box()?,
    })
}

const METHODS: [(&str, Method); 4] = [
    ("tactile", Method::Tactile),
    ("effort", Method::Effort),
    ("joint-sensing", Method::JointSensing),
    // Whether efforts are used is decided by the recording.
    ("combined", Method::Combined { effort: true }),
];

const ACTS_ON: [(&str, ActsOn); 2] = [("payload", ActsOn::Payload), ("sensor", ActsOn::Sensor)];

/// Names of the estimators in Python.
pub(crate) const LEAST_SQUARES: &str = "least-squares";
pub(crate) const NLMS: &str = "nlms";

/// Reads one attribute at a time; an error carries the attribute's name.
struct Options<'a, 'py>(&'a Bound<'py, PyAny>);

impl<'py> Options<'_, 'py> {
    fn attribute(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let value = self.0.getattr(name)?;
        Ok((!value.is_none()).then_some(value))
    }

    fn get<T: for<'a> FromPyObject<'a, 'py>>(&self, name: &'static str) -> PyResult<Option<T>> {
        let Some(value) = self.attribute(name)? else {
            return Ok(None);
        };
        match value.extract::<T>() {
            Ok(value) => Ok(Some(value)),
            Err(error) => {
                let reason = error.into().value(self.0.py()).to_string();
                Err(option_error(
                    format!("{value} does not fit: {reason}"),
                    name,
                ))
            }
        }
    }

    fn choice<T: Copy>(&self, name: &'static str, choices: &[(&str, T)]) -> PyResult<Option<T>> {
        let Some(given) = self.get::<String>(name)? else {
            return Ok(None);
        };
        match choices.iter().find(|(known, _)| *known == given) {
            Some((_, choice)) => Ok(Some(*choice)),
            None => {
                let known: Vec<_> = choices
                    .iter()
                    .map(|(known, _)| format!("{known:?}"))
                    .collect();
                let message = format!("{given:?} is unknown: expected {}", known.join(" or "));
                Err(option_error(message, name))
            }
        }
    }

    fn one_or_several(&self, name: &'static str) -> PyResult<Vec<String>> {
        match self.attribute(name)? {
            None => Ok(Vec::new()),
            Some(one) if one.is_instance_of::<PyString>() => Ok(vec![one.extract()?]),
            Some(_) => Ok(self.get(name)?.unwrap_or_default()),
        }
    }

    fn vector(&self, name: &'static str) -> PyResult<Option<Vector3<f64>>> {
        let Some(given) = self.attribute(name)? else {
            return Ok(None);
        };
        let three = with_option(Series::read(&given, name, &[3]), name)?;
        Ok(Some(Vector3::from_column_slice(with_option(
            three.single(),
            name,
        )?)))
    }

    /// What is given once for all, or for each.
    fn each<T>(
        &self,
        name: &'static str,
        item: &[usize],
        of: impl Fn(&[f64]) -> T,
    ) -> PyResult<Option<Vec<T>>> {
        let Some(given) = self.attribute(name)? else {
            return Ok(None);
        };
        let each = with_option(Series::read(&given, name, item), name)?;
        let count = common_length(&[&each])?.unwrap_or(1);
        Ok(Some((0..count).map(|k| of(each.at(k))).collect()))
    }

    fn bounding_box(&self) -> PyResult<Option<BoundingBox>> {
        let name = "bounding_box";
        let Some(given) = self.attribute(name)? else {
            return Ok(None);
        };
        let corners = with_option(Series::read(&given, name, &[2, 3]), name)?;
        let corners = with_option(corners.single(), name)?;
        Ok(Some(BoundingBox {
            min: Vector3::from_column_slice(&corners[..3]),
            max: Vector3::from_column_slice(&corners[3..]),
        }))
    }

    fn known_tool(&self) -> PyResult<Option<tactid_dynamics::MassProperties>> {
        let body: Option<Py<MassProperties>> = self.get("known_tool")?;
        Ok(body.map(|body| body.get().0))
    }

    /// The name of a link, then three coordinates and a quaternion: eight entries, or a pair.
    fn sensor_frame(&self) -> PyResult<Option<SensorFrame>> {
        let name = "sensor_frame";
        let Some(given) = self.attribute(name)? else {
            return Ok(None);
        };
        let expected = "expected a link, then x, y, z, qx, qy, qz, qw";
        let wrong = || option_error(format!("{given} does not fit: {expected}"), name);
        if given.is_instance_of::<PyString>() {
            return Err(wrong());
        }
        let entries: Vec<Bound<'_, PyAny>> = given.extract().map_err(|_| wrong())?;
        let (parent, rest) = entries.split_first().ok_or_else(wrong)?;
        let parent: String = parent.extract().map_err(|_| wrong())?;
        let numbers: Result<Vec<f64>, _> = match rest {
            [pose] => pose.extract(),
            numbers => numbers
                .iter()
                .map(|number| number.extract::<f64>())
                .collect(),
        };
        let numbers = numbers.map_err(|_| wrong())?;
        let [x, y, z, qx, qy, qz, qw] = numbers[..] else {
            return Err(wrong());
        };
        let frame = SensorFrame::new(&parent, [x, y, z], [qx, qy, qz, qw]);
        frame.map(Some).map_err(IntoPyErr::into_py_err)
    }

    fn known_mass(&self) -> PyResult<Option<KnownMass>> {
        let std_dev_kg: Option<f64> = self.get("known_mass_std_dev")?;
        match (self.get("known_mass")?, std_dev_kg) {
            (None, None) => Ok(None),
            (None, Some(_)) => Err(option_error(
                "a standard deviation is given without a known mass".to_owned(),
                "known_mass",
            )),
            (Some(mass_kg), _) => Ok(Some(KnownMass {
                mass_kg,
                std_dev_kg: std_dev_kg.unwrap_or(0.0),
            })),
        }
    }

    fn estimator(&self) -> PyResult<Option<Estimator>> {
        let is_paper = self.choice("estimator", &[(LEAST_SQUARES, false), (NLMS, true)])?;
        if is_paper == Some(true) {
            return Ok(Some(Estimator::Paper(self.paper_settings()?)));
        }
        for name in ["alpha", "beta", "average", "epochs"] {
            if self.attribute(name)?.is_some() {
                let message = "least squares does not have this option of the paper's filter";
                return Err(option_error(message.to_owned(), name));
            }
        }
        Ok(is_paper.map(|_| Estimator::LeastSquares))
    }

    fn paper_settings(&self) -> PyResult<PaperSettings> {
        let defaults = PaperSettings::default();
        Ok(PaperSettings {
            alpha: self.get("alpha")?.unwrap_or(defaults.alpha),
            beta: self.get("beta")?.unwrap_or(defaults.beta),
            average_s: self.get("average")?.unwrap_or(defaults.average_s),
            epochs: self.get("epochs")?.unwrap_or(defaults.epochs),
        })
    }
}
