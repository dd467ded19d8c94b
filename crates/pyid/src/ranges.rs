//! Logs that a Python object reads by ranges, such as objects in a store.

use std::io;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tactid_logs::Ranges;
use tactid_recordings::{Identified, Observer, RecordingError, Request, Segment};

/// Log that is given as a path, or as an object with `path`, `length()`, `read(at_byte, length)`
/// and `announce(ranges)`, as [`Ranges`] has them.
#[derive(FromPyObject)]
pub(crate) enum GivenLog {
    #[pyo3(transparent)]
    Path(PathBuf),
    #[pyo3(transparent)]
    Object(Py<PyAny>),
}

impl GivenLog {
    /// Returns the parts of the log with one body each.
    pub(crate) fn split(
        self,
        request: &Request,
        observer: &mut Observer<'_>,
    ) -> Result<Vec<Segment>, RecordingError> {
        match self {
            Self::Path(path) => tactid_recordings::split_log(&path, request, observer),
            Self::Object(reader) => {
                let (ranges, path) = PythonRanges::of(reader);
                tactid_recordings::split_ranges(&path, &ranges, request, observer)
            }
        }
    }

    /// Identifies the payload from the log.
    pub(crate) fn identify(
        self,
        request: &Request,
        observer: &mut Observer<'_>,
    ) -> Result<Identified, RecordingError> {
        match self {
            Self::Path(path) => tactid_recordings::identify_log(&path, request, observer),
            Self::Object(reader) => {
                let (ranges, path) = PythonRanges::of(reader);
                tactid_recordings::identify_ranges(&path, &ranges, request, observer)
            }
        }
    }
}

/// Ranges that a Python object reads.
#[derive(Clone, Debug)]
struct PythonRanges(Arc<Py<PyAny>>);

impl PythonRanges {
    /// Returns what reads by an object, and the path by which errors name the log.
    fn of(reader: Py<PyAny>) -> (Self, PathBuf) {
        let ranges = Self(Arc::new(reader));
        let path = ranges.call(|reader| reader.getattr("path")?.extract());
        (ranges, path.unwrap_or_else(|_| "log".into()))
    }

    fn call<T>(&self, work: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<T>) -> io::Result<T> {
        Python::attach(|py| {
            work(self.0.bind(py)).map_err(|error| io::Error::other(error.value(py).to_string()))
        })
    }
}

impl Ranges for PythonRanges {
    fn length(&mut self) -> io::Result<u64> {
        self.call(|reader| reader.call_method0("length")?.extract())
    }

    fn read_range(&mut self, at_byte: u64, length: u64) -> io::Result<Vec<u8>> {
        self.call(|reader| {
            let bytes = reader.call_method1("read", (at_byte, length))?;
            Ok(bytes.cast::<PyBytes>()?.as_bytes().to_vec())
        })
    }

    fn announce(&mut self, ranges: &[Range<u64>]) {
        let ranges: Vec<_> = ranges
            .iter()
            .map(|range| (range.start, range.end))
            .collect();
        // It is advice: what is wrong with the object, reading says.
        let _ = self.call(|reader| reader.call_method1("announce", (ranges,)).map(drop));
    }

    fn costs_requests(&self) -> bool {
        true
    }
}
