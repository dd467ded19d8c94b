"""Coverage of 95 % intervals where a measurement is not what it seems: five remedies.

Run by ``python bench/coverage_remedies.py [DRAWS]``; needs the UR5 of ``example-robot-data``. Each
draw has another body, motion, noise and fault. A line for each remedy has the fraction of the
intervals that contain the truth, for the values of the payload that the recording determines, and
for what the remedy identifies: an offset, a subtracted weight, the direction of gravity. Wrapped
angles and absent moments have no values of their own.
"""

import re
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from contradicted import POSTURE, RATES, UNITS, UR5, zero
from numpy.typing import NDArray

import tactid
from tactid._base.values import Z95, values_of

Array = NDArray[np.float64]

TIME = np.arange(0.0, 12.0, 0.02)
DOWN = np.array([0, 0, -9.81])


class Draw:
    """A random motion of a random body, with its weight apart from the forces of the motion."""

    def __init__(self, robot: tactid.Manipulator, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.body = tactid.MassProperties(
            self.random.uniform(0.5, 4), self.random.uniform(-0.08, 0.08, 3), self._inertia()
        )
        rates = RATES * self.random.uniform(0.7, 1.3, 6)
        angles = np.outer(TIME, rates) + self.random.uniform(0, 6, 6)
        self.q, self.qd = POSTURE + 0.5 * np.sin(angles), 0.5 * rates * np.cos(angles)
        self.tool = robot.kinematics("tool0", self.q, self.qd, -0.5 * rates**2 * np.sin(angles))

    def _inertia(self) -> Array:
        size = self.random.uniform(0.05, 0.15, 3) ** 2
        return np.diag([size[1] + size[2], size[0] + size[2], size[0] + size[1]])

    def wrench(self, gravity: Array, subtracted: Array | None = None) -> Array:
        """Wrenches on the sensor without the weight of a body with these parameters."""

        def load(acceleration: Array, spin: float, parameters: Array) -> Array:
            tool = self.tool
            in_world = acceleration, spin * tool.angular_velocity, spin * tool.angular_acceleration
            felt = np.einsum("nji,snj->sni", tool.pose[:, :3, :3], in_world)
            return np.asarray(-tactid.wrench_regressor(*felt) @ parameters)

        felt = load(self.tool.acceleration - gravity, 1.0, self.body.parameters)
        if subtracted is not None:
            felt -= load(np.tile(-gravity, (len(TIME), 1)), 0.0, subtracted)
        return felt + 0.3 * UNITS * self.random.normal(size=felt.shape)


Remedy = Callable[[Draw], tuple[Array, dict[str, Any], Array | None]]


def offset(draw: Draw) -> tuple[Array, dict[str, Any], Array]:
    """An offset that the data show."""
    added = zero(5.0, draw.random)
    return draw.wrench(DOWN) + added, {}, added


def weight(draw: Draw) -> tuple[Array, dict[str, Any], Array]:
    """A weight that was subtracted."""
    values = np.array([draw.random.uniform(0.3, 2), *draw.random.uniform(-0.05, 0.05, 3)])
    body = tactid.MassProperties(values[0], values[1:], 1e-3 * np.eye(3))
    return draw.wrench(DOWN, body.parameters), {"wrench_is": "without-weight"}, values


def gravity(draw: Draw) -> tuple[Array, dict[str, Any], Array]:
    """Gravity of any direction."""
    direction = draw.random.normal(size=3)
    acting = 9.81 * direction / np.linalg.norm(direction)
    return draw.wrench(acting), {"gravity": "unknown"}, acting


def wrapped(draw: Draw) -> tuple[Array, dict[str, Any], None]:
    """Angles that start again after a turn somewhere in the range of each joint."""
    start = POSTURE + draw.random.uniform(-0.4, 0.4, 6)
    draw.q = start + (draw.q - start) % (2 * np.pi)
    return draw.wrench(DOWN), {}, None


def forces(draw: Draw) -> tuple[Array, dict[str, Any], None]:
    """Three forces without moments."""
    felt = draw.wrench(DOWN)
    felt[:, 3:] = draw.random.choice([0.0, np.nan])
    return felt, {}, None


def main(draws: int) -> None:
    """Prints the coverage with each remedy."""
    text = (Path(sysconfig.get_paths()["purelib"]) / UR5).read_text()
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", text, flags=re.DOTALL)
    robot = tactid.Manipulator.from_urdf(text)
    for remedy in (offset, weight, gravity, wrapped, forces):
        of_payload, of_remedy = [], []
        for seed in range(draws):
            draw = Draw(robot, seed)
            wrench, options, truth = remedy(draw)
            given = {"robot": robot, "tip": "tool0", "q": draw.q, "qd": draw.qd, "wrench": wrench}
            found = tactid.identify(TIME, wrench_acts_on="sensor", **given, **options)
            estimate, fit = found.estimate, found.fit
            std_devs = np.asarray(estimate.std_devs)
            is_inside = np.abs(estimate.values - values_of(draw.body)) < Z95 * std_devs
            of_payload.append(np.where(np.isfinite(std_devs), is_inside, np.nan))
            shown: dict[Remedy, Any] = {
                offset: fit.wrench_offset,
                weight: fit.subtracted_weight,
                gravity: fit.gravity,
            }
            if (own := shown.get(remedy)) is not None and truth is not None:
                error = np.abs(np.asarray(own.values) - truth)
                of_remedy.append(error < Z95 * np.asarray(own.std_devs))
        payload = np.array(of_payload)
        kinds = {"mass": slice(1), "com": slice(1, 4), "inertia": slice(4, 10)}
        inside = {name: payload[:, kind] for name, kind in kinds.items()}
        shares = [
            f"{name} {np.nanmean(of_kind):.1%}" if np.isfinite(of_kind).any() else f"no {name}"
            for name, of_kind in inside.items()
        ]
        line = f"{remedy.__name__:8} " + ", ".join(shares)
        if of_remedy:
            line += f"; itself {np.mean(of_remedy):.1%} (in {len(of_remedy)} of {draws})"
        print(line, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 400)
