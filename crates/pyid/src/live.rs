//! A live session, and the messages of a log one by one. `tactid._live` uses them.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict};
use tactid_logs::{LogReader, Messages};
use tactid_recordings::LiveSettings;

use crate::errors::{IntoPyErr, detached};
use crate::faults::faults;
use crate::findings::findings;
use crate::online::{WrenchData, wrench_data};
use crate::options;
use crate::record::fields;

/// Topic, type, data and time of arrival, ns, of a message.
type Message = (String, String, PyBackedBytes, u64);

/// Time, ns, frame, latency, s, and wrench of a contact.
type Contact<'py> = (i64, String, f64, WrenchData<'py>);

/// Findings, and faults of the messages.
type Notices<'py> = (Vec<Bound<'py, PyAny>>, Vec<Py<PyAny>>);

/// A live session: messages in, an estimate at any time.
#[pyclass(module = "tactid._native", frozen)]
pub(crate) struct LiveSession(Mutex<tactid_recordings::LiveSession>);

#[pymethods]
impl LiveSession {
    #[new]
    fn new(
        options: &Bound<'_, PyDict>,
        in_background: bool,
        contact_frame: Option<String>,
    ) -> PyResult<Self> {
        let settings = LiveSettings {
            in_background,
            contact_frame,
            ..LiveSettings::default()
        };
        let session = tactid_recordings::LiveSession::new(options::request(options)?, settings);
        Ok(Self(Mutex::new(session.map_err(IntoPyErr::into_py_err)?)))
    }

    /// Notes that there are topics, each with the type of its messages.
    fn announce(&self, py: Python<'_>, topics: Vec<(String, String)>) {
        py.detach(|| {
            let mut session = self.lock();
            let each = topics.iter();
            each.for_each(|(name, type_name)| session.announce(name, type_name));
        });
    }

    /// Takes messages in the order in which they came, and what another thread has chosen from the
    /// beginning, if it has.
    fn push(&self, py: Python<'_>, messages: Vec<Message>) -> PyResult<()> {
        let pushed = detached(py, || {
            let mut session = self.lock();
            messages
                .iter()
                .try_for_each(|(name, type_name, data, received_ns)| {
                    session.push(name, type_name, data.to_vec(), *received_ns)
                })?;
            session.proceed()
        })?;
        pushed.map_err(IntoPyErr::into_py_err)
    }

    /// Completes a session without further messages.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        detached(py, || self.lock().finish())?.map_err(IntoPyErr::into_py_err)
    }

    /// Forgets what was identified.
    fn reset(&self, py: Python<'_>) {
        py.detach(|| self.lock().reset());
    }

    /// Returns the estimate; None before an identification runs.
    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let estimate = detached(py, || self.lock().estimate())?;
        estimate.map(|estimate| fields(py, &estimate)).transpose()
    }

    /// Returns the offset of the wrenches; None where it is not an unknown.
    fn wrench_offset<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let offset = detached(py, || self.lock().wrench_offset())?;
        offset.map(|offset| fields(py, &offset)).transpose()
    }

    /// Returns the wrench of a contact: time to which it belongs, ns since the epoch, its frame,
    /// its latency, s, and the wrench as that of an online identifier; None before payload and
    /// offset are known.
    fn contact_wrench<'py>(&self, py: Python<'py>) -> PyResult<Option<Contact<'py>>> {
        let found = detached(py, || self.lock().contact_wrench())?;
        let contact = found.map(|found| {
            let wrench = wrench_data(py, &found.wrench)?;
            Ok((found.time_ns, found.frame, found.latency_s, wrench))
        });
        contact.transpose()
    }

    /// Returns the number of payload changes since the identification began.
    fn payload_changes(&self, py: Python<'_>) -> PyResult<u64> {
        detached(py, || self.lock().payload_changes())
    }

    /// Sets the zero of the wrench sensor, and keeps the estimate of the payload.
    fn tare(&self, py: Python<'_>) -> PyResult<()> {
        detached(py, || self.lock().tare())?.map_err(IntoPyErr::into_py_err)
    }

    /// Holds the payload or ends that.
    fn hold_payload(&self, py: Python<'_>, is_held: bool) -> PyResult<()> {
        let held = detached(py, || self.lock().hold_payload(is_held))?;
        held.map_err(IntoPyErr::into_py_err)
    }

    /// Returns what the session does at the moment, by the fields of `LiveStatus`.
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fields(py, &detached(py, || self.lock().status())?)
    }

    /// Returns the findings at a time, ns since the epoch, and the faults of the messages.
    fn notices<'py>(&self, py: Python<'py>, now_ns: u64) -> PyResult<Notices<'py>> {
        let (noticed, of_messages) = detached(py, || {
            let snapshot = self.lock().snapshot(now_ns);
            (snapshot.findings(), snapshot.faults().to_vec())
        })?;
        let findings = findings(py, &noticed, "command-line")?;
        Ok((findings, faults(py, &of_messages)?))
    }
}

impl LiveSession {
    fn lock(&self) -> MutexGuard<'_, tactid_recordings::LiveSession> {
        // A push that panicked has left numbers behind, not broken memory.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Topic, type, data and time of logging, ns, of a message of a log.
type Logged<'py> = (String, String, Bound<'py, PyBytes>, u64);

/// The messages of a log in the order of their times of logging.
#[pyclass(module = "tactid._native", frozen)]
pub(crate) struct LogMessages(Mutex<Messages>);

#[pymethods]
impl LogMessages {
    #[new]
    fn new(py: Python<'_>, log: PathBuf) -> PyResult<Self> {
        let opened = detached(py, || LogReader::open(log))?;
        let messages = opened.map_err(IntoPyErr::into_py_err)?.messages();
        Ok(Self(Mutex::new(messages)))
    }

    /// Returns the next messages, at most `count`: topic, type, data and time of logging, ns, of
    /// each; none at the end.
    fn read<'py>(&self, py: Python<'py>, count: usize) -> PyResult<Vec<Logged<'py>>> {
        let read = detached(py, || {
            let mut messages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            messages.by_ref().take(count).collect::<Result<Vec<_>, _>>()
        })?;
        let read = read.map_err(IntoPyErr::into_py_err)?;
        let item = |message: &tactid_logs::RawMessage| {
            let (topic, data) = (&message.topic, PyBytes::new(py, message.data()));
            let names = (topic.name.clone(), topic.type_name.clone());
            (names.0, names.1, data, message.log_time_ns)
        };
        Ok(read.iter().map(item).collect())
    }
}
