"""Motion, forces, free-floating base and momentum equal Pinocchio's on random states."""

import numpy as np
import pinocchio as pin
import pytest

import tactid
from pinocchio_oracle import Oracle, State, assert_close, random_state
from random_robots import random_urdf

STATES = 20


@pytest.fixture(params=["ours", *range(6)])
def case(
    request: pytest.FixtureRequest, urdf: str, rng: np.random.Generator
) -> tuple[tactid.Manipulator, Oracle, State]:
    if request.param != "ours":
        urdf = random_urdf(np.random.default_rng(request.param), links=4 + 2 * request.param)
    robot = tactid.Manipulator.from_urdf(urdf, base="floating")
    return robot, Oracle(urdf, robot), random_state(rng, STATES, robot.dof)


def test_motion_of_every_link(case: tuple[tactid.Manipulator, Oracle, State]) -> None:
    robot, oracle, s = case
    model, data, axes = oracle.model, oracle.data, pin.LOCAL_WORLD_ALIGNED
    base = {"base_pose": s.pose, "base_twist": s.twist, "base_acceleration": s.acceleration}
    for name in robot.frame_names:
        ours = robot.kinematics(name, s.q, s.qd, s.qdd, **base)
        frame = model.getFrameId(name, pin.BODY)
        poses, velocities, accelerations = [], [], []
        for k in range(STATES):
            pin.forwardKinematics(model, data, *oracle.configuration(s, k))
            poses.append(pin.updateFramePlacement(model, data, frame).homogeneous)
            velocities.append(pin.getFrameVelocity(model, data, frame, axes).vector)
            moved = pin.getFrameClassicalAcceleration(model, data, frame, axes)
            accelerations.append(moved.vector)
        assert_close(ours.pose, np.array(poses))
        assert_close(np.hstack([ours.velocity, ours.angular_velocity]), np.array(velocities))
        both = np.hstack([ours.acceleration, ours.angular_acceleration])
        assert_close(both, np.array(accelerations))


@pytest.mark.parametrize("gravity", [[0, 0, 0], [0.3, -1.2, -9.81]])
def test_joint_torques_and_base_wrench(
    case: tuple[tactid.Manipulator, Oracle, State], gravity: list[float]
) -> None:
    robot, oracle, s = case
    torques, wrench = robot.inverse_dynamics(
        s.q,
        s.qd,
        s.qdd,
        base_pose=s.pose,
        base_twist=s.twist,
        base_acceleration=s.acceleration,
        gravity=gravity,
    )
    their_torques, their_wrench = oracle.inverse_dynamics(s, gravity)
    assert_close(torques, their_torques)
    assert their_wrench is not None
    assert_close(wrench, their_wrench)


def test_base_acceleration(case: tuple[tactid.Manipulator, Oracle, State]) -> None:
    robot, oracle, s = case
    oracle.model.gravity.linear = np.zeros(3)
    ours = robot.base_acceleration(s.q, s.qd, s.qdd, base_pose=s.pose, base_twist=s.twist)
    theirs = []
    for k in range(STATES):
        position, velocity, acceleration = oracle.configuration(s, k)
        acceleration[:6] = 0
        needed = pin.rnea(oracle.model, oracle.data, position, velocity, acceleration)[:6].copy()
        mass = pin.crba(oracle.model, oracle.data, position)[:6, :6]
        mass = np.triu(mass) + np.triu(mass, 1).T
        spatial = np.linalg.solve(mass, -needed)
        spatial[:3] += np.cross(velocity[3:6], velocity[:3])
        rotation = s.pose[k, :3, :3]
        theirs.append(np.concatenate([rotation @ spatial[:3], rotation @ spatial[3:]]))
    assert_close(ours, np.array(theirs))


def test_momentum(case: tuple[tactid.Manipulator, Oracle, State]) -> None:
    robot, oracle, s = case
    ours = robot.momentum(s.q, s.qd, base_pose=s.pose, base_twist=s.twist)
    theirs = []
    for k in range(STATES):
        position, velocity, _ = oracle.configuration(s, k)
        total = pin.computeCentroidalMomentum(oracle.model, oracle.data, position, velocity)
        about_origin = total.angular + np.cross(oracle.data.com[0], total.linear)
        theirs.append(np.concatenate([total.linear, about_origin]))
    assert_close(ours, np.array(theirs))
