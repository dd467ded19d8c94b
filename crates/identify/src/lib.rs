//! Identifies the mass, centre of mass and inertia of a payload that a robot holds.
//!
//! # In a controller
//!
//! `tactid-identify` is the only dependency: the crate re-exports [`nalgebra`], whose types its
//! signatures have, and [`dynamics`], the model of the robot. The steps are:
//!
//! 1. [`Manipulator::from_urdf`] reads the robot, on a base that is [`Fixed`](BaseKind::Fixed) to
//!    the ground or [`Floating`](BaseKind::Floating).
//! 2. [`Identifier::new`] gets the end-effector frame, the links of the wrench sensors and the
//!    [`EquationSettings`].
//! 3. [`Identifier::push`] gets a [`Sample`] in each cycle. It allocates nothing.
//! 4. [`Identifier::estimate`] returns the [`PayloadEstimate`] with standard deviations.
//!
//! ```
//! use tactid_identify::nalgebra::Vector3;
//! use tactid_identify::{
//!     BaseKind, BaseState, EquationSettings, Identifier, Manipulator, Sample, Wrench,
//! };
//!
//! // Wrenches need no masses of the arm, so that a URDF without <inertial> is enough.
//! let urdf = r#"<robot name="arm"><link name="base"/><link name="tool0"/>
//!   <joint name="wrist" type="continuous">
//!     <parent link="base"/><child link="tool0"/><origin rpy="0.6435 0 0"/><axis xyz="0 1 0"/></joint></robot>"#;
//! let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed)?;
//! let mut identifier = Identifier::new(&robot, "tool0", &["tool0"], &EquationSettings::default())?;
//!
//! // In the control loop:
//! for k in 0..1000 {
//!     let time_s = 2e-3 * f64::from(k);
//!     let (sin, cos) = (3.0 * time_s).sin_cos();
//!     let (position, velocity, acceleration) = (0.8 * sin, 2.4 * cos, -7.2 * sin); // of the joint
//!     // Stands for the sensor: it holds 2 kg at `arm`, and its axis is tilted against gravity.
//!     let (arm, spin) = (Vector3::new(0.05, 0.0, 0.1), velocity * Vector3::y());
//!     let moved = acceleration * Vector3::y().cross(&arm) + spin.cross(&spin.cross(&arm));
//!     let up = Vector3::new(-0.8 * position.sin(), 0.6, 0.8 * position.cos());
//!     let force = 2.0 * (9.81 * up + moved);
//!     let moment = arm.cross(&force);
//!     identifier.push(&Sample {
//!         time_s,
//!         base: BaseState::fixed(),
//!         joint_position: &[position],            // rad
//!         joint_velocity: &[velocity],               // rad/s, or empty where it is not measured
//!         joint_effort: &[],                    // only the effort and combined methods use it
//!         wrenches: &[Wrench { force, moment }], // on the payload, in the sensor's frame, N and N m
//!     })?;
//! }
//! let estimate = identifier.estimate();
//! assert!((estimate.body.mass_kg - 2.0).abs() < 1e-3);
//! assert!((estimate.body.center_of_mass.z - 0.1).abs() < 1e-3);
//! # Ok::<(), tactid_identify::IdentifyError>(())
//! ```
//!
//! A free-floating base is a [`BaseState`] with its measured pose and twist in each sample.
//! [`Identifier`] documents when an estimate includes a window, and what its cycles cost.
//!
//! # How the crate works
//!
//! A [`Sample`] (joints, base, wrenches) enters an [`EquationStream`], which computes the motion of
//! the end-effector by (1)-(20) of Hou et al. 2016 and row equations from motion and wrench by
//! (29)-(48). [`Identifier`] solves them by least squares in the control loop, with uncertainty and
//! detection of payload changes.
//!
//! The crates above use [`equations`] and [`solve`], too: `tactid-batch` solves all equations of a
//! recording together and finds wrong assumptions, those of an online identifier included;
//! `tactid-calibrate` models the efforts of an arm's joints; `tactid-recordings` reads recordings,
//! combines several, and has the paper's filter.
//!
//! All of them return a [`PayloadEstimate`]. The [`Method`] in the settings chooses the
//! measurements: wrenches, joint efforts, the momentum of a floating base, or all of them. Nothing
//! in this crate reads or writes files but [`Manipulator::from_urdf_file`].

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod checks;
pub mod contact;
pub mod equations;
mod error;
mod fingerprint;
mod known_bodies;
mod method;
mod online;
mod prior;
mod range;
mod result;
mod sampling;
pub mod serial;
pub mod solve;

pub use nalgebra;
pub use tactid_dynamics as dynamics;
pub use tactid_dynamics::{BaseKind, Manipulator, ModelError, Wrench};

pub use contact::{ContactState, LoadAndContact, WrenchEstimate, WrenchFrame};
pub use equations::{
    ActsOn, BaseState, Channel, Channels, EffortContent, EquationSettings, EquationStream,
    MotionRows, PushOutcome, Sample, SubtractedLoad, Unknowns, WORLD, states_of_poses,
};
pub use error::IdentifyError;
pub use fingerprint::fingerprint;
pub use known_bodies::{KnownBodies, KnownTool};
pub use method::Method;
pub use online::{Identifier, OnlineSettings, RecentEquations, Snapshot};
pub use prior::{BoundingBox, KnownMass};
pub use range::Range;
pub use result::{
    KINDS, Observability, PayloadEstimate, VALUE_NAMES, WrenchOffset, body_of_values, is_physical,
    serialize_body, serialize_composite, values_of_body,
};
pub use sampling::Sampling;
pub use solve::{HALF_WIDTH_95, largest_of_kind, value_jacobian};
