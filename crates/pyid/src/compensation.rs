//! The wrench of the contact at each sample of a recording. `tactid._api.compensation` and the
//! command line call these.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tactid_recordings::{
    CompensationReport, ContactSample, IdentifiedLoad, RecordedWrenches, RecordingError,
    WrenchPlace, WrenchReceiver, WrittenWrench,
};

use crate::arrays::output;
use crate::errors::option_error;
use crate::faults::faults;
use crate::findings::findings;
use crate::identify::{GivenArrays, run, urdf_errors};
use crate::options;
use crate::record::fields;

/// Returns the wrenches of load and contact at the samples of a log: see :func:`tactid.compensate`.
#[pyfunction]
#[pyo3(signature = (log, options, load, progress=None))]
pub(crate) fn compensate_log(
    py: Python<'_>,
    log: PathBuf,
    options: &Bound<'_, PyDict>,
    load: GivenLoad<'_>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    let request = options::request(options)?;
    let (payload, place) = read(&load)?;
    let mut rows = Rows::default();
    let report = run(py, progress, |observer| {
        tactid_recordings::compensate_log(&log, &request, &payload, &place, &mut rows, observer)
    });
    rows.data(py, &urdf_errors(py, &request, report)?)
}

/// Returns the wrenches of load and contact at samples in arrays: see :func:`tactid.compensate`.
#[pyfunction]
#[pyo3(signature = (time, options, arrays, load, progress=None))]
pub(crate) fn compensate_arrays(
    py: Python<'_>,
    time: &Bound<'_, PyAny>,
    options: &Bound<'_, PyDict>,
    arrays: GivenArrays<'_>,
    load: GivenLoad<'_>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    let (payload, place) = read(&load)?;
    let mut rows = Rows::default();
    arrays.with(time, options, |arrays, request| {
        let report = run(py, progress, |observer| {
            let receiver = &mut rows;
            tactid_recordings::compensate_arrays(
                arrays, request, &payload, &place, receiver, observer,
            )
        })?;
        rows.data(py, &report)
    })
}

/// Writes a copy of a log with the wrenches of load and contact to a file in a folder, and returns
/// what they are like.
#[pyfunction]
#[pyo3(signature = (log, folder, file, options, load, progress=None))]
pub(crate) fn compensate_into(
    py: Python<'_>,
    log: PathBuf,
    folder: PathBuf,
    file: &str,
    options: &Bound<'_, PyDict>,
    load: GivenLoad<'_>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Py<PyDict>> {
    let request = options::request(options)?;
    let (payload, place) = read(&load)?;
    let written = run(py, progress, |observer| {
        let paths = [log.as_path(), folder.as_path()];
        tactid_recordings::compensate_into(paths, file, &request, &payload, &place, observer)
    });
    let written = urdf_errors(py, &request, written)?;
    let data = report_data(py, &written.report)?;
    let summary = &written.summary;
    let series = |of: fn(&WrittenWrench) -> &[f64], width: &[usize]| {
        let values = summary.series.iter().flat_map(of).copied().collect();
        output(py, values, None, &[&[summary.series.len()], width].concat())
    };
    data.set_item("topics", written.topics)?;
    data.set_item("bag_metadata", written.bag_metadata)?;
    data.set_item("samples", summary.samples)?;
    data.set_item(
        "times_s",
        series(|each| std::slice::from_ref(&each.time_s), &[])?,
    )?;
    data.set_item("measured", series(|each| &each.measured, &[6])?)?;
    data.set_item("contact", series(|each| &each.contact, &[6])?)?;
    data.set_item("std_devs", series(|each| &each.std_devs, &[6])?)?;
    data.set_item("measured_rms", summary.measured_rms)?;
    data.set_item("contact_rms", summary.contact_rms)?;
    let greatest = summary.greatest.iter().flatten();
    let greatest = greatest.map(|each| (each.time_s, each.contact, each.std_devs));
    data.set_item("greatest", greatest.collect::<Vec<_>>())?;
    Ok(data.unbind())
}

/// The fields of a result, the link of the point and that of the axes.
type GivenLoad<'py> = (Bound<'py, PyDict>, Option<String>, Option<String>);

fn read((payload, point, axes): &GivenLoad<'_>) -> PyResult<(IdentifiedLoad, WrenchPlace)> {
    let read = pythonize::depythonize(payload).map_err(|error| {
        let message = format!("`payload` is not a result that can be used: {error}");
        option_error(message, "payload")
    })?;
    let place = WrenchPlace {
        point: point.clone(),
        axes: axes.clone(),
    };
    Ok((read, place))
}

fn report_data<'py>(py: Python<'py>, report: &CompensationReport) -> PyResult<Bound<'py, PyDict>> {
    let data = fields(py, report)?;
    data.set_item("findings", findings(py, &report.findings, "keyword")?)?;
    data.set_item("faults", faults(py, &report.faults)?)?;
    Ok(data)
}

/// The wrenches of all samples, row by row, NaN where a sample has none.
#[derive(Default)]
struct Rows {
    times_s: Vec<f64>,
    measured: Vec<f64>,
    /// Wrenches of load and contact.
    wrenches: [Vec<f64>; 2],
    /// Their covariances.
    covariances: [Vec<f64>; 2],
}

impl WrenchReceiver for Rows {
    fn take(&mut self, sample: ContactSample) -> Result<(), RecordingError> {
        self.times_s.push(sample.time_s);
        let Some(RecordedWrenches { measured, parts }) = sample.wrenches else {
            let rows = self.wrenches.iter_mut().chain([&mut self.measured]);
            rows.for_each(|row| row.extend([f64::NAN; 6]));
            let covariances = self.covariances.iter_mut();
            covariances.for_each(|row| row.extend([f64::NAN; 36]));
            return Ok(());
        };
        self.measured.extend(measured.entries());
        for (k, estimate) in [parts.load, parts.contact].iter().enumerate() {
            self.wrenches[k].extend(estimate.wrench.entries());
            // Symmetric: row by row and column by column are the same.
            self.covariances[k].extend(estimate.covariance.as_slice());
        }
        Ok(())
    }
}

impl Rows {
    /// Returns the fields of `tactid.Compensation`.
    fn data(self, py: Python<'_>, report: &CompensationReport) -> PyResult<Py<PyDict>> {
        let data = report_data(py, report)?;
        let count = self.times_s.len();
        let [load, contact] = self.wrenches;
        let [load_covariance, contact_covariance] = self.covariances;
        for (name, values, shape) in [
            ("times_s", self.times_s, &[count][..]),
            ("measured", self.measured, &[count, 6]),
            ("load", load, &[count, 6]),
            ("contact", contact, &[count, 6]),
            ("load_covariance", load_covariance, &[count, 6, 6]),
            ("contact_covariance", contact_covariance, &[count, 6, 6]),
        ] {
            data.set_item(name, output(py, values, None, shape)?)?;
        }
        Ok(data.unbind())
    }
}
