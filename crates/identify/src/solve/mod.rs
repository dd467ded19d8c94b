//! What the least-squares solvers share: the noise model, offsets, observable and unobservable
//! directions, physical consistency, prior knowledge and error propagation. Nothing here knows a
//! robot.

pub mod consistency;
pub mod information;
pub mod intervals;
pub mod noise;
pub mod offsets;
pub mod principal_moments;
pub mod pseudo_inverse;
pub mod report;
pub mod spectrum;
pub mod subspace;
pub mod uncertainty;
pub mod weights;
pub mod widening;

pub use principal_moments::PrincipalMoments;
pub use pseudo_inverse::{PseudoInverse, information, normalized, pseudo_inverse, with_variance};
pub use report::{Posterior, Report};
pub use spectrum::{Excitation, Spectrum};
pub use subspace::{Matrix, NullSpace, Vector};
pub use uncertainty::{HALF_WIDTH_95, is_mass_known, largest_of_kind, value_jacobian, values_of};
pub use widening::widened;
