//! Moments of the uniform solid inside a closed surface.

use nalgebra::{Matrix3, Matrix4, Vector3};

/// Largest disagreement of the volumes by the three coordinates, a fraction: those of assembled CAD
/// parts with small gaps disagree by less, and a box without its lid by a half.
const LARGEST_GAP: f64 = 0.02;

/// Smallest volume relative to that of the box around the solid; below, it is rounding.
const SMALLEST_VOLUME: f64 = 1e-7;

/// Moments of a uniform solid of unit mass: by the divergence theorem, exact for every surface that
/// is closed, of one body or of several.
pub(crate) struct Moments {
    /// Volume; negative where the triangles are clockwise as seen from outside.
    pub(crate) volume: f64,
    /// Second moments, first moments and one: `∫ (x, 1) (x, 1)ᵀ dm`.
    pub(crate) pseudo_inertia: Matrix4<f64>,
}

impl Moments {
    /// Returns the moments inside triangles, about the origin, which should be near them.
    ///
    /// # Errors
    /// Returns the reason why the triangles enclose no solid.
    pub(crate) fn of(triangles: &[[Vector3<f64>; 3]], box_volume: f64) -> Result<Self, String> {
        let mut volumes = Vector3::zeros();
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for [a, b, c] in triangles {
            let sum = a + b + c;
            let area = 0.5 * (b - a).cross(&(c - a));
            volumes += area.component_mul(&(sum / 3.0));
            // The tetrahedron from the origin to the triangle.
            let signed = a.dot(&b.cross(c)) / 6.0;
            volume += signed;
            first += sum * (signed / 4.0);
            let squares = [a, b, c, &sum].map(|corner| corner * corner.transpose());
            second += squares.iter().sum::<Matrix3<f64>>() * (signed / 20.0);
        }
        if (volumes - Vector3::repeat(volume)).amax() > LARGEST_GAP * volumes.amax() {
            return Err(
                "its surface is open, or its faces are oriented differently: close it, and let the corners of each face \
                 be counterclockwise as seen from outside"
                    .to_owned(),
            );
        }
        if volume.abs() <= SMALLEST_VOLUME * box_volume {
            return Err("its faces enclose no volume".to_owned());
        }
        let mut pseudo_inertia = Matrix4::identity();
        let first: Vector3<f64> = first / volume;
        pseudo_inertia
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(second / volume));
        pseudo_inertia
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&first);
        pseudo_inertia
            .fixed_view_mut::<1, 3>(3, 0)
            .copy_from(&first.transpose());
        Ok(Self {
            volume,
            pseudo_inertia,
        })
    }
}
