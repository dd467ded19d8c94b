"""Arguments of :func:`tactid.design_excitation`, checked: each error names its keyword."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactid import _native
from tactid._base.errors import ArgumentError
from tactid._native import Manipulator, MassProperties

MOST = {"rate": 1e5, "acceleration": 1e5, "limit_scale": 1.0, "least_distance": 0.06}
"""Largest values of keywords: a larger rate, Hz, or acceleration is a mistake, a factor above 1
exceeds the velocity limits of the URDF, and larger distances, m, are not computed."""

DURATION_S = 10.0
"""Duration of a motion of which neither duration nor target is given, s."""

ROUNDING = 1e-9
"""By how much a position may be beyond its limit, rad or m: the rounding of the design's check."""

Start: TypeAlias = ArrayLike | Mapping[str, float] | None
"""Positions of joints, in their order or by their names."""
_Floats: TypeAlias = NDArray[np.float64]

WORKSPACE = "the workspace"
"""Name of the box that the tip and the payload's box stay in."""


@dataclass(frozen=True)
class Grip:
    """A grip of two flat pads that face each other, in the tip's frame."""

    center: Sequence[float]
    """Point in the middle between the pads, (3,), m."""
    normal: Sequence[float]
    """Direction from one pad to the other, (3,)."""
    distance: float
    """Distance between the pads, m."""
    force: float
    """Force with which each pad presses, N."""
    friction: float
    """Coefficient of friction between pad and payload."""
    torsion_radius: float
    """Moment about the normal that friction carries for each newton along the pad, m: two thirds of
    the radius of a disc."""
    used: float = 0.7
    """Fraction of the friction that the motion may use."""


def check_types(robot: object, payload: object, seed: object) -> None:
    """Checks what has one type: the robot, the expected payload, and the seed of 64 bits."""
    if not isinstance(robot, Manipulator):
        raise ArgumentError(
            f"`robot` is {robot!r}: expected a tactid.Manipulator, such as"
            " tactid.Manipulator.from_urdf(path)",
            "robot",
        )
    if payload is not None and not isinstance(payload, MassProperties):
        raise ArgumentError(
            f"`payload` is {payload!r}: expected a tactid.MassProperties", "payload"
        )
    is_whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if not is_whole or not 0 <= int(seed) < 2**64:  # type: ignore[call-overload]
        expected = "expected a whole number from 0 to 2^64 - 1"
        raise ArgumentError(f"`seed` is {seed!r}: {expected}", "seed")


def duration_of(duration: float | None, within: float | None) -> float | None:
    """Returns the duration, s; None where the shortest motion that reaches a target is designed."""
    if duration is not None and within is not None:
        raise ArgumentError("`duration` and `within` are both given: give one of them", "within")
    return DURATION_S if duration is None and within is None else duration


def check_numbers(**keywords: object) -> None:
    """Checks that keywords with one number have one, or None."""
    for name, value in keywords.items():
        is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
        if value is not None and not is_number:
            raise ArgumentError(f"`{name}` is {value!r}: expected a number", name)


def check_positive(**keywords: float) -> None:
    """Checks numbers that have a largest value."""
    check_numbers(**keywords)
    for name, value in keywords.items():
        if not 0 < value <= MOST[name]:
            expected = f"more than 0, and at most {MOST[name]:g}"
            raise ArgumentError(f"`{name}` is {value}: expected {expected}", name)


def places(
    payload_box: ArrayLike | None,
    workspace: ArrayLike | None,
    keep_out: Mapping[str, ArrayLike] | None,
    least_distance: float,
) -> dict[str, Any]:
    """Returns the boxes around the robot and the least distance of bodies."""
    check_positive(least_distance=least_distance)
    if keep_out is not None and not isinstance(keep_out, Mapping):
        expected = "expected boxes by their names, such as {'table': [[-1, -1, -0.5], [1, 1, 0]]}"
        raise ArgumentError(f"`keep_out` is {keep_out!r}: {expected}", "keep_out")
    return {
        "payload_box": None if payload_box is None else corners_of("payload_box", payload_box),
        "workspace": None if workspace is None else corners_of("workspace", workspace),
        "keep_out": [
            (name, corners_of("keep_out", box, f" of {name}"))
            for name, box in (keep_out or {}).items()
        ],
        "least_distance": least_distance,
    }


def surroundings(places: Mapping[str, Any]) -> list[str]:
    """Returns the names of the boxes around the robot that :func:`places` returns."""
    workspace = [] if places["workspace"] is None else [WORKSPACE]
    return [*workspace, *(f"the keep-out box {name}" for name, _ in places["keep_out"])]


LARGEST_COORDINATE = 1e6
"""Largest coordinate of a corner of a box, m: beyond it, distances lose their digits."""


def corners_of(keyword: str, box: ArrayLike, which: str = "") -> list[list[float]]:
    """Returns the least and the largest corner of a box, (2, 3); ``which`` one of several."""
    try:
        corners = np.asarray(box, float)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    if corners.shape != (2, 3) or not (np.abs(corners) <= LARGEST_COORDINATE).all():
        raise ArgumentError(
            f"`{keyword}`{which} must have two corners of three numbers, within"
            f" {LARGEST_COORDINATE:g} m: least x, y, z, then largest x, y, z",
            keyword,
        )
    for axis, low, high in zip("xyz", *corners, strict=True):
        if not low < high:
            raise ArgumentError(
                f"`{keyword}`{which} reaches from {low:g} m to {high:g} m along {axis}: expected"
                " the least corner first, and a length above zero",
                keyword,
            )
    found: list[list[float]] = corners.tolist()
    return found


def start_of(robot: Manipulator, tip: str, given: Start) -> _Floats:
    """Returns the positions of all joints at the beginning, which are within their limits."""
    names = robot.joint_names
    rest, moving, ranges = _native.default_posture(robot, tip)
    if not moving:
        raise ArgumentError(
            f"`tip` is {tip}, which no joint moves: expected a link at the end of the arm", "tip"
        )
    start = np.array(rest)
    if given is None:
        return start
    if isinstance(given, Mapping):
        for name, position in given.items():
            if name not in names:
                raise ArgumentError(f"`start` has {name}, but the joints are {names}", "start")
            check_numbers(start=position)
            start[names.index(name)] = position
    else:
        start[_places_of_start(names, moving, tip, given)] = numbers_of("start", given, None)
    for name, position, limits in zip(names, start, ranges, strict=True):
        _check_position(name, position, *limits)
    return start


def _places_of_start(
    names: Sequence[str], moving: list[int], tip: str, given: ArrayLike
) -> list[int]:
    """Returns the indices of the joints whose positions are given."""
    count = len(numbers_of("start", given, None) or [])
    if count == len(moving):
        return moving
    if count == len(names):
        return list(range(count))
    expected = f"{len(moving)}, one for each joint that moves {tip}"
    every = "" if len(moving) == len(names) else f", or {len(names)}, one for each joint"
    raise ArgumentError(f"`start` has {count} positions: expected {expected}{every}", "start")


def _check_position(name: str, position: float, low: float, high: float, unit: str) -> None:
    """Checks a position at the beginning, and recognises degrees."""
    # A start may be given with as many digits as the URDF has for its limits.
    if low - ROUNDING <= position <= high + ROUNDING or not math.isfinite(position):
        return
    degrees = ""
    if unit == "rad" and low <= math.radians(position) <= high:
        degrees = f"; {position:g}° would be {math.radians(position):.4g} rad"
    raise ArgumentError(
        f"`start`: the position of {name} is {position:g} {unit}, outside of its limits of {low:g}"
        f" to {high:g} {unit}{degrees}",
        "start",
    )


def numbers_of(name: str, given: ArrayLike | None, count: int | None) -> list[float] | None:
    """Returns a list of numbers, as many as ``count`` unless that is None; None for None."""
    return None if given is None else _numbers(name, given, count)


def _numbers(name: str, given: ArrayLike, count: int | None) -> list[float]:
    """Returns numbers that must be there; ``name`` may be a field of an argument."""
    try:
        numbers = np.asarray(given, float)
    except (TypeError, ValueError):
        numbers = np.zeros((0, 0))
    if numbers.ndim != 1 or (count is not None and len(numbers) != count):
        expected = "a list of numbers" if count is None else f"{count} numbers"
        argument = name.partition(".")[0]
        raise ArgumentError(f"`{name}` is {given!r}: expected {expected}", argument)
    found: list[float] = numbers.tolist()
    return found


def fraction_of(within: float) -> float:
    """Returns a target, a fraction of one."""
    check_numbers(within=within)
    if not 0 < within < 1:
        expected = "a fraction above 0 and below 1; 0.01 is 1 %"
        raise ArgumentError(f"`within` is {within}: expected {expected}", "within")
    return within


def grip_of(grip: Grip | None) -> tuple[Any, ...] | None:
    """Returns the numbers of a grip."""
    if grip is None:
        return None
    if not isinstance(grip, Grip):
        raise ArgumentError(f"`grip` is {grip!r}: expected a tactid.Grip", "grip")
    carries = (grip.force, grip.friction, grip.torsion_radius, grip.used)
    return (
        _numbers("grip.center", grip.center, 3),
        _numbers("grip.normal", grip.normal, 3),
        grip.distance,
        *carries,
    )


def is_volume(criterion: str) -> bool:
    """Returns whether the volume is minimised."""
    if criterion not in {"largest-interval", "volume"}:
        raise ArgumentError(
            f"`criterion` is {criterion!r}: expected largest-interval or volume", "criterion"
        )
    return criterion == "volume"
