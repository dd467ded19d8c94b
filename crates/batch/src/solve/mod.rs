//! What the solvers of whole recordings share: observable directions by eigenvalues, inverses with a
//! null space, principal moments, and the report of a posterior.

mod posterior;
mod principal_moments;
mod pseudo_inverse;
mod spectrum;

pub use posterior::{Posterior, Report};
pub use principal_moments::PrincipalMoments;
pub(crate) use pseudo_inverse::{INVERSE_ROUNDING, with_variance_floor};
pub use pseudo_inverse::{PseudoInverse, information, normalized, pseudo_inverse, with_variance};
pub use spectrum::{Excitation, Spectrum};
