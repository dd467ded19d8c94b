//! Collision shapes of a robot and boxes around it, from what Python gives.

use pyo3::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use tactid_excitation::{CollisionFinding, CollisionModel};

use crate::dynamics::Manipulator;
use crate::errors::IntoPyErr;

/// What the test for collisions leaves out or relaxes.
#[derive(Serialize, JsonSchema)]
#[serde(rename = "CollisionFinding")]
pub(crate) struct FindingData {
    /// What is left out or relaxed, and the reason.
    text: String,
    /// Names of the bodies of each pair that this is true of; empty for a shape that is left out.
    pairs: Vec<[String; 2]>,
}

/// Returns a finding in words, without its pairs, and the pairs.
pub(crate) fn finding(finding: &CollisionFinding) -> FindingData {
    match finding {
        CollisionFinding::PairsNotTested { pairs, because } => FindingData {
            text: format!("not tested for collisions, because {because}"),
            pairs: pairs.clone(),
        },
        CollisionFinding::LeastDistanceReduced {
            pair,
            at_start_m,
            asked_m,
        } => FindingData {
            text: format!(
                "the least distance is {:.1} mm, half of that at the start, in place of {:.1} mm",
                0.5e3 * at_start_m,
                1e3 * asked_m
            ),
            pairs: vec![pair.clone()],
        },
        other => FindingData {
            text: other.to_string(),
            pairs: Vec::new(),
        },
    }
}

/// Returns the collision shapes of a robot. `read_mesh` is called with the name of each mesh and
/// the folder of the URDF, and returns the bytes of the mesh or the reason why there are none; an
/// exception of it ends the design.
pub(crate) fn collision_model(
    robot: &Bound<'_, Manipulator>,
    read_mesh: &Py<PyAny>,
) -> PyResult<CollisionModel> {
    let (py, source) = (robot.py(), &robot.get().urdf);
    let mut raised = None;
    let mut read = |file: &str| {
        let found = read_mesh.bind(py).call1((file, source.folder.as_ref()));
        let bytes = found.and_then(|found| match found.extract::<Vec<u8>>() {
            Ok(bytes) => Ok(Ok(bytes)),
            Err(_) => found.extract::<String>().map(Err),
        });
        bytes.unwrap_or_else(|error| {
            raised.get_or_insert(error);
            Err(String::new())
        })
    };
    let model = CollisionModel::of_urdf(&source.urdf, &robot.get().robot, &mut read);
    match raised {
        Some(error) => Err(error),
        None => model.map_err(IntoPyErr::into_py_err),
    }
}
