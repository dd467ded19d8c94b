//! The integration tests of this crate, as one program.

#![allow(clippy::panic, clippy::unwrap_used)]

#[path = "../../identify/tests/common/arm.rs"]
#[allow(dead_code, reason = "identify's tests use more of it")]
mod arm;
#[path = "../../identify/tests/common/mod.rs"]
mod common;
#[path = "../../calibrate/tests/common/effort_arm.rs"]
mod effort_arm;
mod recorded_arrays;
mod recorded_log;
#[path = "common/stored_arm.rs"]
mod stored_arm;

mod array_robot;
mod arrays;
mod calibration_combined;
mod calibration_file;
mod doubtful_delays;
mod error_messages;
mod live;
mod log;
mod measured_arms;
mod options;
mod orientations;
mod paper;
mod parts;
mod poses_of_joints;
mod rates;
mod readings;
mod requests;
mod rest;
mod runs;
mod sensor_frame;
mod shape;
mod shape_errors;
mod split;
mod times;
