//! Uniform B-splines of degree five: smooth to the fourth derivative, so that accelerations have no
//! corners.

/// A number for each of the splines that are not zero at a time: their degree plus one.
type OfSplines = [f64; 6];

/// Values, first and second derivatives of the splines that are not zero at a time.
pub(super) type Basis = [OfSplines; 3];

/// Number of splines that are not zero at a time.
pub(super) fn order() -> usize {
    OfSplines::default().len()
}

/// Returns the splines with knots at the integers that are not zero at `x`, from 0 to 1, the
/// earliest first.
pub(super) fn basis(x: f64) -> Basis {
    let [of_order_4, of_order_5, of_order_6] = [4, 5, 6].map(|order| values(x, order));
    let first = differences(&of_order_5);
    [of_order_6, first, differences(&differences(&of_order_4))]
}

/// Returns the values of the splines of an order by the recursion of Cox and de Boor.
fn values(x: f64, order: usize) -> OfSplines {
    let mut values = OfSplines::default();
    values[0] = 1.0;
    for k in 2..=order {
        let before = values;
        for (i, value) in values.iter_mut().enumerate().take(k) {
            // The spline of index i begins at the knot i - (k - 1).
            let since_begin = x - i as f64 + (k - 1) as f64;
            let left = if i > 0 { before[i - 1] } else { 0.0 };
            let right = if i + 1 < k { before[i] } else { 0.0 };
            let sum = since_begin * left + (k as f64 - since_begin) * right;
            *value = sum / (k - 1) as f64;
        }
    }
    values
}

/// Returns the derivatives of the splines of the next order: differences of those of this one.
fn differences(lower: &OfSplines) -> OfSplines {
    std::array::from_fn(|i| {
        let left = if i > 0 { lower[i - 1] } else { 0.0 };
        left - lower[i]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The splines sum to one, reproduce a line with its derivatives, and have the derivatives that
    /// their differences show.
    #[test]
    fn splines_are_smooth_and_reproduce_lines() {
        let step = 1e-4;
        for x in [0.0, 0.3, 0.77, 0.999] {
            let [value, first, second] = basis(x);
            let sum = |values: &OfSplines| values.iter().sum::<f64>();
            assert!((sum(&value) - 1.0).abs() < 1e-14);
            assert!(sum(&first).abs() < 1e-14 && sum(&second).abs() < 1e-13);
            // Greville abscissae: the coefficient of a line at the middle of each spline.
            let line = |values: &OfSplines| -> f64 {
                let terms = values.iter().enumerate();
                terms.map(|(i, value)| value * (i as f64 - 2.0)).sum()
            };
            assert!((line(&value) - x).abs() < 1e-13);
            assert!((line(&first) - 1.0).abs() < 1e-13 && line(&second).abs() < 1e-12);
            if x > step && x < 1.0 - step {
                let (before, after) = (basis(x - step), basis(x + step));
                for i in 0..value.len() {
                    let slope = (after[0][i] - before[0][i]) / (2.0 * step);
                    let bend = (after[1][i] - before[1][i]) / (2.0 * step);
                    assert!((slope - first[i]).abs() < 1e-6, "{slope} {}", first[i]);
                    assert!((bend - second[i]).abs() < 1e-6, "{bend} {}", second[i]);
                }
            }
        }
    }
}
