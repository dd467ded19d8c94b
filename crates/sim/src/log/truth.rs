//! The record of the true payload in a log.

use std::collections::BTreeMap;

use serde::Serialize;
use tactid_dynamics::{MassProperties, symmetric_entries};

use crate::{Experiment, Simulation};

/// Mass properties of a rigid body with the field names of an identification result.
#[derive(Serialize)]
struct Body {
    mass: f64,
    com: BTreeMap<&'static str, f64>,
    inertia: BTreeMap<&'static str, f64>,
}

impl From<&MassProperties> for Body {
    fn from(body: &MassProperties) -> Self {
        let com = body.center_of_mass;
        let names = ["xx", "xy", "xz", "yy", "yz", "zz"];
        Self {
            mass: body.mass_kg,
            com: BTreeMap::from([("x", com.x), ("y", com.y), ("z", com.z)]),
            inertia: names
                .into_iter()
                .zip(symmetric_entries(&body.inertia))
                .collect(),
        }
    }
}

/// The payload in the tool frame at its actual pose in the grasp; `nominal` is the experiment's.
#[derive(Serialize)]
struct TruthRecord<'a> {
    frame: &'a str,
    #[serde(flatten)]
    payload: Body,
    nominal: Body,
}

/// Returns the true payload of a simulation as JSON.
pub(super) fn truth_json(simulation: &Simulation) -> String {
    let Experiment { robot, payload, .. } = simulation.experiment();
    let record = TruthRecord {
        frame: &robot.tool,
        payload: Body::from(simulation.payload_in_tool()),
        nominal: Body::from(&payload.mass_properties()),
    };
    serde_json::to_string(&record).unwrap_or_default()
}
