//! Distances between links, payload and keep-out boxes.

mod convert;
mod distance;
mod mesh;
mod mesh_file;
mod model;
mod pairs;
mod placed;
mod untested;

pub(crate) use distance::Distances;
pub use model::{CollisionFinding, CollisionModel, MeshReader, NotTested};
pub use untested::{UntestedLink, UntestedLinks};
