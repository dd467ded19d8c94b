//! Collision shapes of a robot's links.

mod convert;
mod mesh;
mod model;
mod placed;

pub(crate) use convert::glam_pose;
pub use model::{CollisionFinding, CollisionModel, MeshReader, NotTested};
pub(crate) use placed::{Part, PartPlace, Placed, Solid};
