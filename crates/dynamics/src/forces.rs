//! The wrench on an unknown end-effector, (28)-(30) and (42)-(44).

use crate::Wrench;
use crate::manipulator::FrameId;
use crate::workspace::Workspace;

/// Returns the wrench on an unknown end-effector that follows from the motion of all other bodies
/// if nothing acts from outside: `f_U = -f_K` by (28)-(30) and `n_U` of (44) in Hou et al. 2016,
/// expressed in the frame `tool` and about its origin.
///
/// The workspace holds the [`motion`](crate::motion()) of the robot without its end-effector, which
/// is [`Manipulator::without_subtree`](crate::Manipulator::without_subtree) of `tool`: the masses
/// of its robot count as known. [`forces`](crate::forces()) is not needed. The cost is one pass
/// over the bodies. Nothing is allocated.
#[must_use]
pub fn wrench_on_end_effector(workspace: &Workspace, tool: FrameId) -> Wrench {
    let base = &workspace.states[0];
    let gravity = base.rotation.tr_mul((&workspace.gravity).into());
    let on_rest = workspace.placed_bodies().map(|(body, state, moving)| {
        let placement = moving.placement;
        let mut inertial = *state;
        inertial.acceleration = inertial.acceleration + placement.rotation.tr_mul(gravity);
        inertial.set_inertial_wrench(body);
        placement.transform_wrench(&Wrench {
            force: inertial.force.into(),
            moment: inertial.moment.into(),
        })
    });
    let sum = on_rest.fold(Wrench::zero(), |sum, wrench| sum + wrench); // f_K, below (29), and -n_U, (44)
    -workspace.frame_on_base(tool).inverse_transform_wrench(&sum)
}
