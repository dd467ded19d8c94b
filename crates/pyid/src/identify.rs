//! From a log, or from arrays, to a payload. The package's `identify` calls these.

use std::path::PathBuf;

use nalgebra::Vector3;
use pyo3::prelude::*;
use tactid_dynamics::Wrench;
use tactid_identify::{BaseState, Sample, Topics, states_of_poses};

use crate::arrays::{Poses, Series, common_length};
use crate::dynamics::Manipulator;
use crate::errors::{ArgumentError, IntoPyErr};
use crate::identification::Identification;
use crate::inertia::MassProperties;
use crate::pulse::Pulse;
use crate::request::{Argument, Given, Known, Recorded};

/// Identifies the payload from a log: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (log, *, tool=None, way=None, estimator="rls", alpha=1.8, beta=0.9, gravity=None, average=None, cutoff=None, epochs=None, max_gap=None, wrench_offset=false, wrench_noise=None, effort_noise=None, urdf=None, joints=Vec::new(), wrenches=Vec::new(), odometry=None, imu=None, acceleration=None, wrench_acts_on="payload", known_tool=None, known_mass=None, known_mass_deviation=0.0, bounding_box=None, delay=None, bare=None, effort_gain=Vec::new(), progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn identify_log(
    py: Python<'_>,
    log: PathBuf,
    tool: Option<String>,
    way: Option<&str>,
    estimator: &str,
    alpha: f64,
    beta: f64,
    gravity: Argument<'_, '_>,
    average: Option<f64>,
    cutoff: Option<f64>,
    epochs: Option<u32>,
    max_gap: Option<f64>,
    wrench_offset: bool,
    wrench_noise: Argument<'_, '_>,
    effort_noise: Argument<'_, '_>,
    urdf: Option<String>,
    joints: Vec<String>,
    wrenches: Vec<String>,
    odometry: Option<String>,
    imu: Option<String>,
    acceleration: Option<String>,
    wrench_acts_on: &str,
    known_tool: Option<&MassProperties>,
    known_mass: Option<f64>,
    known_mass_deviation: f64,
    bounding_box: Argument<'_, '_>,
    delay: Option<f64>,
    bare: Option<PathBuf>,
    effort_gain: Vec<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Identification> {
    let mut request = Given {
        way,
        effort: true,
        estimator,
        alpha,
        beta,
        gravity,
        average,
        cutoff,
        epochs,
        max_gap,
        wrench_offset,
        wrench_noise,
        effort_noise,
    }
    .request()?;
    Recorded {
        tool,
        urdf,
        topics: Topics {
            joints,
            wrenches,
            odometry,
            acceleration,
            imu,
        },
        wrench_acts_on,
        delay,
        bare,
        effort_gain,
    }
    .add_to(&mut request)?;
    Known {
        tool: known_tool,
        mass: known_mass,
        mass_deviation: known_mass_deviation,
        bounding_box,
    }
    .add_to(&mut request)?;
    let mut pulse = Pulse::new(progress);
    let result = py.detach(|| {
        tactid_identify::identify_log(&log, &request, &mut |progress| {
            pulse.beat(progress.fraction)
        })
    });
    let result = result.map(Identification).map_err(IntoPyErr::into_py_err);
    pulse.finish(py, result)
}

/// Identifies the payload from arrays: see :func:`tactid.identify`.
#[pyfunction]
#[pyo3(signature = (time, *, robot=None, q=None, qd=None, effort=None, wrench=None, pose=None, twist=None, acceleration=None, sensors=None, tool=None, way=None, estimator="rls", alpha=1.8, beta=0.9, gravity=None, average=None, cutoff=None, epochs=None, max_gap=None, wrench_offset=false, wrench_noise=None, effort_noise=None, known_tool=None, known_mass=None, known_mass_deviation=0.0, bounding_box=None, delay=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn identify_arrays(
    py: Python<'_>,
    time: &Bound<'_, PyAny>,
    robot: Option<&Manipulator>,
    q: Argument<'_, '_>,
    qd: Argument<'_, '_>,
    effort: Argument<'_, '_>,
    wrench: Argument<'_, '_>,
    pose: Argument<'_, '_>,
    twist: Argument<'_, '_>,
    acceleration: Argument<'_, '_>,
    sensors: Option<Vec<String>>,
    tool: Option<&str>,
    way: Option<&str>,
    estimator: &str,
    alpha: f64,
    beta: f64,
    gravity: Argument<'_, '_>,
    average: Option<f64>,
    cutoff: Option<f64>,
    epochs: Option<u32>,
    max_gap: Option<f64>,
    wrench_offset: bool,
    wrench_noise: Argument<'_, '_>,
    effort_noise: Argument<'_, '_>,
    known_tool: Option<&MassProperties>,
    known_mass: Option<f64>,
    known_mass_deviation: f64,
    bounding_box: Argument<'_, '_>,
    delay: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Identification> {
    let default_way = if wrench.is_some() {
        "tactile"
    } else {
        "effort"
    };
    let mut request = Given {
        way: way.or(Some(default_way)),
        effort: effort.is_some(),
        estimator,
        alpha,
        beta,
        gravity,
        average,
        cutoff,
        epochs,
        max_gap,
        wrench_offset,
        wrench_noise,
        effort_noise,
    }
    .request()?;
    request.delay_s = delay.or(request.delay_s);
    Known {
        tool: known_tool,
        mass: known_mass,
        mass_deviation: known_mass_deviation,
        bounding_box,
    }
    .add_to(&mut request)?;
    let lone = tactid_dynamics::Manipulator::lone_body("sensor");
    let model = robot.map_or(&lone, |robot| &robot.0);
    if robot.is_none() && request.settings.gravity.is_none() {
        // A sensor that is carried about is on the ground.
        request.settings.gravity = Some(Vector3::new(0.0, 0.0, -9.81));
    }
    let tool = tool.unwrap_or(if robot.is_some() { "tool0" } else { "sensor" });
    let sensors = sensors.unwrap_or(if wrench.is_some() {
        vec![tool.to_owned()]
    } else {
        vec![]
    });
    let arrays = Arrays::read(
        model.dof(),
        sensors.len(),
        time,
        [q, qd, effort],
        wrench,
        [pose, twist, acceleration],
    )?;
    let names: Vec<&str> = sensors.iter().map(String::as_str).collect();
    let mut pulse = Pulse::new(progress);
    let result = py.detach(|| {
        let samples =
            || -> Box<dyn Iterator<Item = Sample<'_>> + '_> { Box::new(arrays.samples()) };
        tactid_identify::identify_samples(model, tool, &names, samples, &request, &mut |progress| {
            pulse.beat(progress.fraction)
        })
    });
    let result = result.map(Identification).map_err(IntoPyErr::into_py_err);
    pulse.finish(py, result)
}

/// A recording in arrays.
struct Arrays {
    time: Series,
    q: Series,
    qd: Series,
    effort: Series,
    wrenches: Vec<Wrench>,
    sensors: usize,
    bases: Vec<BaseState>,
    count: usize,
}

impl Arrays {
    fn read(
        dof: usize,
        sensors: usize,
        time: &Bound<'_, PyAny>,
        [q, qd, effort]: [Argument<'_, '_>; 3],
        wrench: Argument<'_, '_>,
        [pose, twist, acceleration]: [Argument<'_, '_>; 3],
    ) -> PyResult<Self> {
        let time = Series::read(time, "time", &[])?;
        if dof > 0 && q.is_none() {
            return Err(ArgumentError::new_err(
                "`q` is missing: the robot has joints",
            ));
        }
        let q = Series::read_or_empty(q, "q", dof)?;
        let qd = Series::read_or_empty(qd, "qd", dof)?;
        let effort = Series::read_or_empty(effort, "effort", dof)?;
        let wrench = match wrench {
            None => Series::read_or_zero(None, "wrench", 0)?,
            Some(given) if sensors == 1 => Series::read(given, "wrench", &[6])
                .or_else(|error| Series::read(given, "wrench", &[1, 6]).map_err(|_| error))?,
            Some(given) => Series::read(given, "wrench", &[sensors, 6])?,
        };
        let has_twist = twist.is_some();
        let pose = Poses::read_or_identity(pose, "pose")?;
        let twist = Series::read_or_zero(twist, "twist", 6)?;
        let measured = acceleration
            .map(|given| Series::read(given, "acceleration", &[6]))
            .transpose()?;
        let none = Series::read_or_zero(None, "acceleration", 0)?;
        let all: [&dyn crate::arrays::Sampled; 8] = [
            &time,
            &q,
            &qd,
            &effort,
            &wrench,
            &pose,
            &twist,
            measured.as_ref().unwrap_or(&none),
        ];
        let count = common_length(&all)?.unwrap_or(1);
        let times: Vec<f64> = (0..count).map(|k| time.at(k)[0]).collect();
        let poses: Vec<_> = (0..count).map(|k| *pose.at(k)).collect();
        let mut bases = if has_twist || pose.is_single() {
            let state = |k| BaseState {
                pose: poses[k],
                velocity: twist.vector(k, 0),
                angular_velocity: twist.vector(k, 3),
                ..BaseState::fixed()
            };
            (0..count).map(state).collect()
        } else {
            states_of_poses(&times, &poses)
        };
        if let Some(measured) = &measured {
            for (k, base) in bases.iter_mut().enumerate() {
                base.acceleration = Some(measured.vector(k, 0));
                base.angular_acceleration = Some(measured.vector(k, 3));
            }
        }
        let wrenches = (0..count).flat_map(|k| {
            wrench.at(k).chunks_exact(6).map(|six| Wrench {
                force: Vector3::from_column_slice(&six[..3]),
                moment: Vector3::from_column_slice(&six[3..]),
            })
        });
        Ok(Self {
            wrenches: wrenches.collect(),
            time,
            q,
            qd,
            effort,
            sensors,
            bases,
            count,
        })
    }

    fn samples(&self) -> impl Iterator<Item = Sample<'_>> {
        (0..self.count).map(|k| Sample {
            time_s: self.time.at(k)[0],
            base: self.bases[k],
            joint_position: self.q.at(k),
            joint_velocity: self.qd.at(k),
            joint_effort: self.effort.at(k),
            wrenches: &self.wrenches[k * self.sensors..(k + 1) * self.sensors],
        })
    }
}
