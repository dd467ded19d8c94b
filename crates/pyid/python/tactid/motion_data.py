"""The data of a designed motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tactid.values import Array

WORKSPACE = "the workspace"
"""Name of the box that the tip and the payload's box stay in."""


@dataclass(frozen=True)
class LimitMargin:
    """How much of one limit a motion uses."""

    limit: str
    """The limit, such as ``the velocity of joint joint_3``."""
    used: float
    """Largest fraction of the limit that is used at any time: 1 at the limit."""
    time: float
    """Time at which it is used, s."""
    distance: float | None
    """Of the distance between two bodies, the least, m: 0.08 at most, and negative where they
    touch. None for other limits."""
    binds: bool
    """Whether relaxing the limit allows smaller intervals."""


@dataclass(frozen=True)
class CollisionFinding:
    """What the test for collisions leaves out or relaxes."""

    text: str
    """What is left out or relaxed, and the reason."""
    pairs: tuple[tuple[str, str], ...]
    """Names of the bodies of each pair that this is true of; empty for a shape that is left out."""


@dataclass(frozen=True, eq=False, repr=False)
class MotionData:
    """What is known of a designed motion, without its methods."""

    tip: str
    """Link in whose frame the payload is described."""
    joints: tuple[str, ...]
    """Names of all joints, in the robot's order."""
    moving: tuple[str, ...]
    """Names of the joints that move, in the robot's order."""
    time: Array
    """Times since the start, (N,), s; the last is the end of the motion."""
    q: Array
    """Positions, (N, n), rad or m."""
    qd: Array
    """Velocities, (N, n), rad/s or m/s."""
    qdd: Array
    """Accelerations, (N, n), rad/s² or m/s²."""
    expected_payload: Mapping[str, Any]
    """The payload that the intervals are predicted for, with the keys of an estimate."""
    predicted_std_dev: Mapping[str, Any]
    """Predicted standard deviations, with the keys of an estimate: ``mass``, kg, ``com``, m, and
    ``inertia``, kg m²."""
    within: float
    """Target for half of each 95 % interval, as a fraction of the largest value of its kind."""
    interval_ratio: Mapping[str, Any]
    """Half of each predicted 95 % interval over its target, with the keys of an estimate."""
    base_attitude_deg: float | None
    """Largest angle by which the base turns with the expected payload, degrees; None where it is
    fixed."""
    base_position_m: float | None
    """Largest distance by which the origin of the base moves with the expected payload, m; None
    where it is fixed."""
    margins: tuple[LimitMargin, ...]
    """How much of each limit is used, by the payload that uses most."""
    binding_constraints: tuple[str, ...]
    """The limits that bind: relaxing one allows smaller intervals."""
    collision_findings: tuple[CollisionFinding, ...] | None
    """What the test for collisions leaves out; None where the robot's were not tested."""
    payload_tested: bool
    """Whether the box of the payload was given, so that its collisions were tested."""
    surroundings: tuple[str, ...]
    """The boxes around the robot that were given, such as ``the workspace`` and ``the keep-out box
    table``; empty where nothing around the robot was tested."""
    duration_s: float
    """Duration, s."""
    seed: int
    """Seed of the search."""
    method: str
    """Method that the payload is to be identified by."""
    assumed_noise: tuple[str, ...]
    """Options whose noise was not given, so that a default stands for it."""
    history_time: Array
    """Times at which the intervals of what came before are predicted, (K,), s."""
    history_std_devs: Array
    """Predicted standard deviations of the ten values at these times, (K, 10); NaN where the motion
    up to there does not determine every value."""
    history_base_attitude_deg: Array
    """Largest angle by which the base has turned until these times, (K,), degrees."""
