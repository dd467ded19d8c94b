//! Dynamics of a robot that holds an unknown body, and the linear equations for that body's
//! inertial parameters.
//!
//! ```
//! use nalgebra::{Matrix3, Vector3};
//! use tactid_dynamics::{InertialParameters, MassProperties, ToolMotion, wrench_regressor};
//!
//! let payload = InertialParameters::from(MassProperties {
//!     mass_kg: 2.0,
//!     center_of_mass: Vector3::new(0.0, 0.0, 0.1),
//!     inertia: Matrix3::identity() * 0.02,
//! });
//! // The payload is held still on the ground with y up: p̈ = 0, so p̈ - g points up.
//! let motion = ToolMotion {
//!     acceleration: Vector3::new(0.0, 9.81, 0.0),
//!     angular_velocity: Vector3::zeros(),
//!     angular_acceleration: Vector3::zeros(),
//! };
//! let wrench = wrench_regressor(&motion) * payload.as_vector();
//! assert!((wrench[1] - 2.0 * 9.81).abs() < 1e-12); // the hand pushes up with the weight
//! assert!((wrench[3] + 0.1 * 2.0 * 9.81).abs() < 1e-12); // z × y = -x
//! ```
//!
//! The crate computes equations (1)-(48), sections 1 and 2, of Hou et al. 2016 (doi
//! 10.3873/j.issn.1000-1328.2016.10.009). Where a printed equation needs a correction, a comment at
//! the code states it.
//!
//! [`Manipulator`] is an immutable model, built from a [`Urdf`] or a Denavit-Hartenberg table
//! ([`DhRobot`]). Links without `<inertial>` are massless; [`Manipulator::findings`] names bodies
//! of unknown mass, which matter for forces only, and what else is wrong in a description.
//! [`Workspace`] is the state of one manipulator, allocated once: [`motion()`] computes the motion
//! of every body and [`forces()`] the forces between them; [`inverse_dynamics`] computes both in
//! less time. [`BatchDynamics`] computes many states at once. [`tactile_mass_rows`],
//! [`inertia_rows`] and [`wrench_regressor`] form equations that are linear in the payload's ten
//! [`InertialParameters`].
//!
//! # Conventions
//!
//! - Units are SI.
//! - `world` is the inertial frame, `tool` the end-effector frame `Σ_U`. A transform `a_from_b`
//!   maps coordinates in frame `b` to coordinates in frame `a`.
//! - The unknown parameters are constant only in `Σ_U`, so every vector in an equation for them is
//!   expressed there.
//! - Accelerations of points are classical: the derivative of the point's inertial velocity.
//! - Gravity is an acceleration that points down, and zero in orbit. It enters as `p̈ - g`.
//! - Products of inertia are matrix entries without a sign flip.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod derived;
mod dh;
mod error;
mod finding;
mod forces;
mod frames;
mod inertia;
mod lanes;
mod manipulator;
mod masses;
mod momentum;
mod names;
mod notice;
mod placement;
mod real;
mod recursion;
mod regressors;
mod rows;
mod series;
mod spatial;
mod structure;
mod text_file;
mod urdf;
mod vector;
mod virtual_work;
pub mod words;
mod workspace;

pub use dh::{DhLink, DhRobot};
pub use error::{ModelError, StateError};
pub use finding::{IgnoredPart, MimicFault, ModelFinding};
pub use forces::wrench_on_end_effector;
pub use inertia::{
    InertialParameters, MassProperties, PARAMETER_NAMES, symmetric_entries, symmetric_matrix,
};
pub use manipulator::{BaseKind, FrameId, JointKind, Manipulator};
pub use momentum::{
    BaseAcceleration, FreeRobot, Momentum, base_acceleration, free_base_motion, momentum,
};
pub use names::{list_similar, shortened};
pub use notice::{Notice, Reader, Severity, Subject};
pub use rows::{
    Rows, inertia_regressor, inertia_rows, mass_rows, mean_wrench_regressor, omega_matrix,
    tactile_mass_rows, wrench_regressor,
};
pub use series::{BatchDynamics, StateSeries, VectorUnit};
pub use spatial::{FrameMotion, ToolMotion, Wrench, cross, inertia_product};
pub use structure::{BodyView, JointView, LinkView};
pub use text_file::{read_text, read_text_within};
pub use urdf::{CollisionShape, Urdf};
pub use urdf_rs;
pub use workspace::{
    JointMotion, Workspace, forces, inverse_dynamics, motion, motion_under_gravity,
};
