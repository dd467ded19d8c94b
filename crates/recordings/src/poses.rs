//! Identification from poses at rest: arrays without times.

use std::ops::ControlFlow;

use tactid_batch::distributions::students_factor;
use tactid_batch::{BatchResult, Finding as Data, RestIdentifier};
use tactid_dynamics::words::HALF_WIDTH_95;
use tactid_dynamics::{BaseKind, Wrench};
use tactid_identify::{BaseState, EquationSettings, Method, Sample};

use crate::alignment::{Event, Measured};
use crate::arrays::ArrayRecording;
use crate::beginning::identifying;
use crate::defaults::Motion;
use crate::fault::FaultCounts;
use crate::identification::negate_offsets;
use crate::orientation::{OTHER_READINGS, PoseReading};
use crate::recording::{Recording, Sources};
use crate::wrench_channels::{left_out_channels, unmeasured_in_all, without_channels};
use crate::{
    ActsOn, Arrays, Clock, EstimatorKind, Finding, GravityChoice, Identification, OffsetChoice,
    RecordingError, RecordingReport, Request, Setup,
};

/// Residual of one cause relative to that of another one, below which it explains clearly more.
const CLEARLY_LESS: f64 = 0.5;

/// Number of unknowns for which another reading counts: those of a rotation.
const UNKNOWNS: usize = 3;

/// Mass that few arms lift, kg: 0.2 kg weighed in mN seem to be so much.
const HEAVY_KG: f64 = 200.0;

/// Identifies the payload from poses at rest: attitudes and wrenches without times.
///
/// The arrays have no `time`, `qd`, `effort`, `twist`, `acceleration` or `unloaded`; a row is one
/// pose, or one of several samples in a pose, which follow each other and are averaged. The result
/// is that of a recording whose clock is [`Clock::None`]: it has no history, no cutoff and no
/// forecast, and each of its windows is an attitude. The offset of the sensor is identified unless
/// the request says no, and gravity is 9.81 m/s² along -z unless the request gives another one.
///
/// # Errors
/// Returns [`RecordingError::Option`] if the request has an option that does not apply to poses or
/// does not fit the robot, [`RecordingError::Arrays`] if the arrays do not fit each other or the
/// robot, [`RecordingError::Tip`] if the robot does not have the end-effector frame, and
/// [`RecordingError::Identify`] if a value of the request is out of range, no pose can be used, or
/// all poses have one attitude, which does not distinguish an offset from a weight.
///
/// Values that are not finite are no error, but are counted in
/// [`faults`](crate::RecordingReport::faults) under the name of the array.
pub fn identify_poses(
    arrays: &Arrays<'_>,
    request: &Request,
) -> Result<Identification, RecordingError> {
    request.check_poses()?;
    request.check()?;
    let count = rows(arrays)?;
    // The recording of arrays reads a sample by its time.
    let places: Vec<f64> = (0..count).map(|k| k as f64).collect();
    let arrays = Arrays {
        time: &places,
        ..*arrays
    };
    let recording = ArrayRecording::new(&arrays, request)?;
    let sources = recording.sources();
    let unmeasured = unmeasured_in_all(sources, arrays.wrench);
    let equations = equations(request, sources, &unmeasured);
    let sensors: Vec<&str> = sources.sensors.iter().map(String::as_str).collect();
    let (robot, tip) = (&sources.robot, &sources.options.tip);
    let of_tool = request.tool_at(tip, EstimatorKind::LeastSquares)?;
    let beginning = recording.beginning(&mut |_| ControlFlow::Continue(()))?;
    let mut identifier =
        RestIdentifier::new(robot, tip, &sensors, &equations, request.known_tool())?;
    let unfilled = identifier.clone();
    let faults = push_samples(&recording, &mut identifier, None)?;
    let mut result = identifier.solve()?;
    let is_partial = equations.unmeasured.contains(&true);
    let reading = contradicted_reading(&recording, &identifier, &unfilled, is_partial)?
        .filter(|(ratio, _)| replaces(*ratio, &mut result))
        .map(|(_, finding)| finding);
    if request.wrench_acts_on == Some(ActsOn::Sensor) {
        negate_offsets(&mut result);
    }
    let left_out = left_out_channels(&equations, sources, tip, &unmeasured);
    let of_size = heavy_load(&result);
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
        findings: of_tool
            .into_iter()
            .chain(left_out)
            .chain(of_size)
            .chain(reading)
            .chain(noticed)
            .collect(),
        interrupted: false,
        damage: Vec::new(),
    };
    with_shape(identification(result, report), request)
}

/// Returns a result with what the shape of a request says, where there is one.
fn with_shape(
    mut found: Identification,
    request: &Request,
) -> Result<Identification, RecordingError> {
    if let Some(shape) = request.read_shape()? {
        // The noise is estimated from few poses.
        let freedom = found.linear.degrees_of_freedom;
        found.add_shape(&shape, students_factor(freedom.max(1.0)))?;
    }
    Ok(found)
}

/// Returns the finding that the load is certainly heavier than what most arms lift.
fn heavy_load(result: &BatchResult) -> Option<Finding> {
    let (mass_kg, std_dev_kg) = (result.estimate.body.mass_kg, result.estimate.std_devs[0]);
    (mass_kg - HALF_WIDTH_95 * std_dev_kg > HEAVY_KG).then_some(Finding::HeavyLoad {
        mass_kg,
        std_dev_kg,
    })
}

/// How poses at rest are read otherwise.
#[derive(Clone, Copy)]
enum OtherReading {
    Pose(PoseReading),
    /// Moments are in the places of forces, and forces in those of moments.
    Exchanged,
}

/// Returns the residual of another reading of the poses that explains the wrenches far better than
/// the `given` one, relative to that, with the finding about it. `unfilled` is an identifier
/// without samples; `is_partial`: some channels are not measured, which exchanged ones would fill.
fn contradicted_reading(
    recording: &ArrayRecording<'_>,
    given: &RestIdentifier,
    unfilled: &RestIdentifier,
    is_partial: bool,
) -> Result<Option<(f64, Finding)>, RecordingError> {
    let mut best: Option<(f64, Finding)> = None;
    let of_poses = OTHER_READINGS.map(OtherReading::Pose).into_iter();
    let of_poses = of_poses.filter(|_| recording.measures_poses());
    let exchanged = (!is_partial).then_some(OtherReading::Exchanged);
    for reading in of_poses.chain(exchanged) {
        let mut other = unfilled.clone();
        push_samples(recording, &mut other, Some(reading))?;
        let is_exchanged = matches!(reading, OtherReading::Exchanged);
        let ratio = given.residual_ratio_of(&other, UNKNOWNS, is_exchanged);
        let is_best = |ratio: &f64| best.as_ref().is_none_or(|best| *ratio < best.0);
        let Some(residual_ratio) = ratio.filter(is_best) else {
            continue;
        };
        let finding = match reading {
            OtherReading::Pose(reading) => Finding::OrientationContradicted {
                reading: reading.orientation,
                of_base: recording.sources().contents.motion == Motion::Joints,
                residual_ratio,
            },
            OtherReading::Exchanged => Finding::ForcesAndMomentsExchanged { residual_ratio },
        };
        best = Some((residual_ratio, finding));
    }
    Ok(best)
}

/// Returns whether another reading is a cause beside those that were found in a result, and removes
/// from it what follows from the wrong reading: all causes that explain clearly less.
fn replaces(residual_ratio: f64, result: &mut BatchResult) -> bool {
    let first = result.findings.iter().find_map(|finding| match finding {
        Data::WrongAssumption(cause) => Some(cause.residual_ratio),
        _ => None,
    });
    let others_leave = first.unwrap_or(1.0);
    if others_leave < CLEARLY_LESS * residual_ratio {
        return false;
    }
    let is_ambiguous = residual_ratio > CLEARLY_LESS * others_leave;
    result.findings.retain_mut(|finding| match finding {
        Data::PosesAtRest(resting) => {
            resting.next = None;
            true
        }
        Data::WrongAssumption(_) => is_ambiguous,
        Data::NothingHeld { .. }
        | Data::NegativeMass { .. }
        | Data::KnownBodiesTooHeavy { .. }
        | Data::Inconsistent { .. }
        | Data::TooFewPoses { .. }
        | Data::CenterFarAway(_)
        | Data::OutlyingPose(_) => false,
        _ => true,
    });
    true
}

/// Pushes all samples that can be used, in another reading if there is one, and returns what could
/// not be used.
fn push_samples(
    recording: &ArrayRecording<'_>,
    identifier: &mut RestIdentifier,
    reading: Option<OtherReading>,
) -> Result<FaultCounts, RecordingError> {
    let sources = recording.sources();
    let (sensors, dof) = (sources.sensors.len(), sources.robot.dof());
    let mut joints = Vec::new();
    recording.each_sample(|events| {
        if let Some((mut base, mut wrenches)) = sample(events, sensors, dof, &mut joints) {
            match reading {
                None => {}
                Some(OtherReading::Pose(reading)) => base.pose = reading.read(&base.pose),
                Some(OtherReading::Exchanged) => {
                    for wrench in &mut wrenches {
                        std::mem::swap(&mut wrench.force, &mut wrench.moment);
                    }
                }
            }
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

/// Returns the number of rows of `wrench`. Without any, it is an error.
fn rows(arrays: &Arrays<'_>) -> Result<usize, RecordingError> {
    let sensors = arrays.sensors.map_or(1, <[&str]>::len).max(1);
    let count = arrays.wrench.len() / (6 * sensors);
    let missing = "`wrench` is missing: give the wrench of each pose at rest";
    (count > 0)
        .then_some(count)
        .ok_or_else(|| RecordingError::Arrays(missing.to_owned()))
}

/// Returns the settings of the equations, given the channels that each sensor does not measure.
fn equations(request: &Request, sources: &Sources, unmeasured: &[[bool; 6]]) -> EquationSettings {
    let given = request.gravity.and_then(GravityChoice::vector);
    let down = || BaseKind::Fixed.default_gravity();
    let mut equations = EquationSettings {
        gravity: Some(given.unwrap_or_else(down)),
        wrench_offset: request.wrench_offset != Some(OffsetChoice::No),
        ..request.equation_settings(Method::Tactile)
    };
    let tip = &sources.options.tip;
    equations.unmeasured = without_channels(sources, tip, &equations, unmeasured);
    equations
}

/// Returns the base and the wrenches of one sample, and sets its joints; `None` where something
/// cannot be used.
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
            Measured::Base(state) => base = Some(**state),
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
        load: result.load,
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
        shape: None,
        recording,
    }
}
