//! The integration tests of this crate, as one program.

#![allow(clippy::panic, clippy::unwrap_used)]

mod common;

mod derived_robots;
mod forces;
mod models;
mod motion;
mod no_allocation;
mod parameters;
mod plain_equations;
mod rows;
mod series;
mod urdf_errors;
mod urdf_findings;
mod urdf_names;
mod urdf_rs_robots;
