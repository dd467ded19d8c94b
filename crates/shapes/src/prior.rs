//! What a shape says of the centre of mass and the inertia of a body.

use nalgebra::{Isometry3, Matrix3, Matrix4, SMatrix, SVector, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::InertialParameters;

use crate::Solid;
use crate::blocks::Nine;

/// How well a shape is known: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Standard deviation of the position along each axis, m.
    pub position_m: f64,
    /// Standard deviation of the orientation about each axis, rad.
    pub rotation_rad: f64,
    /// Standard deviation of the size along each axis of the file, a fraction.
    pub size: f64,
    /// Standard deviation of the natural logarithm of the density.
    pub ln_density: f64,
}

/// The tolerances are 3 mm, 3 degrees and 3 %, which cost little where the shape is exact. The
/// standard deviation of the logarithm of the density is 1.4: with it, one of 20 workshop tools of
/// wood, steel and plastic has a value outside its interval in every recording.
impl Default for Tolerance {
    fn default() -> Self {
        Self {
            position_m: 3e-3,
            rotation_rad: 3.0_f64.to_radians(),
            size: 0.03,
            ln_density: 1.4,
        }
    }
}

/// What a shape says of the centre of mass and the inertia of a body: a normal distribution of nine
/// quantities of the body divided by its mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShapePrior {
    /// Mean centre of mass of the uniform solid, m, and its inertia about the origin of the tip's
    /// frame, in whose axes both are, divided by the mass, m²: xx, xy, xz, yy, yz, zz.
    pub mean: [f64; 9],
    /// Covariance of the nine quantities, in the products of their units, (9, 9).
    pub covariance: [[f64; 9]; 9],
}

impl Solid {
    /// Returns what the solid says of a body at a pose, where the unit of its file has a length of
    /// `unit_m`.
    ///
    /// The covariance is that of a random density inside the solid, and of errors of its position,
    /// of its orientation about its centre, and of its sizes along the axes of its file.
    #[must_use]
    pub fn prior(&self, pose: &Isometry3<f64>, unit_m: f64, tolerance: &Tolerance) -> ShapePrior {
        let scaled = Matrix4::new_scaling(unit_m) * Matrix4::new_translation(&self.middle);
        let placed = pose.to_homogeneous() * scaled;
        let pseudo_inertia = placed * self.pseudo_inertia * placed.transpose();
        let turned = linear_map(&placed);
        let of_density = turned * self.covariance * turned.transpose();
        let of_shape: SMatrix<f64, 9, 9> = tolerated(&pseudo_inertia, pose, tolerance)
            .map(|change| change * change.transpose())
            .sum();
        ShapePrior {
            mean: nine(&pseudo_inertia).into(),
            covariance: (of_density * tolerance.ln_density.powi(2) + of_shape).into(),
        }
    }
}

/// Returns the nine quantities of a pseudo-inertia.
fn nine(pseudo_inertia: &Matrix4<f64>) -> Nine {
    let parameters = InertialParameters::from_pseudo_inertia(pseudo_inertia);
    parameters.as_vector().fixed_rows::<9>(1).into()
}

/// Returns the matrix by which an affine map changes differences of the nine quantities.
fn linear_map(map: &Matrix4<f64>) -> SMatrix<f64, 9, 9> {
    let column = |k: usize| {
        let unit = InertialParameters::from_vector(SVector::ith(k + 1, 1.0));
        nine(&(map * unit.pseudo_inertia() * map.transpose()))
    };
    SMatrix::from_columns(&[0, 1, 2, 3, 4, 5, 6, 7, 8].map(column))
}

/// Returns the changes of the nine quantities by independent errors of the shape of one standard
/// deviation, along the axes of a pose: three shifts, and three turns and three scales about the
/// centre.
fn tolerated(
    pseudo_inertia: &Matrix4<f64>,
    pose: &Isometry3<f64>,
    tolerance: &Tolerance,
) -> impl Iterator<Item = Nine> {
    let center: Vector3<f64> = pseudo_inertia.fixed_view::<3, 1>(0, 3).into();
    let errors = (0..3).flat_map(move |axis| {
        let unit = pose.rotation * Vector3::ith(axis, 1.0);
        let of_center =
            |matrix: Matrix3<f64>, size: f64| (matrix * size, -(matrix * center) * size);
        [
            (Matrix3::zeros(), unit * tolerance.position_m),
            of_center(unit.cross_matrix(), tolerance.rotation_rad),
            of_center(unit * unit.transpose(), tolerance.size),
        ]
    });
    let pseudo_inertia = *pseudo_inertia;
    errors.map(move |(matrix, shift)| {
        let mut change = Matrix4::zeros();
        change.fixed_view_mut::<3, 3>(0, 0).copy_from(&matrix);
        change.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
        let of_left = change * pseudo_inertia;
        nine(&(of_left + of_left.transpose()))
    })
}
