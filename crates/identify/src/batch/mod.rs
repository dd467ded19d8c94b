//! Robust weighted least squares over all equations of a recording.

mod equation_batch;
mod findings;
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
mod unexplained;

pub use equation_batch::EquationBatch;
pub(crate) use findings::findings_without_knowledge;
pub use fit::Delay;
pub use forecast::Forecast;
pub use identifier::{BatchIdentifier, BatchResult, BatchSettings};
pub use report::FitReport;
