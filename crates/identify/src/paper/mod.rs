//! The paper's two-stage filter: (48) for mass and centre of mass, then (46) for the inertia, each by
//! normalised LMS.

mod excitation;
mod filter;
mod recent_mean;

pub use excitation::SingularValues;
pub use filter::{PaperFilter, PaperSettings};
