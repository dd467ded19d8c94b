//! User interruption and progress during long computations.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Often enough that Ctrl-C feels immediate, seldom enough to cost nothing.
const INTERVAL: Duration = Duration::from_millis(50);

/// Checks for user interruption (Ctrl-C) and reports the progress to Python, every 50 ms.
pub(crate) struct InterruptionCheck {
    progress: Option<Py<PyAny>>,
    last: Instant,
    error: Option<PyErr>,
}

impl InterruptionCheck {
    /// Creates a check; `progress` is called with the fraction that is done.
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        Self {
            progress,
            last: Instant::now(),
            error: None,
        }
    }

    /// Checks, if the last check is long enough ago; breaks where Python raised an exception, which
    /// [`Self::finish`] returns.
    pub(crate) fn check(&mut self, fraction: f64) -> ControlFlow<()> {
        if self.last.elapsed() < INTERVAL {
            return ControlFlow::Continue(());
        }
        self.last = Instant::now();
        match Python::attach(|py| self.ask(py, fraction)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.error = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    fn ask(&self, py: Python<'_>, fraction: f64) -> PyResult<()> {
        py.check_signals()?;
        if let Some(progress) = &self.progress {
            progress.call1(py, (fraction,))?;
        }
        Ok(())
    }

    /// Returns the exception that stopped the computation, or the computation's own result.
    pub(crate) fn finish<T>(self, py: Python<'_>, result: PyResult<T>) -> PyResult<T> {
        if let Some(error) = self.error {
            return Err(error);
        }
        let value = result?;
        if let Some(progress) = &self.progress {
            progress.call1(py, (1.0,))?;
        }
        Ok(value)
    }
}
