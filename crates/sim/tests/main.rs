//! The integration tests of this crate, as one program.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod common;

mod active_excitation;
mod designed_motion;
mod fixed_base;
mod limits;
mod log;
mod physics;
