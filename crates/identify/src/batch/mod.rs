//! Robust weighted least squares over all equations of a recording.

mod equation_batch;
mod forecast;
mod history;
mod identifier;
pub mod preview;
mod report;
mod rests;

pub use equation_batch::EquationBatch;
pub use forecast::Forecast;
pub use identifier::{BatchIdentifier, BatchResult, BatchSettings};
pub use report::FitReport;
