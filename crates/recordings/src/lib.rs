//! Identifies the payload that a robot holds, or that a force-torque sensor carries, from a
//! recording: a ROS 2 log ([`identify_log`]) or arrays ([`identify_arrays`]).
//!
//! A [`Request`] says what to identify and how. All of its fields are optional: topics, method,
//! filter and the delay between the clocks are chosen from the recording, with the same defaults
//! for logs and arrays. The result is an [`Identification`]: the payload with its uncertainty, what
//! was noticed about the recording ([`Finding`]) and what could not be used ([`DataFault`]). The
//! paper's filter, which knows no uncertainty, has a [`PaperIdentification`].
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use nalgebra::{Isometry3, Vector3};
//! use tactid_recordings::{Arrays, Request, identify_arrays};
//!
//! // For 3 s, a sensor turns about a tilted axis. It carries 2 kg, 0.1 m in front of it.
//! let times_s: Vec<f64> = (0..600).map(|k| 0.005 * f64::from(k)).collect();
//! let (turn_rate, center) = (Vector3::new(3.0, 1.0, 2.0), Vector3::new(0.0, 0.0, 0.1));
//! let gravity = Vector3::new(0.0, 0.0, -9.81);
//! let mut poses = Vec::new();
//! let mut wrenches = Vec::new();
//! for &t in &times_s {
//!     let pose = Isometry3::rotation(turn_rate * t);
//!     let centripetal = turn_rate.cross(&turn_rate.cross(&center));
//!     let force = 2.0 * (centripetal - pose.inverse() * gravity);
//!     let moment = center.cross(&force);
//!     wrenches.extend(force.iter().chain(&moment).copied());
//!     poses.push(pose);
//! }
//!
//! let arrays = Arrays {
//!     time: &times_s,
//!     pose: &poses,
//!     wrench: &wrenches,
//!     ..Arrays::default()
//! };
//! let mut observer = |_| ControlFlow::Continue(());
//! let result = identify_arrays(&arrays, &Request::default(), &mut observer)?;
//! let result = result.into_least_squares().expect("the estimator unless another is requested");
//! let payload = &result.estimate;
//! assert!((payload.body.mass_kg - 2.0).abs() < 1e-3);
//! assert!((payload.body.center_of_mass - center).norm() < 1e-4);
//! // A constant rotation leaves some of the inertia unknown.
//! assert!(payload.not_identifiable().any(|name| name == "Ixx"));
//! # Ok::<(), tactid_recordings::RecordingError>(())
//! ```
//!
//! Several recordings of one payload ([`identify_logs`]) become one estimate with a verdict on
//! whether they agree ([`combine`]).
//!
//! From a recording to the result, each step is built once and whole: the request and the recording
//! give its sources (topics or arrays, robot, frames); the beginning of the recording gives the
//! plan (filter, delay, whether measured accelerations are used); a run aligns all streams and
//! feeds the estimator; the estimator and what was counted on the way give the result.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod alignment;
mod angles;
mod arm_calibration;
mod arrays;
mod beginning;
mod calibration;
mod channel_ranges;
mod choices;
mod clock;
mod combination;
mod combine;
mod compensated_log;
mod compensation;
mod contacts;
mod cut;
mod decode;
mod defaults;
mod error;
mod estimates;
mod fault;
mod feed;
mod finding;
mod identification;
mod identify;
mod known_shape;
mod known_tool;
mod live;
mod log;
mod online;
mod orientation;
mod paper;
mod paper_identification;
mod parallel;
mod plan;
mod poses;
mod preview;
mod progress;
mod rates;
mod readings;
mod recording;
mod recording_report;
mod request;
mod request_checks;
mod request_shape;
mod request_tool;
mod run;
mod same_log;
mod setup;
mod shaped;
mod shortage;
mod sources;
mod split;
mod steps;
mod topic_kind;
mod unloaded;
mod unloaded_scale;
mod uses;
mod wrench_channels;

pub use arm_calibration::ArmCalibration;
pub use arrays::{Arrays, UnloadedArrays, base_is_fixed};
pub use calibration::{
    CalibrationRecording, CalibrationRequest, CalibrationRun, CalibrationSource,
    CalibrationSources, RecordingRole, calibrate_arm,
};
pub use choices::{
    ConfiguredPayload, EstimatorKind, GravityChoice, OffsetChoice, SensorFrame, WrenchIs,
};
pub use clock::Clock;
pub use combination::{CombinedRun, combine, combine_runs};
pub use combine::{
    Agreement, Combination, RunDistance, ShapeFit, ValueDifference, combine_estimates,
};
pub use compensated_log::{CompensatedLog, WrenchSummary, WrittenWrench, compensate_into};
pub use compensation::{
    CompensationReport, IdentifiedLoad, WrenchPlace, WrenchReceiver, compensate_arrays,
    compensate_log,
};
pub use defaults::DEFAULT_TIP;
pub use error::RecordingError;
pub use estimates::write_estimates;
pub use fault::{DataFault, FaultKind};
pub use finding::{ArmChanged, Finding, NotUsedBecause};
pub use identification::{CalibratedFit, Identification, Identified};
pub use identify::{identify_arrays, identify_log, identify_logs, identify_ranges};
pub use known_shape::ShapePose;
pub use known_tool::GivenTool;
pub use live::{LiveContact, LiveSession, LiveSettings, LiveSnapshot, LiveStatus};
pub use online::OnlineSetup;
pub use orientation::{OrientationReading, unit_quaternion};
pub use paper::{PaperEstimate, PaperFilter, PaperSettings, SingularValues};
pub use paper_identification::{PaperHistory, PaperIdentification};
pub use poses::identify_poses;
pub use progress::{Observer, Progress};
pub use recording_report::RecordingReport;
pub use request::Request;
pub use setup::Setup;
pub use split::{Segment, split_log, split_ranges};
pub use tactid_batch::{
    ContactSample, Delay, FitReport, Forecast, LinearEstimate, LoadEstimate, RecordedWrenches,
};
pub use tactid_batch::{HistoryPoint, PrincipalMoments, PriorKnowledge};
pub use tactid_identify::{
    ActsOn, BoundingBox, EffortContent, HALF_WIDTH_95, KnownMass, Method, Observability,
    PayloadEstimate, VALUE_NAMES,
};
pub use tactid_options::{Declaration, Kind, Use};
pub use tactid_shapes::ShapePrior;
