//! The largest motion towards a plan that is within all limits, at closely spaced times and for
//! many payloads.

use crate::ExcitationError;
use crate::cones::Cone;
use crate::limits::Limit;
use crate::search::{Point, Search};

/// Fractions of the way from the rest of the previous plan to a new one, tried until limits hold.
const FRACTIONS: [f64; 7] = [1.0, 0.9, 0.8, 0.65, 0.5, 0.3, 0.15];

/// Fraction by which a plan may exceed a tightened limit.
const EXCESS: f64 = 0.01;

/// Fraction of a limit, which is tightened already, from which on it binds a plan.
const BINDING: f64 = 0.95;

/// A motion within all limits.
pub(super) struct Checked {
    pub(super) values: Vec<f64>,
    /// A limit that binds it.
    pub(super) binding: Option<Limit>,
}

/// Returns the least slack of each limit of the dynamics along a motion, negative if exceeded.
fn slacks(search: &mut Search, values: &[f64]) -> Result<Vec<f64>, ExcitationError> {
    let samples = search.sampler.sample(values, false)?;
    let step_s = search.sampler.grid.step_s;
    let slack = |cone: &Cone| {
        let values = cone.values(&samples, step_s).into_iter();
        values.fold(f64::INFINITY, |least, value| least.min(value.slack()))
    };
    Ok(search.cones.iter().map(slack).collect())
}

/// Lets motions use of each limit as much as the rest of the previous plan does, where a new
/// estimate shows that this is more than plans use. Returns a limit that the rest exceeds: no
/// motion may exceed it.
pub(super) fn relax_to_rest(search: &mut Search) -> Result<Option<Limit>, ExcitationError> {
    let of_rest = slacks(search, &search.direct.clone())?;
    for (cone, slack) in search.cones.iter_mut().zip(of_rest) {
        if slack < 0.0 {
            let left = cone.tightening + slack;
            if left < 0.0 {
                return Ok(Some(cone.limit.clone()));
            }
            cone.tightening = (left - EXCESS).max(0.0);
        }
    }
    Ok(None)
}

/// Returns a motion, or one between the rest of the previous plan and it, that is within the limits
/// of `dense`, with close samples and many payloads. Where a new estimate shows that the rest uses
/// more of a limit than plans do, the motion may use as much, but not exceed the limit; where even
/// the rest exceeds one, it is the rest.
pub(super) fn largest_within_limits(
    search: &Search,
    dense: &mut Search,
    point: &Point,
) -> Result<Checked, ExcitationError> {
    let of_rest = slacks(dense, &search.direct)?;
    let least = |(cone, slack): (&Cone, &f64)| slack.min(-EXCESS).max(-cone.tightening);
    let least: Vec<f64> = dense.cones.iter().zip(&of_rest).map(least).collect();
    for fraction in FRACTIONS {
        let values = search.shrunk(&point.values, fraction);
        let found = slacks(dense, &values)?;
        if found
            .iter()
            .zip(&least)
            .all(|(slack, least)| slack >= least)
        {
            let mut rows = search.rows.iter();
            let of_joint = rows.find(|row| row.value(&values).abs() > BINDING);
            let of_joint = of_joint.map(|row| row.limit.clone());
            let nearest = nearest(dense, &found, 1.0 - BINDING);
            return Ok(Checked {
                values,
                binding: nearest.or(of_joint),
            });
        }
    }
    Ok(Checked {
        values: search.direct.clone(),
        binding: nearest(dense, &of_rest, f64::INFINITY),
    })
}

/// Returns the limit with the least slack, if it is less than `most`.
fn nearest(search: &Search, slacks: &[f64], most: f64) -> Option<Limit> {
    let all = search.cones.iter().zip(slacks);
    let near = all.filter(|(_, slack)| **slack < most);
    let nearest = near.min_by(|a, b| a.1.total_cmp(b.1));
    nearest.map(|(cone, _)| cone.limit.clone())
}
