//! Recordings that consist of rests.

use nalgebra::{Matrix3, Vector3};
use tactid_identify::equations::{Equation, EquationStream, Geometry, WRENCH};

use crate::attitudes::{Attitudes, SAME_ATTITUDE_RAD};
use crate::finding::Rests;
use crate::hypotheses::SLIGHT;

/// Shortest rest, s: longer than a slow swing stays in its turning points.
const LEAST_REST_S: f64 = 1.0;

/// Least fraction of the duration of a recording that consists of rests.
const LEAST_REST_FRACTION: f64 = 0.5;

/// Returns whether the motion hardly tells the weight of the payload from an offset of the wrench,
/// whose channels are the first six: its force and its moment are nearly constant.
///
/// It is the angle between the column of the mass and the constants: zero at rest in one attitude,
/// and small where the tool turns about the vertical alone. An offset then makes the interval of
/// the mass ten times as wide, or more.
pub(super) fn hides_offset(equations: &[Equation], stream: &EquationStream) -> bool {
    if !stream.measures_wrench() || stream.gravity() == Vector3::zeros() {
        return false;
    }
    let windows = equations.len() as f64;
    let [mut all, mut apart] = [0.0; 2];
    for channel in 0..equations.first().map_or(0, |first| first.rows.len()) {
        let entry = |equation: &Equation| equation.rows[channel].regressor[0];
        let mean = equations.iter().map(entry).sum::<f64>() / windows;
        let squares = equations.iter().map(|equation| entry(equation).powi(2));
        let squares = squares.sum::<f64>();
        all += squares;
        apart += if channel < WRENCH {
            squares - windows * mean * mean
        } else {
            squares
        };
    }
    apart <= SLIGHT.powi(2) * all
}

/// Returns whether the joints are at rest in one attitude in all equations.
pub(super) fn is_one_attitude(equations: &[Equation]) -> bool {
    let mut all = equations
        .iter()
        .map(|equation| Geometry::new(&equation.geometry));
    let first = all.next().flatten();
    first.is_some_and(|first| all.all(|other| other.is_some_and(|other| is_same(first, other))))
}

/// Returns the rests of which a recording consists, in several directions of gravity, which is
/// given in the world.
pub(super) fn rests(equations: &[Equation], gravity: &Vector3<f64>) -> Option<Rests> {
    let windows = equations.iter().map(|equation| {
        let geometry = Geometry::new(&equation.geometry)?;
        Some((equation.time_s, geometry))
    });
    let windows: Option<Vec<(f64, Geometry<'_>)>> = windows.collect();
    let windows = windows.filter(|windows| windows.len() > 1 && gravity.norm() > 0.0)?;
    let mut attitudes = Attitudes::default();
    let (mut rests, mut at_rest_s) = (0, 0.0);
    for (duration_s, rotation) in rests_of(&windows) {
        attitudes.number(&(rotation * gravity));
        rests += 1;
        at_rest_s += duration_s;
    }
    let duration_s = windows[windows.len() - 1].0 - windows[0].0;
    let fraction = at_rest_s / duration_s;
    (fraction > LEAST_REST_FRACTION && attitudes.count() > 1).then_some(Rests {
        attitudes: attitudes.count(),
        rests,
        fraction,
    })
}

/// Returns the durations of rests, s, with their attitudes: sections of the windows with the
/// attitude of their first one, and with its positions of the joints.
fn rests_of(windows: &[(f64, Geometry<'_>)]) -> Vec<(f64, Matrix3<f64>)> {
    let mut rests = Vec::new();
    let mut left = windows;
    while let Some((time_s, first)) = left.first() {
        let count = left
            .iter()
            .take_while(|window| is_same(*first, window.1))
            .count()
            .max(1);
        let (rest, after) = left.split_at(count);
        if rest[count - 1].0 - time_s >= LEAST_REST_S {
            rests.push((rest[count - 1].0 - time_s, first.tool_from_world()));
        }
        left = after;
    }
    rests
}

fn is_same(first: Geometry<'_>, other: Geometry<'_>) -> bool {
    // Of a small angle, the norm of the difference of the matrices is √2 times it.
    let change = first.tool_from_world() - other.tool_from_world();
    let positions = first.joints().position.iter();
    let mut steps = positions.zip(other.joints().position);
    change.norm() < SAME_ATTITUDE_RAD * std::f64::consts::SQRT_2
        && steps.all(|(from, to)| (from - to).abs() < SAME_ATTITUDE_RAD)
}
