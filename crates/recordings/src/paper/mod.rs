//! The paper's two-stage filter: (48) for mass and centre of mass, then (46) for the inertia, each
//! by the normalised LMS filter (54).

mod estimate;
mod filter;
mod recent_mean;
mod rows;
mod singular_values;

pub use estimate::PaperEstimate;
pub(crate) use filter::needs_least_squares;
pub use filter::{PaperFilter, PaperSettings};
pub use singular_values::SingularValues;
