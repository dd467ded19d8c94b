"""Poses at rest in a table: one without a column of times."""

from pathlib import Path

import numpy as np

from tactid._base.errors import ArgumentError
from tactid._base.values import Array
from tactid._options.options import Options
from tactid._read import columns
from tactid._read.columns import Quantity
from tactid._read.descriptions import as_urdf
from tactid._read.recordings import file_options
from tactid._read.robot_joints import RobotJoints
from tactid._read.tables import Table, open_table

_ARRAYS = ("q", "pose", "wrench")
"""What a table may have of poses at rest."""

_MOTION = frozenset({"time", "qd", "effort"})
"""What a table has of a motion."""

_MATRICES = (9, 12, 16)
"""Entries of a rotation matrix, and of a homogeneous one without and with its last row."""


def read_poses(path: Path, options: Options) -> dict[str, Array] | None:
    """Reads the arrays of poses at rest.

    They are ``wrench``, (N, 6), and ``q``, (N, n), or ``pose``, (N, 7) or (N, 3, 3). None where the
    file is no table, or has times, velocities or efforts and therefore a motion.

    Raises:
        LogError: The file cannot be read, or a cell is not a number.
        ArgumentError: A column is missing.
    """
    table = open_table(path)
    given = file_options(options).get("columns", {})
    if table is None or not _MOTION.isdisjoint(given):
        return None
    joints = None
    if options.urdf is not None:
        joints = RobotJoints.of(as_urdf(options.urdf), options.tip or "tool0")

    def own(array: str) -> Quantity | None:
        return None if joints is None else joints.columns(table, array)

    if columns.find(table, sorted(_MOTION), None, own):
        return None
    found = columns.find(table, _ARRAYS, given, own)
    if "wrench" not in found:
        raise columns.missing(table, "wrench", "f*")
    wrench = found["wrench"].read(table)
    if wrench.shape[1] != 6:
        raise ArgumentError(
            f"{path}: {found['wrench'].words} are {wrench.shape[1]} numbers a row for `wrench`:"
            " expected three forces and three moments",
            option="columns",
        )
    if joints is not None and "q" in found:
        return {"wrench": wrench, "q": _positions(table, joints, found["q"])}
    if "pose" not in found:
        example = ("pose", "orientation_*") if joints is None else ("q", "joint_*[deg]")
        raise columns.missing(table, *example)
    return {"wrench": wrench, "pose": _poses(table, found["pose"])}


def _positions(table: Table, joints: RobotJoints, quantity: Quantity) -> Array:
    """Returns the positions of all joints of the robot; those that the table lacks are zero."""
    values = quantity.read(table)
    names = joints.named(table, quantity, values.shape[1])
    q = np.zeros((len(values), len(joints.names)))
    for place, name in enumerate(names):
        if name in joints.names:
            q[:, joints.names.index(name)] = values[:, place]
    return q


def _poses(table: Table, quantity: Quantity) -> Array:
    """Returns attitudes as quaternions with zero positions, or as rotation matrices."""
    values = quantity.read(table)
    width = values.shape[1]
    if width in _MATRICES:
        side = 3 if width == _MATRICES[0] else 4
        return values.reshape(len(values), -1, side)[:, :3, :3]
    last = str(quantity.columns[-1]).lower()
    rotation = values[:, 3:] if width > 4 else values
    if rotation.shape[1] == 4:
        quaternion = rotation
    elif rotation.shape[1] == 3 and "yaw" in last:
        quaternion = _of_angles(_checked_angles(table, quantity, rotation))
    elif rotation.shape[1] == 3:
        quaternion = _of_vector(_checked_angles(table, quantity, rotation))
    else:
        raise ArgumentError(
            f"{table.path}: {quantity.words} are {width} numbers a row for `pose`: expected x, y, z"
            " and qx, qy, qz, qw, a rotation vector or roll, pitch, yaw, or a matrix",
            option="columns",
        )
    return np.hstack([np.zeros((len(values), 3)), quaternion])


def _checked_angles(table: Table, quantity: Quantity, angles: Array) -> Array:
    """Returns the angles, rad.

    Raises:
        ArgumentError: An angle exceeds 2 pi, so that the unit is probably degrees.
    """
    largest = np.abs(angles[np.isfinite(angles)]).max(initial=0.0)
    if largest > 2 * np.pi:
        names = ",".join(f"{name}[deg]" for name in quantity.columns[-3:])
        raise ArgumentError(
            f"{table.path}: an angle of {quantity.words} is {largest:g}, more than 2 pi rad."
            f" Degrees are stated by `columns`, such as pose={names}, or in the names of the"
            " columns",
            option="columns",
        )
    return angles


def _of_vector(vectors: Array) -> Array:
    """Returns the quaternions, scalar last, of rotation vectors in rad."""
    half = 0.5 * np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.hstack([0.5 * np.sinc(half / np.pi) * vectors, np.cos(half)])


def _of_angles(angles: Array) -> Array:
    """Returns the quaternions, scalar last, of roll, pitch and yaw in rad about fixed axes."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(0.5 * angles).T, np.cos(0.5 * angles).T
    return np.stack(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ],
        axis=1,
    )
