//! What a shape says of the centre of mass and the inertia of a body.

use nalgebra::{Isometry3, Matrix4, Rotation3, SMatrix, SVector, Vector3};
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
    /// Mean centre of mass, m, and inertia about the origin of the tip's frame, in whose axes both
    /// are, divided by the mass, m²: xx, xy, xz, yy, yz, zz. It is that of the uniform solid, on
    /// average over the errors of its pose and its size.
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
        let pseudo_inertia = scaled * self.pseudo_inertia * scaled.transpose();
        let center: Vector3<f64> = pseudo_inertia.fixed_view::<3, 1>(0, 3).into();
        let placed = pose.to_homogeneous();
        let (mean, of_shape) = tolerated(&self.std_devs(tolerance), |errors| {
            let map = placed * misplaced(&center, errors);
            nine(&(map * pseudo_inertia * map.transpose()))
        });
        let turned = linear_map(&(placed * scaled));
        let of_density = turned * self.covariance * turned.transpose();
        ShapePrior {
            mean: mean.into(),
            covariance: (of_density * tolerance.ln_density.powi(2) + of_shape).into(),
        }
    }

    /// Returns the standard deviations of the errors that [`misplaced`] has.
    fn std_devs(&self, tolerance: &Tolerance) -> Errors {
        let size = self.coarseness.map(|cell| cell.hypot(tolerance.size));
        Errors::from_fn(|k, _| match k {
            0..3 => tolerance.position_m,
            3..6 => tolerance.rotation_rad,
            _ => size[k - 6],
        })
    }
}

/// Shifts, m, turns, rad, and relative changes of the size, each along three axes.
type Errors = SVector<f64, 9>;

/// Returns the map of a solid with this centre that has errors of its position, its orientation
/// about the centre and its sizes.
fn misplaced(center: &Vector3<f64>, errors: &Errors) -> Matrix4<f64> {
    let [shift, turn, size] = [0, 3, 6].map(|first| errors.fixed_rows::<3>(first).into_owned());
    Matrix4::new_translation(&(center + shift))
        * Rotation3::new(turn).to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&size.add_scalar(1.0))
        * Matrix4::new_translation(&-center)
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

/// Returns mean and covariance of the nine quantities for independent normal errors of the shape,
/// to second order: the small moment of a long tool about its axis grows with every turn, and hardly
/// to first order.
fn tolerated(std_devs: &Errors, of_errors: impl Fn(&Errors) -> Nine) -> (Nine, SMatrix<f64, 9, 9>) {
    let step = |axis: usize, sign: f64| Errors::ith(axis, sign * std_devs[axis]);
    let without = of_errors(&Errors::zeros());
    let (mut mean, mut covariance) = (without, SMatrix::zeros());
    for axis in 0..std_devs.len() {
        let [ahead, behind] = [1.0, -1.0].map(|sign| of_errors(&step(axis, sign)));
        let slope = 0.5 * (ahead - behind);
        let curvature = ahead + behind - 2.0 * without;
        mean += 0.5 * curvature;
        covariance += slope * slope.transpose() + 0.5 * curvature * curvature.transpose();
        for other in 0..axis {
            let at = |signs: [f64; 2]| of_errors(&(step(axis, signs[0]) + step(other, signs[1])));
            let equal = at([1.0, 1.0]) + at([-1.0, -1.0]);
            let opposite = at([1.0, -1.0]) + at([-1.0, 1.0]);
            let mixed = 0.25 * (equal - opposite);
            covariance += mixed * mixed.transpose();
        }
    }
    (mean, covariance)
}
