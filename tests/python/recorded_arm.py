"""A UR5e that carries a known body: what its sensors would say at any time, by Pinocchio.

Positions, velocities and accelerations are analytic, so that nothing is integrated and nothing is
approximate but the last digits. Nothing here uses tactid.
"""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import airo_models
import numpy as np
import pinocchio as pin

DOWN = np.array([0.0, 0.0, -9.81])
WEIGHTLESS = np.zeros(3)
TIP = "tool0"
JOINTS = [
    f"{name}_joint"
    for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
]
ELBOW_UP = np.array([0.2, -1.3, 1.6, -1.2, 1.2, 0.3])
PEAK_SPEED = 1.5  # of each joint, rad/s

# A sensor beside the tip and turned against it, and where the URDF has it.
SENSOR = "ft_sensor"
TIP_FROM_SENSOR = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.5, 1.1), np.array([0.01, -0.02, 0.04]))
LINK = f"""
<link name="{SENSOR}"/>
<joint name="{SENSOR}_joint" type="fixed"><parent link="{TIP}"/><child link="{SENSOR}"/>
<origin xyz="0.01 -0.02 0.04" rpy="0.3 -0.5 1.1"/></joint>
</robot>"""


def ur5e(*, as_published: bool = False) -> str:
    """The URDF, with the sensor's link.

    As published it has attributes ``drake:acceleration`` whose prefix it nowhere declares.
    """
    text = Path(airo_models.get_urdf_path("ur5e")).read_text()
    if not as_published:
        text = re.sub(r'\sdrake:\w+="[^"]*"', "", text)
    return text.replace("</robot>", LINK)


@dataclass(frozen=True, eq=False)
class Body:
    """Ten inertial parameters: of a payload in the frame of the tip."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray
    """3x3, about the centre of mass."""

    @cached_property
    def spatial(self) -> pin.Inertia:
        return pin.Inertia(self.mass, self.com, self.inertia)

    @cached_property
    def values(self) -> np.ndarray:
        """Mass, com xyz, Ixx Ixy Ixz Iyy Iyz Izz about the com."""
        return np.array([self.mass, *self.com, *self.inertia[np.triu_indices(3)]])

    @property
    def option(self) -> str:
        """As ``--tool-mass-properties`` takes it."""
        return ",".join(repr(float(value)) for value in self.values)


def body(mass: float, com: list[float], moments: list[float], rpy: list[float]) -> Body:
    """From principal moments about the centre of mass, and how their axes are turned."""
    axes = pin.rpy.rpyToMatrix(*rpy)
    return Body(mass, np.array(com), axes @ np.diag(moments) @ axes.T)


# None of the ten is zero; the principal moments are those of a body of about 20 cm.
PAYLOAD = body(2.3, [0.03, -0.02, 0.11], [0.011, 0.017, 0.021], [0.4, -0.6, 0.9])
TOOL = body(0.8, [-0.004, 0.006, 0.05], [0.0012, 0.0015, 0.0009], [-0.2, 0.3, 0.5])


@dataclass(frozen=True)
class Waves:
    """A sum of sines for each of n quantities."""

    offset: np.ndarray
    amplitude: np.ndarray
    frequency: np.ndarray
    phase: np.ndarray

    def __call__(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values with first and second derivatives, each (N, n)."""
        rate = 2 * np.pi * self.frequency
        angle = time[:, None, None] * rate + self.phase
        value = self.offset + (self.amplitude * np.sin(angle)).sum(axis=2)
        first = (self.amplitude * rate * np.cos(angle)).sum(axis=2)
        return value, first, -(self.amplitude * rate**2 * np.sin(angle)).sum(axis=2)


def waves(seed: int, offset: np.ndarray, peak_speed: np.ndarray | float) -> Waves:
    """Four sines between 0.1 and 1.5 Hz for each quantity, no faster than its peak speed."""
    rng = np.random.default_rng(seed)
    shape = (len(offset), 4)
    frequency = rng.uniform([0.1, 0.3, 0.6, 1.0], [0.3, 0.6, 1.0, 1.5], shape)
    phase = rng.uniform(0, 2 * np.pi, shape)
    raw = Waves(offset, 1 / (2 * np.pi * frequency), frequency, phase)
    fastest = np.abs(raw(np.arange(0, 60, 0.01))[1]).max(axis=0)
    return replace(raw, amplitude=raw.amplitude * (peak_speed / fastest)[:, None])


@dataclass(frozen=True)
class State:
    """What is true at N times. Vectors of base and tip are in their own axes."""

    time: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    effort: np.ndarray
    """Of the joints that carry the payload."""
    unloaded_effort: np.ndarray
    """Of the same motion without it."""
    wrench: np.ndarray
    """On the payload about the tip's origin: force, moment."""
    base: "Frames"
    tip: "Frames"


@dataclass(frozen=True)
class Frames:
    """How a frame moves in the world; each (N, ...)."""

    pose: np.ndarray
    """4x4."""
    velocity: np.ndarray
    angular_velocity: np.ndarray
    acceleration: np.ndarray
    """Classical: the derivative of the origin's velocity, without gravity."""
    angular_acceleration: np.ndarray


@dataclass(frozen=True, eq=False)
class Arm:
    """The arm on its way."""

    payload: Body = PAYLOAD
    seed: int = 3
    floating: bool = False
    gravity: np.ndarray | None = None
    """Down on a fixed base, zero on a floating one, unless it is given."""

    @cached_property
    def motion(self) -> Waves:
        return waves(self.seed, ELBOW_UP, PEAK_SPEED)

    @cached_property
    def base_motion(self) -> Waves:
        """Position of the base, and its roll, pitch and yaw; at rest if it is fixed."""
        speed = np.array([0.3] * 3 + [0.5] * 3) * self.floating
        return waves(
            self.seed + 1000, np.array([1.0, -2, 3, 0.2, -0.3, 0.5]) * self.floating, speed
        )

    def at(self, time: np.ndarray) -> State:
        """What is true at these times, s."""
        model, loaded = (pin.buildModelFromXML(ur5e(), pin.JointModelFreeFlyer()) for _ in "ab")
        tip = model.frames[model.getFrameId(TIP, pin.BODY)]
        loaded.appendBodyToJoint(tip.parentJoint, self.payload.spatial, tip.placement)
        down = self.gravity
        if down is None:
            down = WEIGHTLESS if self.floating else DOWN
        for each in (model, loaded):
            each.gravity.linear = down
            assert list(each.names[2:]) == JOINTS
        q, v, a = self.motion(time)
        base, at_base = self._base(time)
        rows = []
        data, loaded_data = model.createData(), loaded.createData()
        for k in range(len(time)):
            whole = np.concatenate([at_base[0][k], q[k]])
            moving = np.concatenate([at_base[1][k], v[k]]), np.concatenate([at_base[2][k], a[k]])
            effort = pin.rnea(loaded, loaded_data, whole, *moving)[6:].copy()
            unloaded = pin.rnea(model, data, whole, *moving)[6:].copy()
            rows.append((effort, unloaded, *self._at_tip(model, data, whole, *moving, down)))
        effort, unloaded, wrench, *frames = (np.array(column) for column in zip(*rows, strict=True))
        return State(time, q, v, a, effort, unloaded, wrench, base, Frames(*frames))

    def _at_tip(
        self,
        model: pin.Model,
        data: pin.Data,
        q: np.ndarray,
        v: np.ndarray,
        a: np.ndarray,
        down: np.ndarray,
    ) -> tuple[np.ndarray, ...]:
        """The wrench on the payload, and how the tip moves."""
        tip = model.getFrameId(TIP, pin.BODY)
        pin.forwardKinematics(model, data, q, v, a)
        pose = pin.updateFramePlacement(model, data, tip)
        velocity = pin.getFrameVelocity(model, data, tip, pin.LOCAL)
        acceleration = pin.getFrameAcceleration(model, data, tip, pin.LOCAL)
        classical = pin.getFrameClassicalAcceleration(model, data, tip, pin.LOCAL)
        acceleration.linear -= pose.rotation.T @ down
        inertia = self.payload.spatial
        wrench = inertia * acceleration + inertia.vxiv(velocity)
        vectors = (velocity.linear, velocity.angular, classical.linear, classical.angular)
        return (wrench.vector.copy(), pose.homogeneous, *(vector.copy() for vector in vectors))

    def _base(self, time: np.ndarray) -> tuple[Frames, tuple[np.ndarray, ...]]:
        """How the base moves; and the same as Pinocchio's free-flyer takes it."""
        local, rows, joint = pin.LOCAL, [], []
        # One that stands still is worked out once.
        value, first, second = self.base_motion(time if self.floating else time[:1])
        for p, dp, ddp in zip(value, first, second, strict=True):
            pose = pin.SE3(pin.rpy.rpyToMatrix(p[3:]), p[:3])
            jacobian = pin.rpy.computeRpyJacobian(p[3:], local)
            change = pin.rpy.computeRpyJacobianTimeDerivative(p[3:], dp[3:], local)
            back = pose.rotation.T
            linear, angular = back @ dp[:3], jacobian @ dp[3:]
            acceleration = back @ ddp[:3]
            turning = jacobian @ ddp[3:] + change @ dp[3:]
            # Classical to spatial: less the angular velocity times the velocity.
            spatial = acceleration - np.cross(angular, linear)
            rows.append((pose.homogeneous, linear, angular, acceleration, turning))
            joint.append(
                (
                    pin.SE3ToXYZQUAT(pose),
                    np.concatenate([linear, angular]),
                    np.concatenate([spatial, turning]),
                )
            )
        if not self.floating:
            rows, joint = rows * len(time), joint * len(time)
        frames = Frames(*(np.array(column) for column in zip(*rows, strict=True)))
        return frames, tuple(np.array(column) for column in zip(*joint, strict=True))


FIXED = Arm()
FLOATING = Arm(floating=True)


def wrench_about(sensor: pin.SE3, wrench: np.ndarray) -> np.ndarray:
    """Wrenches at the tip, in the axes of a sensor and about its origin; (N, 6)."""
    force = wrench[:, :3] @ sensor.rotation
    moment = (wrench[:, 3:] - np.cross(sensor.translation, wrench[:, :3])) @ sensor.rotation
    return np.hstack([force, moment])


def friction(velocity: np.ndarray) -> np.ndarray:
    """Coulomb and viscous friction of each joint, smooth about zero, N m."""
    coulomb = np.array([6.0, 7.0, 5.0, 2.0, 1.8, 1.5])
    viscous = np.array([8.0, 9.0, 7.0, 2.5, 2.2, 2.0])
    return coulomb * np.tanh(velocity / 0.1) + viscous * velocity


def pose_values(pose: np.ndarray) -> np.ndarray:
    """Position and quaternion xyzw of one 4x4."""
    values: np.ndarray = pin.SE3ToXYZQUAT(pin.SE3(pose))
    return values
