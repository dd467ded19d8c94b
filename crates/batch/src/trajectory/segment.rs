//! A stretch of a recording with the splines of its motion.

use std::ops::Range;

use nalgebra::{DMatrix, Isometry3, Quaternion, SMatrix, UnitQuaternion, Vector3, Vector4};
use tactid_dynamics::FrameMotion;

use super::SETTINGS;
use super::bins::Bin;
use super::spline::{Basis, basis, order};

/// Values of all coordinates at one time, then their first and second derivatives.
pub(super) type Derivatives = [Vec<f64>; 3];

/// Knots of splines at equal distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knots {
    /// Time of the first knot, s.
    pub(super) first_s: f64,
    /// Number of knots in a second, Hz.
    pub(super) rate_hz: f64,
}

impl Knots {
    /// Returns the number of intervals between the first knot and a time.
    pub(super) fn intervals_until(self, time_s: f64) -> f64 {
        (time_s - self.first_s) * self.rate_hz
    }
}

/// Bins without a gap, and the coefficients of the splines of all coordinates: the joints, then
/// those of the base: its position, and the quaternion x, y, z, w of its rotation.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub(super) bins: Vec<Bin>,
    /// Index of the first spline that is not zero at the time of each bin.
    pub(super) spans: Vec<usize>,
    /// The splines at the time of each bin, with derivatives with respect to time.
    pub(super) bases: Vec<Basis>,
    /// Number of splines.
    pub(super) splines: usize,
    pub(super) coordinates: usize,
    /// Coefficients of all coordinates of the first spline, then of the others.
    pub(super) coefficients: Vec<f64>,
}

impl Segment {
    /// Creates a segment of so many coordinates, at rest at zero, whose first and last knots are at
    /// bins.
    pub(super) fn new(bins: &[Bin], coordinates: usize) -> Self {
        let first_s = bins[0].time_s;
        let length_s = bins[bins.len() - 1].time_s - first_s;
        let intervals = (length_s * SETTINGS.knots_hz).ceil().max(1.0);
        let knots = Knots {
            first_s,
            rate_hz: intervals / length_s,
        };
        Self::with_knots(bins.to_vec(), coordinates, knots, 0..intervals as usize)
    }

    /// Creates a segment of so many coordinates, at rest at zero, from bins in some of the intervals
    /// between knots.
    pub(super) fn with_knots(
        bins: Vec<Bin>,
        coordinates: usize,
        knots: Knots,
        intervals: Range<usize>,
    ) -> Self {
        let (mut spans, mut bases) = (Vec::new(), Vec::new());
        let (first, last) = (intervals.start as f64, intervals.end as f64 - 1.0);
        for bin in &bins {
            let x = knots.intervals_until(bin.time_s);
            let span = x.floor().clamp(first, last);
            let [value, rate, second] = basis(x - span);
            spans.push(span as usize - intervals.start);
            bases.push([
                value,
                rate.map(|entry| entry * knots.rate_hz),
                second.map(|entry| entry * knots.rate_hz * knots.rate_hz),
            ]);
        }
        // One for each interval, and those that reach into the last one.
        let splines = intervals.len() + order() - 1;
        Self {
            bins,
            spans,
            bases,
            splines,
            coordinates,
            coefficients: vec![0.0; splines * coordinates],
        }
    }

    /// Returns the part without some of the first intervals, with its coefficients.
    pub(super) fn without_first(mut self, first: usize) -> Self {
        let earlier = self.spans.partition_point(|&span| span < first);
        self.bins.drain(..earlier);
        self.spans.drain(..earlier);
        self.bases.drain(..earlier);
        self.spans.iter_mut().for_each(|span| *span -= first);
        self.splines -= first;
        self.coefficients.drain(..first * self.coordinates);
        self
    }

    /// Fraction of the degrees of freedom of values at the bins that splines leave.
    pub(super) fn freedom(&self) -> f64 {
        let bins = self.bins.len() as f64;
        (bins - self.splines as f64) / bins
    }

    /// Returns the coordinates with their derivatives at a bin.
    pub(super) fn at(&self, bin: usize) -> Derivatives {
        let coordinates = self.coordinates;
        let mut at = [0, 1, 2].map(|_| vec![0.0; coordinates]);
        for (values, weights) in at.iter_mut().zip(&self.bases[bin]) {
            for (spline, weight) in weights.iter().enumerate() {
                let first = (self.spans[bin] + spline) * coordinates;
                let coefficients = &self.coefficients[first..first + coordinates];
                for (value, coefficient) in values.iter_mut().zip(coefficients) {
                    *value += weight * coefficient;
                }
            }
        }
        at
    }

    /// Returns what coefficients of the splines, in rows, change in the coordinates and their first
    /// and second derivatives at a bin.
    pub(super) fn state_of(&self, bin: usize, coefficients: &DMatrix<f64>) -> DMatrix<f64> {
        let size = self.coordinates;
        let mut state = DMatrix::zeros(3 * size, coefficients.ncols());
        for (derivative, weights) in self.bases[bin].iter().enumerate() {
            let mut place = state.rows_mut(derivative * size, size);
            for (spline, weight) in weights.iter().enumerate() {
                let first = (self.spans[bin] + spline) * size;
                place += coefficients.rows(first, size) * *weight;
            }
        }
        state
    }

    /// Returns the product of the transpose of [`state_of`](Self::state_of) with a matrix: that of
    /// the splines that are not zero at the bin.
    pub(super) fn by_coefficients(&self, bin: usize, by_state: &DMatrix<f64>) -> DMatrix<f64> {
        let size = self.coordinates;
        let mut product = DMatrix::zeros(order() * size, by_state.ncols());
        for (from, mut to) in by_state.column_iter().zip(product.column_iter_mut()) {
            for (derivative, weights) in self.bases[bin].iter().enumerate() {
                let from = from.rows(derivative * size, size);
                for (spline, weight) in weights.iter().enumerate() {
                    to.rows_mut(spline * size, size).axpy(*weight, &from, 1.0);
                }
            }
        }
        product
    }
}

/// Returns position and quaternion of the base, the last coordinates, or derivatives of both.
fn base_vectors(values: &[f64]) -> (Vector3<f64>, Vector4<f64>) {
    let (others, quaternion) = values.split_at(values.len() - 4);
    (
        Vector3::from_column_slice(&others[others.len() - 3..]),
        Vector4::from_column_slice(quaternion),
    )
}

/// Returns the quaternion of the base with its derivatives.
pub(super) fn quaternions(at: &Derivatives) -> [Vector4<f64>; 3] {
    [0, 1, 2].map(|order| base_vectors(&at[order]).1)
}

/// Returns the matrix whose product with `a` is the imaginary vector of the quaternion `a q̄`.
pub(super) fn imaginary(q: &Vector4<f64>) -> SMatrix<f64, 3, 4> {
    let [x, y, z, w] = [q.x, q.y, q.z, q.w];
    SMatrix::<f64, 3, 4>::new(w, -z, y, -x, z, w, -x, -y, -y, x, w, -z)
}

/// Returns the motion of the base. The quaternion need not have unit length: the rotation is that
/// of its direction.
pub(super) fn base_motion(at: &Derivatives) -> FrameMotion {
    let [(position, q), (velocity, rate), (acceleration, second)] =
        [0, 1, 2].map(|order| base_vectors(&at[order]));
    let (square, matrix) = (q.norm_squared(), imaginary(&q));
    // ω = 2 vec(q̇ q̄) / |q|², whose derivative lacks vec(q̇ q̇̄) = 0.
    let angular_velocity = matrix * rate * (2.0 / square);
    let of_length = 2.0 * q.dot(&rate) / square;
    FrameMotion {
        pose: Isometry3::from_parts(
            position.into(),
            UnitQuaternion::new_normalize(Quaternion::from(q)),
        ),
        velocity,
        angular_velocity,
        acceleration,
        angular_acceleration: matrix * second * (2.0 / square) - angular_velocity * of_length,
    }
}
