"""Joints of a robot, for the columns of a table that has no names of joints or has them."""

import os
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

from tactid._base.errors import ArgumentError
from tactid._base.files import is_urdf_text
from tactid._base.naming import counted
from tactid._native import Manipulator
from tactid._read.columns import NOT_MEASURED, Quantity
from tactid._read.tables import Table
from tactid._read.units import Unit, readings

MOST_OTHERS = 2
"""Most columns behind those of the arm's joints: the opening of a gripper, or of two fingers."""


@dataclass(frozen=True)
class RobotJoints:
    """The joints that a robot has."""

    names: list[str]
    """Joints that move by themselves, in the robot's order."""
    arm: list[str]
    """Those of them from the base to the end-effector: without the fingers of a gripper."""
    tip: str
    """The end-effector frame."""

    @classmethod
    def of(cls, urdf: str | os.PathLike[str], tip: str) -> "RobotJoints":
        """Reads the joints of a URDF; all of them lead to a tip that it does not have."""
        names = Manipulator.from_urdf(urdf).joint_names
        text = (
            str(urdf)
            if is_urdf_text(urdf)
            else Path(urdf).read_text(encoding="utf-8", errors="replace")
        )
        chain = _chain(text, tip)
        return cls(names, [name for name in chain if name in names] or names, tip)

    def columns(self, table: Table, array: str) -> Quantity | None:
        """Returns the columns that are named after the joints of the arm.

        None where there is none of them. Columns of gripper joints are included where they exist.

        Raises:
            ArgumentError: Some joints of the arm have such columns, and others have not.
        """
        if array not in _AFFIXES:
            return None
        found = {name: _column(table, array, name) for name in self.names}
        missing = [name for name in self.arm if found[name] is None]
        if len(missing) == len(self.arm):
            return None
        if missing:
            raise ArgumentError(
                f"{table.path} has columns of `{array}` for some joints, but none for"
                f" `{missing[0]}`: name them in `columns`; {table.listed}",
                option="columns",
            )
        there = [column for column in found.values() if column is not None]
        names, units = zip(*there, strict=True)
        return Quantity(array, names, units)

    def named(self, table: Table, quantity: Quantity, width: int) -> list[str]:
        """Returns the names of the joints of columns: those of the arm, in its order.

        Further columns belong to no joint of the robot and keep their column names.

        Raises:
            ArgumentError: There are fewer columns than joints, or many more.
        """
        of_joints = [name for name in self.names if _column(table, quantity.array, name)]
        if quantity == self.columns(table, quantity.array):
            return of_joints
        if width == len(self.names):
            return self.names
        if not 0 <= width - len(self.arm) <= MOST_OTHERS:
            joints = ", ".join(f"`{name}`" for name in self.arm)
            raise ArgumentError(
                f"{table.path}: {quantity.words} are {width} numbers a row for `{quantity.array}`,"
                f" but the robot has {counted(len(self.arm), 'joint')} up to `{self.tip}`:"
                f" {joints}; name the columns in `columns`, in this order",
                option="columns",
            )
        last = quantity.columns[-1]
        is_one = len(quantity.columns) == 1
        others = range(len(self.arm), width)
        names = [f"{last}[{k}]" if is_one else str(quantity.columns[k]) for k in others]
        return [*self.arm, *names]


_AFFIXES = {
    "q": ("q", "pos", "position", "angle", "actual_position"),
    "qd": ("qd", "dq", "vel", "velocity", "actual_velocity"),
    "effort": ("effort", "tau", "torque", "current"),
}
"""What stands before or behind the name of a joint in that of its column."""


def array_of_joints(column: str) -> str | None:
    """Returns the array of a column whose name looks like that of a joint's values."""
    plain = _plain(column)
    for array, affixes in _AFFIXES.items():
        if any(plain.startswith(f"{affix}_") or plain.endswith(f"_{affix}") for affix in affixes):
            return array
    return None


def _column(table: Table, array: str, joint: str) -> tuple[str, Unit | None] | None:
    """Returns the column of a joint, with its unit."""
    plain = _plain(joint)
    accepted = [plain] if array == "q" else []
    for affix in _AFFIXES[array]:
        accepted += [f"{affix}_{plain}", f"{plain}_{affix}"]
    for name in table.names:
        for stem, unit in readings(name):
            found = _plain(stem)
            before = next((found[: -len(each)] for each in accepted if found.endswith(each)), None)
            if before == "" or (before is not None and _is_measured(before)):
                return name, unit
    return None


def _is_measured(before: str) -> bool:
    """Returns whether what stands before the name of a joint is that of a measurement."""
    return before.endswith("_") and not NOT_MEASURED.intersection(before.split("_"))


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "_", name).strip("_").lower()


def _chain(urdf: str, tip: str) -> list[str]:
    """Returns the joints from the root of a URDF to a link; none where there is no such link."""
    try:
        root = ElementTree.fromstring(urdf.lstrip("\ufeff").lstrip())
    except ElementTree.ParseError:  # which is reported where it becomes a robot
        return []
    above: dict[str, tuple[str, str]] = {}
    for joint in root.iter("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            above[child.get("link", "")] = (joint.get("name", ""), parent.get("link", ""))
    chain: list[str] = []
    while tip in above and len(chain) < len(above):
        name, tip = above[tip]
        chain.insert(0, name)
    return chain
