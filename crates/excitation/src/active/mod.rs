//! Motions that are planned while the payload is identified.

mod belief;
mod check;
mod contradiction;
mod interior;
mod planner;
mod prior;
mod settings;

pub use contradiction::{PriorBound, PriorContradiction};
pub use planner::{Planner, Step};
pub use prior::Prior;
pub use settings::ActiveSettings;
