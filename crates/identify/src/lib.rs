//! Identifies the mass, centre of mass and inertia of a payload that a robot holds.
//!
//! A [`Sample`] (joints, base, wrenches) enters an [`EquationStream`], which computes the motion of the
//! end-effector by (1)-(20) of Hou et al. 2016 and row equations from motion and wrench by (29)-(48). Three
//! solvers use these equations:
//!
//! - [`Identifier`]: least squares in the control loop, with uncertainty and detection of payload changes;
//! - [`BatchIdentifier`]: robust least squares over a whole recording;
//! - [`PaperFilter`]: the paper's two-stage filter (49)-(54), for comparison with the paper.
//!
//! All of them return a [`PayloadEstimate`]. Nothing in this crate reads or writes files.
//!
//! ```
//! use tactid_dynamics::{BaseKind, Manipulator};
//! use tactid_identify::{EquationSettings, Identifier};
//!
//! # let urdf = r#"<robot name="arm"><link name="base"><inertial><mass value="9"/>
//! #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
//! #   <link name="tool0"><inertial><mass value="1"/>
//! #   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
//! #   <joint name="hinge" type="continuous"><parent link="base"/><child link="tool0"/></joint></robot>"#;
//! let robot = Manipulator::from_urdf(urdf, BaseKind::Floating)?;
//! let mut identifier = Identifier::new(&robot, "tool0", &["tool0"], &EquationSettings::default())?;
//! // For each sample: identifier.push(&sample)?;
//! let estimate = identifier.estimate();
//! assert_eq!(estimate.not_identifiable().count(), 10); // there are no samples yet
//! # Ok::<(), tactid_identify::IdentifyError>(())
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod batch;
pub mod equations;
mod error;
mod finding;
mod method;
mod online;
mod paper;
mod result;
mod solve;

pub use batch::{BatchIdentifier, BatchResult, BatchSettings, Delay, FitReport, Forecast};
pub use equations::{
    BaseState, Channel, Channels, EquationSettings, EquationStream, GRAVITY, PushOutcome, Sample,
    states_of_poses,
};
pub use error::{IdentifyError, three_digits};
pub use finding::Finding;
pub use method::Method;
pub use online::Identifier;
pub use paper::{PaperFilter, PaperSettings, SingularValues};
pub use result::{HistoryPoint, PayloadEstimate, VALUE_NAMES, WrenchOffset};
pub use solve::{BoundingBox, HALF_WIDTH_95, KnownMass, PrincipalMoments};
