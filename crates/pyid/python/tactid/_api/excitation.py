"""Design of motions from which a payload is identified quickly."""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from tactid import _native
from tactid._api.designed_motion import DesignedMotion
from tactid._base.errors import ArgumentError
from tactid._base.meshes import Meshes
from tactid._native import Manipulator, MassProperties
from tactid._options.declaration import with_options
from tactid._options.excitation_arguments import (
    Grip,
    Start,
    check_numbers,
    check_positive,
    check_types,
    corners_of,
    duration_of,
    fraction_of,
    grip_of,
    is_volume,
    numbers_of,
    places,
    start_of,
    surroundings,
)
from tactid._options.options import OPTIONS, Options, collect

Criterion = Literal["largest-interval", "volume"]
"""What a design minimises: the largest interval relative to its target, or the volume of the
confidence ellipsoid."""

OWN = (
    "start", "sensors", "duration", "within", "longest", "payload", "payload_mass_max",
    "payload_box", "sample_rate", "base_noise", "limit_scale", "acceleration", "wrench_limit",
    "grip", "base_attitude", "base_position", "collisions", "workspace", "keep_out",
    "least_distance", "criterion", "seed", "rate", "options", "progress",
)  # fmt: skip
"""The keywords of :func:`design_excitation` that are no options of an identification."""

NUMBERS = ("duration", "longest", "sample_rate", "base_attitude", "base_position")
"""Keywords with one number, whose ranges the design checks."""

WITHIN = 0.01
"""Default target for half of each 95 % interval, as a fraction of the largest of its kind."""

WRENCH_NOISE = (0.5, 0.5, 0.5, 0.05, 0.05, 0.05)
"""Standard deviations of a wrench of which nothing is known, N and N m."""

EFFORT_NOISE = 0.5
"""Standard deviation of a joint effort of which nothing is known, N m or N."""


@with_options(OPTIONS, "design")
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
    limit_scale: float = 1.0,
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
            kind, such as 0.01 for 1 %: the motion is the shortest that reaches it. Not with
            ``duration``. A centre of mass that is nearer to the tip than a tenth of the radius of
            gyration counts as at that distance.
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
        limit_scale: Factor on the velocity limits of the URDF and on ``acceleration``, at most 1.
        acceleration: Largest acceleration of a joint, rad/s² or m/s².
        wrench_limit: Largest magnitudes of the wrench on the payload in the tip's frame, (6,), N
            and N m.
        grip: The grip whose friction must hold the payload.
        base_attitude: Largest angle by which a floating base may turn, rad.
        base_position: Largest distance by which the origin of a floating base may move, m.
        collisions: Whether the links of the robot must not touch one another, the payload's box or
            a keep-out box. It is an error if a link that could be hit has a collision shape that
            cannot be tested, such as a mesh that is not found or is neither STL nor OBJ: False
            accepts a motion that may run the robot through itself. Links to which the URDF gives no
            collision shape are not tested; the result lists them.
        workspace: Least and largest corner of a box that the tip and the payload's box must stay
            in, in the frame of the base, (2, 3), m.
        keep_out: Boxes that must not be entered, by their names: least and largest corner, in the
            frame of the base, (2, 3), m.
        least_distance: Least distance of links, payload and keep-out boxes, m: at most 0.06. A pair
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
        ExcitationError: There is no such motion, and the message names the limit that binds; or
            collision shapes are missing, and the message names the links.
        ModelError: The robot cannot be modelled, has no such link, or a joint has no velocity
            limit.
        ArgumentError: An argument is unknown, missing or out of range, or a shape is wrong.
    """
    collected = collect(options, keywords, "design", ("robot", *OWN))
    check_types(robot, payload, seed)
    check_positive(rate=rate, limit_scale=limit_scale, acceleration=acceleration)
    collected, assumed = _with_noise(collected)
    tip = collected.tip or "tool0"
    given: dict[str, Any] = {
        "duration": duration_of(duration, within),
        "start": start_of(robot, tip, start).tolist(),
        "sensors": [sensors] if isinstance(sensors, str) else list(sensors or (tip,)),
        "sample_rate": rate if sample_rate is None else sample_rate,
        "base_noise": numbers_of("base_noise", base_noise, 6),
        "limit_scale": limit_scale,
        "acceleration": acceleration,
        "payloads": _payloads(payload, payload_mass_max, payload_box),
        "within": fraction_of(WITHIN if within is None else within),
        "longest": longest,
        "wrench_limit": numbers_of("wrench_limit", wrench_limit, 6),
        "grip": grip_of(grip),
        "base_attitude": base_attitude,
        "base_position": base_position,
        "places": places(payload_box, workspace, keep_out, least_distance),
        "read_mesh": Meshes().read if collisions else None,
        "volume": is_volume(criterion),
        "seed": int(seed),
        "rate": rate,
    }
    check_numbers(**{name: given[name] for name in NUMBERS})
    given |= {"assumed_noise": assumed, "surroundings": surroundings(given["places"])}
    found = _native.design_excitation(robot, given, collected.replace(tip=tip).plain(), progress)
    return DesignedMotion(**found)


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
    corners = np.asarray(corners_of("payload_box", box))
    sides = corners[1] - corners[0]
    check_numbers(payload_mass_max=mass_max)
    if not 0 < mass_max < np.inf:
        raise ArgumentError(
            f"`payload_mass_max` is {mass_max}: expected more than 0 kg", "payload_mass_max"
        )
    x, y, z = sides**2 / 12
    even = MassProperties(
        mass_max / 2, corners.mean(axis=0), mass_max / 2 * np.diag([y + z, x + z, x + y])
    )
    # On a fixed base, the force on a body in the box is between those on these bodies and none. Its
    # moment has second moments, too, which are smaller inside the box by up to m d² / 4.
    points = [MassProperties(mass_max, corner, np.zeros((3, 3))) for corner in product(*corners.T)]
    return [payload or even, *points]


def _with_noise(options: Options) -> tuple[Options, list[str]]:
    """Returns options with a default for the noise that is not known, and the names of those."""
    method = options.method or "tactile"
    assumed = []
    if method in {"tactile", "combined"} and options.wrench_noise is None:
        options, assumed = options.replace(wrench_noise=WRENCH_NOISE), ["wrench_noise"]
    if method in {"effort", "combined"} and options.effort_noise is None:
        options = options.replace(effort_noise=EFFORT_NOISE)
        assumed.append("effort_noise")
    return options, assumed
