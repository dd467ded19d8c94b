//! Calibration of an arm from logs and arrays.

use std::path::{Path, PathBuf};

use tactid_calibrate::{
    CalibrateError, CalibrationResult, CalibrationSettings, EffortComparison, EffortRecording,
    KnownPayload, calibrate_interruptibly,
};
use tactid_dynamics::Manipulator;

use super::held_out::check_empty;
use super::record::Recorded;
use super::refusals::{
    are_of_grams, check_radians, do_not_fit, needs_rough_gains, wrong_positions,
};
use crate::ArmCalibration;
use crate::arrays::ArrayRecording;
use crate::defaults::{CLAIMED_GAIN_STD_DEV, effort_gains};
use crate::log::LogRecording;
use crate::progress::part_of;
use crate::recording::Recording;
use crate::run::Run;
use crate::same_log::same_log;
use crate::{
    Arrays, DataFault, Finding, GravityChoice, Observer, Progress, RecordingError, Request,
};

/// What is known of gains that a loaded recording is to find, as a fraction.
const FOUND_GAIN_STD_DEV: f64 = 0.2;

/// A recording of a calibration.
#[derive(Clone, Debug)]
pub enum CalibrationSource<'a> {
    /// The folder of a rosbag2 bag, or an `.mcap` or `.db3` file.
    Log(PathBuf),
    /// Positions and efforts of the joints in arrays.
    Arrays {
        /// Name of the arrays in results and errors.
        name: String,
        /// The arrays.
        arrays: Arrays<'a>,
    },
}

impl CalibrationSource<'_> {
    /// Returns the path of the log, or the name of the arrays.
    fn path(&self) -> &Path {
        match self {
            Self::Log(path) => path,
            Self::Arrays { name, .. } => Path::new(name),
        }
    }
}

/// The recordings of a calibration, of any motion of one robot.
#[derive(Clone, Debug, Default)]
pub struct CalibrationSources<'a> {
    /// Recordings without a payload.
    pub unloaded: Vec<CalibrationSource<'a>>,
    /// Recordings with a payload of which something is known: they find the gains of the efforts.
    pub loaded: Vec<(CalibrationSource<'a>, KnownPayload)>,
    /// Recordings without a payload that are not used, but compared with the calibrated model.
    pub held_out: Vec<CalibrationSource<'a>>,
    /// Standard deviation of the gain of each joint before the calibration, as a fraction; 0 where
    /// efforts are torques. Default: 0.2 with loaded recordings; without any, 0.05 if the request
    /// claims effort gains, else 0.
    pub gain_std_dev: Option<f64>,
}

/// What a recording is to a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingRole {
    /// It has no payload.
    Unloaded,
    /// It has a payload of which something is known.
    Loaded,
    /// It has no payload and was not used.
    HeldOut,
}

/// A recording of a calibration, and how the calibrated model explains it.
#[derive(Clone, Debug)]
pub struct CalibrationRecording {
    /// Path of the log, or the name of the arrays.
    pub path: PathBuf,
    /// What it is to the calibration.
    pub role: RecordingRole,
    /// Time from the first aligned sample to the last, s.
    pub duration_s: f64,
    /// Measured and modelled efforts. The payload is the identified one.
    pub comparison: EffortComparison,
    /// Messages and samples that could not be used, counted by topic and kind.
    pub faults: Vec<DataFault>,
    /// What a reader should know of the recording.
    pub findings: Vec<Finding>,
    /// Where the log could not be read further, and why.
    pub damage: Vec<String>,
}

/// A calibration with the recordings that it is from.
#[derive(Clone, Debug)]
pub struct CalibrationRun {
    /// The calibrated arm.
    pub arm: ArmCalibration,
    /// What was known of the gains before, see [`CalibrationSources::gain_std_dev`].
    pub gain_std_dev: f64,
    /// The recordings: unloaded, loaded and held out, each in the order in which they were given.
    pub recordings: Vec<CalibrationRecording>,
}

/// Calibrates the joint efforts of an arm from logs and arrays.
///
/// Of the request, robot, tip, joints and their topics, gravity, the longest bridged gap and effort
/// gains are used; its cutoff is that of the window means, 2 Hz by default. The arm's base is
/// fixed.
///
/// Recordings are read one after the other. Memory: some 130 MB for an hour of a seven-axis arm.
/// The observer is called several times a second.
///
/// # Errors
/// Returns [`RecordingError::Option`] if no recording is given, [`RecordingError::Together`] if two
/// are the same log or have the same content, [`RecordingError::InRecording`] with the recording
/// and the reason if one cannot be used (its positions are in degrees, for instance),
/// [`RecordingError::Interrupted`] if the observer stops the work, and
/// [`RecordingError::Identify`], [`RecordingError::Calibrate`] or [`RecordingError::Calibration`]
/// if a value is out of range or the recordings do not suffice.
pub fn calibrate_arm(
    sources: &CalibrationSources<'_>,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<CalibrationRun, RecordingError> {
    request.check()?;
    sources.check()?;
    let settings = sources.settings(request);
    settings.check()?;
    let efforts = Request {
        calibration: None,
        ..request.for_efforts(&settings)
    };
    let all = sources.by_role();
    check_paths(&all)?;
    let (mut calibrating, mut held_out, mut used) = (Vec::new(), Vec::new(), Vec::new());
    let (mut effort_gain, mut fingerprints) = (Vec::new(), Vec::new());
    for (index, given) in all.iter().enumerate() {
        let mut of_recording = part_of(observer, index, all.len());
        let read = read(given, &efforts, &settings, &mut of_recording);
        let (windows, notes) = read.map_err(|error| error.in_recording(given.source.path()))?;
        effort_gain = notes.gains.of_arm();
        let fingerprint = windows.fingerprint();
        if let Some(first) = fingerprints.iter().position(|each| *each == fingerprint) {
            return Err(given_twice(&all[first], given));
        }
        fingerprints.push(fingerprint);
        used.push((given, notes));
        match given.role {
            RecordingRole::HeldOut => held_out.push(windows),
            RecordingRole::Unloaded | RecordingRole::Loaded => {
                calibrating.push((windows, given.payload))
            }
        }
    }
    let result = calibrate_interruptibly(&calibrating, &settings, &mut || {
        observer(Progress { fraction: 1.0 })
    });
    let result = result.map_err(|error| cause(error, &used))?;
    let comparisons = compare(&result, &calibrating, &held_out)?;
    check_empty_recordings(&result, &all, &calibrating, &held_out, &comparisons)?;
    let recordings = used.into_iter().zip(comparisons);
    Ok(CalibrationRun {
        gain_std_dev: settings.gain_std_dev,
        recordings: recordings
            .map(|((given, notes), comparison)| notes.of(given, comparison))
            .collect(),
        arm: ArmCalibration {
            model: result.calibration,
            report: result.report,
            effort_gain,
        },
    })
}

/// A recording of a calibration with its role.
struct GivenRecording<'a> {
    source: &'a CalibrationSource<'a>,
    role: RecordingRole,
    payload: Option<KnownPayload>,
}

impl CalibrationSources<'_> {
    /// Checks that there is a recording, and what is known of the payloads.
    fn check(&self) -> Result<(), RecordingError> {
        if self.unloaded.is_empty() && self.loaded.is_empty() {
            return Err(RecordingError::Option {
                option: "unloaded",
                what: "a calibration needs at least one recording, without a payload or with a known one"
                    .to_owned(),
            });
        }
        let mut loaded = self.loaded.iter();
        Ok(loaded.try_for_each(|(_, payload)| payload.check())?)
    }

    fn settings(&self, request: &Request) -> CalibrationSettings {
        let defaults = CalibrationSettings::default();
        let gain_std_dev = if !self.loaded.is_empty() {
            FOUND_GAIN_STD_DEV
        } else if request.effort_gain.is_some() {
            CLAIMED_GAIN_STD_DEV
        } else {
            defaults.gain_std_dev
        };
        CalibrationSettings {
            gravity: request.gravity.and_then(GravityChoice::vector),
            cutoff_hz: request.cutoff_hz.unwrap_or(defaults.cutoff_hz),
            gain_std_dev: self.gain_std_dev.unwrap_or(gain_std_dev),
            ..defaults
        }
    }

    /// Returns all recordings: those that calibrate, then those that are held out.
    fn by_role(&self) -> Vec<GivenRecording<'_>> {
        let given = |source, role, payload| GivenRecording {
            source,
            role,
            payload,
        };
        let unloaded = self.unloaded.iter();
        let unloaded = unloaded.map(|source| given(source, RecordingRole::Unloaded, None));
        let loaded = self.loaded.iter();
        let loaded =
            loaded.map(|(source, payload)| given(source, RecordingRole::Loaded, Some(*payload)));
        let held_out = self.held_out.iter();
        let held_out = held_out.map(|source| given(source, RecordingRole::HeldOut, None));
        unloaded.chain(loaded).chain(held_out).collect()
    }
}

/// Checks that no log is given twice, before any is read.
fn check_paths(recordings: &[GivenRecording<'_>]) -> Result<(), RecordingError> {
    let paths: Vec<&Path> = recordings.iter().map(|each| each.source.path()).collect();
    match same_log(&paths) {
        Some((first, second)) => Err(given_twice(&recordings[first], &recordings[second])),
        None => Ok(()),
    }
}

/// Returns the error that two recordings are the same.
fn given_twice(first: &GivenRecording<'_>, second: &GivenRecording<'_>) -> RecordingError {
    let paths = [first, second].map(|each| each.source.path());
    let because = if first.role == second.role {
        "its noise would count twice"
    } else if second.role == RecordingRole::HeldOut {
        "a recording that calibrates the arm is no independent check"
    } else {
        "it either has a payload or not"
    };
    RecordingError::same_recording(paths, because)
}

/// Returns why recordings could not calibrate an arm.
fn cause(error: CalibrateError, used: &[(&GivenRecording<'_>, Notes)]) -> RecordingError {
    if matches!(error, CalibrateError::Interrupted) {
        return RecordingError::Interrupted;
    }
    let mut noted = used.iter();
    let cause = noted.find_map(|(given, notes)| {
        let error = do_not_fit(wrong_positions(&notes.findings)?);
        Some(error.in_recording(given.source.path()))
    });
    if let Some(cause) = cause {
        return cause;
    }
    match (&error, used.first()) {
        (CalibrateError::GainsUnexpected { gains, .. }, Some((_, notes)))
            if !are_of_grams(gains) =>
        {
            needs_rough_gains(&error, &notes.gains.times(gains))
        }
        _ => error.into(),
    }
}

/// The effort gains of a recording before the calibration, N m or N for one unit of the recorded
/// value.
struct GivenGains {
    /// Those of all joints of the robot.
    of_robot: Vec<f64>,
    /// For each joint of the arm, its index in the robot.
    joints: Vec<usize>,
}

impl GivenGains {
    fn new(request: &Request, robot: &Manipulator, arm: &[String]) -> Self {
        let index = |joint: &String| robot.joint_index(joint);
        Self {
            of_robot: effort_gains(request, robot.joint_names()),
            joints: arm.iter().filter_map(index).collect(),
        }
    }

    /// Returns the gains of the joints of the arm.
    fn of_arm(&self) -> Vec<f64> {
        self.joints.iter().map(|&k| self.of_robot[k]).collect()
    }

    /// Returns the gains of all joints of the robot, those of the arm times some factors.
    fn times(&self, factors: &[f64]) -> Vec<f64> {
        let mut gains = self.of_robot.clone();
        for (&joint, factor) in self.joints.iter().zip(factors) {
            gains[joint] *= factor;
        }
        gains
    }
}

/// What was counted and noticed while a recording was read.
struct Notes {
    gains: GivenGains,
    run: Run,
    findings: Vec<Finding>,
}

impl Notes {
    fn of(self, given: &GivenRecording<'_>, comparison: EffortComparison) -> CalibrationRecording {
        CalibrationRecording {
            path: given.source.path().to_owned(),
            role: given.role,
            duration_s: self.run.duration_s,
            comparison,
            faults: self.run.faults.to_vec(),
            findings: self.findings,
            damage: self.run.damage,
        }
    }
}

/// Reads one log or its arrays, and checks their positions and efforts.
fn read(
    given: &GivenRecording<'_>,
    request: &Request,
    settings: &CalibrationSettings,
    observer: &mut Observer<'_>,
) -> Result<(EffortRecording, Notes), RecordingError> {
    match given.source {
        CalibrationSource::Log(path) => {
            let recording = LogRecording::open(path, request, observer)?;
            read_recording(&recording, given.payload, request, settings, observer)
        }
        CalibrationSource::Arrays { arrays, .. } => {
            let recording = ArrayRecording::new(arrays, request)?;
            read_recording(&recording, given.payload, request, settings, observer)
        }
    }
}

fn read_recording(
    recording: &impl Recording,
    payload: Option<KnownPayload>,
    request: &Request,
    settings: &CalibrationSettings,
    observer: &mut Observer<'_>,
) -> Result<(EffortRecording, Notes), RecordingError> {
    let Recorded { plan, run, windows } = Recorded::new(recording, request, settings, observer)?;
    if run.interrupted {
        return Err(RecordingError::Interrupted);
    }
    let findings = run.noticed(&plan);
    check_radians(&findings)?;
    windows
        .check_efforts(payload.as_ref())
        .map_err(|error| wrong_positions(&findings).map_or(error.into(), do_not_fit))?;
    let notes = Notes {
        gains: GivenGains::new(request, &plan.sources.robot, windows.joint_names()),
        run,
        findings,
    };
    Ok((windows, notes))
}

/// Checks that each recording that was given as unloaded or held out holds nothing beyond what all
/// unloaded ones hold. A single unloaded recording is the reference itself.
fn check_empty_recordings(
    result: &CalibrationResult,
    given: &[GivenRecording<'_>],
    calibrating: &[(EffortRecording, Option<KnownPayload>)],
    held_out: &[EffortRecording],
    comparisons: &[EffortComparison],
) -> Result<(), RecordingError> {
    let windows = calibrating
        .iter()
        .map(|(windows, _)| windows)
        .chain(held_out);
    let is_unloaded = |each: &&GivenRecording<'_>| each.role == RecordingRole::Unloaded;
    let are_compared = given.iter().filter(is_unloaded).count() > 1;
    for ((given, windows), comparison) in given.iter().zip(windows).zip(comparisons) {
        let is_checked = match given.role {
            RecordingRole::Unloaded => are_compared,
            RecordingRole::Loaded => false,
            RecordingRole::HeldOut => true,
        };
        if is_checked {
            let checked = check_empty(&result.calibration, windows, comparison);
            let checked = checked.map_err(|error| match error {
                // The calibration has taken a share of its mass for the arm's.
                CalibrateError::UnloadedHolds { .. } if given.role == RecordingRole::Unloaded => {
                    CalibrateError::Unloaded(
                        "the unloaded recording holds a payload that the other ones do not have: give those of the empty \
                         arm only"
                            .to_owned(),
                    )
                }
                error => error,
            });
            checked
                .map_err(|error| RecordingError::from(error).in_recording(given.source.path()))?;
        }
    }
    Ok(())
}

/// Compares all recordings with the model, those that calibrated it with the payload that was
/// found.
fn compare(
    result: &CalibrationResult,
    calibrating: &[(EffortRecording, Option<KnownPayload>)],
    held_out: &[EffortRecording],
) -> Result<Vec<EffortComparison>, RecordingError> {
    let mut payloads = result.report.payloads.iter();
    let used = calibrating.iter().map(|(windows, known)| {
        let payload = known.and_then(|_| payloads.next());
        (windows, payload)
    });
    let all = used.chain(held_out.iter().map(|windows| (windows, None)));
    let compared =
        all.map(|(windows, payload)| Ok(result.calibration.compare(windows, payload)?));
    compared.collect()
}
