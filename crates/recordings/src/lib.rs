//! Identifies a grasped payload from a log or from arrays.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod alignment;
mod arrays;
mod decode;
mod defaults;
mod error;
mod estimates;
mod fault;
mod feed;
mod finding;
mod identification;
mod identify;
mod log;
mod plan;
mod preview;
mod progress;
mod recording;
mod request;
mod run;
mod sources;
mod unloaded;

pub use arrays::Arrays;
pub use error::{RecordingError, TopicKind};
pub use estimates::write_estimates;
pub use fault::{DataFault, FaultKind};
pub use finding::Finding;
pub use identification::{Clock, Identification};
pub use identify::{identify_arrays, identify_log};
pub use progress::{Observer, Progress};
pub use request::{ActsOn, Estimator, Request, Topics};
pub use tactid_identify::{
    BoundingBox, Delay, FitReport, Forecast, HALF_WIDTH_95, HistoryPoint, KnownMass, Method,
    PaperSettings, PayloadEstimate, PrincipalMoments, SingularValues, VALUE_NAMES,
};
