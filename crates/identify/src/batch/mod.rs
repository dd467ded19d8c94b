//! Robust weighted least squares over all equations of a recording.

mod accumulation;
mod equation_batch;
pub(crate) mod fit;
mod forecast;
mod history;
mod identifier;
pub mod preview;
mod report;
mod suspicions;

pub use equation_batch::EquationBatch;
pub use fit::Delay;
pub use forecast::Forecast;
pub use identifier::{BatchIdentifier, BatchResult, BatchSettings};
pub use report::FitReport;
