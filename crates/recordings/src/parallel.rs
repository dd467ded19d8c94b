//! Work on several recordings at once, as many as there are cores. Each has up to three threads.

use std::num::NonZero;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread;

use crate::{Observer, Progress, RecordingError};

/// The progress of one recording, which waits for the observer's answer.
struct Report {
    index: usize,
    fraction: f64,
    answer: SyncSender<ControlFlow<()>>,
}

/// Calls `work` with the index of each of `count` recordings, on as many threads as there are
/// cores, and returns the results in the order of the recordings: up to the first error, which is
/// returned, or up to the first one that `is_last` accepts.
///
/// The observer is called on this thread, with the fraction of all recordings. Where it stops the
/// work, recordings that are begun later are stopped at their first report. None is begun after a
/// recording with an error.
pub(crate) fn in_parallel<T: Send>(
    count: usize,
    observer: &mut Observer<'_>,
    work: impl Fn(usize, &mut Observer<'_>) -> Result<T, RecordingError> + Sync,
    is_last: impl Fn(&T) -> bool + Sync,
) -> Result<Vec<T>, RecordingError> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let (next, end) = (AtomicUsize::new(0), AtomicUsize::new(count));
    let results: Mutex<Vec<Option<Result<T, RecordingError>>>> =
        Mutex::new((0..count).map(|_| None).collect());
    let worker = |reports: Sender<Report>| {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= end.load(Ordering::Relaxed) {
                return;
            }
            let result = work(index, &mut |progress| ask(&reports, index, progress));
            if result.as_ref().map_or(true, &is_last) {
                end.fetch_min(index, Ordering::Relaxed);
            }
            let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
            results[index] = Some(result);
        }
    };
    thread::scope(|scope| {
        let (reports, received) = channel();
        for _ in 0..threads.min(count) {
            let reports = reports.clone();
            scope.spawn(|| worker(reports));
        }
        drop(reports);
        serve(received, count, &end, observer);
    });
    let mut found = Vec::new();
    let results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    for result in results.into_iter().flatten() {
        let result = result?;
        let ends = is_last(&result);
        found.push(result);
        if ends {
            break;
        }
    }
    Ok(found)
}

/// Reports progress, and returns the observer's answer.
fn ask(reports: &Sender<Report>, index: usize, progress: Progress) -> ControlFlow<()> {
    let (answer, answered) = sync_channel(1);
    let fraction = progress.fraction;
    let report = Report {
        index,
        fraction,
        answer,
    };
    let sent = reports.send(report).is_ok();
    let answer = sent.then(|| answered.recv().ok()).flatten();
    answer.unwrap_or(ControlFlow::Break(()))
}

/// Answers all reports until the work is done. Recordings that follow the `end` are stopped: their
/// results are not used.
fn serve(received: Receiver<Report>, count: usize, end: &AtomicUsize, observer: &mut Observer<'_>) {
    let mut fractions = vec![0.0; count];
    let mut is_stopped = false;
    for report in received {
        fractions[report.index] = report.fraction;
        let fraction = fractions.iter().sum::<f64>() / count as f64;
        is_stopped = is_stopped || observer(Progress { fraction }).is_break();
        let answer = if is_stopped || report.index > end.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        };
        // Nobody waits for an answer any more only where the work has panicked.
        let _ = report.answer.send(answer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Results are in the order of the recordings, whatever the order in which they are done, and
    /// end with the first that is the last one.
    #[test]
    fn results_are_in_order() {
        let work = |index: usize, _: &mut Observer<'_>| {
            thread::sleep(std::time::Duration::from_millis(3 * (5 - index as u64)));
            Ok(index)
        };
        let observer = &mut |_| ControlFlow::Continue(());
        let all = in_parallel(5, observer, work, |_| false).unwrap();
        assert_eq!(all, [0, 1, 2, 3, 4]);
        let some = in_parallel(5, observer, work, |index| *index >= 2).unwrap();
        assert_eq!(some, [0, 1, 2]);
        assert!(
            in_parallel(0, observer, work, |_| false)
                .unwrap()
                .is_empty()
        );
    }

    /// The first error in the order of the recordings is returned, whichever comes first in time.
    #[test]
    fn the_first_error_is_returned() {
        let work = |index: usize, _: &mut Observer<'_>| match index {
            1 => {
                thread::sleep(std::time::Duration::from_millis(20));
                Err(RecordingError::Interrupted)
            }
            2 => Err(RecordingError::data("none")),
            _ => Ok(index),
        };
        let error = in_parallel(6, &mut |_| ControlFlow::Continue(()), work, |_| false);
        assert!(matches!(error, Err(RecordingError::Interrupted)));
    }

    /// The observer sees the mean of all fractions, and stops all that work.
    #[test]
    fn the_observer_stops_all() {
        let work = |_: usize, observer: &mut Observer<'_>| {
            let steps = (0..=10).map(|step| f64::from(step) / 10.0);
            let stopped = steps
                .map(|fraction| observer(Progress { fraction }))
                .any(|answer| answer.is_break());
            Ok(stopped)
        };
        let mut fractions = Vec::new();
        let mut observer = |progress: Progress| {
            fractions.push(progress.fraction);
            if progress.fraction > 0.3 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let stopped = in_parallel(3, &mut observer, work, |stopped| *stopped).unwrap();
        assert_eq!(stopped.last(), Some(&true));
        assert_eq!(stopped.iter().filter(|stopped| **stopped).count(), 1);
        assert!(fractions.is_sorted() && fractions.iter().all(|f| *f <= 0.4));
    }
}
