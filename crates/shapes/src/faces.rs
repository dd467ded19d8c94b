//! Moments of the uniform solid inside a closed surface.

use nalgebra::{Matrix3, Matrix4, Vector3};

/// Largest difference between surface integrals and those of a closed surface, a fraction of the
/// volume: those of assembled CAD parts with small gaps differ by less, and those of a box without
/// its lid by a half.
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
    /// Returns the moments inside triangles, about the origin, which should be near them. `sides` are
    /// those of the box around them.
    ///
    /// # Errors
    /// Returns the reason why the triangles enclose no solid.
    pub(crate) fn of(
        triangles: &[[Vector3<f64>; 3]],
        sides: &Vector3<f64>,
    ) -> Result<Self, String> {
        let (mut areas, mut flux) = (Vector3::zeros(), Matrix3::zeros());
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for [a, b, c] in triangles {
            let sum = a + b + c;
            let area = 0.5 * (b - a).cross(&(c - a));
            areas += area;
            flux += sum / 3.0 * area.transpose();
            // The tetrahedron from the origin to the triangle.
            let signed = a.dot(&b.cross(c)) / 6.0;
            volume += signed;
            first += sum * (signed / 4.0);
            let squares = [a, b, c, &sum].map(|corner| corner * corner.transpose());
            second += squares.iter().sum::<Matrix3<f64>>() * (signed / 20.0);
        }
        if volume.abs() <= SMALLEST_VOLUME * sides.product() {
            return Err("its faces enclose no volume".to_owned());
        }
        // Over a closed surface, the normals sum to zero, and those times a coordinate to the volume
        // along its own axis and to zero along the others; in units of the sides, for thin plates.
        let of_normals = areas.component_mul(sides).amax();
        let in_sides = Matrix3::from_fn(|i, k| flux[(i, k)] * sides[k] / sides[i]);
        let missing = (in_sides - Matrix3::from_diagonal_element(volume)).amax();
        if of_normals.max(missing) > LARGEST_GAP * volume.abs().max(in_sides.amax()) {
            return Err(
                "its surface is open, or its faces are oriented differently: close it, and let the corners of each face \
                 be counterclockwise as seen from outside"
                    .to_owned(),
            );
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
