"""A payload in the format of what will use it: a URDF, a MuJoCo model, ROS, a robot controller.

A URDF and a MuJoCo model have numbers as Python writes them, so that reading one back gives the
very same number. A controller's pendant is typed into: its numbers have no exponent.
"""

import json
import math
import re
from collections.abc import Sequence

from tactid._base.bodies import inertia_about_com, inertia_about_origin, why_impossible
from tactid._base.errors import IdentificationError
from tactid._base.values import KINDS, Values
from tactid._native import VALUE_NAMES

FIGURES, MOST_DECIMALS = 9, 12
"""Significant figures of the largest number of a kind for a controller, beyond any sensor's; and
the most decimals, for kinds that are next to zero."""


def urdf(values: Values, frame: str, uncertain: Sequence[str] = ()) -> str:
    """Returns the ``<inertial>`` of a link of its own, fixed to the frame's link.

    Raises:
        IdentificationError: A value is unknown, or no body can have these values.
    """
    mass, x, y, z, xx, xy, xz, yy, yz, zz = map(repr, possible(values, "inertial for URDF"))
    return f"""{_comment("link of its own, fixed to", frame)}{_uncertain(uncertain)}
<inertial>
  <origin xyz="{x} {y} {z}" rpy="0 0 0"/>
  <mass value="{mass}"/>
  <inertia ixx="{xx}" ixy="{xy}" ixz="{xz}" iyy="{yy}" iyz="{yz}" izz="{zz}"/>
</inertial>"""


def mujoco(values: Values, frame: str, uncertain: Sequence[str] = ()) -> str:
    """Returns the ``<inertial>`` of a MuJoCo body of its own inside the frame's body.

    MuJoCo's order is the diagonal first: xx, yy, zz, xy, xz, yz.

    Raises:
        IdentificationError: A value is unknown, or no body can have these values.
    """
    mass, x, y, z, xx, xy, xz, yy, yz, zz = map(repr, possible(values, "inertial for MuJoCo"))
    return f"""{_comment("body of its own inside", frame)}{_uncertain(uncertain)}
<inertial pos="{x} {y} {z}" mass="{mass}" fullinertia="{xx} {yy} {zz} {xy} {xz} {yz}"/>"""


def controller(
    values: Values,
    frame: str,
    uncertain: Sequence[str] = (),
    tool: tuple[Values, str] | None = None,
) -> str:
    """Returns what a robot controller asks for, as text.

    An unknown inertia is marked as such: most controllers accept a payload without one. Some
    want the centre of mass in mm, and some the inertia about the flange: both are given.

    Raises:
        IdentificationError: The mass or the centre of mass is unknown, or no body can have these
            values.
    """
    what = "payload for a controller"
    mass, *com = mass_and_com(values, what)
    lines = [
        f"payload, in the frame {frame} and along its axes",
        "",
        f"mass                 kg  {_row([mass])}",
        f"centre of mass x y z m   {_row(com)}",
        f"centre of mass x y z mm  {_row([1e3 * entry for entry in com])}",
        *([f"uncertain            {', '.join(uncertain)}"] if uncertain else []),
        *([f"without the          {tool[1]}"] if tool else []),
    ]
    if missing := unknown(values):
        lines += ["", f"inertia              not identifiable: {', '.join(missing)}"]
        return "\n".join(lines)
    body = possible(values, what)
    for place, matrix in (
        ("the centre of mass", inertia_about_com(body)),
        (f"the origin of {frame}", inertia_about_origin(body)),
    ):
        lines += ["", f"inertia about {place}, kg m², rows x y z"]
        numbers = decimals(matrix.ravel().tolist())
        width = max(map(len, numbers))
        shown = [f"{number:>{width}}" for number in numbers]
        lines += [f"  {'  '.join(shown[row : row + 3])}" for row in (0, 3, 6)]
    return "\n".join(lines)


def ros(values: Values, frame: str, uncertain: Sequence[str] = ()) -> str:
    """Returns a ``geometry_msgs/msg/InertiaStamped`` as YAML, for ``ros2 topic pub``.

    The inertia is about the centre of mass, as the message of ROS 2 Humble and later has it.

    Raises:
        IdentificationError: A value is unknown, or no body can have these values.
    """
    mass, x, y, z, *inertia = map(repr, possible(values, "message for ROS"))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    entries = [f"  {name}: {value}" for name, value in zip(names, inertia, strict=True)]
    return "\n".join(
        [
            *([f"# uncertain: {', '.join(uncertain)}"] if uncertain else []),
            "header:",
            f"  frame_id: {json.dumps(frame)}",
            "inertia:",
            f"  m: {mass}",
            f"  com: {{x: {x}, y: {y}, z: {z}}}",
            *entries,
        ]
    )


def mass_and_com(values: Values, what: str) -> list[float]:
    """Returns the mass and the centre of mass, which every controller needs."""
    mass, *com = _known(values, what, upto=KINDS[1].stop)
    if mass <= 0:
        raise IdentificationError(f"no {what}: the mass of a body is positive, not {mass:.4g} kg")
    return [mass, *com]


def unknown(values: Values, upto: int = len(VALUE_NAMES)) -> list[str]:
    """Returns the names of the values that are not known."""
    pairs = zip(VALUE_NAMES[:upto], values[:upto], strict=True)
    return [name for name, value in pairs if value is None or not math.isfinite(value)]


def _known(values: Values, what: str, upto: int = len(VALUE_NAMES)) -> list[float]:
    if missing := unknown(values, upto):
        raise IdentificationError(f"no {what}: {', '.join(missing)} not identifiable")
    return [float(value) for value in values[:upto] if value is not None]


def possible(values: Values, what: str) -> list[float]:
    """Returns the ten values of a body that can exist."""
    body = _known(values, what)
    reason = why_impossible(body)
    if reason is not None:
        raise IdentificationError(f"no {what}: no body can have this estimate: {reason}")
    return body


def decimals(numbers: Sequence[float]) -> list[str]:
    """Returns numbers with the same number of decimals, and without exponents."""
    largest = max(map(abs, numbers))
    magnitude = math.floor(math.log10(largest)) if largest > 0 else 0
    places = min(max(FIGURES - 1 - magnitude, 0), MOST_DECIMALS)
    return [f"{round(number, places) + 0.0:.{places}f}" for number in numbers]


def _row(numbers: Sequence[float]) -> str:
    return "  ".join(decimals(numbers))


def _uncertain(names: Sequence[str]) -> str:
    """Returns a line of XML that says which values are uncertain; empty where none is."""
    return f"\n<!-- uncertain: {', '.join(names)} -->" if names else ""


def _comment(place: str, frame: str) -> str:
    # XML allows no double hyphen within a comment.
    name = re.sub("-(?=-)", "- ", frame)
    return f"<!-- payload in the frame {name}: for a {place} {name} without an offset -->"
