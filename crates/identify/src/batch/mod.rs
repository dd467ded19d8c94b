//! Robust weighted least squares over all equations of a recording.

mod equation_batch;
mod forecast;
mod history;
mod identifier;
mod other_load;
pub mod preview;
mod report;
mod rests;
mod shown_offset;

pub use equation_batch::EquationBatch;
pub use forecast::Forecast;
pub use identifier::{BatchIdentifier, BatchResult, BatchSettings};
pub use report::FitReport;
