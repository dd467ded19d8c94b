//! Intervals of 95 % that claim no more than what a body can have.

use super::uncertainty::HALF_WIDTH_95;
use crate::prior::BoundingBox;

/// Limits of an interval, in the unit of the value.
type Interval = [f64; 2];

/// Indices of the moments of inertia among the ten values, by axis.
const MOMENTS: [usize; 3] = [4, 7, 9];

/// Indices of the products of inertia among the ten values, by the axis that is not in their names.
const PRODUCTS: [usize; 3] = [8, 6, 5];

/// Returns the 95 % intervals of the ten values, given their standard deviations. Cost: some 100
/// operations.
///
/// Each is the interval of the measurements, cut off where no body has a value; so it contains the
/// truth whenever the interval of the measurements and those that bound it do:
///
/// - The mass and the moments of inertia are not negative.
/// - The centre of mass is in the bounding box.
/// - About the centre of mass, no moment exceeds the sum of the two others (triangle inequality),
///   and no product exceeds half of the moment about the third axis, because `2 |x y| ≤ x² + y²`.
/// - In a box with sides `a` and `b` the variance of a coordinate is at most `a² / 4` (Popoviciu
///   1935), so a moment is at most `m (a² + b²) / 4` and a product at most `m a b / 4`.
///
/// Where a bound depends on another value, it is the one at the upper limit of that value's
/// interval. The values of a body that cannot exist, with a mass that is not positive, have the
/// intervals of the measurements.
pub(crate) fn intervals(
    values: &[f64; 10],
    std_devs: &[f64; 10],
    bounding_box: Option<&BoundingBox>,
) -> [Interval; 10] {
    let measured = std::array::from_fn(|k| {
        let half_width = HALF_WIDTH_95 * std_devs[k];
        [values[k] - half_width, values[k] + half_width]
    });
    if values[0] <= 0.0 {
        return measured;
    }
    let mut bounded = Bounded {
        values,
        intervals: measured,
    };
    let mass_kg = bounded.cut(0, 0.0, f64::INFINITY);
    let squares = bounding_box.map(|given| {
        for axis in 0..3 {
            bounded.cut(1 + axis, given.min[axis], given.max[axis]);
        }
        (given.max - given.min).map(|side| 0.25 * side * side)
    });
    let in_box = |a: usize, b: usize, of: fn(f64, f64) -> f64| {
        squares.map_or(f64::INFINITY, |squares| {
            mass_kg * of(squares[a], squares[b])
        })
    };
    let others = |axis: usize| ((axis + 1) % 3, (axis + 2) % 3);
    let measured = [0, 1, 2].map(|axis| {
        let (a, b) = others(axis);
        bounded.cut(MOMENTS[axis], 0.0, in_box(a, b, |a, b| a + b))
    });
    for axis in 0..3 {
        let (a, b) = others(axis);
        let moment = bounded.cut(MOMENTS[axis], 0.0, measured[a] + measured[b]);
        let most = in_box(a, b, |a, b| (a * b).sqrt()).min(0.5 * moment);
        bounded.cut(PRODUCTS[axis], -most, most);
    }
    bounded.intervals
}

/// Intervals that become shorter.
struct Bounded<'a> {
    values: &'a [f64; 10],
    intervals: [Interval; 10],
}

impl Bounded<'_> {
    /// Cuts an interval off at limits and returns its upper end. The estimate stays inside: one on
    /// a limit may be beyond it by rounding.
    fn cut(&mut self, k: usize, low: f64, high: f64) -> f64 {
        let interval = &mut self.intervals[k];
        interval[0] = interval[0].max(low.min(self.values[k]));
        interval[1] = interval[1].min(high.max(self.values[k]));
        interval[1]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use tactid_dynamics::{InertialParameters, MassProperties};

    use super::*;
    use crate::result;

    /// Ten values and their standard deviations.
    fn measured() -> ([f64; 10], [f64; 10]) {
        let values = [2.0, 0.1, 0.0, 0.2, 0.03, 0.0, 0.001, 0.04, 0.0, 0.02];
        (values, [0.01; 10])
    }

    /// A box of 0.2 m by 0.4 m by 0.6 m around the origin.
    fn given() -> BoundingBox {
        let max = Vector3::new(0.1, 0.2, 0.3);
        BoundingBox { min: -max, max }
    }

    /// Returns the intervals when one standard deviation is infinite.
    fn without(k: usize, bounding_box: Option<&BoundingBox>) -> [Interval; 10] {
        let (values, mut std_devs) = measured();
        std_devs[k] = f64::INFINITY;
        intervals(&values, &std_devs, bounding_box)
    }

    /// Checks an interval.
    fn assert_is(found: Interval, expected: Interval) {
        let near = |a: f64, b: f64| a == b || (a - b).abs() < 1e-12;
        assert!(
            near(found[0], expected[0]) && near(found[1], expected[1]),
            "{found:?} instead of {expected:?}"
        );
    }

    /// Far from what no body can have, an interval is 1.96 standard deviations to each side.
    #[test]
    fn what_nothing_bounds_is_symmetric() {
        let (values, std_devs) = measured();
        let found = intervals(&values, &std_devs, None);
        for k in [0, 1, 2, 3, 4, 7] {
            assert_is(found[k], [values[k] - 0.0196, values[k] + 0.0196]);
        }
    }

    /// Each bound, computed by hand: the moments of the others are at most 0.0496, 0.0596 and
    /// 0.0396.
    #[test]
    fn a_body_bounds_what_noise_does_not() {
        let infinity = f64::INFINITY;
        assert_is(without(0, None)[0], [0.0, infinity]);
        assert_is(without(3, None)[3], [-infinity, infinity]);
        assert_is(without(4, None)[4], [0.0, 0.0596 + 0.0396]);
        assert_is(without(7, None)[7], [0.0, 0.0496 + 0.0396]);
        assert_is(without(9, None)[9], [0.0, 0.0496 + 0.0596]);
        assert_is(without(5, None)[5], [-0.0198, 0.0198]);
        assert_is(without(6, None)[6], [-0.0298, 0.0298]);
        assert_is(without(8, None)[8], [-0.0248, 0.0248]);
    }

    /// The box bounds each value as by hand, with the mass at its upper limit of 2.0196 kg.
    #[test]
    fn a_box_bounds_what_noise_does_not() {
        let given = given();
        assert_is(without(0, Some(&given))[0], [0.0, f64::INFINITY]);
        for (k, most) in [(1, 0.1), (2, 0.2), (3, 0.3)] {
            assert_is(without(k, Some(&given))[k], [-most, most]);
        }
        let (values, mut std_devs) = measured();
        std_devs[4..].fill(f64::INFINITY);
        let found = intervals(&values, &std_devs, Some(&given));
        let (mass_kg, [x, y, z]) = (2.0196, [0.01, 0.04, 0.09]);
        for (k, most) in [(4, y + z), (7, x + z), (9, x + y)] {
            assert_is(found[k], [0.0, mass_kg * most]);
        }
        for (k, most) in [(5, 0.02), (6, 0.03), (8, 0.06)] {
            assert_is(found[k], [-mass_kg * most, mass_kg * most]);
        }
    }

    /// No body in the box is outside of the intervals of the box alone, whatever its mass
    /// distribution, also point masses in the corners, which reach the limits.
    #[test]
    fn no_body_is_cut_off() {
        let mut random = SmallRng::seed_from_u64(7);
        let given = given();
        let mut nearest = f64::INFINITY;
        for draw in 0..2000 {
            let mut body = InertialParameters::from(result::body_of_values(&[0.0; 10]));
            for _ in 0..1 + draw % 5 {
                let place = given.max.map(|most| {
                    let at: f64 = random.random_range(-3.0..3.0);
                    most * at.clamp(-1.0, 1.0)
                });
                body = body
                    + InertialParameters::from(MassProperties {
                        mass_kg: random.random_range(0.1..1.0),
                        center_of_mass: place,
                        inertia: nalgebra::Matrix3::zeros(),
                    });
            }
            let truth = result::values_of_body(&body.mass_properties().unwrap());
            let mut std_devs = [f64::INFINITY; 10];
            std_devs[0] = 0.0;
            // The limits depend on the mass alone: the estimate is elsewhere.
            let mut estimate = [0.0; 10];
            estimate[0] = truth[0];
            let found = intervals(&estimate, &std_devs, Some(&given));
            for k in 1..10 {
                let ([low, high], rounding) = (found[k], 1e-12);
                assert!(
                    low - rounding <= truth[k] && truth[k] <= high + rounding,
                    "{k}: {truth:?}"
                );
                nearest = nearest.min(high - truth[k]);
            }
        }
        assert!(nearest < 1e-6, "no body reaches a limit: {nearest}");
    }

    /// An estimate beyond a bound by rounding stays inside its interval, and that of an impossible
    /// body is not bounded.
    #[test]
    fn the_estimate_is_inside() {
        let (mut values, std_devs) = measured();
        values[9] = 0.07 + 1e-12;
        values[4] = -1e-15;
        for bounding_box in [None, Some(&given())] {
            for (value, [low, high]) in
                values
                    .iter()
                    .zip(intervals(&values, &std_devs, bounding_box))
            {
                assert!(low <= *value && *value <= high);
            }
        }
        values[0] = -2.0;
        assert_is(intervals(&values, &std_devs, None)[4], [-0.0196, 0.0196]);
    }
}
