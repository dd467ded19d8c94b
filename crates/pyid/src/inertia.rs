//! Mass properties of a rigid body in Python.

use nalgebra::{Matrix3, SVector, Vector3};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use tactid_dynamics::{InertialParameters, symmetric_matrix};

use crate::arrays::{Series, output};
use crate::errors::ArgumentError;
use crate::poses::Poses;

/// Mass, centre of mass and inertia of a rigid body in one frame.
///
/// Immutable. Bodies in one frame add and subtract: a composite without its gripper is
/// ``composite - gripper``.
///
/// Args: mass: Mass, kg. com: Centre of mass from the frame's origin, m, shape (3,). inertia:
/// Inertia about the centre of mass with the frame's axes, kg m², shape (3, 3). Products of inertia
/// are matrix entries, without a sign flip.
///
/// Raises:
///     ArgumentError: A shape does not fit, a number is not finite, the mass is zero or the inertia
///         is not symmetric.
#[pyclass(module = "tactid", frozen)]
#[derive(Clone)]
pub(crate) struct MassProperties(pub(crate) tactid_dynamics::MassProperties);

#[pymethods]
impl MassProperties {
    #[new]
    fn new(mass: f64, com: &Bound<'_, PyAny>, inertia: &Bound<'_, PyAny>) -> PyResult<Self> {
        let com = Series::read(com, "com", &[3])?;
        let inertia = Series::read(inertia, "inertia", &[3, 3])?;
        for (name, values) in [
            ("mass", &[mass][..]),
            ("com", com.single()?),
            ("inertia", inertia.single()?),
        ] {
            if let Some(given) = values.iter().find(|value| !value.is_finite()) {
                let message = format!("`{name}` has {given}: expected finite numbers");
                return Err(ArgumentError::new_err(message));
            }
        }
        let inertia = Matrix3::from_row_slice(inertia.single()?);
        if (inertia - inertia.transpose()).amax() > 1e-9 * inertia.amax() {
            return Err(ArgumentError::new_err("`inertia` is not symmetric"));
        }
        if mass == 0.0 {
            return Err(ArgumentError::new_err(
                "`mass` is zero: no centre of mass belongs to it",
            ));
        }
        Ok(Self(tactid_dynamics::MassProperties {
            mass_kg: mass,
            center_of_mass: Vector3::from_column_slice(com.single()?),
            inertia,
        }))
    }

    /// Returns the body with these inertial parameters, in which the dynamics are linear.
    ///
    /// Args: parameters: ``[m, m·ax, m·ay, m·az, Ixx, Ixy, Ixz, Iyy, Iyz, Izz]``, the inertia about
    /// the frame's origin; kg, kg m, kg m²; shape (10,).
    ///
    /// Raises:
    ///     ArgumentError: The shape does not fit or the mass is zero.
    #[staticmethod]
    fn from_parameters(parameters: &Bound<'_, PyAny>) -> PyResult<Self> {
        let parameters = Series::read(parameters, "parameters", &[10])?;
        from_dynamics(InertialParameters::from_vector(SVector::from_column_slice(
            parameters.single()?,
        )))
    }

    /// Returns the body with these ten values of a payload, in the order of ``VALUE_NAMES``.
    ///
    /// Args: values: Mass, kg; centre of mass, m; inertia about it, kg m², xx, xy, xz, yy, yz, zz;
    /// shape (10,). The mass may be zero, as in an estimate before its first window.
    ///
    /// Raises:
    ///     ArgumentError: The shape does not fit.
    #[staticmethod]
    fn from_values(values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = Series::read(values, "values", &[10])?;
        let values = values.single()?;
        Ok(Self(tactid_dynamics::MassProperties {
            mass_kg: values[0],
            center_of_mass: Vector3::from_column_slice(&values[1..4]),
            inertia: symmetric_matrix(std::array::from_fn(|k| values[4 + k])),
        }))
    }

    /// Mass, kg.
    #[getter]
    fn mass(&self) -> f64 {
        self.0.mass_kg
    }

    /// Centre of mass from the frame's origin, m, shape (3,).
    #[getter]
    fn com<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        output(py, self.0.center_of_mass.as_slice().to_vec(), None, &[3])
    }

    /// Inertia about the centre of mass with the frame's axes, kg m², shape (3, 3).
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        // Symmetric: row by row and column by column are the same.
        output(py, self.0.inertia.as_slice().to_vec(), None, &[3, 3])
    }

    /// Inertial parameters ``[m, m·ax, m·ay, m·az, Ixx, Ixy, Ixz, Iyy, Iyz, Izz]``, the inertia
    /// about the frame's origin; kg, kg m, kg m²; shape (10,).
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let parameters = InertialParameters::from(self.0);
        output(py, parameters.as_vector().as_slice().to_vec(), None, &[10])
    }

    /// Whether some distribution of positive mass has these properties, but for rounding: the mass
    /// is positive, and no principal moment of inertia exceeds the sum of the two others.
    #[getter]
    fn is_physical(&self) -> bool {
        InertialParameters::from(self.0).is_physical()
    }

    /// Returns whether some distribution of positive mass has these properties within a tolerance.
    ///
    /// Estimates of plates and rods need a tolerance: their largest principal moment of inertia
    /// equals the sum of the two others.
    ///
    /// Args: tolerance: Fraction of the largest principal moment by which it may exceed the sum of
    /// the two others.
    fn is_physical_within(&self, tolerance: f64) -> bool {
        InertialParameters::from(self.0).is_physical_within(tolerance)
    }

    /// Returns this body, expressed in another frame.
    ///
    /// Args:
    ///     a_from_b: Pose of this value's frame ``b`` in the target frame ``a``: 4x4, or
    ///         ``[x, y, z, qx, qy, qz, qw]``.
    ///
    /// Raises:
    ///     ArgumentError: ``a_from_b`` is not a single pose.
    fn expressed_in(&self, a_from_b: &Bound<'_, PyAny>) -> PyResult<Self> {
        let poses = Poses::read_or_identity(Some(a_from_b), "a_from_b")?;
        let pose = poses.single()?;
        from_dynamics(InertialParameters::from(self.0).expressed_in(pose))
    }

    fn __add__(&self, other: &Self) -> PyResult<Self> {
        from_dynamics(InertialParameters::from(self.0) + InertialParameters::from(other.0))
    }

    fn __sub__(&self, other: &Self) -> PyResult<Self> {
        from_dynamics(InertialParameters::from(self.0) - InertialParameters::from(other.0))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    /// The arguments that make the same body: it is copied, and sent to other processes.
    fn __getnewargs__<'py>(
        this: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let argument = |name| this.getattr(name);
        Ok((argument("mass")?, argument("com")?, argument("inertia")?))
    }

    fn __repr__(&self) -> String {
        let tactid_dynamics::MassProperties {
            mass_kg,
            center_of_mass: a,
            inertia: i,
        } = &self.0;
        format!(
            "MassProperties(mass={mass_kg}, com=[{}, {}, {}], inertia=[[{}, {}, {}], [{}, {}, {}], [{}, {}, {}]])",
            a.x, a.y, a.z, i.m11, i.m12, i.m13, i.m21, i.m22, i.m23, i.m31, i.m32, i.m33
        )
    }
}

fn from_dynamics(parameters: InertialParameters) -> PyResult<MassProperties> {
    let properties = parameters.mass_properties().ok_or_else(|| {
        ArgumentError::new_err("the mass is zero: it has no centre of mass and no inertia about it")
    })?;
    Ok(MassProperties(properties))
}
