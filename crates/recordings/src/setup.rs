//! Where a result comes from: measurements, sensors, and what was subtracted.

use schemars::JsonSchema;
use serde::Serialize;
use tactid_dynamics::{InertialParameters, MassProperties};
use tactid_identify::{KnownTool, serial::TenValues, serialize_composite, value_jacobian};

use crate::recording::Sources;
use crate::{ActsOn, Request};

/// Which measurements were read, where the sensors are, and what was subtracted.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Setup {
    /// Number that identifies the first messages or samples: recordings with the same one are
    /// copies, or one is the beginning of the other.
    pub beginning: String,
    /// Topics or arrays that were read.
    pub topics: Vec<String>,
    /// Topic or array of each wrench.
    pub wrench_topics: Vec<String>,
    /// Frame of each wrench, in the order of `wrench_topics`.
    pub wrench_frames: Vec<String>,
    /// Body on which the measured wrenches act.
    pub wrench_acts_on: ActsOn,
    /// Known tool that was subtracted, in the frame of the estimate; `None` where there is none.
    #[serde(serialize_with = "serialize_composite")]
    #[schemars(with = "Option<TenValues<f64>>", extend("x-class" = "MassProperties"))]
    pub known_tool: Option<MassProperties>,
    /// Standard deviation of each of the [ten values](crate::VALUE_NAMES) of the known tool, in its
    /// unit.
    #[schemars(with = "Option<TenValues<f64>>")]
    pub known_tool_std_devs: Option<[f64; 10]>,
    /// Links beyond the tip that were subtracted, as one body in the frame of the estimate; `None`
    /// where the measured load does not contain them.
    #[serde(serialize_with = "serialize_composite")]
    #[schemars(with = "Option<TenValues<f64>>", extend("x-class" = "MassProperties"))]
    pub gripper: Option<MassProperties>,
}

impl Setup {
    /// Returns the setup of a request, given what identifies the first events and the gripper that
    /// the estimator subtracts.
    pub(crate) fn new(
        sources: &Sources,
        request: &Request,
        beginning: String,
        gripper: Option<InertialParameters>,
    ) -> Self {
        let tool = request.known_tool();
        Self {
            beginning,
            topics: sources.names.clone(),
            wrench_topics: sources.wrench_names.clone(),
            wrench_frames: sources.sensors.clone(),
            wrench_acts_on: request.wrench_acts_on.unwrap_or_default(),
            known_tool: tool.map(|tool| tool.body),
            known_tool_std_devs: tool.map(std_devs),
            gripper: gripper.and_then(|gripper| gripper.mass_properties()),
        }
    }
}

/// Returns the standard deviations of the ten values of a tool, in their units; zero without a
/// mass.
fn std_devs(tool: KnownTool) -> [f64; 10] {
    let slopes =
        value_jacobian(InertialParameters::from(tool.body).as_vector()).unwrap_or_default();
    let variances = (slopes * tool.covariance * slopes.transpose()).diagonal();
    variances.map(|variance| variance.max(0.0).sqrt()).into()
}
