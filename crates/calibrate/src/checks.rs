//! Efforts that cannot belong to their joint: constant while it moves, or of the opposite sign.

use nalgebra::{SMatrix, SVector};

use super::arm::PLAIN;
use super::fit::{MOVES, PAYLOAD_SCALES};
use super::payload::KnownPayload;
use super::recording::EffortRecording;
use super::rows::EffortModel;
use crate::CalibrateError;

/// Fewest windows from which a sign is determined: chance explains fewer with either.
const MIN_WINDOWS: usize = 20;

/// A sign is opposite if the negated efforts leave less than this fraction of the sum of squares.
const OPPOSITE: f64 = 0.25;

/// Variation of efforts that counts as none, a fraction of their mean: rounding leaves less.
const CONSTANT: f64 = 1e-9;

/// Precision of the least squares for the sign, a fraction of the data's: enough to solve them.
const WEAKNESS: f64 = 1e-9;

/// Number of columns that explain efforts: offset, acceleration, torque, velocity, and its sign.
/// The last three have positive factors.
const COLUMNS: usize = 5;
const POSITIVE: usize = 3;

impl EffortRecording {
    /// Checks that no effort is constant while its joint moves and others vary, and that none has
    /// the opposite sign of the torque that the robot's description and the `payload` need, with
    /// friction that brakes. Scales do not matter.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Data`] with the first such joint.
    pub fn check_efforts(&self, payload: Option<&KnownPayload>) -> Result<(), CalibrateError> {
        self.check_varies()?;
        let held = payload.map(|payload| *payload.parameters().as_vector());
        let is_reversed = |&joint: &usize| {
            let mut sums = Sums::<COLUMNS>::default();
            for window in 0..self.windows() {
                let columns = self.columns(window, joint);
                let torque =
                    columns.described + held.map_or(0.0, |held| columns.payload.dot(&held));
                let (rate, sign) = (columns.velocity, columns.friction[PLAIN]);
                let row = [1.0, columns.acceleration, torque, rate, sign];
                sums.add(&SVector::from(row), self.effort(window, joint, 0.0), 0.0);
            }
            sums.is_opposite(Sums::bounded)
        };
        match self.first_joint(is_reversed) {
            Some(joint) => Err(CalibrateError::Data(format!(
                "the effort of the joint `{joint}` has the opposite sign of the torque that moves it: give it a negative \
                 effort gain"
            ))),
            None => Ok(()),
        }
    }

    /// Checks that no effort is constant while its joint moves and others vary.
    pub(crate) fn check_varies(&self) -> Result<(), CalibrateError> {
        let is_constant = |joint: &usize| {
            let efforts = (0..self.windows()).map(|window| self.effort(window, *joint, 0.0));
            let (low, high) = efforts
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), effort| {
                    (low.min(effort), high.max(effort))
                });
            high - low <= CONSTANT * low.abs().max(high.abs())
        };
        let moves = |joint: &usize| self.max_velocities(*joint).into_iter().any(|v| v > MOVES);
        if (0..self.joint_names().len()).all(|joint| is_constant(&joint)) {
            return Ok(()); // There are no efforts at all, which is another error.
        }
        match self.first_joint(|joint| is_constant(joint) && moves(joint)) {
            Some(joint) => Err(CalibrateError::Data(format!(
                "the effort of the joint `{joint}` never changes, although it moves: record its effort, too"
            ))),
            None => Ok(()),
        }
    }

    /// Checks that no effort is constant while its joint moves and others vary, and that none has
    /// the opposite sign of a calibrated model's, whatever the payload is that the arm may hold.
    pub(crate) fn check_signs(
        &self,
        model: &EffortModel,
        arm: &[f64],
        may_hold: bool,
    ) -> Result<(), CalibrateError> {
        self.check_varies()?;
        let nothing = SVector::zeros();
        let scales = SVector::from(PAYLOAD_SCALES);
        let is_reversed = |&joint: &usize| {
            let mut sums = Sums::<10>::default();
            for window in 0..self.windows() {
                let at = (window, joint);
                let modelled = model.effort(self, at, arm, &nothing);
                let row = self.columns(window, joint).payload.component_mul(&scales);
                let row = if may_hold { row } else { SVector::zeros() };
                let measured = model.measured(self, at, arm);
                sums.add(&row, measured, modelled.torque + modelled.friction);
            }
            sums.is_opposite(Sums::free)
        };
        match self.first_joint(is_reversed) {
            Some(joint) => Err(CalibrateError::Data(format!(
                "the effort of the joint `{joint}` has the opposite sign of that in the calibration: negate it, or \
                 calibrate anew"
            ))),
            None => Ok(()),
        }
    }

    fn first_joint(&self, is_wrong: impl Fn(&usize) -> bool) -> Option<String> {
        let mut joints = 0..self.joint_names().len();
        joints
            .find(is_wrong)
            .map(|joint| self.joint_names()[joint].clone())
    }
}

/// Sums for a least-squares fit of `C` columns to `±effort - known`.
struct Sums<const C: usize> {
    matrix: SMatrix<f64, C, C>,
    /// Products of the columns with efforts and with what is known of them.
    of_effort: SVector<f64, C>,
    of_known: SVector<f64, C>,
    /// Products of efforts and known efforts.
    squares: [f64; 3],
    count: usize,
}

impl<const C: usize> Default for Sums<C> {
    fn default() -> Self {
        Self {
            matrix: SMatrix::zeros(),
            of_effort: SVector::zeros(),
            of_known: SVector::zeros(),
            squares: [0.0; 3],
            count: 0,
        }
    }
}

impl<const C: usize> Sums<C> {
    fn add(&mut self, row: &SVector<f64, C>, effort: f64, known: f64) {
        self.matrix += row * row.transpose();
        self.of_effort += row * effort;
        self.of_known += row * known;
        let products = [effort * effort, effort * known, known * known];
        self.squares
            .iter_mut()
            .zip(products)
            .for_each(|(sum, product)| *sum += product);
        self.count += 1;
    }

    /// Whether negated efforts leave far less than the efforts as they are.
    fn is_opposite(&self, residual: fn(&Self, f64) -> f64) -> bool {
        self.count >= MIN_WINDOWS && residual(self, -1.0) < OPPOSITE * residual(self, 1.0)
    }

    /// Returns the sum of squares that a fit of some columns leaves of signed efforts, and factors.
    fn fit(&self, sign: f64, is_used: impl Fn(usize) -> bool) -> (f64, SVector<f64, C>) {
        let target = sign * self.of_effort - self.of_known;
        let target: SVector<f64, C> =
            SVector::from_fn(|k, _| if is_used(k) { target[k] } else { 0.0 });
        let matrix: SMatrix<f64, C, C> = SMatrix::from_fn(|i, k| {
            let entry = if is_used(i) && is_used(k) {
                self.matrix[(i, k)]
            } else {
                0.0
            };
            entry
                + if i == k {
                    WEAKNESS * self.matrix.trace() + f64::MIN_POSITIVE
                } else {
                    0.0
                }
        });
        let factors = matrix
            .cholesky()
            .map_or(SVector::zeros(), |factor| factor.solve(&target));
        let [effort, both, known] = self.squares;
        let squares = effort - 2.0 * sign * both + known;
        ((squares - target.dot(&factors)).max(0.0), factors)
    }

    /// Returns the sum of squares that all columns leave.
    fn free(&self, sign: f64) -> f64 {
        self.fit(sign, |_| true).0
    }

    /// Returns the least sum of squares with positive last factors, by the best choice of columns.
    fn bounded(&self, sign: f64) -> f64 {
        let first = C - POSITIVE;
        let choices = (0..1 << POSITIVE).map(|choice: usize| {
            let (squares, factors) =
                self.fit(sign, |k| k < first || choice >> (k - first) & 1 == 1);
            let is_possible = factors.iter().skip(first).all(|factor| *factor >= 0.0);
            if is_possible { squares } else { f64::INFINITY }
        });
        choices.fold(f64::INFINITY, f64::min)
    }
}
