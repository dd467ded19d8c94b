//! First fit: least squares with weak priors, for torques of load-dependent friction and scales.

use nalgebra::{DMatrix, DVector};

use super::arm::PLAIN;
use super::payload::KnownPayload;
use super::recording::EffortRecording;
use super::rows::dot;
use crate::CalibrateError;

/// Least mass of a link in the prior, kg, and the distance that forms its moments and inertia, m.
const LEAST_MASS_KG: f64 = 0.5;
const LINK_LENGTH_M: f64 = 0.15;

/// Standard deviation of the prior, in units of the residual: weak, but equations become solvable.
const WEAKNESS: f64 = 0.02;

/// Least friction of a joint, a fraction of the range of its effort.
const LEAST_FRICTION: f64 = 0.003;

/// Least range of a joint's effort, as a fraction of the largest of all: a constant has none.
const LEAST_RANGE: f64 = 1e-4;

/// Result of the first fit.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    /// Rms torque of each joint, N m or N; positive.
    pub(crate) torques: Vec<f64>,
    /// Friction of each joint at its largest velocity, N m or N; positive.
    pub(crate) friction: Vec<f64>,
}

/// Returns the size of the ten parameters of each link in a prior, in their units.
pub(crate) fn link_sizes(described: &[f64]) -> Vec<f64> {
    let of_link = |link: &[f64]| {
        let mass = link[0].max(LEAST_MASS_KG);
        let sizes: [f64; 10] = std::array::from_fn(|k| match k {
            0 => mass,
            1..=3 => mass * LINK_LENGTH_M,
            _ => mass * LINK_LENGTH_M * LINK_LENGTH_M,
        });
        sizes
    };
    described.chunks(10).flat_map(of_link).collect()
}

/// Fits links, offsets, viscous and Coulomb friction and rotors of all joints to recordings.
pub(crate) fn reference_fit(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
) -> Result<Reference, CalibrateError> {
    let arm = &recordings[0].0.arm;
    let ranges = effort_ranges(recordings)?;
    let (links, joints) = (arm.described.len(), arm.joints.len());
    let sizes = link_sizes(&arm.described);
    let size = |k: usize| match k.checked_sub(links) {
        Some(place) => ranges[place / 4],
        None => sizes[k],
    };
    let count = links + 4 * joints;
    let mut matrix = DMatrix::from_diagonal(&DVector::from_element(count, WEAKNESS * WEAKNESS));
    let mut rhs = DVector::zeros(count);
    let mut row = Vec::with_capacity(count);
    for (recording, window, joint, held) in rows_of(recordings) {
        let columns = recording.columns(window, joint);
        let first = 10 * arm.first_links[joint];
        let rest = [
            1.0,
            columns.velocity,
            columns.friction[PLAIN],
            columns.acceleration,
        ];
        row.clear();
        let entries = columns.links.iter().enumerate();
        row.extend(entries.map(|(k, entry)| (first + k, *entry)));
        row.extend((0..4).map(|k| (links + 4 * joint + k, rest[k])));
        for (k, entry) in &mut row {
            *entry *= size(*k) / ranges[joint];
        }
        let of_payload = held.map_or(0.0, |held| {
            columns.payload.dot(held.parameters().as_vector())
        });
        let target =
            (recording.effort(window, joint, 0.0) - columns.described - of_payload) / ranges[joint];
        for (i, a) in &row {
            for (k, b) in &row {
                matrix[(*i, *k)] += a * b;
            }
            rhs[*i] += a * target;
        }
    }
    let solution = matrix
        .cholesky()
        .ok_or_else(CalibrateError::unsolvable)?
        .solve(&rhs);
    let fitted = |k: usize| solution[k] * size(k);
    let reference_links: Vec<f64> = (0..links).map(|k| arm.described[k] + fitted(k)).collect();
    let friction = (0..joints).map(|joint| {
        let [viscous, coulomb] = [1, 2].map(|k| fitted(links + 4 * joint + k).abs());
        let fastest = fastest(recordings, joint);
        (coulomb + viscous * fastest).max(LEAST_FRICTION * ranges[joint])
    });
    Ok(Reference {
        torques: rms_torques(recordings, &reference_links, &ranges),
        friction: friction.collect(),
    })
}

/// Returns the largest velocity of a joint's window means, rad/s or m/s.
fn fastest(recordings: &[(&EffortRecording, Option<KnownPayload>)], joint: usize) -> f64 {
    let velocities = recordings
        .iter()
        .map(|(recording, _)| recording.max_velocities(joint));
    velocities.flatten().fold(0.0, f64::max)
}

/// Returns all windows of all joints: recording, indices of window and joint, and the payload.
fn rows_of<'a>(
    recordings: &'a [(&'a EffortRecording, Option<KnownPayload>)],
) -> impl Iterator<Item = (&'a EffortRecording, usize, usize, Option<&'a KnownPayload>)> {
    recordings.iter().flat_map(|(recording, held)| {
        let joints = recording.arm.joints.len();
        let pairs = (0..recording.windows() * joints).map(move |k| (k / joints, k % joints));
        pairs.map(move |(window, joint)| (*recording, window, joint, held.as_ref()))
    })
}

/// Returns the largest distance of each joint's effort from its mean, N m or N.
fn effort_ranges(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
) -> Result<Vec<f64>, CalibrateError> {
    let joints = recordings[0].0.arm.joints.len();
    let mut sums = vec![(0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY); joints];
    for (recording, window, joint, _) in rows_of(recordings) {
        let effort = recording.effort(window, joint, 0.0);
        let (count, sum, low, high) = sums[joint];
        sums[joint] = (count + 1.0, sum + effort, low.min(effort), high.max(effort));
    }
    let range = |(count, sum, low, high): (f64, f64, f64, f64)| {
        let mean = sum / count;
        (high - mean).max(mean - low)
    };
    let ranges: Vec<f64> = sums.into_iter().map(range).collect();
    let largest = ranges.iter().copied().fold(0.0, f64::max);
    if largest == 0.0 {
        return Err(CalibrateError::no_efforts());
    }
    let least = LEAST_RANGE * largest;
    Ok(ranges.into_iter().map(|range| range.max(least)).collect())
}

/// Returns the rms torque of each joint, at least a little of the range of its effort.
fn rms_torques(
    recordings: &[(&EffortRecording, Option<KnownPayload>)],
    reference_links: &[f64],
    ranges: &[f64],
) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); ranges.len()];
    for (recording, window, joint, _) in rows_of(recordings) {
        let columns = recording.columns(window, joint);
        let first = 10 * recording.arm.first_links[joint];
        let others = columns.described - dot(columns.links, &recording.arm.described[first..]);
        let torque = others + dot(columns.links, &reference_links[first..]);
        sums[joint].0 += 1.0;
        sums[joint].1 += torque * torque;
    }
    let rms = sums
        .iter()
        .map(|(count, sum): &(f64, f64)| (sum / count).sqrt());
    let pairs = rms.zip(ranges);
    pairs
        .map(|(rms, range)| rms.max(LEAST_FRICTION * range))
        .collect()
}
