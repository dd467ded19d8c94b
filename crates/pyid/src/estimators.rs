//! Python classes of the recursive filters, whose number of parameters is chosen at run time.

use std::fmt::Display;
use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::SVector;
use numpy::PyArrayDyn;
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use tactid_nlms::{Counts, Outcome, SettingError};

use crate::arrays::{Series, common_length, output};
use crate::errors::{ArgumentError, IntoPyErr, detached};

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// An estimator whose number of parameters is known at run time.
trait AnyEstimator: Send {
    fn size(&self) -> usize;
    fn update(&mut self, row: &[f64], target: f64) -> Outcome;
    fn parameters(&self) -> Vec<f64>;
    fn covariance(&self) -> Option<Vec<f64>>;
    fn counts(&self) -> Counts;
}

macro_rules! any_estimator {
    ($kind:ident, $self:ident => $covariance:expr) => {
        impl<const N: usize> AnyEstimator for tactid_nlms::$kind<N> {
            fn size(&self) -> usize {
                N
            }
            fn update(&mut self, row: &[f64], target: f64) -> Outcome {
                let row = SVector::from_column_slice(row);
                tactid_nlms::Estimator::update(self, &row, target)
            }
            fn parameters(&self) -> Vec<f64> {
                tactid_nlms::Estimator::parameters(self).as_slice().to_vec()
            }
            fn covariance(&$self) -> Option<Vec<f64>> {
                $covariance
            }
            fn counts(&self) -> Counts {
                tactid_nlms::Estimator::counts(self)
            }
        }
    };
}

any_estimator!(Lms, self => None);
any_estimator!(Nlms, self => None);
// The matrix is symmetric, so that its order in memory does not matter.
any_estimator!(Rls, self => self.covariance().map(|matrix| matrix.as_slice().to_vec()));

/// Calls a function with the constant `N` that equals `size`.
macro_rules! with_size {
    ($size:expr, $make:ident($($argument:expr),*)) => {
        match $size {
            1 => $make::<1>($($argument),*),
            2 => $make::<2>($($argument),*),
            3 => $make::<3>($($argument),*),
            4 => $make::<4>($($argument),*),
            5 => $make::<5>($($argument),*),
            6 => $make::<6>($($argument),*),
            7 => $make::<7>($($argument),*),
            8 => $make::<8>($($argument),*),
            9 => $make::<9>($($argument),*),
            10 => $make::<10>($($argument),*),
            other => Err(size_error(other)),
        }
    };
}

/// Recursive estimator of ``x`` in ``A x = b``: :class:`Lms`, :class:`Nlms` or :class:`Rls`.
#[pyclass(module = "tactid", frozen, subclass)]
pub(crate) struct Estimator(Mutex<Box<dyn AnyEstimator>>);

impl Estimator {
    fn lock(&self) -> MutexGuard<'_, Box<dyn AnyEstimator>> {
        // An update that panicked has left numbers behind, not broken memory.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Estimator {
    /// Updates the estimate with one row, or with several rows one after the other.
    ///
    /// A row or target that is not finite, or has a magnitude of 1e150 or more, changes nothing but
    /// :attr:`refused`.
    ///
    /// Args:
    ///     rows: Rows of ``A``, (size,) or (N, size).
    ///     targets: Entries of ``b``, () or (N,).
    ///
    /// Returns:
    ///     Number of the rows that were used.
    ///
    /// Raises: ArgumentError: The shape of ``rows`` or ``targets`` does not fit the number of
    /// parameters, or one another.
    fn update(
        &self,
        py: Python<'_>,
        rows: &Bound<'_, PyAny>,
        targets: &Bound<'_, PyAny>,
    ) -> PyResult<usize> {
        let size = py.detach(|| self.lock().size());
        let rows = Series::read(rows, "rows", &[size])?;
        let targets = Series::read(targets, "targets", &[])?;
        let count = common_length(&[&rows, &targets])?.unwrap_or(1);
        detached(py, || {
            let mut estimator = self.lock();
            let used = |&k: &usize| estimator.update(rows.at(k), targets.at(k)[0]) == Outcome::Used;
            (0..count).filter(used).count()
        })
    }

    /// Current estimate of the parameters ``x``, (size,), each in the unit of the target over that
    /// of its column.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let parameters = py.detach(|| self.lock().parameters());
        let size = parameters.len();
        output(py, parameters, None, &[size])
    }

    /// Number of rows that were used.
    #[getter]
    fn used(&self, py: Python<'_>) -> u64 {
        py.detach(|| self.lock().counts().used)
    }

    /// Number of rows that were refused.
    #[getter]
    fn refused(&self, py: Python<'_>) -> u64 {
        py.detach(|| self.lock().counts().refused)
    }
}

/// Estimates parameters by least mean squares (LMS) with a fixed step size, section 3.1 of the
/// paper.
///
/// The estimate may diverge where ``step · |row|²`` reaches 2.
///
/// Args:
///     size: Number of parameters, 1 to 10.
///     step: Step size, positive, in the inverse unit of a row's squared norm.
///     start: Initial parameters, (size,); ones by default.
///
/// Raises:
///     ArgumentError: A setting is out of its range.
#[pyclass(module = "tactid", frozen, extends = Estimator)]
pub(crate) struct Lms;

#[pymethods]
impl Lms {
    #[new]
    #[pyo3(signature = (size, step, *, start=None))]
    fn new(size: Size, step: f64, start: Argument<'_, '_>) -> PyResult<PyClassInitializer<Self>> {
        fn make<const N: usize>(step: f64, start: &[f64]) -> PyResult<Estimator> {
            let start = SVector::from_column_slice(start);
            finish(tactid_nlms::Lms::<N>::new(step).map(|filter| filter.starting_at(start)))
        }
        let start = read_start(start, size.0)?;
        let estimator = with_size!(size.0, make(step, &start))?;
        Ok(PyClassInitializer::from(estimator).add_subclass(Self))
    }
}

/// Estimates parameters by normalised least mean squares (NLMS), the paper's filter, equations
/// (53)-(54).
///
/// The prediction of a row has ``alpha / (2 - alpha)`` times the variance of white noise on the
/// targets, which is 9 times at the paper's alpha.
///
/// Args:
///     size: Number of parameters, 1 to 10.
///     alpha: Step size, in (0, 2).
///     beta: Regularisation, in (0, 1), in the unit of a row's squared norm.
///     start: Initial parameters, (size,); ones by default, as in the paper.
///
/// Raises:
///     ArgumentError: A setting is out of its range.
#[pyclass(module = "tactid", frozen, extends = Estimator)]
pub(crate) struct Nlms;

#[pymethods]
impl Nlms {
    #[new]
    #[pyo3(signature = (size, alpha=1.8, beta=0.9, *, start=None))]
    fn new(
        size: Size,
        alpha: f64,
        beta: f64,
        start: Argument<'_, '_>,
    ) -> PyResult<PyClassInitializer<Self>> {
        fn make<const N: usize>(alpha: f64, beta: f64, start: &[f64]) -> PyResult<Estimator> {
            let start = SVector::from_column_slice(start);
            let filter = tactid_nlms::Nlms::<N>::new(alpha, beta);
            finish(filter.map(|filter| filter.starting_at(start)))
        }
        let start = read_start(start, size.0)?;
        let estimator = with_size!(size.0, make(alpha, beta, &start))?;
        Ok(PyClassInitializer::from(estimator).add_subclass(Self))
    }
}

/// Estimates parameters by recursive least squares (RLS) over all rows with equal weight, in
/// square-root information form.
///
/// A direction that no row excites keeps its initial value.
///
/// Args:
///     size: Number of parameters, 1 to 10.
///     start: Initial parameters, (size,); ones by default.
///
/// Raises:
///     ArgumentError: A setting is out of its range.
#[pyclass(module = "tactid", frozen, extends = Estimator)]
pub(crate) struct Rls;

#[pymethods]
impl Rls {
    #[new]
    #[pyo3(signature = (size, *, start=None))]
    fn new(size: Size, start: Argument<'_, '_>) -> PyResult<PyClassInitializer<Self>> {
        fn make<const N: usize>(start: &[f64]) -> PyResult<Estimator> {
            let start = SVector::from_column_slice(start);
            finish(Ok(tactid_nlms::Rls::<N>::starting_at(start)))
        }
        let start = read_start(start, size.0)?;
        let estimator = with_size!(size.0, make(&start))?;
        Ok(PyClassInitializer::from(estimator).add_subclass(Self))
    }

    /// Covariance of the estimate, (size, size), with the noise variance estimated from the
    /// residuals. It is None until there are more rows than parameters.
    #[getter]
    fn covariance<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let py = slf.py();
        let estimator = slf.as_super().get();
        let (size, covariance) = py.detach(|| {
            let estimator = estimator.lock();
            (estimator.size(), estimator.covariance())
        });
        covariance
            .map(|values| output(py, values, None, &[size, size]))
            .transpose()
    }
}

fn finish<E: AnyEstimator + 'static>(estimator: Result<E, SettingError>) -> PyResult<Estimator> {
    let estimator = estimator.map_err(IntoPyErr::into_py_err)?;
    Ok(Estimator(Mutex::new(Box::new(estimator))))
}

/// Number of parameters. Any integer is read, so that the error of one that is out of its range is
/// ours.
struct Size(usize);

impl<'a, 'py> FromPyObject<'a, 'py> for Size {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        match given.extract::<usize>() {
            Err(error) if error.is_instance_of::<PyOverflowError>(given.py()) => {
                Err(size_error(given.to_owned()))
            }
            size => size.map(Self),
        }
    }
}

/// The error of a number of parameters out of range.
fn size_error(given: impl Display) -> PyErr {
    ArgumentError::new_err(format!("`size` is {given}: expected 1 to 10 parameters"))
}

/// Reads the initial parameters, of length `size`; ones by default.
fn read_start(start: Argument<'_, '_>, size: usize) -> PyResult<Vec<f64>> {
    match start {
        None => Ok(vec![1.0; size.min(10)]),
        Some(value) => Ok(Series::read(value, "start", &[size])?.single()?.to_vec()),
    }
}
