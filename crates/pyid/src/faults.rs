//! Data faults in Python.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::pythonize;
use tactid_recordings::DataFault;

/// Returns data faults as instances of `tactid.DataFault`.
pub(crate) fn faults(py: Python<'_>, faults: &[DataFault]) -> PyResult<Vec<Py<PyAny>>> {
    let class = py.import("tactid._base.findings")?.getattr("DataFault")?;
    let faults = faults.iter().map(|fault| {
        let data = pythonize(py, fault)?.cast_into::<PyDict>()?;
        Ok(class.call((), Some(&data))?.unbind())
    });
    faults.collect()
}
