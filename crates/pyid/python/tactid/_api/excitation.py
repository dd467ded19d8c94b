"""Design of motions from which a payload is identified quickly."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from tactid import _native
from tactid._api.designed_motion import DesignedMotion
from tactid._base.field_docs import with_fields
from tactid._base.meshes import Meshes
from tactid._native import Manipulator
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, OWN, Options, collect, take_own


@with_fields
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


@with_options(OPTIONS, "design", OWN["design"])
def design_excitation(
    robot: Manipulator,
    *,
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
        <own>
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
    own = take_own(keywords, "design")
    collected = collect(options, keywords, "design", ("robot", "options", "progress"))
    found = _native.design_excitation(robot, own, collected.plain(), Meshes().read, progress)
    return DesignedMotion(**found)
