//! Weights of the polynomial through a few samples: its value and its derivatives at a time.

/// Weights of values at `nodes` for the value, the first and the second derivative at `at` of the
/// polynomial through them (Fornberg 1988, Mathematics of Computation 51, 699-706).
///
/// Nodes need not be equidistant, but must differ. Exact for polynomials of degree `N - 1`.
pub(crate) fn weights<const N: usize>(nodes: &[f64; N], at: f64) -> [[f64; N]; 3] {
    let mut weights = [[0.0; N]; 3];
    weights[0][0] = 1.0;
    let mut product = 1.0;
    let mut from_at = nodes[0] - at;
    for i in 1..N {
        let before = from_at;
        from_at = nodes[i] - at;
        let mut next_product = 1.0;
        for j in 0..i {
            let distance = nodes[i] - nodes[j];
            next_product *= distance;
            if j + 1 == i {
                let scale = product / next_product;
                for k in (1..3).rev() {
                    weights[k][i] =
                        scale * (k as f64 * weights[k - 1][i - 1] - before * weights[k][i - 1]);
                }
                weights[0][i] = -scale * before * weights[0][i - 1];
            }
            for k in (1..3).rev() {
                weights[k][j] = (from_at * weights[k][j] - k as f64 * weights[k - 1][j]) / distance;
            }
            weights[0][j] *= from_at / distance;
        }
        product = next_product;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial of degree four through five uneven nodes is met with its derivatives.
    #[test]
    fn is_exact_for_polynomials() {
        let nodes = [-0.21, -0.1, 0.013, 0.09, 0.2];
        let value = |t: f64| 3.0 - 2.0 * t + 5.0 * t.powi(2) - 7.0 * t.powi(3) + 11.0 * t.powi(4);
        for at in [0.013, 0.05, -0.3] {
            let wanted = [
                value(at),
                -2.0 + 10.0 * at - 21.0 * at * at + 44.0 * at.powi(3),
                10.0 - 42.0 * at + 132.0 * at * at,
            ];
            for (order, weights) in weights(&nodes, at).iter().enumerate() {
                let found: f64 = nodes.iter().zip(weights).map(|(t, w)| w * value(*t)).sum();
                assert!((found - wanted[order]).abs() < 1e-10, "{order}: {found}");
            }
        }
    }

    /// On equal steps these are the well-known central differences, with their sign.
    #[test]
    fn gives_the_central_differences() {
        let [value, first, second] = weights(&[-2.0, -1.0, 0.0, 1.0, 2.0], 0.0);
        let expected = [
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0],
            [-1.0 / 12.0, 4.0 / 3.0, -2.5, 4.0 / 3.0, -1.0 / 12.0],
        ];
        for (found, wanted) in [value, first, second]
            .iter()
            .flatten()
            .zip(expected.as_flattened())
        {
            assert!((found - wanted).abs() < 1e-14);
        }
    }
}
