//! Reads the Python object `tactid.options.Options`, the one declaration of options in Python.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyString};
use tactid_recordings::{
    ActsOn, ArmCalibration, BoundingBox, Estimator, KnownMass, Method, PaperSettings, Request,
    SensorFrame, Topics,
};

use crate::arm_model::ArmModel;
use crate::arrays::{Series, common_length};
use crate::errors::{IntoPyErr, option_error, with_option};
use crate::inertia::MassProperties;
use crate::urdf::urdf_text;

/// Reads a request. An attribute that is `None` leaves the choice to the identification.
pub(crate) fn request(options: &Bound<'_, PyAny>) -> PyResult<Request> {
    let options = Options(options);
    Ok(Request {
        estimator: options.estimator()?,
        ..without_estimator(&options)?
    })
}

/// Reads a request for a log, whose unloaded reference is a log, too.
pub(crate) fn log_request(options: &Bound<'_, PyAny>) -> PyResult<Request> {
    let unloaded = Options(options).attribute("unloaded")?;
    if unloaded.is_some_and(|given| given.cast::<PyMapping>().is_ok()) {
        let message = "the unloaded reference of a log is the path of a log, but arrays are given";
        return Err(option_error(message.to_owned(), "unloaded"));
    }
    Ok(Request {
        unloaded: Options(options).get::<PathBuf>("unloaded", "the path of a log")?,
        ..request(options)?
    })
}

/// Reads the unloaded reference of arrays: its arrays by their names.
pub(crate) fn unloaded_arrays<'py>(
    options: &Bound<'py, PyAny>,
) -> PyResult<Option<Bound<'py, PyMapping>>> {
    let Some(given) = Options(options).attribute("unloaded")? else {
        return Ok(None);
    };
    given.cast_into::<PyMapping>().map(Some).map_err(|_| {
        let message =
            "the unloaded reference of arrays is a dict with the arrays `time`, `q` and `effort`";
        option_error(message.to_owned(), "unloaded")
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
        tip: options.text("tip")?,
        urdf: options.urdf()?,
        topics: Topics {
            joints: options.one_or_several("joint_topic")?,
            wrenches: options.one_or_several("wrench_topic")?,
            odometry: options.text("odometry_topic")?,
            acceleration: options.text("acceleration_topic")?,
            imu: options.text("imu_topic")?,
        },
        sensor_frame: options.sensor_frame()?,
        wrench_acts_on: options.choice("wrench_acts_on", &ACTS_ON)?,
        gravity: options.vector("gravity")?,
        cutoff_hz: options.number("cutoff")?,
        max_gap_s: options.number("max_gap")?,
        delay_s: options.number("delay")?,
        wrench_offset: options.get("wrench_offset", "True or False")?,
        wrench_noise: options.each("wrench_noise", &[6], |six| std::array::from_fn(|k| six[k]))?,
        effort_noise: options.each("effort_noise", &[], |one| one[0])?,
        effort_gain: options.each("effort_gain", &[], |one| one[0])?,
        effort_gain_std_dev: options.each("effort_gain_std_dev", &[], |one| one[0])?,
        unloaded: None,
        calibration: options.calibration()?,
        joint_names: options.renamed_joints()?,
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

    /// Reads an attribute, which must be `expected`, as in "a number".
    fn get<T: for<'a> FromPyObject<'a, 'py>>(
        &self,
        name: &'static str,
        expected: &str,
    ) -> PyResult<Option<T>> {
        let Some(value) = self.attribute(name)? else {
            return Ok(None);
        };
        match value.extract::<T>() {
            Ok(value) => Ok(Some(value)),
            Err(_) => {
                let message = format!("`{name}` is {}: expected {expected}", value.repr()?);
                Err(option_error(message, name))
            }
        }
    }

    fn text(&self, name: &'static str) -> PyResult<Option<String>> {
        self.get(name, "text")
    }

    fn number(&self, name: &'static str) -> PyResult<Option<f64>> {
        self.get(name, "a number")
    }

    fn choice<T: Copy>(&self, name: &'static str, choices: &[(&str, T)]) -> PyResult<Option<T>> {
        let known: Vec<_> = choices
            .iter()
            .map(|(known, _)| format!("{known:?}"))
            .collect();
        let expected = known.join(" or ");
        let Some(given) = self.get::<String>(name, &expected)? else {
            return Ok(None);
        };
        match choices.iter().find(|(known, _)| *known == given) {
            Some((_, choice)) => Ok(Some(*choice)),
            None => {
                let message = format!("`{name}` is {given:?}: expected {expected}");
                Err(option_error(message, name))
            }
        }
    }

    fn one_or_several(&self, name: &'static str) -> PyResult<Vec<String>> {
        match self.attribute(name)? {
            None => Ok(Vec::new()),
            Some(one) if one.is_instance_of::<PyString>() => Ok(vec![one.extract()?]),
            Some(_) => Ok(self
                .get(name, "a topic, or a list of topics")?
                .unwrap_or_default()),
        }
    }

    fn urdf(&self) -> PyResult<Option<String>> {
        let given = self.attribute("urdf")?;
        let text = given.map(|given| with_option(urdf_text(&given), "urdf"));
        text.transpose()
    }

    /// Reads a calibration: a `tactid.Calibration`, or the path of its file.
    fn calibration(&self) -> PyResult<Option<ArmCalibration>> {
        let name = "calibration";
        let Some(given) = self.attribute(name)? else {
            return Ok(None);
        };
        if let Ok(model) = given.getattr("model")
            && let Ok(model) = model.cast::<ArmModel>()
        {
            return Ok(Some(model.get().0.as_ref().clone()));
        }
        let path = self.get::<PathBuf>(name, "a tactid.Calibration, or the path of its file")?;
        let read = |path: PathBuf| ArmCalibration::read(&path).map_err(IntoPyErr::into_py_err);
        path.map(read).transpose()
    }

    fn renamed_joints(&self) -> PyResult<Vec<(String, String)>> {
        let expected = "a dict of names in the log and names in the URDF";
        let names = self.get::<BTreeMap<String, String>>("rename_joints", expected)?;
        Ok(names.unwrap_or_default().into_iter().collect())
    }

    fn vector(&self, name: &'static str) -> PyResult<Option<Vector3<f64>>> {
        let Some(given) = self.attribute(name)? else {
            return Ok(None);
        };
        let three = with_option(Series::read_item(&given, name, &[3]), name)?;
        Ok(Some(three.vector(0, 0)))
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
        let each = Series::read_one_of(&given, name, &[item], "one for all, or one for each");
        let each = with_option(each, name)?;
        let count = common_length(&[&each])?.unwrap_or(1);
        Ok(Some((0..count).map(|k| of(each.at(k))).collect()))
    }

    fn bounding_box(&self) -> PyResult<Option<BoundingBox>> {
        let name = "bounding_box";
        let Some(given) = self.attribute(name)? else {
            return Ok(None);
        };
        let corners = with_option(Series::read_item(&given, name, &[2, 3]), name)?;
        let corners = corners.at(0);
        Ok(Some(BoundingBox {
            min: Vector3::from_column_slice(&corners[..3]),
            max: Vector3::from_column_slice(&corners[3..]),
        }))
    }

    fn known_tool(&self) -> PyResult<Option<tactid_dynamics::MassProperties>> {
        let body: Option<Py<MassProperties>> = self.get("known_tool", "a tactid.MassProperties")?;
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
        let std_dev_kg = self.number("known_mass_std_dev")?;
        match (self.number("known_mass")?, std_dev_kg) {
            (None, None) => Ok(None),
            (None, Some(_)) => Err(option_error(
                "`known_mass` is missing, but its standard deviation is given".to_owned(),
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
                let message = format!(
                    "`{name}` is an option of the paper's filter, and not of least squares"
                );
                return Err(option_error(message, name));
            }
        }
        Ok(is_paper.map(|_| Estimator::LeastSquares))
    }

    fn paper_settings(&self) -> PyResult<PaperSettings> {
        let defaults = PaperSettings::default();
        Ok(PaperSettings {
            alpha: self.number("alpha")?.unwrap_or(defaults.alpha),
            beta: self.number("beta")?.unwrap_or(defaults.beta),
            average_s: self.number("average")?.unwrap_or(defaults.average_s),
            epochs: self
                .get("epochs", "a whole number")?
                .unwrap_or(defaults.epochs),
        })
    }
}
