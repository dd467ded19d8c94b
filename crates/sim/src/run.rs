//! Simulation of a whole experiment with its log.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Instant;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::log::{Recorder, RecorderThread};
use crate::{ActiveReport, BaseExcursion, Checks, Experiment, SimError, Simulation};

/// Progress of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Simulated time since the start of the excitation, s.
    pub time_s: f64,
    /// Simulated time at which the run ends at the latest, s.
    pub duration_s: f64,
    /// Number of steps taken.
    pub steps: u64,
    /// Largest number of steps of the whole run.
    pub total_steps: u64,
}

/// Report of a simulation run. Each check is its largest value during the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunReport {
    /// Largest violations of conservation laws and of the grasp.
    #[serde(flatten)]
    pub checks: Checks,
    /// Force of each finger on the payload when the excitation began, N.
    pub grip_force_n: f64,
    /// Number of samples in the log.
    pub steps: u64,
    /// Simulated time in the log, s.
    pub simulated_time_s: f64,
    /// Whether the observer stopped the run.
    pub interrupted: bool,
    /// Largest motion of a free-floating base; `None` for a fixed base.
    #[serde(default)]
    pub base: Option<BaseExcursion>,
    /// What active excitation has reached; `None` for another kind of excitation.
    #[serde(default)]
    pub active: Option<ActiveReport>,
    /// Wall-clock time of the run including grasp and log, s. It is not logged, because the log
    /// depends on the experiment only.
    #[serde(default)]
    pub wall_time_s: f64,
    /// Simulated steps per second of wall-clock time, 1/s.
    #[serde(default)]
    pub steps_per_second: f64,
}

/// Report as it is written to the log.
#[derive(Serialize)]
struct LoggedReport<'a> {
    #[serde(flatten)]
    checks: Checks,
    grip_force_n: f64,
    steps: u64,
    simulated_time_s: f64,
    interrupted: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    base: Option<BaseExcursion>,
    #[serde(skip_serializing_if = "Option::is_none")]
    active: Option<ActiveReport>,
    /// Reason why the run was aborted.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a str>,
}

/// Simulated time between two calls of the observer, s.
const OBSERVE_EVERY_S: f64 = 0.02;

/// Runs an experiment and writes its log. With active excitation the run ends when the payload is
/// identified and the arm rests, at the latest after the experiment's duration.
///
/// The function calls `observer` every 20 ms of simulated time. The observer can stop the run: the
/// log is then complete up to that time, and the report has `interrupted` set. An existing file is
/// replaced. The same experiment gives the same log, byte for byte.
///
/// # The log
///
/// The log is a rosbag2 file (MCAP) with the topics that such a robot would record. Stamps and
/// times of logging begin at 1 s and are the times of the samples.
///
/// | topic | message | contents |
/// |---|---|---|
/// | `/joint_states` | `sensor_msgs/JointState` | position, velocity and effort of every moving joint, fingers included: rad, rad/s, N m, or m, m/s, N; at every step |
/// | `/NAME/wrench` | `geometry_msgs/WrenchStamped` | wrench of each finger **on the payload**, in the frame of the finger's link and about its origin, N and N m; at every step |
/// | `/NAME/contacts` | `sensor_msgs/PointCloud2` | contact points and forces on the payload in the same frame, m and N; 10 Hz |
/// | `/base/odom` | `nav_msgs/Odometry` | pose of the base link in `world`, its twist in its own axes; at every step, only for a floating base |
/// | `/base/imu` | `sensor_msgs/Imu` | specific force and angular velocity of the base link in its own axes; at every step, only for a floating base |
/// | `/tf`, `/tf_static` | `tf2_msgs/TFMessage` | poses of links and payload; 50 Hz, and once |
/// | `/robot_description` | `std_msgs/String` | URDF of the robot with the experiment's base; once |
///
/// `NAME` is the link of the finger without `_link`. A fixed base has no odometry, because a robot
/// on a bench has none, and without odometry an identification takes the base for fixed;
/// `/tf_static` has its pose. The metadata records are `tactid.experiment` (TOML), `tactid.truth`
/// (JSON: the payload in the tool frame, kg, m, kg m² about the centre of mass, as it sits in the
/// grasp and as the experiment asks for it under `nominal`) and `tactid.report` (JSON: the fields
/// of [`RunReport`] that depend on the experiment only).
///
/// # Example
///
/// ```
/// use std::ops::ControlFlow;
/// use tactid_sim::{Experiment, run};
///
/// let mut experiment = Experiment::paper();
/// experiment.duration_s = 0.3;
/// let log = std::env::temp_dir().join("tactid-run-example.mcap");
/// let report = run(&experiment, &log, |_progress| ControlFlow::Continue(()))?;
/// assert_eq!(report.steps, 300);
/// assert!(report.checks.linear_momentum_drift.is_some_and(|drift| drift < 1e-3));
/// # std::fs::remove_file(log).ok();
/// # Ok::<(), tactid_sim::SimError>(())
/// ```
///
/// # Errors
/// Returns the errors of [`Simulation::new`] and [`Simulation::step`], and [`SimError::Log`] if the
/// log cannot be written. If a step fails, the error is [`SimError::Aborted`], and the log up to
/// that step is in the file that it names: `run.failed.mcap` for `run.mcap`, so that a failed run
/// is not taken for a sound one.
pub fn run(
    experiment: &Experiment,
    log_path: &Path,
    mut observer: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<RunReport, SimError> {
    let start = Instant::now();
    let mut simulation = Simulation::new(experiment)?;
    let recorder = Recorder::create(log_path, &simulation)?;
    let (end, recorder) = thread::scope(|scope| {
        let mut writing = RecorderThread::start(scope, recorder);
        let end = simulate(&mut simulation, &mut writing, &mut observer);
        writing.join().map(|recorder| (end, recorder))
    })?;
    let interrupted = matches!(end, End::Interrupted);
    if let End::Failed(error) = end {
        recorder.finish(&logged(&simulation, false, Some(&error.to_string())))?;
        return Err(aborted(error, log_path));
    }
    if !interrupted {
        // The run is complete, so that a request to stop has no effect.
        let _ = observer(&progress(&simulation));
    }
    recorder.finish(&logged(&simulation, interrupted, None))?;
    Ok(report(
        &simulation,
        interrupted,
        start.elapsed().as_secs_f64(),
    ))
}

/// How a run has ended.
enum End {
    Complete,
    Interrupted,
    /// A step has failed.
    Failed(SimError),
}

/// Takes all steps that are left, up to an interruption, a failure or an error of the log, which
/// the writer keeps.
fn simulate(
    simulation: &mut Simulation,
    writing: &mut RecorderThread<'_>,
    observer: &mut impl FnMut(&Progress) -> ControlFlow<()>,
) -> End {
    let every = (OBSERVE_EVERY_S / simulation.experiment().step_s).ceil() as u64;
    while !simulation.is_finished() {
        let steps = simulation.steps();
        if steps.is_multiple_of(every) && observer(&progress(simulation)).is_break() {
            return End::Interrupted;
        }
        if let Err(error) = simulation.step() {
            return End::Failed(error);
        }
        if !writing.write(steps, simulation.sample(), simulation.state()) {
            break;
        }
    }
    End::Complete
}

/// Moves the log of a run that a step aborted, so that its name says so, and returns the error with
/// the log's place.
fn aborted(reason: SimError, log_path: &Path) -> SimError {
    // Only a regular file is moved: a device or a link stays, and so does the target of a link.
    let is_file = std::fs::symlink_metadata(log_path).is_ok_and(|status| status.is_file());
    let moved =
        free_name(log_path).filter(|failed| is_file && std::fs::rename(log_path, failed).is_ok());
    let log = moved.unwrap_or_else(|| log_path.to_owned());
    SimError::Aborted {
        reason: Box::new(reason),
        log,
    }
}

/// Returns an unused name of a failed run's log: `run.failed.mcap`, or `run.failed_2.mcap`.
fn free_name(log_path: &Path) -> Option<PathBuf> {
    let numbered = (2..100).map(|number| format!("failed_{number}.mcap"));
    std::iter::once("failed.mcap".to_owned())
        .chain(numbered)
        .map(|extension| log_path.with_extension(extension))
        .find(|path| std::fs::symlink_metadata(path).is_err())
}

fn progress(simulation: &Simulation) -> Progress {
    Progress {
        time_s: simulation.time_s(),
        duration_s: simulation.experiment().duration_s,
        steps: simulation.steps(),
        total_steps: simulation.total_steps(),
    }
}

fn logged<'a>(
    simulation: &Simulation,
    interrupted: bool,
    error: Option<&'a str>,
) -> LoggedReport<'a> {
    LoggedReport {
        checks: simulation.checks(),
        grip_force_n: simulation.grip_force_n(),
        steps: simulation.steps(),
        simulated_time_s: simulation.time_s(),
        interrupted,
        base: simulation.base_excursion(),
        active: simulation.active_report(),
        error,
    }
}

fn report(simulation: &Simulation, interrupted: bool, wall_time_s: f64) -> RunReport {
    RunReport {
        checks: simulation.checks(),
        grip_force_n: simulation.grip_force_n(),
        steps: simulation.steps(),
        simulated_time_s: simulation.time_s(),
        interrupted,
        base: simulation.base_excursion(),
        active: simulation.active_report(),
        wall_time_s,
        steps_per_second: simulation.steps() as f64 / wall_time_s.max(1e-9),
    }
}
