//! Dynamics of a robot that holds an unknown body: sections 1 and 2 of Hou et al. 2016
//! (doi 10.3873/j.issn.1000-1328.2016.10.009), equations (1)-(48), with the corrections that the
//! printed equations need said where they are computed.
//!
//! A [`Manipulator`] is read from a URDF or a Denavit-Hartenberg table and does not change; a
//! [`Workspace`] is allocated once. [`motion()`] moves every body, [`forces()`] loads it, and the
//! functions [`tactile_mass_rows`], [`inertia_rows`] and [`wrench_regressor`] turn what a robot
//! measures into equations that are linear in the payload's ten [`InertialParameters`].
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
//! // Held still on the ground: p̈ = 0, so p̈ - g points up.
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
//! # Conventions
//!
//! SI units. Bodies move in an inertial frame (`world`); the unknowns are constant only in the
//! end-effector frame `Σ_U` (`tool`), so every vector that enters a row is expressed there.
//! Accelerations of points are classical: the derivative of the point's inertial velocity.
//! Gravity is an acceleration pointing down, zero by default in orbit; it enters as `p̈ - g`.
//! Products of inertia are matrix entries, without a sign flip.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod dh;
mod error;
mod forces;
mod inertia;
mod manipulator;
mod momentum;
mod motion;
mod rows;
mod spatial;
mod urdf;

pub use dh::{DhLink, DhRobot};
pub use error::{ModelError, StateError};
pub use forces::{forces, wrench_on_end_effector};
pub use inertia::{
    InertialParameters, MassProperties, PARAMETER_NAMES, symmetric_entries, symmetric_matrix,
};
pub use manipulator::{BaseKind, FrameId, JointKind, Manipulator};
pub use momentum::{BaseAcceleration, Momentum, base_acceleration, momentum};
pub use motion::{JointMotion, Workspace, motion};
pub use rows::{
    Rows, inertia_regressor, inertia_rows, mass_rows, omega_matrix, tactile_mass_rows,
    wrench_regressor,
};
pub use spatial::{FrameMotion, ToolMotion, Wrench, cross, inertia_product};
