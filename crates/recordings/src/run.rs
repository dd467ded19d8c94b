//! Runs through a recording: events in, an estimator fed.

use std::ops::ControlFlow;
use std::sync::mpsc::{self, SyncSender, channel, sync_channel};
use std::thread;

use tactid_batch::BatchIdentifier;
use tactid_calibrate::EffortRecorder;
use tactid_identify::Sample;

use crate::alignment::{Aligned, Aligner, Event};
use crate::channel_ranges::ChannelRanges;
use crate::fault::{FaultCounts, FaultKind};
use crate::plan::Plan;
use crate::recording::{Reading, Recording};
use crate::steps::Steps;
use crate::unloaded::UnloadedSubtraction;
use crate::unloaded_scale::UnloadedScale;
use crate::wrench_channels::WrenchChannels;
use crate::{Finding, Observer, Progress, RecordingError};

/// Topic of the fault that a sample could not be aligned.
const SAMPLES: &str = "samples";

/// Number of samples that go from the aligning to the estimating thread at a time.
const BATCH: usize = 512;
/// Number of batches that may wait.
const BATCHES: usize = 4;

/// What receives the samples of a run.
pub(crate) trait Receiver: Send {
    /// Number of times that the recording is presented.
    fn epochs(&self) -> u32 {
        1
    }

    /// Receives the next sample.
    fn push(&mut self, sample: &Sample<'_>) -> Result<(), RecordingError>;

    /// Prepares for the same samples once more, of which the last was at `end_s`.
    fn rewind(&mut self, _end_s: f64) {}
}

impl Receiver for EffortRecorder {
    fn push(&mut self, sample: &Sample<'_>) -> Result<(), RecordingError> {
        self.push(sample)?;
        Ok(())
    }
}

impl Receiver for BatchIdentifier {
    fn push(&mut self, sample: &Sample<'_>) -> Result<(), RecordingError> {
        self.push(sample)?;
        Ok(())
    }
}

/// What was counted and noticed while a recording was run through.
pub(crate) struct Run {
    /// Number of aligned samples of the last presentation.
    pub(crate) samples: u64,
    /// Time from the first aligned sample to the last, s.
    pub(crate) duration_s: f64,
    /// The part of it between samples without a gap, s.
    pub(crate) bridged_s: f64,
    pub(crate) faults: FaultCounts,
    pub(crate) findings: Vec<Finding>,
    pub(crate) damage: Vec<String>,
    pub(crate) interrupted: bool,
}

impl Run {
    /// Presents a recording to a receiver, as often as that needs it.
    ///
    /// # Errors
    /// Returns [`RecordingError::Log`] if the recording cannot be read,
    /// [`RecordingError::Identify`] if a setting or a sample does not fit the robot, and
    /// [`RecordingError::Data`] if all efforts are zero or the unloaded recording has another motion.
    pub(crate) fn new(
        recording: &impl Recording,
        plan: &Plan<'_>,
        receiver: &mut impl Receiver,
        observer: &mut Observer<'_>,
    ) -> Result<Self, RecordingError> {
        let epochs = receiver.epochs();
        let mut epoch = 0;
        loop {
            let progress = &mut |fraction| {
                let fraction = (f64::from(epoch) + fraction) / f64::from(epochs);
                observer(Progress { fraction })
            };
            let (pass, reading) = present(recording, plan, receiver, progress)?;
            epoch += 1;
            if reading.interrupted || epoch >= epochs {
                pass.ranges.check_efforts(plan.sources)?;
                if plan.streams.unloaded {
                    pass.unloaded.check_motion(&plan.sources.robot)?;
                }
                let totals = pass.totals(plan);
                return Ok(Self::of_pass(totals, reading));
            }
            let end_s = pass.last_s;
            receiver.rewind(end_s);
        }
    }

    /// Returns what was noticed about the recording before anything was estimated: by its sources,
    /// its plan and its samples.
    pub(crate) fn noticed(&self, plan: &Plan<'_>) -> Vec<Finding> {
        [&plan.sources.findings, &plan.findings, &self.findings]
            .into_iter()
            .flatten()
            .cloned()
            .collect()
    }

    fn of_pass(totals: Totals, reading: Reading) -> Self {
        let mut faults = reading.faults;
        if totals.incomplete > 0 {
            faults.add_many(SAMPLES, FaultKind::Incomplete, totals.incomplete, f64::NAN);
        }
        let mut findings = reading.findings;
        findings.extend(totals.findings);
        Self {
            samples: totals.samples,
            duration_s: totals.duration_s,
            bridged_s: totals.bridged_s,
            faults,
            findings,
            damage: reading.damage,
            interrupted: reading.interrupted,
        }
    }
}

/// Presents a recording once: the samples are aligned on this thread, and received on another.
fn present(
    recording: &impl Recording,
    plan: &Plan<'_>,
    receiver: &mut impl Receiver,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<(Pass, Reading), RecordingError> {
    thread::scope(|scope| {
        let (batches, received) = sync_channel::<Vec<Aligned>>(BATCHES);
        let (used, returned) = channel();
        let receiving = scope.spawn(move || -> Result<(), RecordingError> {
            for batch in received {
                for aligned in &batch {
                    receiver.push(&aligned.sample())?;
                }
                // At the end, it is not needed any more.
                let _ = used.send(batch);
            }
            Ok(())
        });
        let mut pass = Pass::new(plan);
        let mut samples = Samples {
            batches,
            returned,
            batch: Vec::with_capacity(BATCH),
            count: 0,
        };
        let take = &mut |event| pass.take(event, &mut samples);
        let reading = recording.read(plan.selection(), take, progress);
        samples.finish();
        let received = receiving.join();
        received.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        Ok((pass, reading?))
    })
}

/// The aligned samples on their way to the receiver.
struct Samples {
    batches: SyncSender<Vec<Aligned>>,
    /// The batches that the receiver has used, whose memory the next ones reuse.
    returned: mpsc::Receiver<Vec<Aligned>>,
    /// The samples so far, `count` of them, then places of former ones.
    batch: Vec<Aligned>,
    count: usize,
}

impl Samples {
    /// Returns the place of the next sample.
    fn place(&mut self) -> &mut Aligned {
        if self.count == self.batch.len() {
            self.batch.push(Aligned::empty());
        }
        &mut self.batch[self.count]
    }

    /// Adds the sample that was written to the place of the next one.
    ///
    /// # Errors
    /// Returns [`RecordingError::Interrupted`] if the receiver has ended with an error of its own,
    /// which replaces this one.
    fn push(&mut self) -> Result<(), RecordingError> {
        self.count += 1;
        if self.count < BATCH {
            return Ok(());
        }
        self.count = 0;
        let next = self.returned.try_recv().unwrap_or_default();
        let sent = self.batches.send(std::mem::replace(&mut self.batch, next));
        sent.map_err(|_| RecordingError::Interrupted)
    }

    /// Sends the last samples.
    fn finish(mut self) {
        self.batch.truncate(self.count);
        // Where the receiver has ended with an error, they are not needed.
        let _ = self.batches.send(self.batch);
    }
}

/// One presentation of a recording.
struct Pass {
    aligner: Aligner,
    channels: WrenchChannels,
    ranges: ChannelRanges,
    steps: Steps,
    unloaded: UnloadedSubtraction,
    unloaded_scale: UnloadedScale,
    samples: u64,
    first_s: f64,
    last_s: f64,
    max_gap_s: f64,
    bridged_s: f64,
}

/// What is counted in a presentation.
struct Totals {
    samples: u64,
    duration_s: f64,
    bridged_s: f64,
    incomplete: u64,
    findings: Vec<Finding>,
}

impl Pass {
    fn new(plan: &Plan<'_>) -> Self {
        Self {
            aligner: Aligner::new(
                plan.streams.clone(),
                &plan.sources.robot,
                plan.delay_s,
                plan.equations.max_gap_s,
            ),
            channels: WrenchChannels::new(
                plan.sources,
                &plan.tip,
                &plan.equations,
                &plan.unmeasured,
            ),
            ranges: ChannelRanges::new(plan.sources, &plan.tip),
            steps: Steps::new(plan.sources),
            unloaded: UnloadedSubtraction::new(&plan.sources.robot),
            unloaded_scale: UnloadedScale::new(plan),
            samples: 0,
            first_s: 0.0,
            last_s: 0.0,
            max_gap_s: plan.equations.max_gap_s,
            bridged_s: 0.0,
        }
    }

    fn take(&mut self, event: Event, samples: &mut Samples) -> Result<(), RecordingError> {
        self.channels.push(&event);
        self.ranges.push(&event);
        self.steps.push(&event);
        self.aligner.push(event);
        loop {
            let aligned = samples.place();
            if !self.aligner.next_into(aligned) {
                return Ok(());
            }
            if let Some(unloaded) = &aligned.unloaded {
                self.unloaded_scale.push(unloaded);
            }
            self.unloaded.subtract(aligned);
            let passed_s = aligned.time_s - self.last_s;
            if self.samples == 0 {
                self.first_s = aligned.time_s;
            } else if passed_s <= self.max_gap_s {
                self.bridged_s += passed_s;
            }
            self.samples += 1;
            self.last_s = aligned.time_s;
            samples.push()?;
        }
    }

    fn totals(&self, plan: &Plan<'_>) -> Totals {
        let mut findings = self.steps.findings(plan.sources);
        findings.extend(self.channels.findings(f64::INFINITY, plan.sources));
        findings.extend(self.ranges.findings(plan.sources));
        let joints = plan.sources.robot.joint_names();
        findings.extend(self.unloaded_scale.finding(joints));
        Totals {
            findings,
            samples: self.samples,
            duration_s: self.last_s - self.first_s,
            bridged_s: self.bridged_s,
            incomplete: self.aligner.incomplete(),
        }
    }
}
