"""Design of motions from which a payload is identified quickly."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactid import _native, meshes
from tactid._native import Manipulator, MassProperties
from tactid.declaration import with_options
from tactid.designed_motion import CollisionFinding, DesignedMotion, LimitMargin
from tactid.errors import ArgumentError
from tactid.options import Options, collect
from tactid.values import nested, values_of

Criterion = Literal["largest-interval", "volume"]
"""What a design minimises: the largest interval relative to its target, or the volume of the
confidence ellipsoid."""

OWN = (
    "start", "sensors", "duration", "within", "longest", "payload", "payload_mass_max",
    "payload_box", "sample_rate", "base_noise", "speed", "acceleration", "wrench_limit", "grip",
    "base_attitude", "base_position", "collisions", "workspace", "keep_out", "least_distance",
    "criterion", "seed", "rate", "options", "progress",
)  # fmt: skip
"""The keywords of :func:`design_excitation` that are no options of an identification."""

WITHIN = 0.01
"""Default target for half of each 95 % interval, as a fraction of the largest of its kind."""

DURATION_S = 10.0
"""Duration of a motion of which neither duration nor target is given, s."""

WRENCH_NOISE = (0.5, 0.5, 0.5, 0.05, 0.05, 0.05)
"""Standard deviations of a wrench of which nothing is known, N and N m."""

EFFORT_NOISE = 0.5
"""Standard deviation of a joint effort of which nothing is known, N m or N."""

MOST = {"rate": 1e5, "acceleration": 1e5, "speed": 1.0, "least_distance": 0.08}
"""Largest values of keywords: a larger rate, Hz, or acceleration is a mistake, a factor above 1
exceeds the velocity limits of the URDF, and larger distances, m, are not computed."""

Start: TypeAlias = ArrayLike | Mapping[str, float] | None
_Floats: TypeAlias = NDArray[np.float64]


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


@with_options(Options, "design")
def design_excitation(
    robot: Manipulator,
    *,
    start: Start = None,
    sensors: str | Sequence[str] | None = None,
    duration: float | None = None,
    within: float | None = None,
    longest: float = 60.0,
    payload: MassProperties | None = None,
    payload_mass_max: float | None = None,
    payload_box: ArrayLike | None = None,
    sample_rate: float | None = None,
    base_noise: ArrayLike | None = None,
    speed: float = 1.0,
    acceleration: float = 2.0,
    wrench_limit: ArrayLike | None = None,
    grip: Grip | None = None,
    base_attitude: float | None = None,
    base_position: float | None = None,
    collisions: bool = True,
    workspace: ArrayLike | None = None,
    keep_out: Mapping[str, ArrayLike] | None = None,
    least_distance: float = 0.01,
    criterion: Criterion = "largest-interval",
    seed: int = 0,
    rate: float = 1000.0,
    options: Options | None = None,
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> DesignedMotion:
    """Designs the motion that determines a payload best, within the limits of the robot.

    The motion begins and ends at rest in the same posture. Positions, velocities and efforts are
    within the limits of the URDF for the expected payload and all others that are given; the result
    says how much of each limit is used, and what the motion will determine.

        motion = tactid.design_excitation(robot, payload_mass_max=3, payload_box=box)
        motion.write("motion")

    Args:
        robot: The robot with its gripper and without the payload, read from its URDF.
        start: Positions at the beginning: one for each joint, one for each joint that moves the
            tip, or a mapping from names. Default: 0, or the middle of a range that excludes it.
        sensors: Links in which wrenches are measured. Default: the tip.
        duration: Duration, s. Default: 10, unless ``within`` is given. A motion of 15 s or more
            passes several times along the same path, in turn forth and back.
        within: Target for half of each 95 % interval, as a fraction of the largest value of its
            kind: the motion is the shortest that reaches it. Not with ``duration``.
        longest: Longest duration that is tried for ``within``, s.
        payload: The expected payload, in the tip's frame.
        payload_mass_max: Largest mass of a payload of which only a box is known, kg. Half of it,
            filling the box evenly, is expected; and all limits hold with all of it at any corner,
            and without a payload.
        payload_box: Least and largest corner of the box, in the tip's frame, (2, 3), m. It must not
            touch the robot, either; with ``payload``, it serves for this only.
        sample_rate: Samples of the sensors per second, Hz. Default: ``rate``.
        base_noise: Standard deviations of the wrench that follows from the motion of a floating
            base, (6,), N and N m: for the methods joint-sensing and combined.
        speed: Factor on the velocity limits of the URDF and on ``acceleration``, at most 1.
        acceleration: Largest acceleration of a joint, rad/s² or m/s².
        wrench_limit: Largest magnitudes of the wrench on the payload in the tip's frame, (6,), N
            and N m.
        grip: The grip whose friction must hold the payload.
        base_attitude: Largest angle by which a floating base may turn, rad.
        base_position: Largest distance by which the origin of a floating base may move, m.
        collisions: Whether the links of the robot must not touch one another, the payload's box or
            a keep-out box. Links without collision shapes in the URDF, and meshes that are not STL
            or OBJ or not found, are left out; the result lists them.
        workspace: Least and largest corner of a box that the tip and the payload's box must stay
            in, in the frame of the base, (2, 3), m.
        keep_out: Boxes that must not be entered, by their names: least and largest corner, in the
            frame of the base, (2, 3), m.
        least_distance: Least distance of links, payload and keep-out boxes, m: at most 0.08. A pair
            that is closer than twice that at the start keeps half of its distance there, unless it
            is a keep-out box; the result lists those pairs.
        criterion: What is minimised: the largest interval relative to its target, or the volume of
            the confidence ellipsoid.
        seed: Seed of the search: the same seed gives the same motion.
        rate: Rate of the arrays, Hz.
        options: Options to start from; keywords replace them.
        progress: Called with the fraction that is done, about twenty times a second. An exception
            that it raises stops the design, as Ctrl-C does.
        **keywords: Those fields of :class:`tactid.Options` that apply, as follows.

            <options>

    Raises:
        ExcitationError: There is no such motion; the message names the limit that binds.
        ModelError: The robot cannot be modelled, has no such link, or a joint has no velocity
            limit.
        ArgumentError: An argument is unknown, missing or out of range, or a shape is wrong.
    """
    collected = collect(options, keywords, "design", ("robot", *OWN))
    _check_seed(seed)
    _check_duration(duration, within)
    _check_positive(rate=rate, speed=speed, acceleration=acceleration)
    payloads = _payloads(payload, payload_mass_max, payload_box)
    collected, assumed = _with_noise(collected)
    tip = collected.tip or "tool0"
    given = {
        "start": _start(robot, tip, start).tolist(),
        "sensors": [sensors] if isinstance(sensors, str) else list(sensors or (tip,)),
        "sample_rate": rate if sample_rate is None else sample_rate,
        "base_noise": _numbers("base_noise", base_noise, 6),
        "speed": speed,
        "acceleration": acceleration,
        "payloads": payloads,
        "duration": DURATION_S if duration is None and within is None else duration,
        "within": _fraction(WITHIN if within is None else within),
        "longest": longest,
        "wrench_limit": _numbers("wrench_limit", wrench_limit, 6),
        "grip": _grip(grip),
        "base_attitude": base_attitude,
        "base_position": base_position,
        "places": _places(payload_box, workspace, keep_out, least_distance),
        "read_mesh": meshes.read if collisions else None,
        "volume": _is_volume(criterion),
        "seed": seed,
        "rate": rate,
    }
    found = _native.design_excitation(robot, given, replace(collected, tip=tip), progress)
    return _result(robot, tip, payloads[0], given, found, collected.method, assumed)


def _check_seed(seed: int) -> None:
    if not 0 <= seed < 2**64:
        raise ArgumentError(f"`seed` is {seed}: expected 0 to 2^64 - 1", option="seed")


def _check_duration(duration: float | None, within: float | None) -> None:
    if duration is not None and within is not None:
        raise ArgumentError(
            "`duration` and `within` are both given: give one of them", option="within"
        )


def _check_positive(**keywords: float) -> None:
    for name, value in keywords.items():
        if not 0 < value <= MOST[name]:
            expected = f"more than 0, and at most {MOST[name]:g}"
            raise ArgumentError(f"`{name}` is {value}: expected {expected}", name)


def _result(
    robot: Manipulator,
    tip: str,
    expected: MassProperties,
    given: Mapping[str, Any],
    found: Mapping[str, Any],
    method: str | None,
    assumed: tuple[str, ...],
) -> DesignedMotion:
    floats = robot.base == "floating"
    margins = tuple(LimitMargin(**margin) for margin in found["margins"])
    findings = found["collision_findings"]
    names = robot.joint_names
    return DesignedMotion(
        tip=tip,
        joints=tuple(names),
        moving=tuple(names[joint] for joint in found["moving"]),
        **{name: found[name] for name in ("time", "q", "qd", "qdd")},
        expected_payload=nested(values_of(expected)),
        predicted_std_dev=nested(found["std_devs"]),
        within=given["within"],
        interval_ratio=nested(found["ratios"]),
        base_attitude_deg=float(np.degrees(found["base_attitude"])) if floats else None,
        base_position_m=found["base_position"] if floats else None,
        margins=margins,
        binding_constraints=tuple(margin.limit for margin in margins if margin.binds),
        collision_findings=None if findings is None else tuple(map(_finding, findings)),
        duration_s=found["duration"],
        seed=given["seed"],
        method=method or "tactile",
        assumed_noise=assumed,
        history_time=found["history_time"],
        history_std_devs=found["history_std_devs"],
        history_base_attitude_deg=np.degrees(found["history_base_attitude"]),
    )


def _payloads(
    payload: MassProperties | None, mass_max: float | None, box: ArrayLike | None
) -> list[MassProperties]:
    """Returns the expected payload, and those with which the limits must hold, too."""
    if (mass_max is None) != (box is None) and (payload is None or box is None):
        missing = "payload_mass_max" if mass_max is None else "payload_box"
        raise ArgumentError(f"`{missing}` is missing: mass and box belong together", missing)
    if mass_max is None or box is None:
        if payload is None:
            raise ArgumentError(
                "the payload is missing: give the expected one as `payload`, or its largest mass"
                " and a box",
                option="payload",
            )
        return [payload]
    corners = np.asarray(_corners("payload_box", box))
    sides = corners[1] - corners[0]
    if not 0 < mass_max < np.inf:
        raise ArgumentError(f"`payload_mass_max` is {mass_max}: expected more than 0 kg")
    x, y, z = sides**2 / 12
    even = MassProperties(
        mass_max / 2, corners.mean(axis=0), mass_max / 2 * np.diag([y + z, x + z, x + y])
    )
    # On a fixed base, effort and wrench are linear in the parameters: those of a body in the box
    # are between those of these bodies and those without a payload, which the design adds.
    points = [MassProperties(mass_max, corner, np.zeros((3, 3))) for corner in product(*corners.T)]
    return [payload or even, *points]


def _places(
    payload_box: ArrayLike | None,
    workspace: ArrayLike | None,
    keep_out: Mapping[str, ArrayLike] | None,
    least_distance: float,
) -> dict[str, Any]:
    """Returns the boxes around the robot and the least distance of bodies."""
    _check_positive(least_distance=least_distance)
    boxes = dict(keep_out or {})
    return {
        "payload_box": None if payload_box is None else _corners("payload_box", payload_box),
        "workspace": None if workspace is None else _corners("workspace", workspace),
        "keep_out": [(name, _corners("keep_out", box)) for name, box in boxes.items()],
        "least_distance": least_distance,
    }


def _corners(name: str, box: ArrayLike) -> list[list[float]]:
    """Returns the least and the largest corner of a box."""
    try:
        corners = np.asarray(box, float)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    sides = corners[1] - corners[0] if corners.shape == (2, 3) else np.zeros(3)
    if not (sides > 0).all() or not np.isfinite(sides).all():
        raise ArgumentError(f"`{name}` must have a least and a largest corner, (2, 3)", name)
    found: list[list[float]] = corners.tolist()
    return found


def _finding(found: Mapping[str, Any]) -> CollisionFinding:
    return CollisionFinding(found["text"], tuple(map(tuple, found["pairs"])))


def _with_noise(options: Options) -> tuple[Options, tuple[str, ...]]:
    """Returns options with a default for the noise that is not known, and the names of those."""
    method = options.method or "tactile"
    assumed = []
    if method in {"tactile", "combined"} and options.wrench_noise is None:
        options, assumed = replace(options, wrench_noise=WRENCH_NOISE), ["wrench_noise"]
    if method in {"effort", "combined"} and options.effort_noise is None:
        options = replace(options, effort_noise=EFFORT_NOISE)
        assumed.append("effort_noise")
    return options, tuple(assumed)


def _start(robot: Manipulator, tip: str, given: Start) -> _Floats:
    """Returns the positions of all joints at the beginning."""
    names = robot.joint_names
    rest, moving = _native.default_posture(robot, tip)
    start = np.array(rest)
    if given is None:
        return start
    if isinstance(given, Mapping):
        for name, position in given.items():
            if name not in names:
                raise ArgumentError(f"`start` has {name}, but the joints are {names}", "start")
            start[names.index(name)] = position
        return start
    positions = _numbers("start", given, None) or []
    if len(positions) not in {len(names), len(moving)}:
        count = f"{len(moving)}, one for each joint that moves {tip}"
        every = "" if len(moving) == len(names) else f", or {len(names)}, one for each joint"
        raise ArgumentError(
            f"`start` has {len(positions)} positions: expected {count}{every}", "start"
        )
    start[moving if len(positions) == len(moving) else slice(None)] = positions
    return start


def _numbers(name: str, given: ArrayLike | None, count: int | None) -> list[float] | None:
    if given is None:
        return None
    try:
        numbers = np.asarray(given, float)
    except (TypeError, ValueError):
        numbers = np.zeros((0, 0))
    if numbers.ndim != 1 or (count is not None and len(numbers) != count):
        expected = "a list of numbers" if count is None else f"{count} numbers"
        raise ArgumentError(f"`{name}` is {given!r}: expected {expected}", name)
    found: list[float] = numbers.tolist()
    return found


def _fraction(within: float) -> float:
    if not 0 < within < np.inf:
        raise ArgumentError(f"`within` is {within}: expected a positive fraction", "within")
    return within


def _grip(grip: Grip | None) -> tuple[Any, ...] | None:
    if grip is None:
        return None
    center, normal = list(map(float, grip.center)), list(map(float, grip.normal))
    carries = (grip.force, grip.friction, grip.torsion_radius, grip.used)
    return (center, normal, grip.distance, *carries)


def _is_volume(criterion: str) -> bool:
    if criterion not in {"largest-interval", "volume"}:
        raise ArgumentError(
            f"`criterion` is {criterion!r}: expected largest-interval or volume", "criterion"
        )
    return criterion == "volume"
