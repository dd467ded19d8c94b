"""A recorded motion whose noise can be drawn anew, for the studies beside this file."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tactid
from tactid._base.values import values_of

Array = NDArray[np.float64]

Noise = Callable[[Array, Array, np.random.Generator], Array]
"""Noise on values, (n, ...), with standard deviations, (...), from a generator."""

FINGERS = ["finger_left_link", "finger_right_link"]
METHODS = ["tactile", "effort", "joint-sensing", "combined"]


def white(values: Array, std_devs: Array, random: np.random.Generator) -> Array:
    """Noise that each sample draws anew."""
    return std_devs * random.standard_normal(values.shape)


@dataclass(frozen=True)
class Recorded:
    """What the robot measured: a row an instant, orientations as x, y, z, w."""

    time: Array
    q: Array
    qd: Array
    effort: Array
    position: Array
    orientation: Array
    twist: Array
    """Twist of the base in its own frame: linear, then angular, (n, 6)."""
    wrench: Array
    """Wrenches of both fingers on the payload, (n, 2, 6)."""

    @classmethod
    def of(cls, experiment: tactid.Experiment) -> "Recorded":
        """Simulates an experiment and reads its log."""
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "run.mcap"
            tactid.simulate(experiment, log)
            return cls.read(log)

    @classmethod
    def read(cls, log: Path) -> "Recorded":
        """Reads a log of the simulator."""
        joints, base = tactid.read(log, "/joint_states"), tactid.read(log, "/base/odom")
        fingers = [tactid.read(log, f"/finger_{side}/wrench") for side in ("left", "right")]
        return cls(
            time=joints.time,
            q=joints["position"],
            qd=joints["velocity"],
            effort=joints["effort"],
            position=base["pose"][:, :3],
            orientation=base["pose"][:, 3:],
            twist=base["twist"],
            wrench=np.stack([finger["wrench"] for finger in fingers], axis=1),
        )

    def pose(self) -> Array:
        """Returns the pose of the base: position, then quaternion x, y, z, w, (n, 7)."""
        return np.hstack([self.position, self.orientation])

    def world_twist(self) -> Array:
        """Returns the twist of the base in world axes: linear, then angular, (n, 6)."""
        twist = self.twist.reshape(-1, 2, 3)
        return np.einsum("nij,nkj->nki", rotations(self.orientation), twist).reshape(-1, 6)

    def kinematics(self, robot: tactid.Manipulator, frame: str) -> tactid.FrameMotion:
        """Returns the motion of a frame, with accelerations derived from the velocities."""
        step, twist = self.time[1] - self.time[0], self.world_twist()
        return robot.kinematics(
            frame,
            self.q,
            self.qd,
            np.gradient(self.qd, step, axis=0),
            base_pose=self.pose(),
            base_twist=twist,
            base_acceleration=np.gradient(twist, step, axis=0),
        )

    def regressor(self, robot: tactid.Manipulator) -> Array:
        """Of the wrench on the payload in the tool's frame and about its origin, (n, 6, 10)."""
        tool = self.kinematics(robot, "tool0")
        vectors = [tool.acceleration, tool.angular_velocity, tool.angular_acceleration]
        tool_from_world = np.swapaxes(tool.pose[:, :3, :3], 1, 2)
        own = (np.einsum("nij,nj->ni", tool_from_world, vector) for vector in vectors)
        return tactid.wrench_regressor(*own)

    def with_noise(
        self,
        random: np.random.Generator,
        *,
        wrench: float,
        motion: float = 0.0,
        effort: float = 0.0,
        draw: "Noise" = white,
    ) -> "Recorded":
        """Noise whose standard deviation is such a part of each channel's peak."""

        def of(values: Array, level: float) -> Array:
            std_devs = level * np.abs(values).max(axis=0)
            return draw(values, std_devs, random) if level > 0 else 0.0 * values

        return replace(
            self,
            wrench=self.wrench + of(self.wrench, wrench),
            # Small rotations: twice the quaternion's vector part.
            orientation=turned(self.orientation, of(2 * self.orientation[:, :3], motion)),
            q=self.q + of(self.q, motion),
            qd=self.qd + of(self.qd, motion),
            effort=self.effort + of(self.effort, effort),
            position=self.position + of(self.position, motion),
            twist=self.twist + of(self.twist, motion),
        )

    def identify(
        self,
        robot: tactid.Manipulator,
        method: str,
        seconds: float,
        estimator: str = "least-squares",
        **options: object,
    ) -> tactid.Identification:
        """As a user would, from the first seconds alone."""
        rows = slice(0, int(np.searchsorted(self.time, self.time[0] + seconds, side="right")))
        given = {
            "method": method,
            "estimator": estimator,
            "q": self.q[rows],
            "qd": self.qd[rows],
            "pose": self.pose()[rows],
            "twist": self.world_twist()[rows],
        }
        if method in ("effort", "combined"):
            given["effort"] = self.effort[rows]
        sensors = []
        if method in ("tactile", "combined"):
            given["wrench"], sensors = self.wrench[rows], FINGERS
        time = self.time[rows]
        return tactid.identify(time, robot=robot, sensors=sensors, delay_s=0.0, **given, **options)

    def wrench_std_dev(self, level: float) -> Array:
        """Standard deviations of the noise on each finger's channels at a level, (2, 6)."""
        return level * np.abs(self.wrench).max(axis=0)


def rotations(orientation: Array) -> Array:
    """Rotation matrices of unit quaternions x, y, z, w."""
    x, y, z, w = orientation.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def turned(orientation: Array, turns: Array) -> Array:
    """Quaternions turned by small rotation vectors in the world's axes."""
    a = np.hstack([turns / 2, np.ones((len(turns), 1))])
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = orientation
    vector = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
    scalar = a[:, 3] * b[:, 3] - np.sum(a[:, :3] * b[:, :3], axis=1)
    return np.column_stack([vector, scalar])


def scales(body: tactid.MassProperties) -> Array:
    """What an error is relative to: the value, or for a small one the largest of its kind."""
    size = np.abs(values_of(body))
    for kind in (slice(1, 4), slice(4, 10)):
        largest = size[kind].max()
        size[kind] = np.where(size[kind] < 1e-3 * largest, largest, size[kind])
    return size
