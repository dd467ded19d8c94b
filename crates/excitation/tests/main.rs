//! The integration tests of this crate, as one program.

#![allow(clippy::panic, clippy::unwrap_used)]

#[path = "common/closed_loop.rs"]
#[allow(dead_code, reason = "the example uses more of it")]
mod closed_loop;
mod common;

mod active;
mod collisions;
mod designs;
mod limits;
mod prediction;
mod untested_shapes;
