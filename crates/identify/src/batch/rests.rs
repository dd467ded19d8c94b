//! Recordings that consist of rests.

use nalgebra::{Matrix3, Vector3};

use crate::equations::{Equation, Geometry, SAME_ATTITUDE_RAD};
use crate::finding::Rests;
use crate::fit::least_squares::MIN_ROWS;

/// Returns the rests of which a recording consists, in at least two directions of gravity, given that in the world.
pub(super) fn rests(equations: &[Equation], gravity: &Vector3<f64>) -> Option<Rests> {
    let rotations: Option<Vec<(f64, Matrix3<f64>)>> = equations
        .iter()
        .map(|equation| {
            let rotation = Geometry::new(&equation.geometry)?.tool_from_world();
            Some((equation.time_s, rotation))
        })
        .collect();
    let rotations = rotations.filter(|rotations| rotations.len() > 1 && gravity.norm() > 0.0)?;
    let mut attitudes: Vec<Vector3<f64>> = Vec::new();
    let (mut rests, mut at_rest_s) = (0, 0.0);
    for (duration_s, rotation) in rests_of(&rotations) {
        let down = rotation * gravity;
        if attitudes
            .iter()
            .all(|other| other.angle(&down) > SAME_ATTITUDE_RAD)
        {
            attitudes.push(down);
        }
        rests += 1;
        at_rest_s += duration_s;
    }
    let duration_s = rotations[rotations.len() - 1].0 - rotations[0].0;
    let fraction = at_rest_s / duration_s;
    let is_mostly_still = fraction > 0.5;
    (is_mostly_still && attitudes.len() > 1).then_some(Rests {
        attitudes: attitudes.len(),
        rests,
        fraction,
    })
}

/// Returns the durations of rests, s, with their attitudes: sections of the windows with the attitude of their first one.
fn rests_of(windows: &[(f64, Matrix3<f64>)]) -> Vec<(f64, Matrix3<f64>)> {
    let mut rests = Vec::new();
    let mut left = windows;
    while let Some((time_s, first)) = left.first() {
        let count = left
            .iter()
            .take_while(|window| is_same(first, &window.1))
            .count()
            .max(1);
        let (rest, after) = left.split_at(count);
        // About 1 s at the default cutoff: longer than a slow swing stays in its turning points.
        if count >= MIN_ROWS {
            rests.push((rest[count - 1].0 - time_s, *first));
        }
        left = after;
    }
    rests
}

fn is_same(first: &Matrix3<f64>, second: &Matrix3<f64>) -> bool {
    // Of a small angle, the norm of the difference of the matrices is √2 times it.
    (first - second).norm() < SAME_ATTITUDE_RAD * std::f64::consts::SQRT_2
}
