//! Inertial parameters of a rigid body, in linear form and as mass properties.

use std::ops::{Add, Neg, Sub};

use nalgebra::{Isometry3, Matrix3, Matrix4, SVector, SymmetricEigen, Vector3};

use crate::cross;

/// Names of the ten entries of [`InertialParameters`], in their order, for labels of regressor
/// columns and covariances: mass, first moments, and inertia about the frame's origin.
pub const PARAMETER_NAMES: [&str; 10] = [
    "mass",
    "mass*com x",
    "mass*com y",
    "mass*com z",
    "Ixx",
    "Ixy",
    "Ixz",
    "Iyy",
    "Iyz",
    "Izz",
];

/// Returns the entries `[Ixx, Ixy, Ixz, Iyy, Iyz, Izz]` of a symmetric 3x3 matrix, row by row.
///
/// Products of inertia are the off-diagonal matrix entries (no sign flip), as in URDF and in
/// `geometry_msgs/Inertia`.
#[must_use]
#[inline]
pub fn symmetric_entries(matrix: &Matrix3<f64>) -> [f64; 6] {
    [
        matrix[(0, 0)],
        matrix[(0, 1)],
        matrix[(0, 2)],
        matrix[(1, 1)],
        matrix[(1, 2)],
        matrix[(2, 2)],
    ]
}

/// Returns the symmetric 3x3 matrix with the entries `[xx, xy, xz, yy, yz, zz]`.
#[must_use]
pub fn symmetric_matrix([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Mass, centre of mass and inertia about the centre of mass of a rigid body, expressed in one
/// frame. The context names the frame: the value does not carry it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Vector from the frame's origin to the centre of mass, m (`a` in the paper).
    pub center_of_mass: Vector3<f64>,
    /// Inertia about the centre of mass, along the frame's axes, kg m² (`I` in the paper).
    pub inertia: Matrix3<f64>,
}

/// The ten inertial parameters of a rigid body, in which its equations of motion are linear.
///
/// Order: `[m, m·ax, m·ay, m·az, Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`, with the inertia about the
/// **frame's origin** (not about the centre of mass) and products of inertia without a sign flip.
/// Units: kg, kg m, kg m². Bodies that share a frame add and subtract entry by entry.
///
/// ```
/// use nalgebra::{Matrix3, Vector3};
/// use tactid_dynamics::{InertialParameters, MassProperties};
///
/// let payload = MassProperties {
///     mass_kg: 100.0,
///     center_of_mass: Vector3::new(0.5, 0.0, 0.0),
///     inertia: Matrix3::from_diagonal(&Vector3::new(10.0, 20.0, 10.0)),
/// };
/// let parameters = InertialParameters::from(payload);
/// assert_eq!(parameters.as_vector()[1], 50.0); // kg m
/// assert_eq!(parameters.as_vector()[7], 45.0); // 20 + 100 · 0.5²
/// assert!(parameters.is_physical());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialParameters(SVector<f64, 10>);

impl InertialParameters {
    /// Returns the parameters of a body without mass: the neutral element of addition.
    #[must_use]
    pub fn zero() -> Self {
        Self(SVector::zeros())
    }

    /// Wraps ten numbers in the order of the type. They are not checked.
    #[must_use]
    pub fn from_vector(parameters: SVector<f64, 10>) -> Self {
        Self(parameters)
    }

    /// Returns the ten numbers in the order of the type.
    #[must_use]
    pub fn as_vector(&self) -> &SVector<f64, 10> {
        &self.0
    }

    /// Builds the parameters from a mass (kg), the first moment `m·a` (kg m) and the inertia about
    /// the frame's origin (kg m²), of which the upper triangle is read.
    #[must_use]
    pub fn from_moments(
        mass_kg: f64,
        first_moment: &Vector3<f64>,
        inertia_about_origin: &Matrix3<f64>,
    ) -> Self {
        let [xx, xy, xz, yy, yz, zz] = symmetric_entries(inertia_about_origin);
        let h = first_moment;
        Self(SVector::from([
            mass_kg, h.x, h.y, h.z, xx, xy, xz, yy, yz, zz,
        ]))
    }

    /// Returns the mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.0[0]
    }

    /// Returns the first moment of mass `m·a` about the frame's origin, kg m.
    #[must_use]
    pub fn first_moment(&self) -> Vector3<f64> {
        Vector3::new(self.0[1], self.0[2], self.0[3])
    }

    /// Returns the inertia about the frame's origin, kg m².
    #[must_use]
    pub fn inertia_about_origin(&self) -> Matrix3<f64> {
        symmetric_matrix([
            self.0[4], self.0[5], self.0[6], self.0[7], self.0[8], self.0[9],
        ])
    }

    /// Returns mass, centre of mass and inertia about it, or `None` if the mass is zero.
    #[must_use]
    pub fn mass_properties(&self) -> Option<MassProperties> {
        let mass_kg = self.mass();
        if mass_kg == 0.0 {
            return None;
        }
        let center_of_mass = self.first_moment() / mass_kg;
        Some(MassProperties {
            mass_kg,
            center_of_mass,
            inertia: self.inertia_about_origin() - parallel_axis(mass_kg, &center_of_mass),
        })
    }

    /// Returns the parameters of the same body expressed in frame `a` and about its origin, where
    /// `self` is in frame `b`.
    #[must_use]
    pub fn expressed_in(&self, a_from_b: &Isometry3<f64>) -> Self {
        let t = a_from_b.to_homogeneous();
        Self::from_pseudo_inertia(&(t * self.pseudo_inertia() * t.transpose()))
    }

    /// Returns the 4x4 pseudo-inertia `[[Σ, h], [hᵀ, m]]` with the second moments
    /// `Σ = ½ tr(I) 1 - I`: the integral of `[x; 1][x; 1]ᵀ` over the mass, kg m², kg m, kg.
    #[must_use]
    pub fn pseudo_inertia(&self) -> Matrix4<f64> {
        let inertia = self.inertia_about_origin();
        let second_moments = Matrix3::identity() * (0.5 * inertia.trace()) - inertia;
        let h = self.first_moment();
        let mut pseudo = Matrix4::zeros();
        pseudo
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&second_moments);
        pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&h);
        pseudo
            .fixed_view_mut::<1, 3>(3, 0)
            .copy_from(&h.transpose());
        pseudo[(3, 3)] = self.mass();
        pseudo
    }

    /// Returns the parameters with a given pseudo-inertia, the inverse of [`Self::pseudo_inertia`].
    /// Only the symmetric part is read.
    #[must_use]
    pub fn from_pseudo_inertia(pseudo: &Matrix4<f64>) -> Self {
        let symmetric = (pseudo + pseudo.transpose()) * 0.5;
        let second_moments: Matrix3<f64> = symmetric.fixed_view::<3, 3>(0, 0).into();
        let inertia = Matrix3::identity() * second_moments.trace() - second_moments;
        let h: Vector3<f64> = symmetric.fixed_view::<3, 1>(0, 3).into();
        Self::from_moments(symmetric[(3, 3)], &h, &inertia)
    }

    /// Returns whether some distribution of positive mass has these parameters: the mass is
    /// positive and the pseudo-inertia has no negative eigenvalue, up to rounding.
    ///
    /// Point masses, rods and plates without thickness lie on the boundary and count as physical.
    /// The paper's payload, diag(10, 20, 10) kg m², is such a plate: half of all unbiased estimates
    /// of it lie outside. Use [`Self::is_physical_within`] for estimates.
    #[must_use]
    pub fn is_physical(&self) -> bool {
        self.is_physical_within(1e-9)
    }

    /// Returns whether the mass is positive and the largest principal moment about the centre of
    /// mass exceeds the sum of the two others by at most `tolerance` times itself.
    ///
    /// For a positive mass this triangle inequality is equivalent to a pseudo-inertia without
    /// negative eigenvalues, by the Schur complement about the centre of mass.
    #[must_use]
    pub fn is_physical_within(&self, tolerance: f64) -> bool {
        // The inertia about the centre of mass has the rounding error of the parallel-axis term.
        let rounding = 1e-14 * self.inertia_about_origin().trace();
        self.mass() > 0.0
            && self.principal_moments().is_some_and(|moments| {
                let [least, middle, largest] = moments.into();
                largest <= least + middle + tolerance * largest + rounding
            })
    }

    /// Returns the principal moments of inertia about the centre of mass in ascending order, kg m²,
    /// or `None` if the mass is zero or a parameter is not finite.
    #[must_use]
    pub fn principal_moments(&self) -> Option<Vector3<f64>> {
        let finite = self.0.iter().all(|entry| entry.is_finite());
        let inertia = self.mass_properties().filter(|_| finite)?.inertia;
        let mut moments = SymmetricEigen::new(inertia).eigenvalues;
        moments.as_mut_slice().sort_by(f64::total_cmp);
        Some(moments)
    }
}

/// Violation of the triangle inequality of principal moments that is tolerated, as a fraction of
/// the largest moment. Descriptions of robots round to three or four digits, and a thin rod or
/// plate lies on the boundary.
const INERTIA_TOLERANCE: f64 = 1e-3;

/// Square of the radius of gyration, m², below which a moment is a rounding error: a radius of 0.1
/// µm. Published robots have moments of ±1e-18 kg m² that are the rest of a difference.
const ROUNDING: f64 = 1e-14;

/// Returns the principal moments about the centre of mass in ascending order, kg m², if no body of
/// positive mass has them, else, or if the mass is zero, `None`. Rounding errors count as zero.
pub(crate) fn impossible_moments(parameters: &InertialParameters) -> Option<[f64; 3]> {
    let rounding = ROUNDING * parameters.mass().abs();
    let round = |moment: f64| {
        if moment.abs() <= rounding {
            0.0
        } else {
            moment
        }
    };
    let moments: [f64; 3] = parameters.principal_moments()?.map(round).into();
    let is_impossible = !parameters.is_physical_within(INERTIA_TOLERANCE)
        && moments[2] > moments[0] + moments[1] + rounding;
    is_impossible.then_some(moments)
}

/// Returns the term `-m [a]×²` (kg m²) that the parallel-axis theorem adds to an inertia about the
/// centre of mass, for a point `a` (m) away from it.
fn parallel_axis(mass_kg: f64, a: &Vector3<f64>) -> Matrix3<f64> {
    -cross(a) * cross(a) * mass_kg
}

impl From<MassProperties> for InertialParameters {
    fn from(body: MassProperties) -> Self {
        let about_origin = body.inertia + parallel_axis(body.mass_kg, &body.center_of_mass);
        Self::from_moments(
            body.mass_kg,
            &(body.center_of_mass * body.mass_kg),
            &about_origin,
        )
    }
}

impl Add for InertialParameters {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for InertialParameters {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Neg for InertialParameters {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl std::iter::Sum for InertialParameters {
    fn sum<I: Iterator<Item = Self>>(bodies: I) -> Self {
        bodies.fold(Self::zero(), Add::add)
    }
}
