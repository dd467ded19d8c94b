//! What an identification noticed about the data, for a program to match.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;
use tactid_dynamics::ModelFinding;

use crate::Method;
use crate::checks::{
    EffortsBeyondLimits, PositionsBeyondLimits, TwistContradiction, VelocityContradiction,
};
use crate::prior::KnownMass;
use crate::result::WrenchOffset;
use crate::sampling::Sampling;

/// How much of the load the model leaves unexplained.
#[derive(Clone, Debug, PartialEq)]
pub struct UnexplainedLoad {
    /// The joint whose effort is not explained, with a calibration; `None` for all channels of the unit.
    pub joint: Option<String>,
    /// Unit of the channels with the largest unexplained fraction.
    pub unit: &'static str,
    /// Rms of measured less predicted load, in the unit.
    pub residual_rms: f64,
    /// Rms of the measured load, in the unit.
    pub load_rms: f64,
    /// Rms noise of the measurements, from the differences of neighbouring samples, in the unit.
    pub noise_rms: f64,
    /// The measurements that were used.
    pub method: Method,
}

/// How several recordings of one payload differ by more than their noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// Number of recordings.
    pub runs: usize,
    /// Distance of all parameters of the recordings from the combined ones, see [`Agreement::chi_square`](crate::Agreement::chi_square).
    pub chi_square: f64,
    /// Degrees of freedom of the chi-square.
    pub degrees_of_freedom: f64,
    /// Degrees of freedom from which the noise was estimated.
    pub noise_degrees_of_freedom: f64,
    /// Probability of at least this chi-square if noise were the only difference between the recordings.
    pub p_value: f64,
    /// Name of the value whose differences alone are the least probable, of [`VALUE_NAMES`](crate::VALUE_NAMES).
    pub least_probable: &'static str,
    /// Probability of the differences of this value alone.
    pub least_p_value: f64,
    /// Index of the recording that differs most from the others; `None` for two recordings.
    pub run: Option<usize>,
    /// Whether the other recordings agree among themselves; false for two recordings.
    pub others_agree: bool,
    /// The largest difference between this recording and the others, or of the second of two recordings from the first.
    pub largest: Option<ValueDifference>,
}

/// Difference between one run and the others in one value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ValueDifference {
    /// Index of the run. Of two runs, neither is the one that differs, and it is the second.
    pub run: usize,
    /// Name of the value, of [`VALUE_NAMES`](crate::VALUE_NAMES).
    pub value: &'static str,
    /// Value of the run less that of the others, in its unit.
    pub difference: f64,
    /// Value of the others, in its unit.
    pub others: f64,
    /// Standard deviation of the difference from the noise within the runs, in the unit of the value.
    pub std_dev: f64,
}

impl ValueDifference {
    /// Returns the difference in standard deviations, with its sign.
    #[must_use]
    pub fn sigmas(&self) -> f64 {
        self.difference / self.std_dev
    }
}

/// An observation about the data or the robot's description that concerns the assumptions of an identification. Nothing is
/// corrected silently: each finding is for the user to decide on.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// The measured velocities of joints are not the derivatives of their positions.
    VelocitiesContradicted(VelocityContradiction),
    /// Joint positions are beyond the limits of the robot's description.
    PositionsBeyondLimits(PositionsBeyondLimits),
    /// Most efforts of joints are far beyond the limits of the robot's description.
    EffortsBeyondLimits(EffortsBeyondLimits),
    /// The twist of the base, or of a sensor without a robot, is not the derivative of its pose.
    TwistContradicted(TwistContradiction),
    /// Some channels of a wrench sensor have the same value in all samples.
    ConstantChannels {
        /// Frame of the sensor.
        frame: String,
        /// The channels, such as `force x`.
        channels: Vec<&'static str>,
        /// Whether all of these values are zero.
        is_zero: bool,
    },
    /// Not a single window of the averages was filled, so that nothing is known.
    NoEquations(Sampling),
    /// Something is wrong in the description of the robot. Masses and inertias are reported only where the method uses
    /// them.
    Model(ModelFinding),
    /// Another gravity explains the load far better than the given one.
    GravityContradicted {
        /// The better gravitational acceleration in the inertial frame, m/s²: none at all, or the opposite.
        better: Vector3<f64>,
        /// Residual with the better gravity, relative to that with the given one: the geometric mean over the directions of
        /// the channels.
        residual_ratio: f64,
        /// The measurements that were used.
        method: Method,
    },
    /// The mass of the payload is zero within its uncertainty.
    NothingHeld {
        /// Identified mass of the load beyond the known bodies, kg; it may be negative.
        mass_kg: f64,
        /// Its standard deviation, kg.
        std_dev_kg: f64,
    },
    /// The mass of the whole load comes out negative: the load has the opposite sign.
    NegativeMass {
        /// The measurements that were used.
        method: Method,
        /// Whether gravity of the opposite sign would explain the data just as well.
        or_gravity: bool,
    },
    /// The known bodies weigh more than the whole load that contains them, so that the mass of the payload comes out
    /// negative.
    KnownBodiesTooHeavy {
        /// Mass of the known bodies: the known tool, and the links below the tool where the method includes them, kg.
        known_bodies_kg: f64,
        /// Mass of the whole load from the data alone, kg.
        load_kg: f64,
    },
    /// The wrenches seem to have a constant offset that was not among the unknowns.
    OffsetSuspected {
        /// The offset, as it is identified together with the payload.
        offset: WrenchOffset,
        /// Rms force of the measured wrenches without the offset, N.
        load_force_rms_n: f64,
    },
    /// The model leaves much of the load unexplained, far more than the noise of the measurements: its error is not in
    /// the standard deviations. Usual reasons are friction in the joints where efforts are used, and otherwise a frame,
    /// a pose or an order of joints that is not that of the data.
    LoadUnexplained(UnexplainedLoad),
    /// The data contradict the known mass. It is not reported where a wrong sign, a wrong gravity or a known body that is
    /// too heavy is, because each of these contradicts the mass as well.
    MassContradicted {
        /// The known mass of the payload.
        known: KnownMass,
        /// The mass from the data alone, kg.
        found_kg: f64,
        /// Standard deviation of the mass from the data alone, kg.
        std_dev_kg: f64,
        /// Distance between the two masses, in standard deviations of their difference.
        distance: f64,
    },
    /// The result does not have the known mass, although the data do not contradict it: no physically consistent body of
    /// this mass, within the bounding box if one is given, explains the data.
    KnownMassNotKept {
        /// The known mass of the payload.
        known: KnownMass,
        /// The mass of the result, kg.
        estimated_kg: f64,
        /// Whether the body also had to fit into a bounding box.
        within_box: bool,
    },
    /// No physically consistent body explains the data within their noise: there are other errors. The projection onto
    /// consistent parameters is returned. For recordings, the standard deviations are multiplied by half of `distance`, except
    /// that of a known mass; online they are not.
    Inconsistent {
        /// Mahalanobis distance of the returned body from the unconstrained estimate, in standard deviations.
        distance: f64,
        /// Whether the body also had to fit into a bounding box.
        within_box: bool,
    },
    /// Several recordings of one payload differ by more than their noise. The combined intervals include what varies.
    RunsDisagree(Disagreement),
    /// Some windows are outliers, for example because of an impact, and have next to no weight.
    Outliers {
        /// Number of outliers.
        outliers: usize,
        /// Number of windows.
        windows: usize,
    },
}
