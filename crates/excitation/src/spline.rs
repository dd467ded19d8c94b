//! Clamped uniform B-splines of degree five, which end at rest; in a design they begin so, too.

use nalgebra::{DMatrix, DVector};

/// Degree of the splines. Their acceleration is a spline of degree three, which is smooth.
const DEGREE: usize = 5;

/// Control points at each end for position, velocity and acceleration; at rest they are equal.
pub(crate) const AT_REST: usize = 3;

/// Equal control points at an end where all derivatives vanish that are continuous between two
/// knots, so that the spline and the rest after it are one spline.
pub(crate) const AT_STANDSTILL: usize = DEGREE;

/// Fewest control points of a motion with a free control point beside those at rest.
pub const FEWEST_CONTROL_POINTS: usize = 2 * AT_REST + 1;

/// Parts that each span is divided into for the hull of position, velocity and acceleration. Of an
/// acceleration that oscillates as fast as the splines can, the control points are a third larger
/// than the function, and the parts' control points a few percent; lower derivatives are smoother.
const PARTS: [usize; 3] = [1, 2, 4];

/// Number of spline functions that differ from zero at one time.
pub(crate) const LOCAL: usize = DEGREE + 1;

/// Values of the spline functions that differ from zero at one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalBasis {
    /// Index of the first of them.
    pub(crate) first: usize,
    /// Their values, first and second derivatives (1/s, 1/s²).
    pub(crate) values: [[f64; LOCAL]; 3],
}

/// Functions of a clamped B-spline of degree five with uniform knots between its ends.
///
/// A spline lies in the hull of its control points, and its derivatives are splines of lower degree
/// with differences of its own control points. A limit on the control points of a derivative
/// therefore holds at all times.
#[derive(Clone, Debug)]
pub(crate) struct SplineBasis {
    knots: Vec<f64>,
    count: usize,
    duration_s: f64,
}

impl SplineBasis {
    /// Creates functions for control points, at least [`FEWEST_CONTROL_POINTS`], and a duration, s.
    pub(crate) fn new(count: usize, duration_s: f64) -> Self {
        let spans = count - DEGREE;
        let knot = |k: usize| {
            let span = k.saturating_sub(DEGREE).min(spans);
            duration_s * span as f64 / spans as f64
        };
        Self {
            knots: (0..count + DEGREE + 1).map(knot).collect(),
            count,
            duration_s,
        }
    }

    /// Returns the number of control points.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Returns the duration of the motion, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Returns the number of polynomials that the spline consists of.
    pub(crate) fn spans(&self) -> usize {
        self.count - DEGREE
    }

    /// Returns functions and derivatives at a time; times outside of the motion count as its ends.
    pub(crate) fn at(&self, time_s: f64) -> LocalBasis {
        let time_s = time_s.clamp(0.0, self.duration_s);
        let spans = self.spans();
        let span = ((time_s / self.duration_s * spans as f64) as usize).min(spans - 1);
        let mut all = [[0.0; LOCAL]; LOCAL];
        all[0][0] = 1.0;
        // Cox and de Boor: row p has the functions of degree p, the last from knot `span + DEGREE`.
        for degree in 1..=DEGREE {
            let previous = all[degree - 1];
            for (k, value) in all[degree].iter_mut().enumerate().take(degree + 1) {
                let left = span + DEGREE + k - degree;
                if k > 0 {
                    let width = self.knots[left + degree] - self.knots[left];
                    *value += previous[k - 1] * (time_s - self.knots[left]) / width;
                }
                if k < degree {
                    let width = self.knots[left + degree + 1] - self.knots[left + 1];
                    *value += previous[k] * (self.knots[left + degree + 1] - time_s) / width;
                }
            }
        }
        let mut values = [all[DEGREE], [0.0; LOCAL], [0.0; LOCAL]];
        for (order, values) in values.iter_mut().enumerate().skip(1) {
            for (point, weight) in self.weights_at(&all[DEGREE - order], span, order) {
                values[point - span] += weight;
            }
        }
        LocalBasis {
            first: span,
            values,
        }
    }

    /// Returns what each control point contributes to a derivative, given the functions of the
    /// lower degree in a span.
    fn weights_at(
        &self,
        functions: &[f64; LOCAL],
        span: usize,
        order: usize,
    ) -> impl Iterator<Item = (usize, f64)> {
        let count = DEGREE + 1 - order;
        (0..count).flat_map(move |k| {
            let [a, b, c] = self.derivative(span + k, order);
            let value = functions[k];
            [
                (span + k, a * value),
                (span + k + 1, b * value),
                (span + k + 2, c * value),
            ]
            .into_iter()
            .filter(|(_, weight)| *weight != 0.0)
        })
    }

    /// Returns the coefficients of three successive control points, the first of which has the
    /// index given, in the control point with this index of the derivative of an order from 0 to 2.
    /// A spline with `n` control points has a derivative of order `k` with `n - k` control points.
    fn derivative(&self, index: usize, order: usize) -> [f64; 3] {
        let first = |i: usize| DEGREE as f64 / (self.knots[i + DEGREE + 1] - self.knots[i + 1]);
        match order {
            0 => [1.0, 0.0, 0.0],
            1 => [-first(index), first(index), 0.0],
            _ => {
                let width = self.knots[index + DEGREE + 1] - self.knots[index + 2];
                let factor = (DEGREE - 1) as f64 / width;
                let (a, b) = (first(index), first(index + 1));
                [factor * a, -factor * (a + b), factor * b]
            }
        }
    }

    /// Returns the points between which the derivative of an order from 0 to 2 is at all times: its
    /// control points after dividing each span into [`PARTS`], closer to the function than its own.
    pub(crate) fn hull(&self, order: usize) -> impl Iterator<Item = HullPoint> + '_ {
        let degree = DEGREE - order;
        let spans = self.spans() * PARTS[order];
        (0..spans + degree).map(move |index| {
            let argument = |k: usize| {
                let span = (index + 1 + k).saturating_sub(degree).min(spans);
                self.duration_s * span as f64 / spans as f64
            };
            // Any of the refined spans that the control point belongs to gives the same.
            let span = index.saturating_sub(degree / 2).min(spans - 1) / PARTS[order];
            let weights = self.blossom(span, order, argument);
            let mut point = HullPoint {
                first: span,
                weights: [0.0; LOCAL],
            };
            for (k, weight) in weights.iter().enumerate().take(degree + 1) {
                let coefficients = self.derivative(span + k, order);
                for (offset, coefficient) in coefficients.iter().enumerate().take(order + 1) {
                    point.weights[k + offset] += weight * coefficient;
                }
            }
            point
        })
    }

    /// Returns the weights of the control points of a derivative in the blossom of its polynomial
    /// on a span, by the algorithm of de Boor with one argument in each step.
    fn blossom(&self, span: usize, order: usize, argument: impl Fn(usize) -> f64) -> [f64; LOCAL] {
        let degree = DEGREE - order;
        let mut rows = [[0.0; LOCAL]; LOCAL];
        for (k, row) in rows.iter_mut().enumerate() {
            row[k] = 1.0;
        }
        for step in 1..=degree {
            let at = argument(step - 1);
            for k in (step..=degree).rev() {
                // A derivative has the knots of the spline without `order` of them at each end.
                let (left, right) = (span + k + order, span + k + order + degree + 1 - step);
                let alpha = (at - self.knots[left]) / (self.knots[right] - self.knots[left]);
                let before = rows[k - 1];
                for (own, before) in rows[k].iter_mut().zip(before) {
                    *own = (1.0 - alpha) * before + alpha * *own;
                }
            }
        }
        rows[degree]
    }
}

/// A linear function of six successive control points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HullPoint {
    /// Index of the first of them.
    pub(crate) first: usize,
    /// Their coefficients.
    pub(crate) weights: [f64; LOCAL],
}

/// Position of one coordinate, rad or m, as a spline.
#[derive(Clone, Debug)]
pub struct Spline {
    basis: SplineBasis,
    pub(crate) control_points: Vec<f64>,
}

impl Spline {
    /// Creates a spline from as many control points as the basis has.
    pub(crate) fn new(basis: SplineBasis, control_points: Vec<f64>) -> Self {
        Self {
            basis,
            control_points,
        }
    }

    /// Creates a spline that rests at a position.
    pub(crate) fn at_rest(basis: SplineBasis, position: f64) -> Self {
        let control_points = vec![position; basis.count()];
        Self::new(basis, control_points)
    }

    /// Returns the spline of the same basis that begins some spans later, and rests after this one.
    ///
    /// It is the same function where the last five control points are equal: it ends at rest.
    pub(crate) fn tail(&self, spans: usize) -> Self {
        let basis = &self.basis;
        let span_s = basis.duration_s / basis.spans() as f64;
        let point = |index: usize| {
            // The first of the spans that the control point belongs to.
            let span = spans + index.saturating_sub(DEGREE);
            if span >= basis.spans() {
                return self.control_points[basis.count() - 1];
            }
            let knot = |k: usize| span_s * spans as f64 + basis.knots[index + 1 + k];
            let weights = basis.blossom(span, 0, knot);
            let points = &self.control_points[span..span + LOCAL];
            weights.iter().zip(points).map(|(w, c)| w * c).sum()
        };
        Self::new(basis.clone(), (0..basis.count()).map(point).collect())
    }

    /// Returns the spline of another basis that has the positions of this one at as many fractions
    /// of the duration as it has control points: the same function of this fraction where the other
    /// basis has the knots of this one. `None` where the interpolation has no solution.
    pub(crate) fn in_basis(&self, basis: &SplineBasis) -> Option<Self> {
        let count = basis.count();
        let mut functions = DMatrix::zeros(count, count);
        let mut values = DVector::zeros(count);
        for row in 0..count {
            // The mean of the knots inside the support of a function, where it is the largest.
            let knots = &basis.knots[row + 1..=row + DEGREE];
            let time_s = knots.iter().sum::<f64>() / DEGREE as f64;
            let local = basis.at(time_s);
            for (k, value) in local.values[0].iter().enumerate() {
                functions[(row, local.first + k)] = *value;
            }
            values[row] = self.at(time_s * self.basis.duration_s / basis.duration_s)[0];
        }
        let control_points = functions.lu().solve(&values)?;
        Some(Self::new(basis.clone(), control_points.as_slice().to_vec()))
    }

    /// Returns position, velocity and acceleration at a time, s. Before the beginning they are as
    /// at the beginning, and after the end the spline rests.
    #[must_use]
    pub fn at(&self, time_s: f64) -> [f64; 3] {
        let local = self.basis.at(time_s);
        let points = &self.control_points[local.first..local.first + LOCAL];
        local
            .values
            .map(|values| values.iter().zip(points).map(|(b, c)| b * c).sum())
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::variables::Variables;

    fn random_spline(random: &mut SmallRng, end: Option<f64>) -> Spline {
        let basis = SplineBasis::new(random.random_range(7..16), random.random_range(0.5..9.0));
        let variables = Variables::new(basis, vec![0.4], end.map(|end| vec![end]));
        let values: Vec<f64> = (0..variables.count())
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        variables.splines(&values).remove(0)
    }

    /// The functions sum to one, and a spline with Greville abscissae as control points is time.
    #[test]
    fn reproduces_constants_and_time() {
        let basis = SplineBasis::new(11, 3.0);
        let mean = |k: usize| basis.knots[k + 1..=k + DEGREE].iter().sum::<f64>() / DEGREE as f64;
        let time = Spline::new(basis.clone(), (0..11).map(mean).collect());
        let one = Spline::new(basis, vec![1.0; 11]);
        for k in 0..=300 {
            let t = f64::from(k) * 0.01;
            let [value, slope, curvature] = time.at(t);
            assert!((value - t).abs() < 1e-13 && (slope - 1.0).abs() < 1e-12);
            assert!(curvature.abs() < 1e-11, "{curvature}");
            let [value, slope, _] = one.at(t);
            assert!((value - 1.0).abs() < 1e-14 && slope.abs() < 1e-13);
        }
    }

    /// Velocity and acceleration are the derivatives of position and velocity.
    #[test]
    fn derivatives_are_those_of_the_position() {
        let mut random = SmallRng::seed_from_u64(1);
        for _ in 0..20 {
            let spline = random_spline(&mut random, Some(-0.3));
            let step = 1e-6;
            for k in 1..40 {
                let t = spline.basis.duration_s * f64::from(k) / 40.0;
                let (before, after) = (spline.at(t - step), spline.at(t + step));
                for order in 0..2 {
                    let slope = (after[order] - before[order]) / (2.0 * step);
                    let size = 1.0 + spline.at(t)[order + 1].abs();
                    assert!((slope - spline.at(t)[order + 1]).abs() < 1e-5 * size);
                }
            }
        }
    }

    /// A motion starts and ends at rest, without velocity and acceleration, at the given positions.
    #[test]
    fn both_ends_are_at_rest() {
        let mut random = SmallRng::seed_from_u64(2);
        for end in [Some(-0.3), None].repeat(10) {
            let spline = random_spline(&mut random, end);
            let [position, velocity, acceleration] = spline.at(0.0);
            assert_eq!(position, 0.4);
            assert!(velocity.abs() < 1e-12 && acceleration.abs() < 1e-10);
            let [position, velocity, acceleration] = spline.at(spline.basis.duration_s);
            assert!(velocity.abs() < 1e-10 && acceleration.abs() < 1e-9);
            assert!(end.is_none_or(|end| (position - end).abs() < 1e-14));
            assert_eq!(spline.at(1e9), spline.at(spline.basis.duration_s));
        }
    }

    /// A spline is the same function in a basis with its knots, and close with more knots.
    #[test]
    fn another_basis_has_the_same_function() {
        let mut random = SmallRng::seed_from_u64(5);
        for (count, tolerance) in [(21, 1e-11), (33, 1e-2)] {
            let basis = SplineBasis::new(13, 2.0); // 8 spans
            let points = (0..13).map(|_| random.random_range(-1.0..1.0)).collect();
            let spline = Spline::new(basis, points);
            let other = spline.in_basis(&SplineBasis::new(count, 2.0)).unwrap();
            for k in 0..=200 {
                let t = f64::from(k) * 0.01;
                let difference = (other.at(t)[0] - spline.at(t)[0]).abs();
                assert!(difference < tolerance, "{count} {t} {difference}");
            }
        }
    }

    /// In a basis of another duration, a spline is the same function of the duration's fraction.
    #[test]
    fn another_duration_stretches_the_function() {
        let mut random = SmallRng::seed_from_u64(6);
        let points = (0..13).map(|_| random.random_range(-1.0..1.0)).collect();
        let spline = Spline::new(SplineBasis::new(13, 2.0), points);
        let longer = spline.in_basis(&SplineBasis::new(21, 5.0)).unwrap();
        for k in 0..=100 {
            let t = f64::from(k) * 0.02;
            assert!((longer.at(2.5 * t)[0] - spline.at(t)[0]).abs() < 1e-11);
        }
    }

    /// The tail of a spline that stands still at its end is the same function, and has the same
    /// tail as the whole.
    #[test]
    fn a_tail_is_the_same_function() {
        let mut random = SmallRng::seed_from_u64(4);
        let basis = SplineBasis::new(15, 2.0); // 10 spans of 0.2 s
        for _ in 0..20 {
            let rest = [Spline::at_rest(basis.clone(), 0.4)];
            let variables = Variables::continuing(&basis, &rest);
            let values: Vec<f64> = (0..variables.count())
                .map(|_| random.random_range(-1.0..1.0))
                .collect();
            let whole = variables.splines(&values).remove(0);
            let tail = whole.tail(3);
            // What continues the tail with its own values is the tail.
            let again = Variables::continuing(&basis, std::slice::from_ref(&tail));
            let values = again.values([&tail].into_iter()).unwrap();
            let again = again.splines(&values).remove(0);
            for k in 0..=200 {
                let t = f64::from(k) * 0.01;
                for order in 0..3 {
                    let expected = whole.at(0.6 + t)[order];
                    assert!((tail.at(t)[order] - expected).abs() < 1e-9, "{t} {order}");
                    assert!((again.at(t)[order] - expected).abs() < 1e-9, "{t} {order}");
                }
            }
        }
    }

    /// Returns the ends of the hull of position, velocity or acceleration (order 0, 1 or 2).
    fn bounds(spline: &Spline, order: usize) -> [f64; 2] {
        let points = spline.basis.hull(order).map(|point| {
            let points = &spline.control_points[point.first..];
            point.weights.iter().zip(points).map(|(a, c)| a * c).sum()
        });
        points.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x: f64| {
            [low.min(x), high.max(x)]
        })
    }

    /// No value of a spline or of its derivatives is outside of its bounds, and the bounds of the
    /// acceleration are close to what is reached.
    #[test]
    fn bounds_hold_and_are_close() {
        let mut random = SmallRng::seed_from_u64(3);
        for _ in 0..100 {
            let spline = random_spline(&mut random, None);
            for order in 0..3 {
                let [low, high] = bounds(&spline, order);
                let slack = 1e-11 * (high - low);
                let mut reached = [f64::INFINITY, f64::NEG_INFINITY];
                for k in 0..=500 {
                    let value = spline.at(spline.basis.duration_s * f64::from(k) / 500.0)[order];
                    assert!((low - slack..=high + slack).contains(&value));
                    reached = [reached[0].min(value), reached[1].max(value)];
                }
                assert!(order < 2 || reached[1] - reached[0] > 0.75 * (high - low));
            }
        }
    }
}
