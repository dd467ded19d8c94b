//! A payload as Python reads it.

use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::output;
use crate::inertia::MassProperties;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// A payload as identified, in the end-effector frame.
#[pyclass(module = "tactid", frozen)]
#[derive(Clone)]
pub(crate) struct PayloadEstimate(pub(crate) tactid_identify::PayloadEstimate);

#[pymethods]
impl PayloadEstimate {
    /// The payload alone.
    #[getter]
    fn body(&self) -> MassProperties {
        MassProperties(self.0.body)
    }

    /// Gripper and payload as one body, for the joint-sensing way; else None.
    #[getter]
    fn composite(&self) -> Option<MassProperties> {
        self.0.composite.map(MassProperties)
    }

    /// Mass, kg; centre of mass, m; inertia about it, kg m²; in the order of ``VALUE_NAMES``, (10,).
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        output(py, self.0.values().to_vec(), None, &[10])
    }

    /// Standard deviation of each of ``VALUE_NAMES``, (10,), infinite where the motion did not determine it; NaN
    /// for the paper's filter, which knows of none.
    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let deviations = self.0.deviations.unwrap_or([f64::NAN; 10]);
        output(py, deviations.to_vec(), None, &[10])
    }

    /// For each of ``VALUE_NAMES``: whether the motion determined it. Where it did not, the number is where
    /// the estimator happened to start or drift.
    #[getter]
    fn identifiable(&self) -> [bool; 10] {
        self.0.identifiable
    }

    /// The names of the values that the motion did not determine.
    #[getter]
    fn not_identifiable(&self) -> Vec<&'static str> {
        self.0.not_identifiable().collect()
    }

    /// How strongly the motion excited mass and centre of mass: rms singular values of the rows of equation
    /// (48), descending, (4,), m/s²; NaN for least squares online, whose deviations say more.
    #[getter]
    fn mass_singular_values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let mass = self.0.singular_values.map_or([f64::NAN; 4], |s| s.mass);
        output(py, mass.to_vec(), None, &[4])
    }

    /// How strongly the motion excited the inertia: rms singular values of the rows of equation (46),
    /// descending, (6,), rad/s²; NaN for least squares online.
    #[getter]
    fn inertia_singular_values<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let inertia = self.0.singular_values.map_or([f64::NAN; 6], |s| s.inertia);
        output(py, inertia.to_vec(), None, &[6])
    }

    /// Whether a body with these parameters can exist, within 1 % of its largest principal moment: a plate,
    /// such as the paper's payload, lies on the border of what can, and no estimate is exact.
    #[getter]
    fn is_physical(&self) -> bool {
        self.0.is_physical
    }

    /// Windows that gave rows.
    #[getter]
    fn intervals(&self) -> u64 {
        self.0.intervals
    }

    /// How often least squares online saw that the payload is another than before.
    #[getter]
    fn changes(&self) -> u64 {
        self.0.changes
    }

    /// From when on the estimate is made, on the samples' clock, s: the last change, or minus infinity.
    #[getter]
    fn since(&self) -> f64 {
        self.0.since_s
    }

    /// Samples refused: not finite, or not later than the one before.
    #[getter]
    fn refused(&self) -> u64 {
        self.0.refused
    }

    /// Gaps that were too long to be bridged.
    #[getter]
    fn gaps(&self) -> u64 {
        self.0.gaps
    }
}
