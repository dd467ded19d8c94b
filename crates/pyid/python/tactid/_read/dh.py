"""Robots from Denavit-Hartenberg tables, as URDF."""

import math
import sys
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from tactid._base.errors import ArgumentError, ModelError
from tactid._base.naming import counted, listed
from tactid._base.values import Array

LENGTHS = ("a", "d")
"""Entries of a row in m."""

ANGLES = ("alpha", "theta")
"""Entries of a row in rad, or in degrees with `_deg` behind the name."""

_ENTRIES = {
    *("name", "type", "mass", "com", "inertia", *LENGTHS, *ANGLES),
    *(f"{angle}_deg" for angle in ANGLES),
}


def dh_urdf(
    joints: Sequence[Mapping[str, Any]], *, tip: str = "tool0", convention: str = "standard"
) -> str:
    """Returns the URDF of a serial robot from its Denavit-Hartenberg table.

    A row has ``a`` and ``d``, m, ``alpha`` and ``theta``, rad (or ``alpha_deg`` and ``theta_deg``),
    each 0 where it is left out; the position of the joint adds to ``theta``, or to ``d`` where
    ``type`` is ``"prismatic"``. Further entries are its ``name`` and, for joint efforts, the body
    of its link in the frame of the row: ``mass``, kg, ``com``, m, and ``inertia`` about it, kg m².

    >>> table = [{"d": 0.3, "alpha_deg": 90}, {"a": 0.5}, {"a": 0.4}]
    >>> arm = tactid.Manipulator.from_urdf(tactid.dh_urdf(table))
    >>> arm.joint_names
    ['joint_1', 'joint_2', 'joint_3']
    >>> arm.kinematics("tool0", [0, 0, 0]).pose[:3, 3].round(3).tolist()
    [0.9, 0.0, 0.3]

    Args:
        joints: A row for each joint, from the base outwards.
        tip: Name of the last frame of the table.
        convention: ``"standard"``, where a row is Rz(theta) Tz(d) Tx(a) Rx(alpha), or
            ``"modified"`` (Craig), where it is Rx(alpha) Tx(a) Rz(theta) Tz(d).

    Returns:
        The text of a URDF, for ``urdf`` and ``Manipulator.from_urdf``.

    Raises:
        ArgumentError: A row has another entry, or an entry is no number.
    """
    if convention not in ("standard", "modified"):
        raise ArgumentError(f'`convention` is {convention!r}: expected "standard" or "modified"')
    if not isinstance(tip, str):
        raise ArgumentError(f"`tip` is {tip!r}: expected the name of the last frame")
    if not joints:
        raise ArgumentError("a robot has at least one joint, but the table has no row")
    parts = ['<robot name="dh">', '<link name="base"/>']
    parent, before = "base", np.eye(4)
    for number, row in enumerate(joints, 1):
        _check(row, number)
        kind = row.get("type", "revolute")
        link = f"link_{number}"
        a, d, alpha, theta = (_entry(row, name, number) for name in ("a", "d", "alpha", "theta"))
        along_x, along_z = _along_x(a, alpha), _along_z(d, theta)
        if convention == "modified":
            moving, behind = before @ along_x @ along_z, np.eye(4)
        else:
            moving, behind = before @ along_z, along_x
        name = str(row.get("name", f"joint_{number}"))
        parts.append(_link(link, row, behind, number))
        parts.append(
            f"<joint name={_quoted(name)} type={_quoted(_TYPES[kind])}>{_origin(moving)}"
            f'<parent link="{parent}"/><child link="{link}"/><axis xyz="0 0 1"/>{_LIMITS[kind]}'
            "</joint>"
        )
        parent, before = link, behind
    parts.append(
        f'<link name={_quoted(tip)}/><joint name="tip" type="fixed">{_origin(before)}'
        f'<parent link="{parent}"/><child link={_quoted(tip)}/></joint></robot>'
    )
    return "\n".join(parts)


_TYPES = {"revolute": "continuous", "prismatic": "prismatic"}
"""Types of joints, with those of a URDF that need no limits of angles."""

_LIMITS = {
    "revolute": "",
    "prismatic": '<limit lower="-1000" upper="1000" effort="0" velocity="0"/>',
}


def urdf_from_toml(path: Path) -> str:
    """Returns the URDF of a table in a TOML file: an array ``joints`` of tables, with the keywords.

    Raises:
        ModelError: The file is no TOML, or has no such table.
        ArgumentError: It cannot be read by this Python.
    """
    if sys.version_info < (3, 11):
        raise ArgumentError(
            f"{path}: a table in TOML needs Python 3.11; give tactid.dh_urdf(...) as the URDF",
            option="urdf",
        )
    import tomllib

    try:
        with path.open("rb") as file:
            read = tomllib.load(file)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ModelError(f"{path} is no TOML: {error}", "urdf") from None
    rows = read.pop("joints", None)
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ModelError(
            f"{path} has no robot: expected a table [[joints]] with a, d, alpha and theta for each"
            " joint",
            "urdf",
        )
    if unknown := set(read) - {"tip", "convention"}:
        raise ModelError(
            f"{path} has `{min(unknown)}`: expected `joints`, `tip` and `convention`", "urdf"
        )
    try:
        return dh_urdf(rows, **read)
    except ArgumentError as error:
        raise ModelError(f"{path}: {error}", "urdf") from None


def _check(row: Mapping[str, Any], number: int) -> None:
    if unknown := set(row) - _ENTRIES:
        raise ArgumentError(
            f"row {number} has `{min(unknown)}`: expected {listed(sorted(_ENTRIES))}"
        )
    if row.get("type", "revolute") not in _TYPES:
        raise ArgumentError(
            f'row {number} has the type {row["type"]!r}: expected "revolute" or "prismatic"'
        )
    for angle in ANGLES:
        if angle in row and f"{angle}_deg" in row:
            raise ArgumentError(f"row {number} has both `{angle}` and `{angle}_deg`: give one")


def _entry(row: Mapping[str, Any], name: str, number: int) -> float:
    """Returns an entry of a row, rad or m."""
    if f"{name}_deg" in row:
        return math.radians(_numbers(row, f"{name}_deg", 1, number)[0])
    return _numbers(row, name, 1, number)[0] if name in row else 0.0


def _numbers(row: Mapping[str, Any], name: str, count: int, number: int) -> list[float]:
    """Returns the numbers of an entry of a row."""
    try:
        found = [float(each) for each in np.asarray(row[name], float).ravel()]
    except (TypeError, ValueError):
        found = []
    if len(found) != count or not all(map(math.isfinite, found)):
        raise ArgumentError(
            f"row {number}: `{name}` is {row[name]!r}: expected {counted(count, 'number')}"
        )
    return found


def _along_z(d: float, theta: float) -> Array:
    """Returns Rz(theta) Tz(d)."""
    cos, sin = math.cos(theta), math.sin(theta)
    return np.array([[cos, -sin, 0, 0], [sin, cos, 0, 0], [0, 0, 1, d], [0, 0, 0, 1.0]])


def _along_x(a: float, alpha: float) -> Array:
    """Returns Tx(a) Rx(alpha)."""
    cos, sin = math.cos(alpha), math.sin(alpha)
    return np.array([[1, 0, 0, a], [0, cos, -sin, 0], [0, sin, cos, 0], [0, 0, 0, 1.0]])


def _origin(pose: Array) -> str:
    """Returns a pose as URDF writes it: its rotation is Rz(yaw) Ry(pitch) Rx(roll)."""
    r = pose[:3, :3]
    pitch = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    if math.hypot(r[0, 0], r[1, 0]) > 1e-9:
        roll, yaw = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
    else:  # roll and yaw turn about the same axis
        roll, yaw = math.atan2(-r[1, 2], r[1, 1]), 0.0
    return f'<origin xyz="{_texts(pose[:3, 3])}" rpy="{_texts((roll, pitch, yaw))}"/>'


def _link(name: str, row: Mapping[str, Any], link_from_row: Array, number: int) -> str:
    """Returns a link, whose body the row has in its own frame."""
    if "mass" not in row:
        return f'<link name="{name}"/>'
    (mass,) = _numbers(row, "mass", 1, number)
    com = _numbers(row, "com", 3, number) if "com" in row else [0.0] * 3
    inertia = _numbers(row, "inertia", 9, number) if "inertia" in row else [0.0] * 9
    rotation = link_from_row[:3, :3]
    center = rotation @ com + link_from_row[:3, 3]
    turned = rotation @ np.reshape(inertia, (3, 3)) @ rotation.T
    entries = zip(_SIX, turned[np.triu_indices(3)].tolist(), strict=True)
    texts = " ".join(f'i{axes}="{value!r}"' for axes, value in entries)
    return (
        f'<link name="{name}"><inertial><origin xyz="{_texts(center)}"/><mass value="{mass!r}"/>'
        f"<inertia {texts}/></inertial></link>"
    )


_SIX = ("xx", "xy", "xz", "yy", "yz", "zz")


def _texts(numbers: Sequence[float] | Array) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _quoted(text: str) -> str:
    return f'"{escape(text)}"'
