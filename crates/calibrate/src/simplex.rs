//! Minimisation without derivatives, by the simplex method of Nelder and Mead (1965, doi
//! 10.1093/comjnl/7.4.308).
//!
//! Sixty lines, where argmin would add a dozen crates for the same four numbers.

/// Differences between corners of a simplex, in unknowns and values, that end the search.
const TOLERANCES: [f64; 2] = [0.05, 0.1];

/// Returns the best point after at most so many steps from a simplex at `start` of this `size`.
pub(crate) fn minimise<const N: usize>(
    mut value: impl FnMut(&[f64; N]) -> f64,
    start: &[f64; N],
    size: f64,
    steps: usize,
) -> [f64; N] {
    let mut corners: Vec<([f64; N], f64)> = (0..=N)
        .map(|k| {
            let at = std::array::from_fn(|i| start[i] + if i + 1 == k { size } else { 0.0 });
            (at, value(&at))
        })
        .collect();
    for _ in 0..steps {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        if is_small(&corners) {
            break;
        }
        let centre: [f64; N] = std::array::from_fn(|i| {
            corners[..N].iter().map(|(at, _)| at[i]).sum::<f64>() / N as f64
        });
        let worst = corners[N];
        let mut beyond = |factor: f64| {
            let at = std::array::from_fn(|i| centre[i] + factor * (centre[i] - worst.0[i]));
            (at, value(&at))
        };
        let reflected = beyond(1.0);
        let better = if reflected.1 < corners[0].1 {
            let expanded = beyond(2.0);
            Some(if expanded.1 < reflected.1 {
                expanded
            } else {
                reflected
            })
        } else if reflected.1 < corners[N - 1].1 {
            Some(reflected)
        } else {
            let contracted = beyond(if reflected.1 < worst.1 { 0.5 } else { -0.5 });
            (contracted.1 < reflected.1.min(worst.1)).then_some(contracted)
        };
        match better {
            Some(corner) => corners[N] = corner,
            None => shrink(&mut corners, &mut value),
        }
    }
    corners.sort_by(|a, b| a.1.total_cmp(&b.1));
    corners[0].0
}

/// Whether all corners are within the tolerances of the first.
fn is_small<const N: usize>(corners: &[([f64; N], f64)]) -> bool {
    let (first, others) = (&corners[0], &corners[1..]);
    others.iter().all(|(at, value)| {
        let mut distances = at.iter().zip(first.0).map(|(a, b)| (a - b).abs());
        distances.all(|distance| distance <= TOLERANCES[0]) && value - first.1 <= TOLERANCES[1]
    })
}

/// Moves all corners half the distance to the first.
fn shrink<const N: usize>(
    corners: &mut [([f64; N], f64)],
    value: &mut impl FnMut(&[f64; N]) -> f64,
) {
    let best = corners[0].0;
    for corner in &mut corners[1..] {
        corner.0 = std::array::from_fn(|i| 0.5 * (best[i] + corner.0[i]));
        corner.1 = value(&corner.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curved valley is followed to its end.
    #[test]
    fn finds_the_minimum_of_a_valley() {
        let mut calls = 0;
        let valley = |x: &[f64; 2]| {
            calls += 1;
            1e4 * ((1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2))
        };
        let found = minimise(valley, &[-1.2, 1.0], 0.5, 300);
        assert!(
            (found[0] - 1.0).abs() < 0.01 && (found[1] - 1.0).abs() < 0.02,
            "{found:?}"
        );
        assert!(calls < 400);
    }

    /// The number of steps is bounded, and the best point is never worse than the start.
    #[test]
    fn stops_after_its_steps() {
        let far = |x: &[f64; 4]| x.iter().map(|x| (x - 100.0).powi(2)).sum::<f64>();
        let start = [0.0; 4];
        let found = minimise(far, &start, 0.1, 5);
        assert!(far(&found) < far(&start) && far(&found) > 1e4);
    }
}
