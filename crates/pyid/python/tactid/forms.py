"""A payload in the format of what will use it: a URDF, a MuJoCo model, a robot controller.

Numbers are written as Python writes them, so that reading one back gives the very same number.
"""

import math
import re
from collections.abc import Callable, Sequence

from tactid.bodies import inertia_about_com, inertia_about_origin, why_impossible
from tactid.errors import IdentificationError
from tactid.table import NAMES
from tactid.values import KINDS, Values


def urdf(values: Values, frame: str) -> str:
    """Returns the ``<inertial>`` of a link at the frame.

    Raises:
        IdentificationError: A value is unknown, or no body can have these values.
    """
    mass, x, y, z, xx, xy, xz, yy, yz, zz = map(repr, _of_a_simulator(values, "URDF"))
    return f"""{_comment(frame)}
<inertial>
  <origin xyz="{x} {y} {z}" rpy="0 0 0"/>
  <mass value="{mass}"/>
  <inertia ixx="{xx}" ixy="{xy}" ixz="{xz}" iyy="{yy}" iyz="{yz}" izz="{zz}"/>
</inertial>
"""


def mujoco(values: Values, frame: str) -> str:
    """Returns the ``<inertial>`` of a MuJoCo body at the frame.

    MuJoCo's order is the diagonal first: xx, yy, zz, xy, xz, yz.

    Raises:
        IdentificationError: A value is unknown, or no body can have these values.
    """
    mass, x, y, z, xx, xy, xz, yy, yz, zz = map(repr, _of_a_simulator(values, "MuJoCo"))
    return f"""{_comment(frame)}
<inertial pos="{x} {y} {z}" mass="{mass}" fullinertia="{xx} {yy} {zz} {xy} {xz} {yz}"/>
"""


def controller(values: Values, frame: str) -> str:
    """Returns what a robot controller asks for, as text.

    An unknown inertia is marked as such: most controllers accept a payload without one. Some
    want the centre of mass in mm, and some the inertia about the flange: both are given.
    """
    mass, *com = _known(values, "payload for a controller", upto=KINDS[1].stop)
    lines = [
        f"payload, in the frame {frame} and along its axes",
        "",
        f"mass                 kg  {mass!r}",
        f"centre of mass x y z m   {_row(com)}",
        f"centre of mass x y z mm  {_row([1e3 * entry for entry in com])}",
    ]
    unknown = _unknown(values)
    if unknown:
        lines += ["", f"inertia              not identifiable: {', '.join(unknown)}"]
        return "\n".join(lines) + "\n"
    body = _known(values, "payload for a controller")
    for place, matrix in (
        ("the centre of mass", inertia_about_com(body)),
        (f"the origin of {frame}", inertia_about_origin(body)),
    ):
        lines += ["", f"inertia about {place}, kg m², rows x y z"]
        rows = matrix.tolist()
        width = max(len(repr(entry)) for row in rows for entry in row)
        lines += [f"  {_row(row, width)}" for row in rows]
    reason = why_impossible(body)
    if reason is not None:
        lines += ["", f"Beware: no body can have this inertia: {reason}."]
    return "\n".join(lines) + "\n"


FORMS: dict[str, Callable[[Values, str], str]] = {
    "urdf": urdf,
    "mujoco": mujoco,
    "controller": controller,
}
"""The function that writes each format, from the ten values and the name of their frame."""


def _unknown(values: Values, upto: int = len(NAMES)) -> list[str]:
    pairs = zip(NAMES[:upto], values[:upto], strict=True)
    return [name for name, value in pairs if value is None or not math.isfinite(value)]


def _known(values: Values, what: str, upto: int = len(NAMES)) -> list[float]:
    unknown = _unknown(values, upto)
    if unknown:
        raise IdentificationError(f"no {what}: {', '.join(unknown)} not identifiable")
    return [float(value) for value in values[:upto] if value is not None]


def _of_a_simulator(values: Values, name: str) -> list[float]:
    body = _known(values, f"inertial for {name}")
    reason = why_impossible(body)
    if reason is not None:
        raise IdentificationError(
            f"no inertial for {name}: no body can have this estimate: {reason}"
        )
    return body


def _row(numbers: Sequence[float], width: int = 0) -> str:
    return "  ".join(f"{number!r:>{width}}" for number in numbers)


def _comment(frame: str) -> str:
    # XML allows no double hyphen within a comment.
    name = re.sub("-(?=-)", "- ", frame)
    return f"<!-- payload, for the link {name} and along its axes -->"
