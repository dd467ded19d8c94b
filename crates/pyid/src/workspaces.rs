//! Workspaces of one robot, which calls from Python use again and again.

use std::sync::{Mutex, PoisonError};

use pyo3::PyResult;
use tactid_dynamics::{Manipulator, Workspace};

/// Workspaces that no call uses at the moment: at most as many as calls have run at once.
#[derive(Default)]
pub(crate) struct Workspaces(Mutex<Vec<Workspace>>);

impl Workspaces {
    /// Calls a function with a workspace of the robot, which is the same in all calls, and keeps it for the next call.
    pub(crate) fn with<T>(
        &self,
        robot: &Manipulator,
        work: impl FnOnce(&mut Workspace) -> PyResult<T>,
    ) -> PyResult<T> {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let free = kept().pop();
        let mut workspace = free.unwrap_or_else(|| Workspace::new(robot));
        let done = work(&mut workspace);
        kept().push(workspace);
        done
    }
}
