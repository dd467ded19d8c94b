"""An arm that moves and carries a payload, for those without a robot."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from tactid._base.values import Array
from tactid._native import Experiment, Manipulator, MassProperties, wrench_regressor

TIP = "tool0"
"""The frame of the payload and of the wrist sensor."""
RATE_HZ = 1000
"""Samples of the wrist sensor a second. The joints have half as many."""

_PAYLOADS = (
    MassProperties(2.5, [0.02, -0.01, 0.16], np.diag([0.012, 0.015, 0.008])),
    MassProperties(1.2, [-0.01, 0.03, 0.09], np.diag([0.004, 0.004, 0.002])),
)
_HELD_S = 60.0
"""Time for which a payload is held before the other one, s."""
_PUSHED_S = (40.0, 40.8)
"""Begin and end of a contact while a payload is held, s."""
_PUSH_N = np.array([0.0, 0.0, -15.0])
"""Force of the contact on the payload, in the base frame, N."""
_OFFSET = np.array([4.0, -7.0, 12.0, 0.2, -0.3, 0.1])
"""What the sensor measures of nothing, N and N m."""
_NOISE = np.array([0.3, 0.3, 0.3, 0.02, 0.02, 0.02])
"""Standard deviations of the sensor's noise, N and N m."""
_POSTURE = np.array([0.0, -1.2, 1.6, -0.4, 1.57, 0.0])
_AMPLITUDE = 0.6
_RATES = np.array([1.1, 1.3, 1.7, 2.3, 2.9, 3.7])
"""Angular rates of the sines of the joints, rad/s."""


class SimulatedArm:
    """The arm of the built-in robot on a fixed base, with a force-torque sensor at its wrist.

    All joints move by sines without end. Payloads of 2.5 kg and of 1.2 kg take turns every minute,
    and after 40 s something pushes on the payload by 15 N for 0.8 s. The sensor measures what the
    robot exerts on the payload, with noise and a zero that is not set.
    """

    def __init__(self) -> None:
        robot = ElementTree.fromstring(Experiment.paper().urdf)
        parts = list(robot)
        gripper = [part.get("name") for part in parts].index("gripper_mount")
        for part in parts[gripper:]:
            robot.remove(part)
        self.urdf = ElementTree.tostring(robot, encoding="unicode")
        """Description of the arm."""
        self._robot = Manipulator.from_urdf(self.urdf)
        self._random = np.random.default_rng(0)

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints."""
        return list(self._robot.joint_names)

    def samples(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Returns what is measured at times since the start, (N,), s.

        Returns:
            Joint positions, (N, 6), rad; joint velocities, (N, 6), rad/s; wrenches in the frame
            ``tool0``, (N, 6), N and N m.
        """
        angles = np.outer(time_s, _RATES) + np.arange(len(_RATES))
        q = _POSTURE + _AMPLITUDE * np.sin(angles)
        qd = _AMPLITUDE * _RATES * np.cos(angles)
        qdd = -_AMPLITUDE * _RATES**2 * np.sin(angles)
        tool = self._robot.kinematics(TIP, q, qd, qdd)
        tool_from_world = tool.pose[:, :3, :3].transpose(0, 2, 1)
        felt = tool.acceleration + np.array([0.0, 0.0, 9.81])
        in_world = felt, tool.angular_velocity, tool.angular_acceleration
        motion = [np.einsum("nij,nj->ni", tool_from_world, vector) for vector in in_world]
        regressor = wrench_regressor(*motion)
        wrench = self._random.normal(size=(len(time_s), 6)) * _NOISE + _OFFSET
        for k, seconds in enumerate(np.asarray(time_s, dtype=float).tolist()):
            turn, since_s = divmod(seconds, _HELD_S)
            wrench[k] += regressor[k] @ _PAYLOADS[int(turn) % 2].parameters
            if _PUSHED_S[0] <= since_s < _PUSHED_S[1]:
                # The robot holds against the push.
                wrench[k, :3] -= tool_from_world[k] @ _PUSH_N
        return q, qd, wrench
