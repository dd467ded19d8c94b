//! Writing of a log on a thread of its own, while the simulation goes on.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};

use super::Recorder;
use crate::SimError;
use crate::sample::Sample;
use crate::scene::State;

/// Number of steps that go to the thread at a time.
const BATCH: usize = 32;
/// Number of batches that may wait. With the one that is being written and the one that is being
/// filled, a killed process loses at most 128 steps besides the open chunk.
const WAITING: usize = 2;

/// A step of the simulation.
struct Step {
    index: u64,
    sample: Sample,
    state: State,
}

/// A recorder that encodes and compresses on a thread of its own, in the order of the steps.
pub(crate) struct RecorderThread<'scope> {
    batches: SyncSender<Vec<Step>>,
    batch: Vec<Step>,
    writing: ScopedJoinHandle<'scope, Result<Recorder, SimError>>,
}

impl<'scope> RecorderThread<'scope> {
    /// Starts the thread.
    pub(crate) fn start(scope: &'scope Scope<'scope, '_>, mut recorder: Recorder) -> Self {
        let (batches, received) = sync_channel::<Vec<Step>>(WAITING);
        let writing = scope.spawn(move || {
            for Step {
                index,
                sample,
                state,
            } in received.into_iter().flatten()
            {
                recorder.write(index, &sample, &state)?;
            }
            Ok(recorder)
        });
        Self {
            batches,
            batch: Vec::with_capacity(BATCH),
            writing,
        }
    }

    /// Writes the sample of the step `index`; `state` is the state at its time. Returns false where
    /// the log cannot be written any more; [`join`](Self::join) returns the error.
    pub(crate) fn write(&mut self, index: u64, sample: &Sample, state: &State) -> bool {
        self.batch.push(Step {
            index,
            sample: sample.clone(),
            state: state.clone(),
        });
        if self.batch.len() < BATCH {
            return true;
        }
        let batch = std::mem::replace(&mut self.batch, Vec::with_capacity(BATCH));
        self.batches.send(batch).is_ok()
    }

    /// Waits until all steps are written, and returns the recorder.
    ///
    /// # Errors
    /// Returns [`SimError::Log`] if the log cannot be written.
    pub(crate) fn join(self) -> Result<Recorder, SimError> {
        // Where the thread has ended early, its own error is returned below.
        let _ = self.batches.send(self.batch);
        drop(self.batches);
        match self.writing.join() {
            Ok(recorder) => recorder,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}
