//! The rows of the dynamics at a state of the motion, and their derivatives by the motion.

use nalgebra::{DMatrix, DVector, SVector};
use tactid_dynamics::{StateError, Wrench};
use tactid_identify::equations::{Instant, KnownNoise, Model, Row};

use super::bins::{Bin, Layout};
use super::segment::{Derivatives, base_motion};

/// Steps of the differences by which values, first and second derivatives of a coordinate are
/// varied, in the coordinate's unit, per s and per s². The rows are smooth far beyond them.
const STEPS: [f64; 3] = [1e-6, 1e-5, 1e-4];

/// Computes the rows of a model at states of the motion.
pub(super) struct Dynamics {
    model: Model,
    layout: Layout,
    instant: Instant,
    rows: Vec<Row>,
}

/// The rows at a state.
pub(super) struct Linearised {
    /// What the parameters leave of the targets.
    pub(super) residuals: DVector<f64>,
    /// Derivatives of the predictions by the parameters.
    pub(super) by_parameters: DMatrix<f64>,
}

impl Dynamics {
    /// Creates the rows of a model whose bins have this layout.
    pub(super) fn new(model: Model, layout: Layout) -> Self {
        Self {
            instant: Instant::new(layout.joints, layout.sensors),
            rows: vec![Row::zero(); model.row_count()],
            model,
            layout,
        }
    }

    /// Where the channels of a bin are.
    pub(super) fn layout(&self) -> Layout {
        self.layout
    }

    /// Returns for each channel whether a sensor measures it. A channel without a sensor, such as
    /// the momentum of a free base, has no noise but that of the motion.
    pub(super) fn are_measured(&self) -> Vec<bool> {
        self.model.are_measured()
    }

    /// Index of the source of each channel.
    pub(super) fn source_of(&self) -> Vec<usize> {
        self.model.channels().source_of()
    }

    /// Known noise of the sensors of some sources, at the posture of the last rows.
    pub(super) fn known_noise(&self) -> Vec<KnownNoise> {
        self.model.channels().known_noise
    }

    /// Returns the rows at a motion with the efforts and wrenches of a bin.
    pub(super) fn rows(&mut self, at: &Derivatives, bin: &Bin) -> Result<&[Row], StateError> {
        let Layout { joints, .. } = self.layout;
        let instant = &mut self.instant;
        instant.time_s = bin.time_s;
        instant.base = base_motion(at);
        instant.joint_position.copy_from_slice(&at[0][..joints]);
        instant.joint_velocity.copy_from_slice(&at[1][..joints]);
        instant.joint_acceleration.copy_from_slice(&at[2][..joints]);
        let (effort, wrenches) = (self.layout.effort(), self.layout.wrenches());
        let efforts = &bin.values[effort..wrenches];
        instant.joint_effort.copy_from_slice(efforts);
        let values = bin.values[wrenches..].chunks_exact(6);
        for (wrench, values) in instant.wrenches.iter_mut().zip(values) {
            let [force, moment] =
                [&values[..3], &values[3..]].map(SVector::<f64, 3>::from_column_slice);
            *wrench = Wrench { force, moment };
        }
        let entries = self.model.entries(instant)?.to_vec();
        self.model.set_rows(&mut self.rows, &entries);
        Ok(&self.rows)
    }

    /// Returns the rows at a motion, and what the parameters leave of them.
    pub(super) fn linearised(
        &mut self,
        at: &Derivatives,
        bin: &Bin,
        parameters: &SVector<f64, 10>,
    ) -> Result<Linearised, StateError> {
        let rows = self.rows(at, bin)?;
        Ok(Linearised {
            by_parameters: DMatrix::from_fn(rows.len(), 10, |i, k| rows[i].regressor[k]),
            residuals: remainders(rows, parameters),
        })
    }

    /// Returns the derivatives of the residuals by the motion. Cost: a pass over the robot's bodies
    /// for each coordinate and derivative.
    pub(super) fn by_motion(
        &mut self,
        at: &Derivatives,
        bin: &Bin,
        parameters: &SVector<f64, 10>,
    ) -> Result<DMatrix<f64>, StateError> {
        let residuals = remainders(self.rows(at, bin)?, parameters);
        let coordinates = at[0].len();
        let mut by_motion = DMatrix::zeros(residuals.len(), 3 * coordinates);
        let mut varied = at.clone();
        for (order, step) in STEPS.into_iter().enumerate() {
            for coordinate in 0..coordinates {
                // Where the base is, and how fast, changes no force.
                let of_base = coordinate.checked_sub(self.layout.joints);
                if order < 2 && of_base.is_some_and(|axis| axis < 3) {
                    continue;
                }
                varied[order][coordinate] += step;
                let other = remainders(self.rows(&varied, bin)?, parameters);
                varied[order][coordinate] = at[order][coordinate];
                let slope = (other - &residuals) / step;
                by_motion.set_column(order * coordinates + coordinate, &slope);
            }
        }
        Ok(by_motion)
    }
}

/// Returns what parameters leave of the targets of rows.
fn remainders(rows: &[Row], parameters: &SVector<f64, 10>) -> DVector<f64> {
    let rest = rows
        .iter()
        .map(|row| row.target - row.regressor.dot(parameters));
    DVector::from_iterator(rows.len(), rest)
}
