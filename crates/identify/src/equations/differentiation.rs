//! Differentiation and smoothing of samples: weights of the polynomial fitted to a few of them.

use nalgebra::{UnitQuaternion, Vector4};

/// Number of coefficients of a polynomial of degree four, and fewest nodes to which one is fitted:
/// it passes through so many.
pub(crate) const MIN_NODES: usize = 5;

/// Most nodes to which a polynomial is fitted. A smoothed value from so many keeps a third of the
/// variance of the noise.
pub(crate) const MAX_NODES: usize = 11;

/// Weights of the values at some nodes for quantities of the polynomial that is fitted to them.
/// Weights beyond the number of nodes are zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    /// Weights for the value at the time of evaluation.
    pub(crate) value: [f64; MAX_NODES],
    /// Weights for the first derivative there.
    pub(crate) first: [f64; MAX_NODES],
    /// Weights for the second derivative there.
    pub(crate) second: [f64; MAX_NODES],
    /// Weights for the mean over the nodes of the integral from the time of evaluation to the node.
    /// Of a velocity it is the mean position at the nodes less the position at the time of
    /// evaluation.
    pub(crate) displacement: [f64; MAX_NODES],
}

/// Returns weights of values at `nodes` for quantities, at time `at`, of the polynomial that is
/// fitted to them in least squares.
///
/// The polynomial has degree four, or passes through all nodes where these are fewer than five.
/// There are at most [`MAX_NODES`] nodes, all different; they need not be equidistant. The
/// polynomials of the recurrence are orthogonal on the nodes (Forsythe 1957, doi 10.1137/0105007).
pub(crate) fn weights(nodes: &[f64], at: f64) -> Weights {
    let count = nodes.len();
    // Of the derivatives at `at`, from the value to the fourth.
    let mut weights = [[0.0; MAX_NODES]; MIN_NODES];
    // The orthogonal polynomial of this degree and that of one less: at the nodes, and with
    // derivatives at `at`.
    let (mut current, mut previous) = ([1.0; MAX_NODES], [0.0; MAX_NODES]);
    let (mut current_at, mut previous_at) = ([0.0; MIN_NODES], [0.0; MIN_NODES]);
    current_at[0] = 1.0;
    let mut previous_norm = f64::INFINITY;
    for _ in 0..count.min(MIN_NODES) {
        let (mut norm, mut moment) = (0.0, 0.0);
        for (p, t) in current[..count].iter().zip(nodes) {
            norm += p * p;
            moment += (t - at) * p * p;
        }
        for (weights, current_at) in weights.iter_mut().zip(current_at) {
            let coefficient = current_at / norm;
            for (weight, p) in weights[..count].iter_mut().zip(current) {
                *weight += coefficient * p;
            }
        }
        // p_{k+1}(t) = (t - shift) p_k(t) - ratio p_{k-1}(t)
        let (shift, ratio) = (moment / norm, norm / previous_norm);
        for k in 0..count {
            let next = (nodes[k] - at - shift) * current[k] - ratio * previous[k];
            (previous[k], current[k]) = (current[k], next);
        }
        let next_at = std::array::from_fn(|k| {
            let product = if k == 0 {
                0.0
            } else {
                k as f64 * current_at[k - 1]
            };
            product - shift * current_at[k] - ratio * previous_at[k]
        });
        (previous_at, current_at) = (current_at, next_at);
        previous_norm = norm;
    }
    let displacement = displacement(nodes, at, &weights);
    let [value, first, second, ..] = weights;
    Weights {
        value,
        first,
        second,
        displacement,
    }
}

/// Returns the weights for the mean integral from `at` to the nodes, given those for the
/// derivatives at `at`: the integral of the Taylor polynomial, term by term.
fn displacement(
    nodes: &[f64],
    at: f64,
    derivatives: &[[f64; MAX_NODES]; MIN_NODES],
) -> [f64; MAX_NODES] {
    let mut powers = [0.0; MAX_NODES];
    powers[..nodes.len()].fill((nodes.len() as f64).recip());
    let mut displacement = [0.0; MAX_NODES];
    for (order, weights) in derivatives.iter().enumerate() {
        let mut mean = 0.0; // of (t - at)^(order + 1) / (order + 1)!
        for (power, t) in powers.iter_mut().zip(nodes) {
            *power *= (t - at) / (order + 1) as f64;
            mean += *power;
        }
        for (sum, weight) in displacement.iter_mut().zip(weights) {
            *sum += mean * weight;
        }
    }
    displacement
}

/// Nodes whose times, relative to their span, differ by less than this have the same weights.
const SAME_TIMES: f64 = 1e-7;

/// Cached weights of an odd number of nodes at their middle. Equidistant samples use the same ones
/// again and again.
#[derive(Clone, Debug)]
pub(crate) struct CachedWeights {
    count: usize,
    /// Times of the nodes less that of the middle one.
    from_middle: [f64; MAX_NODES],
    weights: Weights,
}

impl CachedWeights {
    /// Creates an empty cache.
    pub(crate) fn new() -> Self {
        Self {
            count: 0,
            from_middle: [0.0; MAX_NODES],
            weights: Weights {
                value: [0.0; MAX_NODES],
                first: [0.0; MAX_NODES],
                second: [0.0; MAX_NODES],
                displacement: [0.0; MAX_NODES],
            },
        }
    }

    /// Returns the [`weights`] at the middle one of the nodes, to one part in ten million.
    pub(crate) fn at_middle(&mut self, nodes: impl ExactSizeIterator<Item = f64>) -> &Weights {
        let count = nodes.len();
        let mut times = [0.0; MAX_NODES];
        for (time, node) in times.iter_mut().zip(nodes) {
            *time = node;
        }
        let middle = times[count / 2];
        let span = times[count - 1] - times[0];
        let pairs = times[..count].iter().zip(&self.from_middle);
        let is_same =
            |(time, cached): (&f64, &f64)| (time - middle - cached).abs() < SAME_TIMES * span;
        // All nodes are compared without a branch, which is faster than to stop at the first
        // difference.
        if self.count != count || !pairs.map(is_same).fold(true, |all, one| all & one) {
            self.count = count;
            self.from_middle = times.map(|time| time - middle);
            self.weights = weights(&self.from_middle[..count], 0.0);
        }
        &self.weights
    }
}

/// Returns a weighted sum of the rotations' quaternions, not normalised. Of the two quaternions of
/// each rotation it uses the one on the side of `reference`.
pub(crate) fn weighted_rotation_sum<'a>(
    rotations: impl Iterator<Item = (&'a UnitQuaternion<f64>, f64)>,
    reference: &UnitQuaternion<f64>,
) -> Vector4<f64> {
    let signed = |(rotation, weight): (&UnitQuaternion<f64>, f64)| {
        let coords = rotation.coords;
        coords * (weight * 1f64.copysign(coords.dot(&reference.coords)))
    };
    rotations.map(signed).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNEVEN: [f64; MAX_NODES] = [
        -0.49, -0.41, -0.32, -0.21, -0.1, 0.013, 0.09, 0.2, 0.31, 0.38, 0.52,
    ];

    /// The weights reproduce a polynomial of degree four and its derivatives, from any number of
    /// nodes.
    #[test]
    fn is_exact_for_polynomials() {
        let value = |t: f64| 3.0 - 2.0 * t + 5.0 * t.powi(2) - 7.0 * t.powi(3) + 11.0 * t.powi(4);
        for (nodes, at) in [
            (&UNEVEN[3..8], 0.013),
            (&UNEVEN[3..8], -0.3),
            (&UNEVEN[2..9], 0.05),
            (&UNEVEN[..], 0.013),
        ] {
            let target = [
                value(at),
                -2.0 + 10.0 * at - 21.0 * at * at + 44.0 * at.powi(3),
                10.0 - 42.0 * at + 132.0 * at * at,
            ];
            let found = weights(nodes, at);
            for (order, weights) in [found.value, found.first, found.second].iter().enumerate() {
                let found: f64 = nodes.iter().zip(weights).map(|(t, w)| w * value(*t)).sum();
                assert!((found - target[order]).abs() < 1e-10, "{order}: {found}");
            }
        }
    }

    /// The mean of the positions at the nodes less the displacement of the velocities is the
    /// position at the time of evaluation, exactly for positions that are a polynomial of degree
    /// five.
    #[test]
    fn displacement_leads_from_the_mean_to_a_position() {
        let position = |t: f64| 2.0 + t * (3.0 + t * (-1.0 + t * (5.0 + t * (-7.0 + 11.0 * t))));
        let velocity = |t: f64| 3.0 + t * (-2.0 + t * (15.0 + t * (-28.0 + 55.0 * t)));
        for (nodes, at) in [
            (&UNEVEN[3..8], 0.013),
            (&UNEVEN[3..8], -0.3),
            (&UNEVEN[..], 0.013),
        ] {
            let mean = nodes.iter().map(|&t| position(t)).sum::<f64>() / nodes.len() as f64;
            let pairs = nodes.iter().zip(weights(nodes, at).displacement);
            let displacement: f64 = pairs.map(|(&t, weight)| weight * velocity(t)).sum();
            assert!((mean - displacement - position(at)).abs() < 1e-12);
        }
    }

    /// Five equal steps have the well-known central differences, with their sign. Eleven have the
    /// smoothing weights of Savitzky and Golay (1964), table of the quartic: 143 of 429 in the
    /// middle, 18 at the end.
    #[test]
    fn gives_the_well_known_weights() {
        let five = weights(&[-2.0, -1.0, 0.0, 1.0, 2.0], 0.0);
        let expected = [
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0],
            [-1.0 / 12.0, 4.0 / 3.0, -2.5, 4.0 / 3.0, -1.0 / 12.0],
        ];
        for (found, target) in [five.value, five.first, five.second].iter().zip(expected) {
            for (found, target) in found.iter().zip(target) {
                assert!((found - target).abs() < 1e-14);
            }
        }
        let steps: Vec<f64> = (0..11).map(|k| f64::from(k) - 5.0).collect();
        let value = weights(&steps, 0.0).value;
        let expected = [18.0, -45.0, -10.0, 60.0, 120.0, 143.0];
        for (k, target) in expected.iter().enumerate() {
            assert!((value[k] - target / 429.0).abs() < 1e-14, "{k}");
            assert!((value[10 - k] - target / 429.0).abs() < 1e-14, "{k}");
        }
    }

    /// The cache returns the weights of the nodes it is asked for, shifted, even or uneven.
    #[test]
    fn weights_follow_the_nodes() {
        let mut cached = CachedWeights::new();
        for nodes in [&UNEVEN[..], &UNEVEN[3..8], &UNEVEN[2..9], &UNEVEN[4..9]] {
            for shift in [0.0, 0.25, 3.0] {
                let shifted: Vec<f64> = nodes.iter().map(|t| t + shift).collect();
                let found = cached.at_middle(shifted.iter().copied());
                let target = weights(&shifted, shifted[nodes.len() / 2]);
                for (found, target) in [
                    (found.value, target.value),
                    (found.first, target.first),
                    (found.second, target.second),
                    (found.displacement, target.displacement),
                ] {
                    for (found, target) in found.iter().zip(target) {
                        assert!((found - target).abs() < 1e-9 * (1.0 + target.abs()));
                    }
                }
            }
        }
    }
}
