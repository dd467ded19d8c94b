//! Times and the motion of the base.

use nalgebra::{Isometry3, Vector3};
use tactid_identify::{BaseState, states_of_poses};

use super::fields::Arrays;
use crate::clock::LONGEST_LATENESS_S;
use crate::fault::{FaultKind, check};

/// The samples whose times can be used.
pub(super) struct Timeline {
    /// Indices of all samples in the order of their times. Those that are no time, or come far too
    /// late, stay in their places.
    pub(super) order: Vec<usize>,
    /// Whether each sample was brought before others that came earlier.
    pub(super) is_late: Vec<bool>,
    /// Whether the time of each sample is far ahead of those that follow it.
    pub(super) is_ahead: Vec<bool>,
    /// Indices of the samples that come later than all usable ones before them in this order.
    pub(super) usable: Vec<usize>,
    /// Time from the first to the last of them, s.
    pub(super) length_s: f64,
    /// Mean time between two of them, s; `None` where there is one sample only.
    pub(super) period_s: Option<f64>,
}

/// Returns whether a time is later than another one, s: by a nanosecond, as in the stamps of logs.
/// What rounding makes of equal times is no step.
pub(super) fn is_later(time_s: f64, last_s: f64) -> bool {
    time_s - last_s >= 1e-9
}

impl Timeline {
    pub(super) fn new(times_s: &[f64]) -> Self {
        let is_ahead = far_ahead(times_s);
        let (order, is_late) = in_order(times_s, &is_ahead);
        let mut last_s = f64::NEG_INFINITY;
        let mut usable = Vec::with_capacity(times_s.len());
        for &k in &order {
            let time_s = times_s[k];
            if time_s.is_finite() && is_later(time_s, last_s) && !is_ahead[k] {
                last_s = time_s;
                usable.push(k);
            }
        }
        let first_s = usable.first().map_or(last_s, |&first| times_s[first]);
        let length_s = if usable.len() > 1 {
            last_s - first_s
        } else {
            0.0
        };
        let period_s = length_s / (usable.len().max(2) - 1) as f64;
        Self {
            order,
            is_late,
            is_ahead,
            usable,
            length_s,
            period_s: (period_s > 0.0 && period_s.is_finite()).then_some(period_s),
        }
    }
}

/// Returns for each of some times whether it is outside of the longest sequence of increasing times,
/// and ahead of the next one in it: by more than a time can be late, or at all where the times that
/// follow it are, as before a clock was set back.
fn far_ahead(times_s: &[f64]) -> Vec<bool> {
    // The last element of the sequence of each length that ends with the earliest time.
    let mut ends: Vec<usize> = Vec::new();
    let mut before = vec![None; times_s.len()];
    for k in (0..times_s.len()).filter(|&k| times_s[k].is_finite()) {
        let length = ends.partition_point(|&end| times_s[end] < times_s[k]);
        before[k] = length.checked_sub(1).map(|shorter| ends[shorter]);
        match ends.get_mut(length) {
            Some(end) if times_s[*end] == times_s[k] => {}
            Some(end) => *end = k,
            None => ends.push(k),
        }
    }
    let mut is_ahead = vec![false; times_s.len()];
    let (mut next, mut next_s) = (ends.last().copied(), f64::INFINITY);
    let mut is_run = false;
    for k in (0..times_s.len()).rev() {
        if next == Some(k) {
            (next, next_s, is_run) = (before[k], times_s[k], false);
        } else {
            let ahead_s = times_s[k] - next_s;
            is_run = ahead_s > LONGEST_LATENESS_S || (is_run && ahead_s > 0.0);
            is_ahead[k] = is_run;
        }
    }
    is_ahead
}

/// Returns the indices of samples in the order of their times, and whether each came late. Where
/// most do, times run backwards, and the order is that in which they are. Those far ahead, or far
/// too late, stay in their places, and so do those that follow the latter until they are later than
/// all before.
fn in_order(times_s: &[f64], is_ahead: &[bool]) -> (Vec<usize>, Vec<bool>) {
    let (mut newest_s, mut in_time) = (f64::NEG_INFINITY, 0);
    let mut is_late = vec![false; times_s.len()];
    let mut is_back = false;
    let mut places_s = Vec::with_capacity(times_s.len());
    for ((&time_s, is_late), is_ahead) in times_s.iter().zip(&mut is_late).zip(is_ahead) {
        if time_s.is_finite() && !is_ahead {
            let lateness_s = newest_s - time_s;
            is_back = lateness_s >= LONGEST_LATENESS_S || (is_back && lateness_s >= 0.0);
        }
        let is_in_time = time_s.is_finite() && !is_ahead && !is_back;
        places_s.push(if is_in_time { time_s } else { newest_s });
        if is_in_time {
            *is_late = time_s < newest_s;
            in_time += 1;
            newest_s = newest_s.max(time_s);
        }
    }
    let mut order: Vec<usize> = (0..times_s.len()).collect();
    if 2 * is_late.iter().filter(|late| **late).count() > in_time {
        return (order, vec![false; times_s.len()]);
    }
    order.sort_by(|&a, &b| places_s[a].total_cmp(&places_s[b]));
    (order, is_late)
}

/// Returns the state of the base at each sample. Where no twists are measured, they follow from the
/// poses of the samples that can be used.
pub(super) fn base_states(arrays: &Arrays<'_>, timeline: &Timeline) -> Vec<BaseState> {
    let vector = |values: &[f64], at: usize| Vector3::from_column_slice(&values[at..at + 3]);
    let pose = |k: usize| match arrays.pose {
        [] => Isometry3::identity(),
        [single] => *single,
        poses => poses[k],
    };
    let at_rest = |k| BaseState {
        pose: pose(k),
        ..BaseState::fixed()
    };
    let mut bases: Vec<BaseState> = (0..arrays.time.len()).map(at_rest).collect();
    if !arrays.twist.is_empty() {
        for (base, twist) in bases.iter_mut().zip(arrays.twist.chunks_exact(6)) {
            base.velocity = vector(twist, 0);
            base.angular_velocity = vector(twist, 3);
        }
    } else if arrays.pose.len() > 1 {
        let usable = timeline.usable.iter().copied();
        let known: Vec<usize> = usable
            .filter(|&k| check_pose(&arrays.pose[k]).is_ok())
            .collect();
        let times_s: Vec<f64> = known.iter().map(|&k| arrays.time[k]).collect();
        let poses: Vec<_> = known.iter().map(|&k| arrays.pose[k]).collect();
        for (&k, state) in known.iter().zip(states_of_poses(&times_s, &poses)) {
            bases[k] = state;
        }
    }
    let accelerations = arrays.acceleration.chunks_exact(6);
    for (base, measured) in bases.iter_mut().zip(accelerations) {
        base.acceleration = Some(vector(measured, 0));
        base.angular_acceleration = Some(vector(measured, 3));
    }
    bases
}

/// Checks a state of the base. The error has the name of the array.
pub(super) fn check_base(base: &BaseState) -> Result<(), (&'static str, FaultKind)> {
    check_pose(&base.pose).map_err(|kind| ("pose", kind))?;
    let twist = base.velocity.iter().chain(&base.angular_velocity);
    check(twist).map_err(|kind| ("twist", kind))?;
    let measured = base.acceleration.iter().chain(&base.angular_acceleration);
    let measured = measured.flat_map(|vector| vector.iter());
    check(measured).map_err(|kind| ("acceleration", kind))
}

fn check_pose(pose: &Isometry3<f64>) -> Result<(), FaultKind> {
    let translation = pose.translation.vector.iter();
    check(translation.chain(pose.rotation.coords.iter()))
}
