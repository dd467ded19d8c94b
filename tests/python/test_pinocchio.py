"""Motion, forces, free-floating base and momentum equal Pinocchio's on random states."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import pytest

import tactid
from random_robots import random_urdf

TOLERANCE = 1e-10
STATES = 20


@dataclass
class State:
    """N random states: joints, and the base in world axes."""

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    acceleration: np.ndarray


class Oracle:
    """Pinocchio with a free-flyer, spoken to in tactid's terms."""

    def __init__(self, urdf: str, robot: tactid.Manipulator) -> None:
        self.model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        self.joints = [self.model.joints[self.model.getJointId(n)] for n in robot.joint_names]
        assert self.model.nv == 6 + robot.dof
        self.columns = [joint.idx_v for joint in self.joints]

    def configuration(self, state: State, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and accelerations; the base's in its own axes, spatial."""
        position = pin.neutral(self.model)
        position[:7] = pin.SE3ToXYZQUAT(pin.SE3(state.pose[k]))
        for joint, angle in zip(self.joints, state.q[k], strict=True):
            continuous = joint.nq == 2
            position[joint.idx_q : joint.idx_q + joint.nq] = (
                [np.cos(angle), np.sin(angle)] if continuous else angle
            )
        back = state.pose[k, :3, :3].T
        velocity, acceleration = np.zeros(self.model.nv), np.zeros(self.model.nv)
        velocity[:3], velocity[3:6] = back @ state.twist[k, :3], back @ state.twist[k, 3:]
        # Classical to spatial: less the angular velocity times the velocity.
        acceleration[:3] = back @ state.acceleration[k, :3] - np.cross(velocity[3:6], velocity[:3])
        acceleration[3:6] = back @ state.acceleration[k, 3:]
        velocity[self.columns], acceleration[self.columns] = state.qd[k], state.qdd[k]
        return position, velocity, acceleration


def assert_close(ours: np.ndarray, theirs: np.ndarray) -> None:
    """Equal to 1e-10 of the largest entry."""
    scale = np.abs(theirs).max(initial=1e-3)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=TOLERANCE * scale)


@pytest.fixture(params=["ours", *range(6)])
def case(
    request: pytest.FixtureRequest, urdf: str, rng: np.random.Generator
) -> tuple[tactid.Manipulator, Oracle, State]:
    if request.param != "ours":
        urdf = random_urdf(np.random.default_rng(request.param), links=4 + 2 * request.param)
    robot = tactid.Manipulator.from_urdf(urdf, base="floating")
    q, qd, qdd = rng.normal(size=(3, STATES, robot.dof)) * 1.5
    pose = np.array([pin.SE3.Random().homogeneous for _ in range(STATES)])
    twist, acceleration = rng.normal(size=(2, STATES, 6))
    return robot, Oracle(urdf, robot), State(q, qd, qdd, pose, twist, acceleration)


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
    oracle.model.gravity.linear = np.array(gravity)
    torques, wrench = robot.inverse_dynamics(
        s.q,
        s.qd,
        s.qdd,
        base_pose=s.pose,
        base_twist=s.twist,
        base_acceleration=s.acceleration,
        gravity=gravity,
    )
    theirs = [
        pin.rnea(oracle.model, oracle.data, *oracle.configuration(s, k)).copy()
        for k in range(STATES)
    ]
    assert_close(torques, np.array(theirs)[:, oracle.columns])
    in_world = [
        np.concatenate([s.pose[k, :3, :3] @ f[:3], s.pose[k, :3, :3] @ f[3:6]])
        for k, f in enumerate(theirs)
    ]
    assert_close(wrench, np.array(in_world))


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
