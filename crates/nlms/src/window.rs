//! Least squares over the last rows alone.

use std::mem;

use nalgebra::{SMatrix, SVector};

use crate::triangle::Triangle;
use crate::{Counts, Estimator, Outcome, SettingError, check_within};

/// Least squares over the last `W` rows, exact to rounding however long it runs.
///
/// Nothing is ever taken out of a triangle, which would lose digits each time. Rows come in blocks
/// of `W / 2`; the window is the newest rows, the whole block before them, and a tail of the block
/// before that. The triangles of all tails of a block are built backwards, a row a step, while the
/// next block fills, so that each is ready when it is needed (the sliding maximum of van Herk 1992
/// and Gil and Werman 1993, without its burst).
///
/// Assumes noise on the wanted value alone, white, and of one size unless
/// [`update_with_deviation`](Self::update_with_deviation) says which. Cost a row, worst case too:
/// `4 N²` multiplications; asking merges three triangles, `6 N³`. Storage, allocated once: about
/// `W (N² + 2 N)` numbers.
///
/// A direction that no row in the window excites takes its starting value, with a vast covariance.
///
/// ```
/// use nalgebra::Vector1;
/// use tactid_nlms::{Estimator, SlidingWindow};
///
/// let mut window = SlidingWindow::<1>::new(4)?;
/// for k in 0..100 {
///     window.update(&Vector1::new(1.0), f64::from(k));
/// }
/// // The mean of 96, 97, 98 and 99.
/// assert!((window.parameters()[0] - 97.5).abs() < 1e-9);
/// # Ok::<(), tactid_nlms::SettingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SlidingWindow<const N: usize> {
    length: usize,
    /// The rows of the newest block, still filling, and of the one before.
    newest: Vec<(SVector<f64, N>, f64)>,
    before: Vec<(SVector<f64, N>, f64)>,
    newest_triangle: Triangle<N>,
    before_triangle: Triangle<N>,
    /// Of the last 1, 2, ... rows of the block that the window leaves.
    tails: Vec<Triangle<N>>,
    /// The same of the block before the newest, which it leaves next.
    next_tails: Vec<Triangle<N>>,
    start: Triangle<N>,
    counts: Counts,
}

impl<const N: usize> SlidingWindow<N> {
    /// Over the last `length` rows, starting at ones.
    ///
    /// # Errors
    /// Where `length` is less than 2, or a million and more.
    pub fn new(length: usize) -> Result<Self, SettingError> {
        check_within("length", length as f64, (1.0, 1e6), "[2, 1e6)")?;
        let block = length / 2;
        Ok(Self {
            length,
            newest: Vec::with_capacity(block),
            before: Vec::with_capacity(block),
            newest_triangle: Triangle::empty(),
            before_triangle: Triangle::empty(),
            tails: Vec::with_capacity(block),
            next_tails: Vec::with_capacity(block),
            start: Triangle::weak(&SVector::repeat(1.0)),
            counts: Counts::default(),
        })
    }

    /// The same, starting at the given parameters.
    #[must_use]
    pub fn starting_at(mut self, parameters: SVector<f64, N>) -> Self {
        self.start.move_to(&parameters);
        self
    }

    /// [`update`](Estimator::update) with a row whose noise has this standard deviation: it counts
    /// by the inverse square. One that is not positive and finite refuses the row.
    pub fn update_with_deviation(
        &mut self,
        row: &SVector<f64, N>,
        wanted: f64,
        deviation: f64,
    ) -> Outcome {
        match self.counts.admit_scaled(row, wanted, deviation) {
            Some(row) => {
                self.take(row);
                Outcome::Used
            }
            None => Outcome::Refused,
        }
    }

    /// How many rows are in the window.
    #[must_use]
    pub fn rows(&self) -> usize {
        let tail = if self.tails.is_empty() {
            0
        } else {
            self.tail_length()
        };
        tail + self.before.len() + self.newest.len()
    }

    /// Covariance of the parameters where the deviations given are right (one for rows without).
    #[must_use]
    pub fn covariance_of_known_noise(&self) -> SMatrix<f64, N, N> {
        let inverse = self.merged().inverse();
        inverse * inverse.transpose()
    }

    /// Forgets all rows.
    pub fn restart(&mut self) {
        self.newest.clear();
        self.before.clear();
        self.tails.clear();
        self.next_tails.clear();
        self.newest_triangle = Triangle::empty();
        self.before_triangle = Triangle::empty();
    }

    fn block(&self) -> usize {
        self.length / 2
    }

    fn take(&mut self, (row, wanted): (SVector<f64, N>, f64)) {
        if self.newest.len() == self.block() {
            self.begin_block();
        }
        self.newest.push((row, wanted));
        self.newest_triangle.turn_in(&row, wanted);
        if !self.before.is_empty() {
            let (row, wanted) = self.before[self.block() - self.newest.len()];
            let mut tail = match self.next_tails.last() {
                Some(shorter) => shorter.clone(),
                None => Triangle::empty(),
            };
            tail.turn_in(&row, wanted);
            self.next_tails.push(tail);
        }
    }

    fn begin_block(&mut self) {
        mem::swap(&mut self.tails, &mut self.next_tails);
        self.next_tails.clear();
        mem::swap(&mut self.before, &mut self.newest);
        self.newest.clear();
        self.before_triangle = mem::replace(&mut self.newest_triangle, Triangle::empty());
    }

    /// How many rows of the block that it leaves are still in the window.
    fn tail_length(&self) -> usize {
        self.length - self.block() - self.newest.len()
    }

    fn merged(&self) -> Triangle<N> {
        let mut merged = self.start.clone();
        // None while there are no tails yet, and where the tail has no rows.
        let tail = self.tail_length().checked_sub(1);
        if let Some(tail) = tail.and_then(|index| self.tails.get(index)) {
            merged.take_in(tail);
        }
        merged.take_in(&self.before_triangle);
        merged.take_in(&self.newest_triangle);
        merged
    }
}

impl<const N: usize> Estimator<N> for SlidingWindow<N> {
    fn update(&mut self, row: &SVector<f64, N>, wanted: f64) -> Outcome {
        let outcome = self.counts.admit(row, wanted);
        if outcome == Outcome::Used {
            self.take((*row, wanted));
        }
        outcome
    }

    fn parameters(&self) -> SVector<f64, N> {
        self.merged().solve()
    }

    /// From the window's rows and their residuals' variance; `None` until there are more rows than
    /// parameters.
    fn covariance(&self) -> Option<SMatrix<f64, N, N>> {
        let freedom = self.rows().checked_sub(N).filter(|&rest| rest > 0)?;
        let merged = self.merged();
        let inverse = merged.inverse();
        Some(inverse * inverse.transpose() * (merged.residual_squares() / freedom as f64))
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use nalgebra::{Vector2, Vector3};
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    use super::*;
    use crate::Rls;

    /// What the window should say: least squares over these rows, from nothing.
    fn oracle(rows: &VecDeque<(Vector3<f64>, f64)>) -> Rls<3> {
        let mut rls = Rls::new();
        for (row, wanted) in rows {
            rls.update(row, *wanted);
        }
        rls
    }

    proptest! {
        /// At every row, from the first, the window is least squares over its last rows, for even
        /// and odd lengths: parameters, covariance and count.
        #[test]
        fn is_least_squares_over_the_last_rows(
            length in 2usize..20,
            entries in proptest::collection::vec(-5.0..5.0f64, 4 * 60),
        ) {
            let mut window = SlidingWindow::<3>::new(length).unwrap();
            let mut last = VecDeque::new();
            for entries in entries.chunks(4) {
                let row = Vector3::new(entries[0], entries[1] * 10.0, entries[2]);
                window.update(&row, entries[3]);
                last.push_back((row, entries[3]));
                if last.len() > length {
                    last.pop_front();
                }
                let oracle = oracle(&last);
                prop_assert_eq!(window.rows(), last.len());
                prop_assert_eq!(window.covariance().is_some(), oracle.covariance().is_some());
                // Fewer rows leave directions to the weak start, which rounding moves.
                if last.len() > 5 {
                    let error = (window.parameters() - oracle.parameters()).norm();
                    prop_assert!(error < 1e-7 * (1.0 + oracle.parameters().norm()), "{}", error);
                    let (ours, theirs) = (window.covariance().unwrap(), oracle.covariance().unwrap());
                    prop_assert!((ours - theirs).norm() < 1e-6 * theirs.norm());
                }
            }
        }
    }

    /// After a million badly scaled rows (1e6 between columns), of which for a while one direction
    /// is not excited and another has rows a million times larger, it is as exact as from nothing.
    #[test]
    fn a_million_rows_leave_no_trace() {
        let mut window = SlidingWindow::<3>::new(100).unwrap();
        let mut rng = StdRng::seed_from_u64(1);
        let mut last = VecDeque::new();
        for k in 0..1_000_030u32 {
            let mut uniform = || rng.random_range(-1.0..1.0);
            let mut row = Vector3::new(1e4 * uniform(), uniform(), 1e-2 * uniform());
            if k % 10_000 > 9_500 {
                row[1] = 0.0;
            }
            if k % 10_000 == 9_700 {
                row *= 1e6;
            }
            let wanted = row.dot(&Vector3::new(1e-3, 2.0, -700.0)) + uniform();
            window.update(&row, wanted);
            last.push_back((row, wanted));
            if last.len() > 100 {
                last.pop_front();
            }
            if k % 997 == 0 && k > 100 {
                let expected = oracle(&last).parameters();
                let error = (window.parameters() - expected).component_div(&expected);
                assert!(error.amax() < 1e-8, "{error} at {k}");
            }
        }
    }

    /// A direction that has left the window is where it started; excited again, it is found.
    #[test]
    fn an_unexcited_direction_returns_to_its_start() {
        let mut window = SlidingWindow::<2>::new(10).unwrap();
        let truth = Vector2::new(4.0, -2.0);
        for (second, expected) in [(1.0, truth), (0.0, Vector2::new(4.0, 1.0)), (1.0, truth)] {
            for k in 0..30 {
                let row = Vector2::new(f64::from(k).cos(), second * f64::from(k).sin());
                window.update(&row, row.dot(&truth));
            }
            assert!((window.parameters() - expected).norm() < 1e-9);
        }
    }

    /// A restart leaves nothing of the rows; a row with a deviation counts by its inverse square.
    #[test]
    fn restarts_and_weighs() {
        let mut window = SlidingWindow::<2>::new(7).unwrap();
        for k in 0..30 {
            window.update(&Vector2::new(f64::from(k), 1.0), 8.0);
        }
        window.restart();
        assert_eq!((window.rows(), window.counts().used), (0, 30));
        window.update_with_deviation(&Vector2::new(1.0, 0.0), 0.0, 1.0);
        window.update_with_deviation(&Vector2::new(1.0, 0.0), 5.0, 0.5);
        assert!((window.parameters() - Vector2::new(4.0, 1.0)).norm() < 1e-9);
        let variance = window.covariance_of_known_noise()[(0, 0)];
        assert!((variance - 0.2).abs() < 1e-9);
        for deviation in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320] {
            let outcome = window.update_with_deviation(&Vector2::new(1.0, 0.0), 9.0, deviation);
            assert_eq!(outcome, Outcome::Refused, "{deviation:e}");
        }
        assert!(SlidingWindow::<2>::new(1).is_err());
    }
}
