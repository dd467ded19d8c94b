"""The speed at which the files of a designed motion run."""

from dataclasses import replace

import numpy as np

from tactid._base.errors import ArgumentError
from tactid._results.records import DesignedMotion

SPEED = 0.5
"""Fraction of the designed speed at which files run unless another one is given: a robot that makes
a motion for the first time can then be stopped in time."""

LEAST_SPEED = 0.01
"""Least fraction: a slower motion makes files of many million rows, and determines nothing."""


def speed_of(speed: float) -> float:
    """Returns a fraction of the designed speed that is within its range."""
    if isinstance(speed, bool) or not isinstance(speed, int | float | np.number):
        raise ArgumentError(f"`speed` is {speed!r}: expected a number", "speed")
    if not LEAST_SPEED <= speed <= 1:
        raise ArgumentError(
            f"`speed` is {speed:g}: expected a fraction from {LEAST_SPEED:g} to 1, the designed"
            " speed, which is within the limits of the robot",
            "speed",
        )
    return float(speed)


def optional_speed(speed: float | None) -> float | None:
    """Returns a fraction that is within its range; None stays."""
    return None if speed is None else speed_of(speed)


def at_speed(motion: DesignedMotion, speed: float) -> DesignedMotion:
    """Returns a motion along the same path at a fraction of its speed."""
    return replace(
        motion,
        times_s=motion.times_s / speed,
        qd=motion.qd * speed,
        qdd=motion.qdd * speed**2,
        duration_s=motion.duration_s / speed,
    )
