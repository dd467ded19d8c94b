//! What the least-squares solvers share: the noise model, offsets, observable and unobservable
//! directions, physical consistency and error propagation. Nothing here knows a robot.

pub(crate) mod consistency;
pub(crate) mod information;
mod intervals;
pub(crate) mod noise;
pub(crate) mod offsets;
mod report;
pub(crate) mod subspace;
pub(crate) mod uncertainty;
pub(crate) mod weights;

pub use consistency::{Projection, project};
pub use noise::{Noise, RESIDUAL_ROUNDING, VARIANCE_FLOOR, Whitening, ZERO_SIZE, target_sizes};
pub use offsets::{Centering, MeanRow, Offsets, joint_covariance};
pub(crate) use report::Described;
pub use report::{body_of, estimate};
pub use subspace::{
    EIGENVALUE_RATIO, LEVER_ARM_M, Matrix, NullSpace, QUANTITY_FRACTION, VARIANCE_RATIO, Vector,
    bounded_lengths, least_signal, least_signal_of_columns,
};
pub use uncertainty::{
    HALF_WIDTH_95, ValueStdDevs, is_mass_known, largest_of_kind, propagated, std_dev, std_devs,
    students_widening, value_jacobian, values_of,
};
pub use weights::{OUTLIER, rare_distance, robust_weight};
