"""A payload as the controllers of robot makers take it: a line of their language.

Each function states the maker's own definition: the frame, the point that the inertia is about, the
order and the units. The numbers have no exponent.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from tactid._base.bodies import inertia_about_com, principal_axes, together
from tactid._base.errors import ArgumentError
from tactid._base.values import Values
from tactid._results import forms


def controller(
    maker: str,
    values: Values,
    frame: str,
    uncertain: Sequence[str] = (),
    tool: tuple[Values, str] | None = None,
) -> str:
    """Returns the payload for the controllers of a maker.

    A comment names the values that are ``uncertain``, and says whether the line contains the
    ``tool`` that was subtracted, which is given in the same frame and in words.

    Raises:
        ArgumentError: The maker is not known.
        IdentificationError: A value that the controller needs is unknown, or no body can have
            these values.
    """
    if maker not in MAKERS:
        raise ArgumentError(f"`maker` is {maker!r}: expected one of {', '.join(MAKERS)}")
    place = TOOL_ELSEWHERE.get(maker)
    whole = values if tool is None or place is not None else together(values, tool[0])
    comment, line = MAKERS[maker](whole, frame).split("\n")
    names = f"; uncertain: {', '.join(uncertain)}" if uncertain else ""
    contains = "" if tool is None else f"; {_of_the_tool(tool[1], place)}"
    return f"{comment}{names}{contains}\n{line}"


def _of_the_tool(what: str, place: str | None) -> str:
    """Says whether a line contains what was subtracted, and where it belongs otherwise."""
    return f"with the {what}" if place is None else f"without the {what}, set in {place}"


def universal_robots(values: Values, frame: str) -> str:
    """Returns a call of URScript's ``set_target_payload(m, cog, inertia)``.

    Mass in kg, centre of mass from the tool flange in m, inertia about the centre of mass along the
    flange's axes in kg m², in the order Ixx, Iyy, Izz, Ixy, Ixz, Iyz. An unknown inertia is left
    out, as the controller permits. Source: Universal Robots, Script Manual,
    ``set_target_payload``.
    """
    what = "payload for Universal Robots"
    mass, *com = forms.mass_and_com(values, what)
    arguments = [_number(mass), _list(com)]
    if not forms.unknown(values):
        xx, xy, xz, yy, yz, zz = forms.possible(values, what)[4:]
        arguments.append(_list([xx, yy, zz, xy, xz, yz]))
    return f"# {what}: {_place(frame)}\nset_target_payload({', '.join(arguments)})"


def franka(values: Values, frame: str) -> str:
    """Returns a call of libfranka's ``Robot::setLoad``.

    Mass in kg, centre of mass in the flange's frame in m, inertia about the centre of mass along
    the flange's axes in kg m², as the nine entries of the matrix by columns. Source: libfranka,
    ``Robot::setLoad`` and ``RobotState::I_load``.
    """
    what = "payload for Franka"
    body = forms.possible(values, what)
    columns = inertia_about_com(body).ravel(order="F").tolist()
    com, inertia = (", ".join(forms.decimals(each)) for each in (body[1:4], columns))
    call = f"robot.setLoad({_number(body[0])}, {{{{{com}}}}}, {{{{{inertia}}}}});"
    return f"// {what}: {_place(frame)}\n{call}"


def kuka(values: Values, frame: str) -> str:
    """Returns an assignment of KRL's ``LOAD_DATA``, for tool 1.

    Mass in kg, centre of mass in the flange's frame in mm, the principal axes there by the angles
    A, B and C in degrees (rotations about z, then the new y, then the new x), and the principal
    moments about the centre of mass in kg m². Source: KUKA, load data of the operating manuals.
    """
    what = "payload for KUKA"
    body = forms.possible(values, what)
    moments, axes = principal_axes(inertia_about_com(body))
    angles = [
        math.atan2(axes[1, 0], axes[0, 0]),
        math.atan2(-axes[2, 0], math.hypot(axes[2, 1], axes[2, 2])),
        math.atan2(axes[2, 1], axes[2, 2]),
    ]
    center, turn = _named("XYZ", _in_mm(body[1:4])), _named("ABC", np.degrees(angles).tolist())
    return (
        f"; {what}: {_place(frame)}\n"
        f"LOAD_DATA[1] = {{M {_number(body[0])}, CM {{{center}, {turn}}},"
        f" J {{{_named('XYZ', moments)}}}}}"
    )


def abb(values: Values, frame: str) -> str:
    """Returns a declaration of RAPID's ``loaddata``.

    Mass in kg, centre of mass in the frame of the tool in use in mm, the principal axes there as
    the quaternion q1 to q4 (the scalar first), and the principal moments about the centre of mass
    in kg m². An unknown inertia is zero, which RAPID takes for a point mass. Source: ABB, RAPID
    data types, ``loaddata``.
    """
    what = "payload for ABB"
    mass, *com = forms.mass_and_com(values, what)
    moments, axes = [0.0, 0.0, 0.0], np.eye(3)
    if not forms.unknown(values):
        moments, axes = principal_axes(inertia_about_com(forms.possible(values, what)))
    entries = [
        _number(mass),
        _list(_in_mm(com)),
        _list(_quaternion(axes)),
        *forms.decimals(moments),
    ]
    place = f"the frame {_name(frame)} must be the coordinate system of the tool in use"
    return f"! {what}: {place}\nPERS loaddata payload := [{', '.join(entries)}];"


MAKERS: dict[str, Callable[[Values, str], str]] = {
    "ur": universal_robots,
    "franka": franka,
    "kuka": kuka,
    "abb": abb,
}
"""The makers of controllers, by the names of their formats."""

TOOL_ELSEWHERE = {
    "franka": "the end effector's settings in Desk",
    "abb": "tload of the tool's tooldata",
}
"""Makers whose payload is without the tool, and where its load belongs.

The payload of Universal Robots is tool and workpiece together (Script Manual and "How to change
payload and center of gravity settings"), and so are the load data of KUKA, which a tool number
selects. Source of the others: libfranka, ``Robot::setLoad``, which is not for the end effector;
ABB, RAPID data types, ``loaddata``: the load in the gripper, while ``tooldata`` has the tool's.
"""


def _quaternion(rotation: NDArray[np.float64]) -> list[float]:
    """Returns the unit quaternion of a rotation by less than 180 degrees, the scalar first."""
    scalar = math.sqrt(1.0 + float(np.trace(rotation))) / 2
    skew = rotation - rotation.T
    vector = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4 * scalar)
    return [scalar, *vector.tolist()]


def _in_mm(lengths: list[float]) -> list[float]:
    return [1e3 * length for length in lengths]


def _number(number: float) -> str:
    return forms.decimals([number])[0]


def _list(numbers: list[float]) -> str:
    return f"[{', '.join(forms.decimals(numbers))}]"


def _named(names: str, numbers: list[float]) -> str:
    pairs = zip(names, forms.decimals(numbers), strict=True)
    return ", ".join(f"{name} {number}" for name, number in pairs)


def _place(frame: str) -> str:
    return f"the frame {_name(frame)} must be that of the flange"


def _name(frame: str) -> str:
    return " ".join(frame.split())
