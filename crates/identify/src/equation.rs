//! The equations of motion, averaged over an interval.

use nalgebra::{SMatrix, Vector3};
use tactid_dynamics::{
    Rows, ToolMotion, Wrench, inertia_rows, tactile_mass_rows, wrench_regressor,
};

/// Rows of (48), (46) and the one-stage form, each the mean over a time.
///
/// The rows are averaged as a whole, after their products are formed, so that both sides of each
/// equation pass the same filter and it holds for the means as it does at every instant.
#[derive(Clone, Debug)]
pub(crate) struct MeanEquation {
    duration_s: f64,
    /// (48).
    pub(crate) mass: Rows<4>,
    /// (46) for `a_U = 0`; see [`Self::inertia`].
    inertia_about_origin: Rows<6>,
    /// `Y` in `[f_U; n_U] = Y π`.
    pub(crate) regressor: SMatrix<f64, 6, 10>,
    /// On the body, in `Σ_U` and about its origin.
    pub(crate) wrench: Wrench,
}

impl MeanEquation {
    pub(crate) fn new() -> Self {
        Self {
            duration_s: 0.0,
            mass: Rows {
                matrix: SMatrix::zeros(),
                wanted: Vector3::zeros(),
            },
            inertia_about_origin: Rows {
                matrix: SMatrix::zeros(),
                wanted: Vector3::zeros(),
            },
            regressor: SMatrix::zeros(),
            wrench: Wrench::zero(),
        }
    }

    /// The time that it is the mean of, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Takes in a motion and a wrench that lasted for a time.
    pub(crate) fn add(&mut self, motion: &ToolMotion, wrench: &Wrench, duration_s: f64) {
        self.duration_s += duration_s;
        let share = duration_s / self.duration_s;
        blend(
            &mut self.mass,
            &tactile_mass_rows(motion, &wrench.force),
            share,
        );
        let about_origin = inertia_rows(motion, wrench, &Vector3::zeros());
        blend(&mut self.inertia_about_origin, &about_origin, share);
        self.regressor += (wrench_regressor(motion) - self.regressor) * share;
        self.wrench.force += (wrench.force - self.wrench.force) * share;
        self.wrench.moment += (wrench.moment - self.wrench.moment) * share;
    }

    /// (46) for a centre of mass, which enters in proportion to the force.
    pub(crate) fn inertia(&self, center_of_mass: &Vector3<f64>) -> Rows<6> {
        let Rows { matrix, wanted } = self.inertia_about_origin;
        Rows {
            matrix,
            wanted: wanted - center_of_mass.cross(&self.wrench.force), // b_4, (45)
        }
    }
}

/// Moves a mean by its `share` towards new rows.
fn blend<const N: usize>(mean: &mut Rows<N>, new: &Rows<N>, share: f64) {
    mean.matrix += (new.matrix - mean.matrix) * share;
    mean.wanted += (new.wanted - mean.wanted) * share;
}
