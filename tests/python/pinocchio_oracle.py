"""Pinocchio as an oracle of the dynamics, asked in tactid's terms."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

import tactid

TOLERANCE = 1e-10


@dataclass
class State:
    """N random states: joints, and the base in world axes."""

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    acceleration: np.ndarray


def random_state(rng: np.random.Generator, count: int, joints: int) -> State:
    q, qd, qdd = rng.normal(size=(3, count, joints)) * 1.5
    pose = np.array([pin.SE3.Random().homogeneous for _ in range(count)])
    twist, acceleration = rng.normal(size=(2, count, 6))
    return State(q, qd, qdd, pose, twist, acceleration)


@dataclass
class Joint:
    """A joint of Pinocchio's model: ``position = ratio * q[column] + offset`` with tactid's q."""

    model: pin.JointModel
    column: int
    ratio: float = 1.0
    offset: float = 0.0


class Oracle:
    """Pinocchio's model of a robot, on the same kind of base.

    It takes mimic joints for independent ones, so their positions and torques are combined here.
    """

    def __init__(self, urdf: str, robot: tactid.Manipulator) -> None:
        self.floats = robot.base == "floating"
        root = (pin.JointModelFreeFlyer(),) if self.floats else ()
        self.model = pin.buildModelFromXML(urdf, *root)
        self.data = self.model.createData()
        self.joints = []
        for element in ET.fromstring(urdf.encode()).findall("joint"):
            name, mimic = element.attrib["name"], element.find("mimic")
            if not self.model.existJointName(name):
                continue  # It is fixed.
            joint = self.model.joints[self.model.getJointId(name)]
            if mimic is None or name in robot.joint_names:
                self.joints.append(Joint(joint, robot.joint_names.index(name)))
            else:
                column = robot.joint_names.index(mimic.attrib["joint"])
                ratio, offset = (
                    float(mimic.get(key, default))
                    for key, default in (("multiplier", "1"), ("offset", "0"))
                )
                self.joints.append(Joint(joint, column, ratio, offset))
        assert self.model.nv == 6 * self.floats + len(self.joints)

    def configuration(self, state: State, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and accelerations; the base's in its own axes, spatial."""
        position = pin.neutral(self.model)
        velocity, acceleration = np.zeros(self.model.nv), np.zeros(self.model.nv)
        if self.floats:
            position[:7] = pin.SE3ToXYZQUAT(pin.SE3(state.pose[k]))
            back = state.pose[k, :3, :3].T
            velocity[:3], velocity[3:6] = back @ state.twist[k, :3], back @ state.twist[k, 3:]
            # Classical to spatial: less the angular velocity times the velocity.
            acceleration[:3] = back @ state.acceleration[k, :3]
            acceleration[:3] -= np.cross(velocity[3:6], velocity[:3])
            acceleration[3:6] = back @ state.acceleration[k, 3:]
        for joint in self.joints:
            at, model = joint.column, joint.model
            angle = joint.ratio * state.q[k, at] + joint.offset
            continuous = model.nq == 2
            position[model.idx_q : model.idx_q + model.nq] = (
                [np.cos(angle), np.sin(angle)] if continuous else angle
            )
            velocity[model.idx_v] = joint.ratio * state.qd[k, at]
            acceleration[model.idx_v] = joint.ratio * state.qdd[k, at]
        return position, velocity, acceleration

    def inverse_dynamics(
        self, state: State, gravity: list[float]
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Torques of tactid's joints, and the wrench on a floating base in world axes."""
        self.model.gravity.linear = np.array(gravity)
        torques, wrenches = np.zeros_like(state.q), []
        for k in range(len(state.q)):
            forces = pin.rnea(self.model, self.data, *self.configuration(state, k))
            for joint in self.joints:
                torques[k, joint.column] += joint.ratio * forces[joint.model.idx_v]
            if self.floats:
                rotation = state.pose[k, :3, :3]
                wrenches.append([*(rotation @ forces[:3]), *(rotation @ forces[3:6])])
        return torques, np.array(wrenches) if self.floats else None


def assert_close(ours: np.ndarray, theirs: np.ndarray) -> None:
    """Equal to 1e-10 of the largest entry."""
    scale = np.abs(theirs).max(initial=1e-3)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=TOLERANCE * scale)
