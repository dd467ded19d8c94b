//! Clamped uniform B-splines of degree five that begin and end at rest.

/// Degree of the splines. Their acceleration is a spline of degree three, which is smooth.
const DEGREE: usize = 5;

/// Control points at each end that the conditions of rest make equal: position, velocity and acceleration.
const AT_REST: usize = 3;

/// Fewest control points of a motion with a free control point beside those at rest.
pub const FEWEST_CONTROL_POINTS: usize = 2 * AT_REST + 1;

/// Parts that each span is divided into for the hull of position, velocity and acceleration. Of an acceleration that
/// oscillates as fast as the splines can, the control points are a third larger than the function, and those of the parts a
/// few percent; lower derivatives are smoother.
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
/// A spline lies in the hull of its control points, and its derivatives are splines of lower degree whose control points
/// are differences of its own. A limit on the control points of a derivative therefore holds at all times.
#[derive(Clone, Debug)]
pub(crate) struct SplineBasis {
    knots: Vec<f64>,
    count: usize,
    duration_s: f64,
}

impl SplineBasis {
    /// Creates the functions for so many control points, at least [`FEWEST_CONTROL_POINTS`], over a positive duration, s.
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

    /// Returns the functions and their derivatives at a time; times outside of the motion count as its ends.
    pub(crate) fn at(&self, time_s: f64) -> LocalBasis {
        let time_s = time_s.clamp(0.0, self.duration_s);
        let spans = self.spans();
        let span = ((time_s / self.duration_s * spans as f64) as usize).min(spans - 1);
        let mut all = [[0.0; LOCAL]; LOCAL];
        all[0][0] = 1.0;
        // Cox and de Boor: row p has the functions of degree p, the last of which begins at knot `span + DEGREE`.
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

    /// Returns what each control point contributes to a derivative, given the functions of the lower degree in a span.
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

    /// Returns the coefficients of three successive control points, the first of which has the index given, in the control
    /// point with this index of the derivative of an order from 0 to 2. A spline with `n` control points has a derivative
    /// of order `k` with `n - k` control points.
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

    /// Returns the points between which the derivative of an order from 0 to 2 is at all times: its control points after
    /// each span has been divided into [`PARTS`], which the function is closer to than to its own.
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

    /// Returns the weights of the control points of a derivative in the blossom of its polynomial on a span, by the
    /// algorithm of de Boor with one argument in each step.
    fn blossom(&self, span: usize, order: usize, argument: impl Fn(usize) -> f64) -> [f64; LOCAL] {
        let degree = DEGREE - order;
        let mut rows = [[0.0; LOCAL]; LOCAL];
        for (k, row) in rows.iter_mut().enumerate() {
            row[k] = 1.0;
        }
        for step in 1..=degree {
            let at = argument(step - 1);
            for k in (step..=degree).rev() {
                // The knots of a derivative are those of the spline without `order` of them at each end.
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
    control_points: Vec<f64>,
}

impl Spline {
    /// Creates a spline from as many control points as the basis has.
    pub(crate) fn new(basis: SplineBasis, control_points: Vec<f64>) -> Self {
        Self {
            basis,
            control_points,
        }
    }

    /// Returns position, velocity and acceleration at a time, s. Before the beginning and after the end the spline rests.
    #[must_use]
    pub fn at(&self, time_s: f64) -> [f64; 3] {
        let local = self.basis.at(time_s);
        let points = &self.control_points[local.first..local.first + LOCAL];
        local
            .values
            .map(|values| values.iter().zip(points).map(|(b, c)| b * c).sum())
    }
}

/// Where a motion ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum End {
    /// In the posture in which it starts.
    #[default]
    Start,
    /// Anywhere within the limits.
    Free,
    /// In a given posture: a position for each joint of the robot, rad or m. Joints that do not move end where they start.
    At(Vec<f64>),
}

/// A control point of a joint.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ControlPoint {
    /// The variable with this index.
    Variable(usize),
    /// A value that a condition at one of the ends gives, rad or m.
    Fixed(f64),
}

/// The control points of several joints as functions of the variables that the conditions at both ends leave free.
#[derive(Clone, Debug)]
pub(crate) struct Variables {
    pub(crate) basis: SplineBasis,
    /// Positions of the joints at the beginning.
    start: Vec<f64>,
    /// Positions at the end, where they are given.
    end: Option<Vec<f64>>,
}

impl Variables {
    /// Creates the variables of joints that start at `start` and end at `end`, or anywhere.
    pub(crate) fn new(basis: SplineBasis, start: Vec<f64>, end: Option<Vec<f64>>) -> Self {
        Self { basis, start, end }
    }

    /// Number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.start.len()
    }

    /// Number of variables of one joint.
    pub(crate) fn of_joint(&self) -> usize {
        self.basis.count() - 2 * AT_REST + usize::from(self.end.is_none())
    }

    /// Number of all variables. Those of one joint follow one another.
    pub(crate) fn count(&self) -> usize {
        self.joints() * self.of_joint()
    }

    /// Returns what a control point of a joint is.
    pub(crate) fn control_point(&self, joint: usize, point: usize) -> ControlPoint {
        let after = self.basis.count() - AT_REST;
        match &self.end {
            _ if point < AT_REST => ControlPoint::Fixed(self.start[joint]),
            Some(end) if point >= after => ControlPoint::Fixed(end[joint]),
            _ => ControlPoint::Variable(joint * self.of_joint() + point.min(after) - AT_REST),
        }
    }

    /// Returns the values of all variables for the control points of a motion from start to end without excursion: the
    /// joints rest, or move along one smooth step.
    pub(crate) fn direct(&self) -> Vec<f64> {
        let mut values = vec![0.0; self.count()];
        let last = (self.basis.count() - 2 * AT_REST + 1) as f64;
        for joint in 0..self.joints() {
            for point in AT_REST..self.basis.count() {
                if let ControlPoint::Variable(variable) = self.control_point(joint, point) {
                    let start = self.start[joint];
                    let end = self.end.as_ref().map_or(start, |end| end[joint]);
                    let fraction = ((point + 1 - AT_REST) as f64 / last).min(1.0);
                    let smooth = fraction * fraction * (3.0 - 2.0 * fraction);
                    values[variable] = start + (end - start) * smooth;
                }
            }
        }
        values
    }

    /// Returns the values of the variables of splines of all joints, or `None` for splines of another basis.
    pub(crate) fn values<'a>(&self, splines: impl Iterator<Item = &'a Spline>) -> Option<Vec<f64>> {
        let mut values = Vec::with_capacity(self.count());
        for spline in splines {
            let points = spline
                .control_points
                .get(AT_REST..AT_REST + self.of_joint());
            let has_same_basis = spline.control_points.len() == self.basis.count();
            values.extend_from_slice(points.filter(|_| has_same_basis)?);
        }
        (values.len() == self.count()).then_some(values)
    }

    /// Returns the splines of all joints.
    pub(crate) fn splines(&self, values: &[f64]) -> Vec<Spline> {
        let spline = |joint| {
            let point = |k| match self.control_point(joint, k) {
                ControlPoint::Variable(variable) => values[variable],
                ControlPoint::Fixed(fixed) => fixed,
            };
            let points = (0..self.basis.count()).map(point);
            Spline::new(self.basis.clone(), points.collect())
        };
        (0..self.joints()).map(spline).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;

    fn random_spline(random: &mut SmallRng, end: Option<f64>) -> Spline {
        let basis = SplineBasis::new(random.random_range(7..16), random.random_range(0.5..9.0));
        let variables = Variables::new(basis, vec![0.4], end.map(|end| vec![end]));
        let values: Vec<f64> = (0..variables.count())
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        variables.splines(&values).remove(0)
    }

    /// The functions sum to one, and a spline whose control points are the Greville abscissae is the time itself.
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

    /// A motion starts and ends at rest: velocity and acceleration vanish there, and the positions are those given.
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

    /// Returns the ends of the hull of the position, the velocity or the acceleration (order 0, 1 or 2).
    fn bounds(spline: &Spline, order: usize) -> [f64; 2] {
        let points = spline.basis.hull(order).map(|point| {
            let points = &spline.control_points[point.first..];
            point.weights.iter().zip(points).map(|(a, c)| a * c).sum()
        });
        points.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x: f64| {
            [low.min(x), high.max(x)]
        })
    }

    /// No value of a spline or of its derivatives is outside of its bounds, and those of the acceleration are close to
    /// what is reached.
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
