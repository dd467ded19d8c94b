//! The recording of the same motion without the payload, and when it began.

use std::path::Path;

use tactid_logs::LogReader;

use super::decode::Decoder;
use super::feed::Feed;
use super::request::Request;
use super::sources::Sources;
use super::streams::{Event, Measured};
use super::{Observer, look_up};
use crate::{IdentifyError, Method};

/// Grid on which motions are compared at first, s.
const COARSE_S: f64 = 0.05;
/// How much of the beginning is compared at full rate, s.
const FINE_S: f64 = 60.0;
/// How many instants of the loaded motion are compared.
const COMPARED: usize = 2000;
/// The recordings must share this part of the shorter one.
const SHARED: f64 = 0.5;

/// A bare recording, and where it lies on the loaded one's clock.
pub(crate) struct Unloaded {
    pub(crate) log: LogReader,
    pub(crate) decoder: Decoder,
    /// To be added to the bare recording's times, s.
    pub(crate) shift_s: f64,
}

/// Positions of all joints over time.
type Motion = Vec<(f64, Vec<f64>)>;

impl Unloaded {
    pub(crate) fn find(
        path: &Path,
        loaded_log: &LogReader,
        loaded: &Decoder,
        request: &Request,
        observer: &mut Observer<'_>,
    ) -> Result<Self, IdentifyError> {
        if loaded.sources().method != Method::Effort {
            return Err(IdentifyError::UnloadedNeedsEffort);
        }
        let log = LogReader::open(path)?;
        let mut request = request.clone();
        request.method = Some(Method::Effort);
        let mut sources = Sources::find(&log, &request).or_else(|error| match error {
            // The robot is described in the loaded recording.
            IdentifyError::NoUrdf(_) => {
                let mut sources = loaded.sources().clone();
                sources.motion = super::sources::Motion::Joints(super::sources::joint_topics(
                    &log,
                    &request.topics.joints,
                )?);
                Ok(sources)
            }
            error => Err(error),
        })?;
        sources.robot = loaded.sources().robot.clone();
        sources.odometry = None;
        let decoder = Decoder::new(&log, sources, &request)?;
        if decoder.groups().places.len() > 1 {
            return Err(IdentifyError::SeveralTopics {
                what: "joint states, which a unloaded recording must have in one",
                topics: decoder.sources().measured().join(", "),
                option: "--joints",
            });
        }
        let ours = Motions::read(loaded_log, loaded, observer)?;
        let theirs = Motions::read(&log, &decoder, observer)?;
        let shift_s = coarse_shift_s(&ours.coarse, &theirs.coarse).ok_or(
            IdentifyError::NoOverlap("the loaded and the unloaded motion".to_owned()),
        )?;
        Ok(Self {
            log,
            decoder,
            shift_s: fine_shift_s(&ours.fine, &theirs.fine, shift_s),
        })
    }
}

/// The joints' motion over a log.
struct Motions {
    /// At most one instant in [`COARSE_S`].
    coarse: Motion,
    /// Every instant of the first [`FINE_S`].
    fine: Motion,
}

impl Motions {
    fn read(
        log: &LogReader,
        decoder: &Decoder,
        observer: &mut Observer<'_>,
    ) -> Result<Self, IdentifyError> {
        let mut feed = Feed::new(log, decoder.clone())?;
        let mut events: Vec<Event> = Vec::new();
        let mut motions = Self {
            coarse: Motion::new(),
            fine: Motion::new(),
        };
        let mut next_s = f64::NEG_INFINITY;
        while feed.read(&mut events)?.is_some() {
            look_up(observer)?;
            for event in events.drain(..) {
                let Measured::Joints(values) = event.what else {
                    continue;
                };
                if event.time_s >= next_s {
                    next_s = event.time_s + COARSE_S;
                    let position = values.position.clone();
                    motions.coarse.push((event.time_s, position));
                }
                if event.time_s < FINE_S {
                    motions.fine.push((event.time_s, values.position));
                }
            }
        }
        Ok(motions)
    }
}

/// The positions at a time, on the line between two instants.
fn at(motion: &Motion, time_s: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let right = motion.partition_point(|(t, _)| *t <= time_s);
    let (before_s, before) = motion.get(right.checked_sub(1)?)?;
    let (after_s, after) = motion.get(right)?;
    let length_s = after_s - before_s;
    let part = (time_s - before_s) / length_s;
    let pairs = || before.iter().zip(after);
    Some((
        pairs().map(|(a, b)| a + (b - a) * part).collect(),
        pairs().map(|(a, b)| (b - a) / length_s).collect(),
    ))
}

/// The shift on the coarse grid at which the motions differ least.
fn coarse_shift_s(ours: &Motion, theirs: &Motion) -> Option<f64> {
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
        let (mut squares, mut count) = (0.0, 0usize);
        for (time_s, position) in &compared {
            if let Some((their, _)) = at(theirs, time_s - shift_s) {
                squares += position
                    .iter()
                    .zip(&their)
                    .map(|(a, b)| (a - b).powi(2))
                    .sum::<f64>();
                count += 1;
            }
        }
        if count > enough.saturating_sub(2).max(2) {
            let mean = squares / count as f64;
            if best.is_none_or(|(least, _)| mean < least) {
                best = Some((mean, shift_s));
            }
        }
    }
    best.map(|(_, shift_s)| shift_s)
}

/// Gauss-Newton from a shift that is right to the grid.
fn fine_shift_s(ours: &Motion, theirs: &Motion, mut shift_s: f64) -> f64 {
    for _ in 0..8 {
        let (mut slope, mut square) = (0.0, 0.0);
        for (time_s, position) in ours {
            if let Some((their, rate)) = at(theirs, time_s - shift_s) {
                for ((a, b), rate) in position.iter().zip(&their).zip(&rate) {
                    slope += (a - b) * rate;
                    square += rate * rate;
                }
            }
        }
        if square == 0.0 {
            break;
        }
        let step = (slope / square).clamp(-COARSE_S, COARSE_S);
        shift_s -= step;
        if step.abs() < 1e-9 {
            break;
        }
    }
    shift_s
}
