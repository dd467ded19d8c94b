//! Least squares in the control loop: an estimate with its uncertainty at every sample.

mod estimator;
mod identifier;
mod readout;
mod running_noise;
mod sums;

pub use identifier::Identifier;
