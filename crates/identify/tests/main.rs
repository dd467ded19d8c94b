//! The integration tests of this crate, as one program.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "common/arm.rs"]
mod arm;
#[path = "common/at_rest.rs"]
mod at_rest;
mod common;
#[path = "common/faults.rs"]
mod faults;
#[path = "common/handling.rs"]
mod handling;
#[path = "common/recorded.rs"]
mod recorded;
#[path = "common/setups.rs"]
mod setups;
#[path = "common/turning.rs"]
mod turning;

mod batch;
mod checks;
mod contact;
mod contact_or_payload;
mod effort_intervals;
mod findings;
mod further_unknowns;
mod identifier;
mod little_motion;
mod masses;
mod motion_rows;
mod multi_cutoff;
mod no_allocation;
mod online;
mod online_offset;
mod online_settings;
mod payload_change;
mod poses;
mod poses_assumptions;
mod recorded_contact;
mod scales;
mod still_arms;
mod trajectory;
mod trajectory_limits;
mod wrong_assumptions;
