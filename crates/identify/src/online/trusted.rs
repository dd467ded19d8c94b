//! The estimate as of the last window that nothing contradicted, and what returns to it.

use nalgebra::{Matrix6, SMatrix};

use super::accumulated_rows::{AccumulatedRows, RowSums};
use super::noise_tracker::NoiseTracker;
use crate::equations::Channels;
use crate::solve::information::Information;
use crate::solve::offsets::{Centering, KnownOffsets, Offsets};
use crate::solve::subspace::{Matrix, Vector};

/// What an estimator has concluded from all windows up to one.
#[derive(Clone, Debug)]
pub(crate) struct State {
    pub(crate) rows: AccumulatedRows,
    /// Sums over the rows before the present block of windows.
    pub(crate) earlier: RowSums,
    /// Sum of the squared residuals of the windows of this block.
    pub(crate) block_squares: f64,
    /// Score of what all windows leave of the block before it; zero where it is not known.
    pub(crate) block_score: f64,
    pub(crate) noise: NoiseTracker,
    pub(crate) centering: Centering,
    pub(crate) parameters: Vector,
    /// Number of windows since the first one or the last payload change.
    pub(crate) windows_since_start: usize,
}

impl State {
    /// Creates the state before any window.
    pub(crate) fn new(channels: &Channels) -> Self {
        Self {
            rows: AccumulatedRows::new(channels.count()),
            earlier: RowSums::none(),
            block_squares: 0.0,
            block_score: 0.0,
            noise: NoiseTracker::new(channels),
            centering: Centering::new(channels.offsets),
            parameters: Vector::zeros(),
            windows_since_start: 0,
        }
    }

    /// Copies the state of as many channels, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.rows.copy_from(&other.rows);
        self.earlier = other.earlier;
        (self.block_squares, self.block_score) = (other.block_squares, other.block_score);
        self.noise.copy_from(&other.noise);
        self.centering.copy_from(&other.centering);
        self.parameters = other.parameters;
        self.windows_since_start = other.windows_since_start;
    }
}

/// Parameters of the load and offsets of a wrench sensor with their joint covariance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointEstimate {
    pub(crate) parameters: Vector,
    pub(crate) covariance: Matrix,
    /// Whether the motion determines mass, first moments and offsets: the wrench of the load at
    /// rest in any attitude.
    pub(crate) is_determined: bool,
    /// `None` where the offsets are known to be zero.
    pub(crate) offsets: Option<Offsets>,
}

impl JointEstimate {
    /// Returns the estimate of a state, given the covariance of the parameters and the information
    /// on them.
    pub(crate) fn of(state: &State, covariance: Matrix, information: &Information) -> Self {
        let State {
            centering,
            parameters,
            ..
        } = state;
        let noise = state.noise.of_wrench();
        let offsets = noise.and_then(|noise| centering.offsets(parameters, &noise));
        let knows_offsets = offsets.is_some() || !centering.is_needed();
        let is_determined = information.is_complete() || {
            let null_space = information.null_space(state.rows.scales());
            let unit = Matrix::identity();
            let mut of_weight = unit.row_iter().take(4);
            of_weight.all(|gradient| null_space.determines(&gradient.into()))
                && offsets.is_none_or(|offsets| offsets.are_determined(&null_space))
        };
        Self {
            parameters: *parameters,
            covariance,
            is_determined: is_determined && knows_offsets,
            offsets,
        }
    }

    /// Returns what is known of the offsets, whatever the payload.
    pub(crate) fn known_offsets(&self) -> Option<KnownOffsets> {
        self.offsets.map(|offsets| KnownOffsets {
            values: offsets.values,
            covariance: offsets.covariance(&self.covariance),
        })
    }

    /// Returns the covariance of what a load with this regressor and the offsets measure together.
    pub(crate) fn covariance_of_load(&self, regressor: &SMatrix<f64, 6, 10>) -> Matrix6<f64> {
        match &self.offsets {
            Some(offsets) => offsets.covariance_of_load(regressor, &self.covariance),
            None => regressor * self.covariance * regressor.transpose(),
        }
    }
}

/// The estimate as of the last window that nothing contradicted. It is that of the payload before a
/// change until the payload after it is known well enough to detect further changes.
#[derive(Clone, Debug)]
pub(crate) struct Trusted {
    state: State,
    /// `None` before the first window from which changes are detected.
    estimate: Option<JointEstimate>,
}

impl Trusted {
    /// Creates an estimate of nothing.
    pub(crate) fn new(channels: &Channels) -> Self {
        Self {
            state: State::new(channels),
            estimate: None,
        }
    }

    /// The estimate; `None` before the first.
    pub(crate) fn estimate(&self) -> Option<&JointEstimate> {
        self.estimate.as_ref()
    }

    /// The state of the estimator with this estimate.
    pub(crate) fn state(&self) -> &State {
        &self.state
    }

    /// Replaces the estimate by the present one, which nothing contradicts.
    pub(crate) fn set(&mut self, state: &State, estimate: JointEstimate) {
        self.state.copy_from(state);
        self.estimate = Some(estimate);
    }
}
