//! Distances between links, payload and keep-out boxes.

mod distance;
mod pairs;

pub(crate) use distance::Distances;
