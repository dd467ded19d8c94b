//! Identifies a grasped payload from a log or from arrays.

mod arrays;
mod error;
mod estimates;
mod fault;
mod finding;
mod identification;
mod log;
mod progress;
mod request;

pub use arrays::{Arrays, identify_arrays};
pub use error::{RecordingError, TopicKind};
pub use estimates::write_estimates;
pub use fault::{DataFault, FaultKind};
pub use finding::Finding;
pub use identification::{Clock, Identification};
pub use log::identify_log;
pub use progress::{Observer, Progress};
pub use request::{ActsOn, Estimator, Request, Topics};
pub use tactid_identify::{
    BoundingBox, Delay, FitReport, Forecast, HALF_WIDTH_95, HistoryPoint, KnownMass, Method,
    PaperSettings, PayloadEstimate, PrincipalMoments, SingularValues, VALUE_NAMES,
};
