//! Solids in meshes and point clouds.

use nalgebra::{Matrix4, SMatrix, Vector3};
use tactid_dynamics::InertialParameters;

use crate::blocks;
use crate::faces::Moments;
use crate::grid;
use crate::{Mesh, cloud};

/// Most triangles or points: a scan has some million.
const MOST: usize = 4_000_000;

/// A solid of unit mass, in the unit and in the frame of its file.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Middle of the box around the solid.
    pub(crate) middle: Vector3<f64>,
    /// Diagonal of the box.
    pub(crate) diagonal: f64,
    /// Standard deviation of the size along each axis, a fraction, because its file is coarse: a cell
    /// of a point cloud, and none of a mesh, whose faces are exact.
    pub(crate) coarseness: Vector3<f64>,
    /// Pseudo-inertia of the uniform solid about `middle`.
    pub(crate) pseudo_inertia: Matrix4<f64>,
    /// Covariance of the centre of mass and the inertia about `middle` for a random density, whose
    /// logarithm has a standard deviation of one.
    pub(crate) covariance: SMatrix<f64, 9, 9>,
}

impl Solid {
    /// Returns the solid inside the faces of a mesh, or inside a point cloud.
    ///
    /// # Errors
    /// Returns the reason why there is none: a coordinate that is not finite, a surface that is
    /// open, or no volume.
    pub fn new(mesh: &Mesh) -> Result<Self, String> {
        let triangles = mesh.triangles.as_ref().map_err(Clone::clone)?;
        if mesh.vertices.len().max(triangles.len()) > MOST {
            return Err(format!(
                "it has more than {} million vertices or triangles: reduce it",
                MOST / 1_000_000
            ));
        }
        if !mesh
            .vertices
            .iter()
            .flatten()
            .all(|entry| entry.is_finite())
        {
            return Err("a coordinate is not finite".to_owned());
        }
        let point = |vertex: &[f32; 3]| Vector3::from(vertex.map(f64::from));
        let vertices: Vec<_> = mesh.vertices.iter().map(point).collect();
        let used = || triangles.iter().flatten().map(|k| vertices[*k as usize]);
        // A mesh may have vertices that belong to no face.
        let [low, high] = if mesh.is_cloud() {
            bounds(vertices.iter().copied())
        } else {
            bounds(used())
        };
        let middle = 0.5 * (low + high);
        let corners = [low - middle, high - middle];
        let sides = high - low;
        let (pseudo_inertia, voxels, coarseness) = if mesh.is_cloud() {
            let points: Vec<_> = vertices.iter().map(|vertex| vertex - middle).collect();
            let voxels = cloud::voxels(&points, corners)?;
            let coarseness = sides.map(|side| voxels.pitch / side);
            (pseudo_inertia(&blocks::mean(&voxels)), voxels, coarseness)
        } else {
            let placed = |triangle: &[u32; 3]| triangle.map(|k| vertices[k as usize] - middle);
            let triangles: Vec<_> = triangles.iter().map(placed).collect();
            let moments = Moments::of(&triangles, &sides)?;
            let voxels = grid::voxels(&triangles, corners, moments.volume);
            (moments.pseudo_inertia, voxels, Vector3::zeros())
        };
        if voxels.centers.is_empty() {
            return Err("its solid is too thin to be divided into cells".to_owned());
        }
        let diagonal = sides.norm();
        Ok(Self {
            middle,
            diagonal,
            coarseness,
            pseudo_inertia,
            covariance: blocks::covariance(&voxels, diagonal),
        })
    }

    /// Returns the diagonal of the box around the solid, in the unit of the file.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }
}

/// Returns the least and the largest coordinates of points.
fn bounds(points: impl Iterator<Item = Vector3<f64>>) -> [Vector3<f64>; 2] {
    let start = [f64::INFINITY, f64::NEG_INFINITY].map(Vector3::repeat);
    points.fold(start, |[low, high], at| [low.inf(&at), high.sup(&at)])
}

/// Returns the pseudo-inertia of a body of unit mass.
pub(crate) fn pseudo_inertia(nine: &blocks::Nine) -> Matrix4<f64> {
    InertialParameters::from_vector(nine.insert_row(0, 1.0)).pseudo_inertia()
}
