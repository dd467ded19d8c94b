//! Robust weighted least squares over all equations of a recording.

mod equation_batch;
mod fit;
mod forecast;
mod history;
mod identifier;
mod least_squares;
mod normal_equations;
pub mod preview;
mod report;
mod sandwich;
mod suspicions;

pub use equation_batch::EquationBatch;
pub use fit::Delay;
pub use forecast::Forecast;
pub use identifier::{BatchIdentifier, BatchResult, BatchSettings};
pub use report::FitReport;
