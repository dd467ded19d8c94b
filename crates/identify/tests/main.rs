//! The integration tests of this crate, as one program.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "common/arm.rs"]
mod arm;
mod common;
#[path = "common/handling.rs"]
mod handling;

mod contact_or_payload;
mod identifier;
mod masses;
mod motion_rows;
mod multi_cutoff;
mod no_allocation;
mod noisy_changes;
mod online;
mod online_offset;
mod online_settings;
mod payload_change;
