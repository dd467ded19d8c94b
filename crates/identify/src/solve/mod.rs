//! What the least-squares solvers share: the noise model, offsets, observable and unobservable
//! directions, physical consistency, prior knowledge and error propagation. Nothing here knows a
//! robot.

pub(crate) mod consistency;
pub(crate) mod information;
pub(crate) mod intervals;
pub(crate) mod noise;
pub(crate) mod offsets;
pub(crate) mod principal_moments;
pub(crate) mod pseudo_inverse;
pub(crate) mod report;
pub(crate) mod spectrum;
pub(crate) mod subspace;
pub(crate) mod uncertainty;
pub(crate) mod weights;
pub(crate) mod widening;

pub use principal_moments::PrincipalMoments;
pub use pseudo_inverse::{PseudoInverse, information, normalized, pseudo_inverse, with_variance};
pub use report::{Posterior, Report};
pub use spectrum::{Excitation, Spectrum};
pub use subspace::{Matrix, NullSpace, Vector};
pub use uncertainty::{HALF_WIDTH_95, is_mass_known, largest_of_kind, value_jacobian, values_of};
pub use widening::widened;
