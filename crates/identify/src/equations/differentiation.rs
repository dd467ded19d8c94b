//! Weights of the polynomial nearest to a few samples: its value and its derivatives at a time.

/// The polynomial of degree four passes through so many samples.
pub(crate) const FEWEST: usize = 5;

/// The most samples; a third of the noise's variance is left in a value from so many.
pub(crate) const MOST: usize = 11;

/// Weights of values at `nodes`, at most [`MOST`] of them, for the value, the first and the second
/// derivative at `at` of the polynomial of degree four that is nearest in least squares (of less where
/// there are fewer nodes, and through all of them), by polynomials that are orthogonal on the nodes
/// (Forsythe 1957, doi 10.1137/0105007).
///
/// Nodes need not be equidistant, but must differ. Weights of nodes that are not there are zero.
pub(crate) fn weights(nodes: &[f64], at: f64) -> [[f64; MOST]; 3] {
    let count = nodes.len();
    let mut weights = [[0.0; MOST]; 3];
    // A polynomial and the one of a degree less: at the nodes; value and derivatives at `at`.
    let (mut now, mut before) = ([1.0; MOST], [0.0; MOST]);
    let (mut here, mut here_before) = ([1.0, 0.0, 0.0], [0.0; 3]);
    let mut norm_before = f64::INFINITY;
    for _ in 0..count.min(FEWEST) {
        let (mut norm, mut moment) = (0.0, 0.0);
        for (p, t) in now[..count].iter().zip(nodes) {
            norm += p * p;
            moment += (t - at) * p * p;
        }
        for (weights, here) in weights.iter_mut().zip(here) {
            let share = here / norm;
            for (weight, p) in weights[..count].iter_mut().zip(now) {
                *weight += share * p;
            }
        }
        let (middle, part) = (moment / norm, norm / norm_before);
        for k in 0..count {
            let next = (nodes[k] - at - middle) * now[k] - part * before[k];
            (before[k], now[k]) = (now[k], next);
        }
        let next = std::array::from_fn(|k| {
            let product = if k == 0 { 0.0 } else { k as f64 * here[k - 1] };
            product - middle * here[k] - part * here_before[k]
        });
        (here_before, here) = (here, next);
        norm_before = norm;
    }
    weights
}

/// Times that differ by less than this part of their span have the same weights.
const ALIKE: f64 = 1e-7;

/// The weights of an odd number of nodes at their middle, which even samples have again and again.
#[derive(Clone, Debug)]
pub(crate) struct Stencil {
    count: usize,
    /// The nodes' times from that of the middle one.
    from_middle: [f64; MOST],
    weights: [[f64; MOST]; 3],
}

impl Stencil {
    pub(crate) fn new() -> Self {
        Self {
            count: 0,
            from_middle: [0.0; MOST],
            weights: [[0.0; MOST]; 3],
        }
    }

    /// As [`weights`] has them, to one part in ten million.
    pub(crate) fn at_middle(
        &mut self,
        nodes: impl ExactSizeIterator<Item = f64>,
    ) -> [[f64; MOST]; 3] {
        let count = nodes.len();
        let mut times = [0.0; MOST];
        for (time, node) in times.iter_mut().zip(nodes) {
            *time = node;
        }
        let middle = times[count / 2];
        let span = times[count - 1] - times[0];
        let pairs = times[..count].iter().zip(&self.from_middle);
        let is_alike = |(time, before): (&f64, &f64)| (time - middle - before).abs() < ALIKE * span;
        if self.count != count || !pairs.map(is_alike).fold(true, |all, one| all & one) {
            self.count = count;
            self.from_middle = times.map(|time| time - middle);
            self.weights = weights(&self.from_middle[..count], 0.0);
        }
        self.weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNEVEN: [f64; MOST] = [
        -0.49, -0.41, -0.32, -0.21, -0.1, 0.013, 0.09, 0.2, 0.31, 0.38, 0.52,
    ];

    /// A polynomial of degree four is met with its derivatives, however many nodes there are.
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
            for (order, weights) in weights(nodes, at).iter().enumerate() {
                let found: f64 = nodes.iter().zip(weights).map(|(t, w)| w * value(*t)).sum();
                assert!((found - target[order]).abs() < 1e-10, "{order}: {found}");
            }
        }
    }

    /// Five equal steps have the well-known central differences, with their sign; eleven the smoothing
    /// of Savitzky and Golay (1964), table of the quartic: 143 of 429 in the middle, 18 at the end.
    #[test]
    fn gives_the_well_known_weights() {
        let five = weights(&[-2.0, -1.0, 0.0, 1.0, 2.0], 0.0);
        let expected = [
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0],
            [-1.0 / 12.0, 4.0 / 3.0, -2.5, 4.0 / 3.0, -1.0 / 12.0],
        ];
        for (found, target) in five.iter().zip(expected) {
            for (found, target) in found.iter().zip(target) {
                assert!((found - target).abs() < 1e-14);
            }
        }
        let steps: Vec<f64> = (0..11).map(|k| f64::from(k) - 5.0).collect();
        let [value, ..] = weights(&steps, 0.0);
        let expected = [18.0, -45.0, -10.0, 60.0, 120.0, 143.0];
        for (k, target) in expected.iter().enumerate() {
            assert!((value[k] - target / 429.0).abs() < 1e-14, "{k}");
            assert!((value[10 - k] - target / 429.0).abs() < 1e-14, "{k}");
        }
    }

    /// Even nodes have their weights again, uneven ones their own.
    #[test]
    fn weights_follow_the_nodes() {
        let mut stencil = Stencil::new();
        for nodes in [&UNEVEN[..], &UNEVEN[3..8], &UNEVEN[2..9], &UNEVEN[4..9]] {
            for shift in [0.0, 0.25, 3.0] {
                let shifted: Vec<f64> = nodes.iter().map(|t| t + shift).collect();
                let found = stencil.at_middle(shifted.iter().copied());
                let target = weights(&shifted, shifted[nodes.len() / 2]);
                for (found, target) in found.as_flattened().iter().zip(target.as_flattened()) {
                    assert!((found - target).abs() < 1e-9 * (1.0 + target.abs()));
                }
            }
        }
    }
}
