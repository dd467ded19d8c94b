//! The twist of a base, or of a sensor that is carried about, against its pose.

use nalgebra::Vector3;
use tactid_identify::BaseState;

use super::increments::Increments;
use super::judge;
use crate::Finding;
use crate::alignment::{Event, Measured};
use crate::finding::TwistAxes;
use crate::recording::Sources;

/// Number of columns of a velocity or an angular velocity.
const AXES: usize = 3;

/// Returns a finding if the measured twist is not the derivative of the measured pose.
pub(super) fn contradicted(sources: &Sources, events: &[Event], max_gap_s: f64) -> Option<Finding> {
    let (source, axes) = sources.measured_twist.as_ref()?;
    let poses = events.iter().filter_map(|event| match &event.measured {
        Measured::Base(base) => Some((event.time_s, base)),
        _ => None,
    });
    let poses: Vec<(f64, &BaseState)> = poses.collect();
    let step =
        |a: &&BaseState, b: &&BaseState, duration_s: f64| Some(step(a, b, duration_s, *axes));
    let increments = Increments::new(&poses, max_gap_s, step)?;
    let other = match axes {
        TwistAxes::World => TwistAxes::Body,
        TwistAxes::Body => TwistAxes::World,
    };
    // Linear and angular velocity are judged apart, because their units differ.
    let contradictions = [0, AXES].into_iter().filter_map(|first| {
        let difference = |hypothesis: usize| {
            let integral = 2 * AXES * hypothesis + first;
            increments.relative_difference(first..first + AXES, integral..integral + AXES, 1.0)
        };
        let relative_difference = difference(1)?;
        let causes = difference(2).into_iter().map(|rest| (rest, other));
        Some((relative_difference, judge(relative_difference, causes)?))
    });
    let (relative_difference, better_axes) = contradictions.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Finding::TwistContradicted {
        source: source.clone(),
        relative_difference,
        better_axes,
    })
}

/// Returns the changes of position and rotation, then the integrals of the velocities, then what these would be if the
/// recording had them in the other axes than `axes`.
fn step(a: &BaseState, b: &BaseState, duration_s: f64, axes: TwistAxes) -> Vec<f64> {
    let changes = [
        b.pose.translation.vector - a.pose.translation.vector,
        (b.pose.rotation * a.pose.rotation.inverse()).scaled_axis(),
    ];
    let turned = |base: &BaseState, rate: Vector3<f64>| match axes {
        TwistAxes::World => base.pose.rotation * rate,
        TwistAxes::Body => base.pose.rotation.inverse() * rate,
    };
    let mean = |of: &dyn Fn(&BaseState) -> Vector3<f64>| 0.5 * duration_s * (of(a) + of(b));
    let integrals = [
        mean(&|base| base.velocity),
        mean(&|base| base.angular_velocity),
        mean(&|base| turned(base, base.velocity)),
        mean(&|base| turned(base, base.angular_velocity)),
    ];
    let vectors = changes.iter().chain(&integrals);
    vectors.flat_map(|vector| vector.iter().copied()).collect()
}
