//! Which rows go to which estimator.

use nalgebra::{Matrix3, SVector, Vector3};
use tactid_dynamics::{InertialParameters, MassProperties, symmetric_matrix};
use tactid_nlms::{Estimator, Nlms, Rls, SettingError};

use crate::EstimatorKind;
use crate::equation::Equation;

/// The rows' way to the ten parameters.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "one lives in each identifier, and a box would cost a jump a row"
)]
pub(crate) enum Method {
    /// (48), then (46) with the centre of mass that (48) has found so far.
    TwoStage { mass: Nlms<4>, inertia: Nlms<6> },
    /// `[f_U; n_U] = Y π` at once.
    OneStage(Rls<10>),
}

impl Method {
    pub(crate) fn new(kind: EstimatorKind) -> Result<Self, SettingError> {
        Ok(match kind {
            EstimatorKind::Nlms { alpha, beta } => Self::TwoStage {
                mass: Nlms::new(alpha, beta)?,
                inertia: Nlms::new(alpha, beta)?,
            },
            EstimatorKind::Rls => Self::OneStage(Rls::new()),
        })
    }

    pub(crate) fn update(&mut self, equation: &Equation) {
        match self {
            Self::TwoStage { mass, inertia } => {
                for (row, wanted) in equation.mass().iter() {
                    mass.update(&row, wanted);
                }
                let a_u = mass.parameters().fixed_rows::<3>(1).into_owned();
                for (row, wanted) in equation.inertia(&a_u).iter() {
                    inertia.update(&row, wanted);
                }
            }
            Self::OneStage(estimator) => {
                for row in &equation.rows {
                    estimator.update(&row.regressor, row.wanted);
                }
            }
        }
    }

    /// The body as known now, in `Σ_U`.
    pub(crate) fn body(&self) -> MassProperties {
        match self {
            Self::TwoStage { mass, inertia } => {
                let first: SVector<f64, 4> = mass.parameters();
                MassProperties {
                    mass_kg: 1.0 / first[0], // x_3 = [1/m_U; a_U], (32)
                    center_of_mass: first.fixed_rows::<3>(1).into_owned(),
                    inertia: symmetric_matrix(inertia.parameters().into()),
                }
            }
            Self::OneStage(estimator) => {
                let parameters = InertialParameters::from_vector(estimator.parameters());
                parameters.mass_properties().unwrap_or(MassProperties {
                    mass_kg: 0.0,
                    center_of_mass: Vector3::zeros(),
                    inertia: Matrix3::zeros(),
                })
            }
        }
    }
}
