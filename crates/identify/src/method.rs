//! Which rows go to which estimator.

use nalgebra::SVector;
use tactid_dynamics::{MassProperties, symmetric_matrix};
use tactid_nlms::{Estimator, Nlms, SettingError};

use crate::EstimatorKind;
use crate::equation::Equation;
use crate::noise::Channels;
use crate::recursive::Recursive;

/// The rows' way to the ten parameters.
#[derive(Clone, Debug)]
pub(crate) enum Method {
    /// (48), then (46) with the centre of mass that (48) has found so far.
    TwoStage(Box<TwoStage>),
    /// `[f_U; n_U] = Y π` at once.
    OneStage(Box<Recursive>),
}

/// The paper's filters.
#[derive(Clone, Debug)]
pub(crate) struct TwoStage {
    mass: Nlms<4>,
    inertia: Nlms<6>,
}

impl Method {
    pub(crate) fn new(kind: EstimatorKind, channels: &Channels) -> Result<Self, SettingError> {
        Ok(match kind {
            EstimatorKind::Nlms { alpha, beta } => Self::TwoStage(Box::new(TwoStage {
                mass: Nlms::new(alpha, beta)?,
                inertia: Nlms::new(alpha, beta)?,
            })),
            EstimatorKind::Rls => Self::OneStage(Box::new(Recursive::new(channels)?)),
        })
    }

    /// True where the rows show that the payload is another. What is known with them comes
    /// [in stages](Self::proceed).
    pub(crate) fn update(&mut self, equation: &Equation) -> bool {
        match self {
            Self::TwoStage(filters) => {
                filters.update(equation);
                false
            }
            Self::OneStage(estimator) => estimator.update(equation),
        }
    }

    /// Does the next stage; false where none is left.
    pub(crate) fn proceed(&mut self) -> bool {
        match self {
            Self::TwoStage(_) => false,
            Self::OneStage(estimator) => estimator.proceed(),
        }
    }
}

impl TwoStage {
    fn update(&mut self, equation: &Equation) {
        for (row, wanted) in equation.mass().iter() {
            self.mass.update(&row, wanted);
        }
        let a_u = self.mass.parameters().fixed_rows::<3>(1).into_owned();
        for (row, wanted) in equation.inertia(&a_u).iter() {
            self.inertia.update(&row, wanted);
        }
    }

    /// The body as known now, in `Σ_U`.
    pub(crate) fn body(&self) -> MassProperties {
        let first: SVector<f64, 4> = self.mass.parameters();
        MassProperties {
            mass_kg: 1.0 / first[0], // x_3 = [1/m_U; a_U], (32)
            center_of_mass: first.fixed_rows::<3>(1).into_owned(),
            inertia: symmetric_matrix(self.inertia.parameters().into()),
        }
    }
}
