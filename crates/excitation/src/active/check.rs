//! The largest motion towards a plan that is within all limits, at closely spaced times and for many payloads.

use crate::ExcitationError;
use crate::cones::Cone;
use crate::limits::Limit;
use crate::search::{Point, Search};

/// Fractions of the way from the rest of the previous plan to a new one that are tried until all limits hold.
const FRACTIONS: [f64; 7] = [1.0, 0.9, 0.8, 0.65, 0.5, 0.3, 0.15];

/// Fraction by which a plan may exceed a tightened limit.
pub(super) const EXCESS: f64 = 0.01;

/// Fraction of a limit from which on it binds.
const BINDING: f64 = 0.95;

/// A motion within all limits.
pub(super) struct Checked {
    pub(super) values: Vec<f64>,
    /// A limit that binds it.
    pub(super) binding: Option<Limit>,
}

/// Returns the limit of the dynamics that is the nearest along a motion, with its slack: negative where it is
/// exceeded, infinite without limits.
fn nearest_limit(
    dense: &mut Search,
    values: &[f64],
) -> Result<(Option<Limit>, f64), ExcitationError> {
    let samples = dense.sampler.sample(values, false)?;
    let step_s = dense.sampler.grid.step_s;
    let slack = |cone: &Cone| {
        let values = cone.values(&samples, step_s).into_iter();
        let slack = values.map(|value| value.slack());
        (
            Some(cone.limit.clone()),
            slack.fold(f64::INFINITY, f64::min),
        )
    };
    let all = dense.cones.iter().map(slack);
    let nearest = all.min_by(|a, b| a.1.total_cmp(&b.1));
    Ok(nearest.unwrap_or((None, f64::INFINITY)))
}

/// Returns a motion, or one between the rest of the previous plan and it, that is within the limits of `dense`, whose samples
/// are close and whose payloads are many. Where a new estimate shows that even the rest exceeds a limit, no other motion
/// exceeds it more.
pub(super) fn largest_within_limits(
    search: &Search,
    dense: &mut Search,
    point: &Point,
) -> Result<Checked, ExcitationError> {
    let (of_rest, slack_of_rest) = nearest_limit(dense, &search.direct)?;
    let least = slack_of_rest.min(-EXCESS);
    for fraction in FRACTIONS {
        let values = search.shrunk(&point.values, fraction);
        let (limit, slack) = nearest_limit(dense, &values)?;
        if slack >= least {
            let mut rows = search.rows.iter();
            let of_joint = rows.find(|row| row.value(&values).abs() > BINDING);
            let of_joint = of_joint.map(|row| row.limit.clone());
            let nearest = limit.filter(|_| slack < 1.0 - BINDING);
            return Ok(Checked {
                values,
                binding: nearest.or(of_joint),
            });
        }
    }
    Ok(Checked {
        values: search.direct.clone(),
        binding: of_rest,
    })
}
