"""Which errors of a wrist sensor leave a result right: the source of what contradicts a result.

Run by ``python bench/contradicted.py``; needs the UR5 of ``example-robot-data``. Bodies of several
shapes are swung with faults of the sensor and of the robot. A line for each recording with the
finding ``wrong_assumption`` or ``inconsistent`` has the first cause, by how much it changes the
mass and the centre of mass, the distance from a possible body, and the errors of the values.
"""

import re
import sysconfig
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tactid
from tactid._base.values import values_of

Array = NDArray[np.float64]

UR5 = "cmeel.prefix/share/example-robot-data/robots/ur_description/urdf/ur5_robot.urdf"
RATES = np.array([1.1, 1.3, 1.7, 2.3, 2.9, 3.7])
POSTURE = np.array([0, -1.2, 1.6, -0.4, 1.57, 0])
TIME = np.arange(0.0, 20.0, 0.01)
UNITS = np.repeat([1.0, 0.07], 3)
"""A moment for each force: forces in N, moments in N m."""

BODIES = {
    "box": tactid.MassProperties(2.3, [0.02, -0.01, 0.10], np.diag([0.012, 0.015, 0.008])),
    "plate": tactid.MassProperties(2.0, [0.0, 0.0, 0.03], np.diag([0.01, 0.01, 0.02])),
    "rod": tactid.MassProperties(1.0, [0.02, -0.01, 0.15], np.diag([0.0075, 0.0075, 2e-5])),
    "sphere": tactid.MassProperties(1.5, [0.0, 0.0, 0.05], 0.0015 * np.eye(3)),
}

Fault = Callable[[Array, np.random.Generator], Array]


def main() -> None:
    """Prints the recordings with one of the two findings."""
    text = (Path(sysconfig.get_paths()["purelib"]) / UR5).read_text()
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", text, flags=re.DOTALL)
    robot = tactid.Manipulator.from_urdf(text)
    print(
        "body   swing noise fault              cause           change shift distance   mass   com"
    )
    for name, body in BODIES.items():
        for swing in (0.1, 0.5):
            q, qd, wrench = motion(robot, body, swing)
            for noise in (0.05, 0.3):
                for fault, turned, change in faults():
                    random = np.random.default_rng(1)
                    felt = change(wrench, random) + noise * UNITS * random.normal(size=wrench.shape)
                    given = {"robot": robot, "tip": "tool0", "q": q + turned, "qd": qd}
                    found = tactid.identify(
                        TIME, wrench=felt, wrench_offset="no", wrench_acts_on="sensor", **given
                    )
                    if line := described(found, body):
                        print(f"{name:6} {swing:5} {noise:5} {fault:18} {line}")


def motion(
    robot: tactid.Manipulator, body: tactid.MassProperties, swing: float
) -> tuple[Array, Array, Array]:
    """Returns positions, velocities, and the wrenches of a body on the sensor."""
    angles = np.outer(TIME, RATES) + np.arange(6)
    q, qd = POSTURE + swing * np.sin(angles), swing * RATES * np.cos(angles)
    tool = robot.kinematics("tool0", q, qd, -swing * RATES**2 * np.sin(angles))
    up = np.array([0, 0, 9.81])
    in_world = tool.acceleration + up, tool.angular_velocity, tool.angular_acceleration
    felt = np.einsum("nji,snj->sni", tool.pose[:, :3, :3], in_world)
    return q, qd, -tactid.wrench_regressor(*felt) @ body.parameters


def faults() -> Iterator[tuple[str, Array, Fault]]:
    """What is wrong: its name, an error of the joints' positions, and a change of the wrenches."""
    none, wrist = np.zeros(6), np.eye(6)[3]
    for gain in (0.01, 0.03, 0.05):
        yield f"gain {gain}", none, lambda w, _, gain=gain: w * [1, 1, 1 + gain, 1, 1, 1]
    for angle in (0.01, 0.035, 0.09):
        yield f"turned {angle} rad", none, lambda w, _, angle=angle: turned(w, angle)
    for size in (0.2, 0.5, 1.0):
        yield f"drift {size} N", none, lambda w, random, size=size: w + drift(size, random)
    for size in (0.2, 0.5, 1.0, 2.0, 5.0, 12.0):
        yield f"offset {size} N", none, lambda w, random, size=size: w + zero(size, random)
    for angle in (0.005, 0.02):
        yield f"joint zero {angle}", angle * wrist, lambda w, _: w


def turned(wrench: Array, angle: float) -> Array:
    """Wrenches of a sensor that is turned about its x axis."""
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    return (wrench.reshape(-1, 2, 3) @ turn.T).reshape(-1, 6)


def drift(size: float, random: np.random.Generator) -> Array:
    """An offset that grows from zero."""
    return np.outer(TIME / TIME[-1], size * UNITS * random.normal(size=6))


def zero(size: float, random: np.random.Generator) -> Array:
    """An offset whose force is as large as ``size``."""
    direction = random.normal(size=6)
    return np.asarray(size * UNITS * direction / np.linalg.norm(direction[:3]))


def described(found: tactid.Identification, body: tactid.MassProperties) -> str:
    """Returns what is compared; empty without a finding."""
    noticed = {each.kind: each.data for each in found.findings}
    wrong, far = noticed.get("wrong_assumption"), noticed.get("inconsistent")
    if wrong is None and far is None:
        return ""
    cause, change, shift = "", 0.0, 0.0
    if wrong is not None:
        cause, change, shift = (wrong[key] for key in ("cause", "mass_change", "shift_m"))
    distance = 0.0 if far is None else far["distance"]
    error = np.abs(found.estimate.values - values_of(body))
    inertia = error[4:].max() / np.trace(body.inertia)
    return (
        f"{cause:15} {change:6.1%} {1e3 * shift:3.0f}mm {distance:8.1f} {error[0] / body.mass:6.1%}"
        f" {1e3 * error[1:4].max():3.0f}mm {inertia:7.1%} {int(found.is_contradicted):4}"
    )


if __name__ == "__main__":
    main()
