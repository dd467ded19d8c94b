//! The integration tests of this crate, as one program.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[allow(dead_code)] // Gaps are only in tests of the online identifier.
#[path = "../../identify/tests/common/arm.rs"]
mod arm;
#[path = "common/at_rest.rs"]
mod at_rest;
#[path = "../../identify/tests/common/mod.rs"]
mod common;
#[path = "common/faults.rs"]
mod faults;
#[path = "../../identify/tests/common/handling.rs"]
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
mod cut_off;
mod effort_intervals;
mod findings;
mod further_unknowns;
mod lag;
mod lag_settings;
mod lag_streams;
mod little_motion;
mod online_findings;
mod poses;
mod poses_assumptions;
mod recorded_contact;
mod scales;
mod still_arms;
mod trajectory;
mod trajectory_limits;
mod wrong_assumptions;
mod wrong_weights;
