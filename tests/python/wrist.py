"""A wrist with a force-torque sensor that carries a known body, recorded for any time."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import tactid

Array = NDArray[np.float64]

BODY = tactid.MassProperties(
    1.84,
    [0.012, -0.031, 0.094],
    [[0.0112, 0.0011, -0.0009], [0.0011, 0.0093, 0.0014], [-0.0009, 0.0014, 0.0046]],
)
TRUTH = np.array([BODY.mass, *BODY.com, *BODY.inertia[np.triu_indices(3)]])
NOISE = np.array([0.3, 0.3, 0.3, 0.02, 0.02, 0.02])
PERIOD, RATE, EARLY = 4.0, 100.0, 8.0
KINDS = np.repeat([0, 1, 2], [1, 3, 6])


def turned(time: Array, calm_until: float) -> Array:
    """Attitudes of a wrist that swings with a period of 4 s, by less before some time."""
    rise = np.clip(time - calm_until + 1, 0, 1)
    size = (0.65 - 0.35 * np.cos(np.pi * rise))[:, None]
    rates = 2 * np.pi / PERIOD * np.array([[1, 3], [2, 5], [1, 4]])
    waves = np.sin(time[:, None, None] * rates + [[0.0, 1.0], [2.0, 0.5], [1.0, 3.0]])
    roll, pitch, yaw = (size * (waves @ [0.6, 0.3])).T
    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def about(axis: int, angle: Array) -> Array:
    """Rotations about x, y or z, (N, 3, 3)."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1
    turn[:, one, one] = turn[:, two, two] = np.cos(angle)
    turn[:, two, one] = np.sin(angle)
    turn[:, one, two] = -turn[:, two, one]
    return turn


def identified(
    duration: float,
    seed: int,
    *,
    calm_until: float = 0.0,
    swings: bool = True,
    noise: Array = NOISE,
    offset: Array | float = 0.0,
    sign: float = 1.0,
    **options: Any,
) -> tactid.Identification:
    """The result of a recording of so many seconds, its noise drawn from the seed."""
    time = np.arange(0.0, duration, 1 / RATE)
    step = 1e-4

    def at(shift: float) -> Array:
        return turned(time + shift, calm_until) if swings else turned(0 * time, calm_until)

    def velocity(shift: float) -> Array:
        spin = (at(shift + step) - at(shift - step)) / (2 * step) @ np.swapaxes(at(shift), 1, 2)
        return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)

    turn, back = at(0.0), np.swapaxes(at(0.0), 1, 2)
    acceleration = (velocity(step) - velocity(-step)) / (2 * step)
    felt = back @ [0.0, 0.0, 9.81]
    own = [np.einsum("nij,nj->ni", back, vector) for vector in (velocity(0.0), acceleration)]
    wrench = tactid.wrench_regressor(felt, *own) @ BODY.parameters
    wrench += noise * np.random.default_rng(seed).normal(size=wrench.shape)
    wrench = sign * wrench + offset
    pose = np.zeros((len(time), 4, 4))
    pose[:, :3, :3], pose[:, 3, 3] = turn, 1.0
    twist = np.hstack([np.zeros((len(time), 3)), velocity(0.0)])
    given = {"pose": pose, "twist": twist, "wrench": wrench}
    return tactid.identify(time, **given, **{"cutoff_hz": 5.0, "delay_s": 0.0} | options)


def half_widths(found: tactid.Identification) -> Array:
    """Half of each interval as a fraction of the largest value of its kind."""
    values = np.abs(found.estimate.values)
    largest = np.array([values[kind == KINDS].max() for kind in range(3)])
    return 1.96 * found.estimate.std_devs / largest[KINDS]
