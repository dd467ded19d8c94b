//! Meshes and point clouds: their files, the solids in them, and what a solid says of the inertial
//! parameters of a body with this shape.
//!
//! [`Mesh::read`] reads STL, OBJ and PLY files. A [`Solid`] has the exact moments of the uniform
//! solid inside a mesh, by the divergence theorem, and the covariance of these moments for a random
//! density inside it. Its [`ShapePrior`] is what the shape says of the centre of mass and the
//! inertia of a body at a pose. It says nothing of the mass.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod blocks;
mod cloud;
mod faces;
mod grid;
mod mesh;
mod obj;
mod ply;
mod prior;
mod read;
mod solid;
mod stl;

pub use mesh::Mesh;
pub use prior::{ShapePrior, Tolerance};
pub use read::FORMATS;
pub use solid::Solid;

#[cfg(test)]
mod tests;
