//! The unloaded recording: search of the shift in time at which it has the same motion, and
//! subtraction of its efforts.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::sync::Arc;

use tactid_dynamics::{JointKind, Manipulator};
use tactid_logs::LogReader;

use crate::alignment::{Aligned, Event, Measured};
use crate::angles::Angles;
use crate::cut::Cut;
use crate::decode::Decoding;
use crate::feed::{Feed, Unloaded};
use crate::progress::{check_interruption, open_log};
use crate::same_log::same_log;
use crate::sources::{LogSources, MeasuredTopics, MotionTopics, joint_topics};
use crate::{Method, Observer, RecordingError, Request};

/// Why a recording is not its own unloaded reference.
pub(crate) const NO_LOAD: &str = "no load is left without its own efforts";

/// Step of the grid on which motions are compared at first, s.
const COARSE_S: f64 = 0.05;
/// Length of the beginning that is compared at full rate, s.
const FINE_S: f64 = 60.0;
/// Number of instants of the loaded motion that are compared.
const COMPARED: usize = 2000;
/// Fraction of the shorter recording that both must share.
const SHARED: f64 = 0.5;
/// Largest number of Gauss-Newton steps to the shift, which converge in three or four.
const FINE_STEPS: usize = 8;
/// A shift that moves by less has converged, s.
const CONVERGED_S: f64 = 1e-9;
/// Largest rms difference of a joint between the loaded and the unloaded motion, rad or m.
const SAME_MOTION: f64 = 0.02;

/// Positions of all joints over time.
type Motion = Vec<(f64, Vec<f64>)>;

/// Finds the joints of an unloaded recording by the robot of the loaded one, and the shift in time
/// at which the motions agree. The paths are those of the loaded and of the unloaded recording.
pub(crate) fn find_unloaded(
    [loaded_path, path]: [&Path; 2],
    (loaded_log, loaded, loaded_decoding): (&LogReader, &LogSources, &Arc<Decoding>),
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Unloaded, RecordingError> {
    let MotionTopics::Joints { joints, .. } = &loaded.topics.motion else {
        return Err(RecordingError::unloaded_needs_effort());
    };
    if loaded.options.method() != Method::Effort {
        return Err(RecordingError::unloaded_needs_effort());
    }
    let same_recording = || RecordingError::same_recording([loaded_path, path], NO_LOAD);
    if same_log(&[loaded_path, path]).is_some() {
        return Err(same_recording());
    }
    let log = open_log(path, observer).map_err(|error| match error {
        RecordingError::Log(error) => RecordingError::UnloadedLog(error),
        error => error,
    })?;
    let topics = joint_topics(&log, request)?;
    let sources = LogSources {
        topics: MeasuredTopics {
            motion: MotionTopics::Joints {
                joints: topics.clone(),
                base_odometry: None,
                base_imu: None,
            },
            ..loaded.topics.clone()
        },
        ..loaded.clone()
    };
    let decoding = Arc::new(Decoding::new(&log, &sources, request)?);
    if decoding.joint_publishers() > 1 {
        return Err(RecordingError::data_of(
            "unloaded",
            format!(
                "the joint states of the unloaded recording come from several publishers, but must come from one: record \
                 the unloaded motion with one publisher of all joints; topics: {}",
                topics.join(", ")
            ),
        ));
    }
    let mut ours = Motions::new(&loaded.robot);
    ours.read(loaded_log, joints, loaded_decoding, observer)?;
    let mut theirs = Motions::new(&loaded.robot);
    theirs.read(&log, &topics, &decoding, observer)?;
    if ours.content.finish() == theirs.content.finish() {
        return Err(same_recording());
    }
    Ok(Unloaded {
        log,
        topics,
        decoding,
        shift_s: ours.shift_s(&theirs)?,
    })
}

/// The motion of the joints over a recording.
pub(crate) struct Motions {
    angles: Angles,
    /// At most one instant in [`COARSE_S`].
    coarse: Motion,
    /// Every instant of the first [`FINE_S`].
    fine: Motion,
    /// Hash of all positions and efforts, bit by bit, which a copy of the recording has, too.
    content: DefaultHasher,
}

impl Motions {
    /// Creates the motion of a robot, of which there is nothing yet.
    pub(crate) fn new(robot: &Manipulator) -> Self {
        Self {
            angles: Angles::new(robot),
            coarse: Motion::new(),
            fine: Motion::new(),
            content: DefaultHasher::new(),
        }
    }

    /// Adds the motion and the content of a log.
    fn read(
        &mut self,
        log: &LogReader,
        topics: &[String],
        decoding: &Arc<Decoding>,
        observer: &mut Observer<'_>,
    ) -> Result<(), RecordingError> {
        let mut feed = Feed::new(log, topics, decoding, f64::INFINITY, None, Cut::WHOLE)?;
        let mut events: Vec<Event> = Vec::new();
        while feed.read(&mut events)?.is_some() {
            check_interruption(observer)?;
            for event in events.drain(..) {
                if let Measured::Joints(values) = event.measured {
                    self.add(event.time_s, &values.position);
                    let numbers = values.position.iter().chain(&values.effort);
                    numbers.for_each(|number| number.to_bits().hash(&mut self.content));
                }
            }
        }
        Ok(())
    }

    /// Adds the positions of all joints at a time, s. Times are in order.
    pub(crate) fn add(&mut self, time_s: f64, position: &[f64]) {
        let last = self.coarse.last();
        if last.is_none_or(|(last_s, _)| time_s >= last_s + COARSE_S) {
            self.coarse.push((time_s, position.to_vec()));
        }
        if time_s < FINE_S {
            self.fine.push((time_s, position.to_vec()));
        }
    }

    /// Returns the time to add to another motion's times at which the motions agree best, s.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] if they share too few instants to be compared.
    pub(crate) fn shift_s(&self, other: &Self) -> Result<f64, RecordingError> {
        let angles = &self.angles;
        let coarse_s = coarse_shift_s(angles, &self.coarse, &other.coarse);
        let coarse_s = coarse_s.ok_or_else(|| {
            RecordingError::data_of(
                "unloaded",
                "the loaded and the unloaded recording have too few joint states at the same points of the motion to be \
                 compared: record the whole motion once more without the payload",
            )
        })?;
        Ok(fine_shift_s(angles, &self.fine, &other.fine, coarse_s))
    }
}

/// Returns positions and velocities at a time, on the line between two instants.
fn at(angles: &Angles, motion: &Motion, time_s: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let right = motion.partition_point(|(t, _)| *t <= time_s);
    let (before_s, before) = motion.get(right.checked_sub(1)?)?;
    let (after_s, after) = motion.get(right)?;
    let length_s = after_s - before_s;
    let fraction = (time_s - before_s) / length_s;
    let changes = || angles.changes(before, after);
    let positions = before.iter().zip(changes());
    Some((
        positions.map(|(a, change)| a + change * fraction).collect(),
        changes().map(|change| change / length_s).collect(),
    ))
}

/// Returns the shift on the coarse grid at which the motions differ least.
fn coarse_shift_s(angles: &Angles, ours: &Motion, theirs: &Motion) -> Option<f64> {
    let (first, last) = (ours.first()?.0, ours.last()?.0);
    let (their_first, their_last) = (theirs.first()?.0, theirs.last()?.0);
    let shared_s = SHARED * (last - first).min(their_last - their_first);
    let every = ours.len().div_ceil(COMPARED).max(1);
    let compared: Vec<_> = ours.iter().step_by(every).collect();
    let enough = (shared_s / (last - first).max(1e-9) * compared.len() as f64) as usize;
    let lowest = first - their_last + shared_s;
    let highest = last - their_first - shared_s;
    let steps = ((highest - lowest) / COARSE_S).ceil().max(0.0) as usize;
    let mut best = None;
    for step in 0..=steps {
        let shift_s = lowest + step as f64 * COARSE_S;
        let (squares, count) = difference(angles, &compared, theirs, shift_s);
        if count > enough.saturating_sub(2).max(2) {
            let mean = squares / count as f64;
            if best.is_none_or(|(least, _)| mean < least) {
                best = Some((mean, shift_s));
            }
        }
    }
    best.map(|(_, shift_s)| shift_s)
}

/// Returns the sum of the squared differences of the positions with a shift, and the number of
/// instants that both motions have.
fn difference(
    angles: &Angles,
    compared: &[&(f64, Vec<f64>)],
    theirs: &Motion,
    shift_s: f64,
) -> (f64, usize) {
    let (mut squares, mut count) = (0.0, 0);
    for (time_s, position) in compared {
        if let Some((their, _)) = at(angles, theirs, time_s - shift_s) {
            let changes = angles.changes(&their, position);
            squares += changes.map(|change| change * change).sum::<f64>();
            count += 1;
        }
    }
    (squares, count)
}

/// Returns the shift at which the motions differ least, by Gauss-Newton steps from one that is
/// right to the grid.
fn fine_shift_s(angles: &Angles, ours: &Motion, theirs: &Motion, mut shift_s: f64) -> f64 {
    for _ in 0..FINE_STEPS {
        let (mut slope, mut square) = (0.0, 0.0);
        for (time_s, position) in ours {
            if let Some((their, rate)) = at(angles, theirs, time_s - shift_s) {
                for (change, rate) in angles.changes(&their, position).zip(&rate) {
                    slope += change * rate;
                    square += rate * rate;
                }
            }
        }
        if square == 0.0 {
            break;
        }
        let step = (slope / square).clamp(-COARSE_S, COARSE_S);
        shift_s -= step;
        if step.abs() < CONVERGED_S {
            break;
        }
    }
    shift_s
}

/// Subtraction of the efforts of the unloaded arm, with the difference between the two motions,
/// which must be small.
pub(crate) struct UnloadedSubtraction {
    angles: Angles,
    /// Sum of the squared differences of the position of each joint, rad² or m².
    squares: Vec<f64>,
    /// Number of samples from which efforts were subtracted.
    count: u64,
}

impl UnloadedSubtraction {
    pub(crate) fn new(robot: &Manipulator) -> Self {
        Self {
            angles: Angles::new(robot),
            squares: vec![0.0; robot.dof()],
            count: 0,
        }
    }

    /// Subtracts the efforts of the unloaded arm at the same point of the same motion, if it was
    /// recorded.
    pub(crate) fn subtract(&mut self, aligned: &mut Aligned) {
        let Some(unloaded) = &aligned.unloaded else {
            return;
        };
        let pairs = aligned.joints.effort.iter_mut().zip(&unloaded.effort);
        for (effort, unloaded) in pairs {
            *effort -= unloaded;
        }
        self.count += 1;
        let (from, to) = (&unloaded.position, &aligned.joints.position);
        let changes = self.angles.changes(from, to);
        for (square, change) in self.squares.iter_mut().zip(changes) {
            *square += change * change;
        }
    }

    /// Checks that the unloaded recording has the same motion.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] with the joint that differs most if it does so by more than
    /// [`SAME_MOTION`].
    pub(crate) fn check_motion(&self, robot: &Manipulator) -> Result<(), RecordingError> {
        let squares = self.squares.iter().enumerate();
        let Some((joint, square)) = squares.max_by(|a, b| a.1.total_cmp(b.1)) else {
            return Ok(());
        };
        let rms = (square / self.count.max(1) as f64).sqrt();
        if rms <= SAME_MOTION {
            return Ok(());
        }
        let unit = match robot.joint_kind(joint) {
            Some(JointKind::Prismatic) => "m",
            Some(JointKind::Revolute) | None => "rad",
        };
        let name = &robot.joint_names()[joint];
        Err(RecordingError::data_of(
            "unloaded",
            format!(
                "the unloaded recording has another motion: joint `{name}` differs by {rms:.3} {unit} rms, where \
                 {SAME_MOTION} {unit} is allowed; repeat the commanded motion of the loaded recording without the payload"
            ),
        ))
    }
}
