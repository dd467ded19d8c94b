//! Identification from poses at rest: arrays without times.

use std::ops::ControlFlow;

use tactid_dynamics::{BaseKind, Wrench};
use tactid_identify::{BaseState, BatchResult, EquationSettings, Method, RestIdentifier, Sample};

use crate::alignment::{Event, Measured};
use crate::arrays::ArrayRecording;
use crate::beginning::identifying;
use crate::fault::FaultCounts;
use crate::identification::negate_offsets;
use crate::recording::Recording;
use crate::wrench_channels::{left_out_channels, unmeasured_in_all};
use crate::{
    ActsOn, Arrays, Clock, EstimatorKind, Finding, GravityChoice, Identification, OffsetChoice,
    RecordingError, RecordingReport, Request, Setup,
};

/// Identifies the payload from poses at rest: attitudes and wrenches without times.
///
/// The arrays have no `time`, `qd`, `effort`, `twist`, `acceleration` or `unloaded`; a row is one pose,
/// or one of several samples in a pose, which follow each other and are averaged. The result is that of
/// a recording whose clock is [`Clock::None`]: it has no history, no cutoff and no forecast, and each of
/// its windows is an attitude. The offset of the sensor is identified unless the request says no, and
/// gravity is 9.81 m/s² along -z unless the request gives another one.
///
/// # Errors
/// Returns [`RecordingError::Option`] if the request has an option that does not apply to poses or does
/// not fit the robot, [`RecordingError::Arrays`] if the arrays do not fit each other or the robot,
/// [`RecordingError::Tip`] if the robot does not have the end-effector frame, and
/// [`RecordingError::Identify`] if a value of the request is out of range, no pose can be used, or all
/// poses have one attitude, which does not distinguish an offset from a weight.
///
/// Values that are not finite are no error, but are counted in
/// [`faults`](crate::RecordingReport::faults) under the name of the array.
pub fn identify_poses(
    arrays: &Arrays<'_>,
    request: &Request,
) -> Result<Identification, RecordingError> {
    request.check_poses()?;
    request.check()?;
    let count = rows(arrays);
    if count == 0 {
        return Err(RecordingError::Arrays(
            "`wrench` is missing: give the wrench of each pose at rest".to_owned(),
        ));
    }
    // The recording of arrays reads a sample by its time.
    let places: Vec<f64> = (0..count).map(|k| k as f64).collect();
    let arrays = Arrays {
        time: &places,
        ..*arrays
    };
    let recording = ArrayRecording::new(&arrays, request)?;
    let sources = recording.sources();
    let mut equations = equations(request);
    let sensors: Vec<&str> = sources.sensors.iter().map(String::as_str).collect();
    let (robot, tip) = (&sources.robot, &sources.options.tip);
    // Axes that turn against the sensor's have no channel that measures nothing.
    if equations.wrench_axes.is_none() {
        let six = arrays.wrench.chunks_exact(6);
        let six = six.filter_map(|wrench| wrench.try_into().ok());
        equations.unmeasured = unmeasured_in_all(sources, tip, six);
    }
    let of_tool = request.tool_at(tip, EstimatorKind::LeastSquares)?;
    let tool = request.known_tool();
    let beginning = recording.beginning(&mut |_| ControlFlow::Continue(()))?;
    let mut identifier = RestIdentifier::new(robot, tip, &sensors, &equations, tool)?;
    let faults = push_samples(&recording, &mut identifier)?;
    let mut result = identifier.solve()?;
    if request.wrench_acts_on == Some(ActsOn::Sensor) {
        negate_offsets(&mut result);
    }
    let left_out = left_out_channels(&equations.unmeasured, sources);
    let noticed = result.findings.drain(..).map(Finding::Data);
    let report = RecordingReport {
        setup: Setup::new(sources, request, identifying(&beginning), None),
        method: Method::Tactile,
        estimator: EstimatorKind::LeastSquares,
        cutoff_hz: f64::NAN,
        max_gap_s: f64::NAN,
        gravity_m_s2: equations.gravity_for(robot.base_kind()),
        delay_s: 0.0,
        clock: Clock::None,
        start_ns: 0,
        duration_s: 0.0,
        faults: faults.without_times().to_vec(),
        findings: of_tool.into_iter().chain(left_out).chain(noticed).collect(),
        interrupted: false,
        damage: Vec::new(),
    };
    Ok(identification(result, report))
}

/// Pushes all samples that can be used, and returns what could not.
fn push_samples(
    recording: &ArrayRecording<'_>,
    identifier: &mut RestIdentifier,
) -> Result<FaultCounts, RecordingError> {
    let sources = recording.sources();
    let (sensors, dof) = (sources.sensors.len(), sources.robot.dof());
    let mut joints = Vec::new();
    recording.each_sample(|events| {
        if let Some((base, wrenches)) = sample(events, sensors, dof, &mut joints) {
            identifier.push(&Sample {
                time_s: 0.0,
                base,
                joint_position: &joints,
                joint_velocity: &[],
                joint_effort: &[],
                wrenches: &wrenches,
            })?;
        } else {
            identifier.skip();
        }
        Ok::<(), RecordingError>(())
    })
}

/// Returns the number of rows of `wrench`.
fn rows(arrays: &Arrays<'_>) -> usize {
    let sensors = arrays.sensors.map_or(1, <[&str]>::len).max(1);
    arrays.wrench.len() / (6 * sensors)
}

fn equations(request: &Request) -> EquationSettings {
    let given = request.gravity.and_then(GravityChoice::vector);
    let down = || BaseKind::Fixed.default_gravity();
    EquationSettings {
        gravity: Some(given.unwrap_or_else(down)),
        wrench_offset: request.wrench_offset != Some(OffsetChoice::No),
        ..request.equation_settings(Method::Tactile)
    }
}

/// Returns the base and the wrenches of one sample, and sets its joints; `None` where something cannot be used.
fn sample(
    events: &[Event],
    sensors: usize,
    dof: usize,
    joints: &mut Vec<f64>,
) -> Option<(BaseState, Vec<Wrench>)> {
    let (mut base, mut wrenches) = (None, Vec::with_capacity(sensors));
    joints.clear();
    for event in events {
        match &event.measured {
            Measured::Base(state) => base = Some(*state),
            Measured::Joints(values) => joints.extend(&values.position),
            Measured::Wrench(_, wrench) => wrenches.push(*wrench),
            _ => {}
        }
    }
    let is_whole = wrenches.len() == sensors && joints.len() == dof;
    base.filter(|_| is_whole).map(|base| (base, wrenches))
}

fn identification(result: BatchResult, recording: RecordingReport) -> Identification {
    Identification {
        estimate: result.estimate,
        principal_moments: result.principal_moments,
        linear: result.linear,
        history: result.history,
        fit: result.fit,
        forecast: result.forecast,
        estimated_delay: None,
        subtracts_unloaded: false,
        calibrated: None,
        known_mass: None,
        bounding_box: None,
        recording,
    }
}
