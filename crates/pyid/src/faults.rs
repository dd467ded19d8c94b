//! Data faults in Python.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::pythonize;
use tactid_recordings::DataFault;

/// Returns data faults by the fields of `tactid.DataFault`.
pub(crate) fn fault_data(py: Python<'_>, faults: &[DataFault]) -> PyResult<Vec<Py<PyDict>>> {
    let faults = faults.iter().map(|fault| {
        let data = pythonize(py, fault)?.cast_into::<PyDict>()?;
        let first = data.as_any().get_item("first_s")?;
        data.del_item("first_s")?;
        data.set_item("first", first)?;
        Ok(data.unbind())
    });
    faults.collect()
}
