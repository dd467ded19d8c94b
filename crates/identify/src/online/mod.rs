//! Least squares in the control loop: an estimate with its uncertainty at every sample.

mod accumulated_rows;
mod changes;
mod contact_observer;
mod explanations;
mod identifier;
mod innovation;
mod inputs;
mod least_squares;
mod noise_tracker;
mod payload_times;
mod readout;
mod recent_equations;
mod residual_correlation;
mod restarts;
mod settings;
mod snapshot;
mod stage;
mod staged_update;
mod trusted;
mod wrenches;

pub use identifier::Identifier;
pub use recent_equations::RecentEquations;
pub use settings::OnlineSettings;
pub use snapshot::Snapshot;
