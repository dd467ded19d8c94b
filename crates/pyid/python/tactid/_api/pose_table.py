"""Poses at rest in a table: a CSV file without a column of times."""

import csv
import os
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tactid._base.errors import LogError
from tactid._base.naming import counted
from tactid._base.values import Array

_TIME = re.compile(r"(time|timestamp|stamp|t)([_ \[(].*)?")
"""A column of times: the table is that of a recording."""

_WRENCHES = tuple(
    tuple(f"{name}{between}{axis}" for name in (force, moment) for axis in "xyz")
    for force, moment, between in (
        ("f", "t", ""),
        ("f", "m", ""),
        ("f", "n", ""),
        *(("force", name, between) for name in ("torque", "moment") for between in ("_", " ", ".")),
    )
)
_ORIENTATION = ("qx", "qy", "qz", "qw")
_POSITION = ("x", "y", "z")
_JOINT = re.compile(r"q_?(\d+)(_deg| ?\[deg\])?")


def read_pose_table(path: Path) -> Mapping[str, Array] | None:
    """Reads the arrays ``wrench`` and ``q`` or ``pose`` of a table with a row for each sample.

    Returns None where the file is no CSV, or has a column of times.

    Raises:
        LogError: A column is missing, or a cell is no number.
    """
    names = _names(path)
    if not names or any(_TIME.fullmatch(name) for name in names):
        return None
    rows = _rows(path, names)
    wrench = next((each for each in _WRENCHES if set(each) <= set(names)), None)
    if wrench is None:
        raise LogError(f"{path} has no wrench: its six columns are fx, fy, fz, tx, ty, tz")
    arrays = {"wrench": rows[:, [names.index(name) for name in wrench]]}
    joints = sorted(
        (int(found[1]), column, bool(found[2]))
        for column, name in enumerate(names)
        if (found := _JOINT.fullmatch(name))
    )
    if joints:
        factors = [np.pi / 180 if in_degrees else 1.0 for _, _, in_degrees in joints]
        return arrays | {"q": rows[:, [column for _, column, _ in joints]] * factors}
    if not set(_ORIENTATION) <= set(names):
        raise LogError(
            f"{path} has no attitudes: expected the columns q1, q2, ... of joint positions in rad"
            " (q1_deg, ... in degrees), or qx, qy, qz, qw of the orientation of the sensor"
        )
    position = [
        rows[:, names.index(name)] if name in names else np.zeros(len(rows)) for name in _POSITION
    ]
    orientation = [rows[:, names.index(name)] for name in _ORIENTATION]
    return arrays | {"pose": np.stack([*position, *orientation], axis=1)}


def _names(path: str | os.PathLike[str]) -> list[str]:
    """Returns the names of the columns in small letters; none where the file is no CSV."""
    path = Path(path)
    if path.suffix.lower() != ".csv" or not path.is_file():
        return []
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        return [name.strip().lower() for name in next(csv.reader(file), [])]


def _rows(path: Path, names: list[str]) -> Array:
    rows = []
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        reader = csv.reader(file)
        next(reader)
        for cells in filter(None, reader):
            if len(cells) != len(names):
                raise LogError(
                    f"{path}, line {reader.line_num}, has {counted(len(cells), 'cell')}, but there"
                    f" are {counted(len(names), 'column')}"
                )
            rows.append(
                [_number(path, reader.line_num, *each) for each in zip(names, cells, strict=True)]
            )
    if not rows:
        raise LogError(f"{path} has no row of numbers")
    return np.array(rows)


def _number(path: Path, line: int, name: str, cell: str) -> float:
    """Returns the number of a cell; an empty one, and one of a column that is not used, is NaN."""
    try:
        return float(cell) if cell.strip() else np.nan
    except ValueError:
        known = {name for each in _WRENCHES for name in each} | {*_ORIENTATION, *_POSITION}
        if name in known or _JOINT.fullmatch(name):
            raise LogError(f"{path}, line {line}: {name} is {cell!r}, and no number") from None
        return np.nan
