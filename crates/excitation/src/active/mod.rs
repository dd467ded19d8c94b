//! Motions that are planned while the payload is identified.

mod belief;
mod check;
mod contradiction;
mod interior;
mod planner;
mod prior;

pub use contradiction::{PriorBound, PriorContradiction};
pub use planner::{ActiveSettings, Planner, Step};
pub use prior::Prior;
