//! The equation stream: samples in, averaged equations of motion out.
//!
//! A sample is differentiated and smoothed with its neighbours ([`differentiation`]), each source of
//! measurements gives its rows for that instant ([`sources`](model)), and averaging windows make equations of
//! them ([`window`]). What leaves this module is a linear regression that knows no robot.

mod channels;
pub(crate) mod differentiation;
mod equation;
pub(crate) mod model;
mod sample;
mod settings;
mod stream;
pub mod window;

pub use channels::GivenNoise;
pub use channels::{Channel, Channels};
pub(crate) use channels::{cholesky_in_place, to_correlation};
pub use equation::{Equation, Row};
pub use sample::{BaseState, Sample, states_of_poses};
pub use settings::EquationSettings;
pub use stream::{EquationStream, PushOutcome};
