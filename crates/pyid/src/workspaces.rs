//! Workspaces of a robot, which its calls from Python use again and again.

use std::sync::{Mutex, OnceLock, PoisonError};

use tactid_dynamics::{BatchDynamics, Manipulator, Workspace};

/// Workspaces of one robot: making one costs more than a computation with it.
#[derive(Default)]
pub(crate) struct Workspaces {
    /// Those that no call uses at the moment: at most as many as calls have run at once.
    unused: Mutex<Vec<Workspace>>,
    series: OnceLock<BatchDynamics>,
}

impl Workspaces {
    /// Calls a function with a workspace of the robot, which must be the same one in all calls.
    pub(crate) fn with<T>(&self, robot: &Manipulator, work: impl FnOnce(&mut Workspace) -> T) -> T {
        let unused = || self.unused.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = unused().pop();
        let mut workspace = taken.unwrap_or_else(|| Workspace::new(robot));
        let result = work(&mut workspace);
        unused().push(workspace);
        result
    }

    /// Returns the workspace for series of states of the robot, which must be the same one in all
    /// calls.
    pub(crate) fn series(&self, robot: &Manipulator) -> &BatchDynamics {
        self.series.get_or_init(|| BatchDynamics::new(robot))
    }
}
