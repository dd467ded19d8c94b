//! Motions that are planned while the payload is identified.

mod belief;
mod check;
mod interior;
mod planner;
mod prior;

pub use planner::{ActiveSettings, Planner, Step};
pub use prior::Prior;
