"""A robot as it is shown: its frames over time, and its shapes."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactid._base.errors import ModelError
from tactid._base.naming import abridged
from tactid._base.values import Array
from tactid._native import Manipulator
from tactid._view.shapes import Shape, shapes_of

MOST_FRAMES = 500
"""Frames that are shown of a robot: a humanoid with hands has a quarter of them."""
MOST_SHAPES = 2000
"""Shapes that are shown of a robot."""
MOST_POSES = 1_000_000
"""Frames, or joints, times points in time at most: 0.1 GB of poses."""


MOST_TEXT = 16 << 20
"""Characters of the largest URDF that is read as a robot."""


@dataclass(frozen=True)
class Frame:
    """A frame as it moves in the world."""

    time: Array
    """(N,), s since the scene's start."""
    position: Array
    """(N, 3), m."""
    quaternion: Array
    """(N, 4), of length one, the scalar last."""


def read_urdf(path: Path) -> str:
    """The text of a URDF file; of one that is too large to be a robot, as much as shows that."""
    try:
        with path.open(encoding="utf-8") as file:
            return file.read(MOST_TEXT + 1)
    except UnicodeDecodeError:
        raise ModelError(f"{path} is not a URDF: it is not text", option="urdf") from None


def step(robot: Manipulator, points: int) -> int:
    """Every how many of the points in time a robot is shown, so that its poses fit in memory."""
    frames = min(len(robot.frame_names), MOST_FRAMES)
    return max(math.ceil(points * max(frames, robot.dof) / MOST_POSES), 1)


def moving_frames(
    robot: Manipulator, time: Array, q: Array, base_pose: Array
) -> tuple[dict[str, Frame], list[str]]:
    """The frames of a robot at joint positions, (N, n), and poses of its base.

    Beside them stands a note where the robot has more than are shown.
    """
    frames = {}
    names = robot.frame_names
    for name in names[:MOST_FRAMES]:
        placed = robot.kinematics(name, q, base_pose=base_pose).pose
        frames[name] = Frame(time, placed[:, :3, 3], _quaternions(placed[:, :3, :3]))
    more = f"Of the {len(names)} links of the robot, the first {MOST_FRAMES} are shown."
    return frames, [more] if len(names) > MOST_FRAMES else []


def robot_shapes(
    urdf: str, path: Path | None, frames: dict[str, Frame]
) -> tuple[dict[str, list[Shape]], list[str]]:
    """The shapes of a robot by its frames, and notes on those that are not shown."""
    found, reasons = shapes_of(urdf, None if path is None else path.resolve().parent, frames)
    notes = []
    for reason in sorted(set(reasons.values())):
        meshes = sorted(uri for uri in reasons if reasons[uri] == reason)
        notes.append(f"Meshes that are not shown, each because {reason}: {abridged(meshes)}.")
    count = sum(len(shapes) for shapes in found.values())
    if count > MOST_SHAPES:
        notes.append(f"Of the {count} shapes of the robot, the first {MOST_SHAPES} are shown.")
    left = MOST_SHAPES
    shown = {}
    for name, shapes in found.items():
        shown[name] = shapes[:left]
        left -= len(shown[name])
    return shown, notes


def _quaternions(rotations: Array) -> Array:
    """(N, 4), the scalar last, of rotations (N, 3, 3)."""
    m = np.moveaxis(rotations, 0, -1)
    # Four times the products of the quaternion's entries; each row is parallel to the quaternion.
    products = np.array(
        [
            [
                1 + m[0, 0] - m[1, 1] - m[2, 2],
                m[0, 1] + m[1, 0],
                m[0, 2] + m[2, 0],
                m[2, 1] - m[1, 2],
            ],
            [
                m[0, 1] + m[1, 0],
                1 - m[0, 0] + m[1, 1] - m[2, 2],
                m[1, 2] + m[2, 1],
                m[0, 2] - m[2, 0],
            ],
            [
                m[0, 2] + m[2, 0],
                m[1, 2] + m[2, 1],
                1 - m[0, 0] - m[1, 1] + m[2, 2],
                m[1, 0] - m[0, 1],
            ],
            [
                m[2, 1] - m[1, 2],
                m[0, 2] - m[2, 0],
                m[1, 0] - m[0, 1],
                1 + m[0, 0] + m[1, 1] + m[2, 2],
            ],
        ]
    )
    # The row of the largest entry is the one that no rounding spoils.
    largest = np.argmax(np.einsum("iin->ni", products), axis=1)
    rows: Array = products[largest, :, np.arange(len(rotations))]
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return rows
