//! Reads any text as a URDF. A robot has finite poses and torques at rest.

use crate::text_of;
use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::{
    BaseKind, FrameMotion, JointMotion, Manipulator, Urdf, Workspace, inverse_dynamics,
};

/// Magnitude below which products of a description's numbers are finite.
const USUAL: f64 = 1e50;

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    let text = text_of(bytes);
    let Ok(urdf) = Urdf::from_xml(text) else {
        return;
    };
    for link in &urdf.robot().links {
        let _ = urdf.collision_shapes(&link.name);
    }
    for base in [BaseKind::Fixed, BaseKind::Floating] {
        if let Ok(robot) = urdf.manipulator(base) {
            check(&robot);
        }
    }
}

fn check(robot: &Manipulator) {
    for link in robot.links() {
        assert!(robot.frame(link.name).is_ok(), "{} is no frame", link.name);
    }
    assert!(
        robot
            .joint_names()
            .iter()
            .all(|name| robot.joint_index(name).is_some())
    );
    let parameters = robot
        .bodies()
        .all(|body| body.parameters.as_vector().iter().all(|x| x.abs() < USUAL));
    let places = robot.bodies().filter_map(|body| body.joint);
    let lengths = places.map(|joint| joint.parent_from_body.translation.vector.amax());
    if !parameters || lengths.fold(0.0, f64::max) > USUAL {
        return;
    }
    let mut workspace = Workspace::new(robot);
    let zeros = vec![0.0; robot.dof()];
    let joints = JointMotion {
        position: &zeros,
        velocity: &zeros,
        acceleration: &zeros,
    };
    inverse_dynamics(
        &mut workspace,
        &FrameMotion::at_rest(Isometry3::identity()),
        joints,
        &Vector3::new(0.0, 0.0, -9.81),
    )
    .expect("vectors of the robot's length");
    let torques = workspace
        .joint_torques()
        .expect("the dynamics are computed");
    assert!(
        torques.iter().all(|torque| torque.is_finite()),
        "{torques:?}"
    );
}
