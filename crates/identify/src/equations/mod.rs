//! The equation stream: samples in, averaged equations of motion out.
//!
//! A polynomial fit differentiates and smooths each [`Sample`] with its neighbours
//! (`differentiation`, `instant`). A kinematic model computes the motion of the robot once per
//! instant (`model`), and each measurement source fills its rows from it (`sources`, one file a
//! source). Averaging windows turn the rows into equations ([`window`]). What leaves this module is
//! a linear regression that knows no robot: [`Equation`]s, and the [`Channels`] that say what each
//! of their rows measures.

mod channels;
pub mod clock_watch;
mod continuation;
mod differentiation;
mod equation;
mod geometry;
mod instant;
mod interpolation;
mod model;
mod motion_rows;
mod motion_stream;
mod multi_cutoff;
mod offset_frame;
mod sample;
mod sample_ring;
mod settings;
mod sources;
mod stream;
pub mod window;

pub use channels::{Channel, Channels, KnownNoise, WRENCH};
pub use continuation::Continuation;
pub(crate) use continuation::{SMALL_STEP, Step, are_angles, largest_step};
pub use equation::{Equation, Row};
pub use geometry::Geometry;
pub use instant::Instant;
pub(crate) use instant::LANES;
pub use interpolation::{InterpolationAt, interpolation};
pub use model::Model;
pub use motion_rows::MotionRows;
pub use motion_stream::{MotionStep, MotionStream};
pub use multi_cutoff::MultiCutoffStream;
pub use offset_frame::OffsetFrame;
pub use sample::{ActsOn, BaseState, Sample, states_of_poses};
pub use settings::{EffortContent, EquationSettings, SubtractedLoad, Unknowns, WORLD};
pub use sources::acceleration_columns;
pub(crate) use sources::{MOTION_TERMS, WrenchRegressor, columns_expressed_in};
pub use stream::{EquationStream, PushOutcome};
