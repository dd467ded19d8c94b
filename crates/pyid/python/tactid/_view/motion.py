"""What a designed motion shows: the robot as the joints of a file move it."""

from pathlib import Path

import numpy as np

from tactid._base.errors import ArgumentError, LogError
from tactid._base.naming import abridged
from tactid._native import Manipulator, info as log_info, read_motion
from tactid._view.robot import moving_frames, read_urdf, robot_shapes, step
from tactid._view.scene import MOST, RATE_HZ, Scene

TRAJECTORY = "trajectory.mcap"
"""The file that is read of the folder of a motion."""

BAG = "metadata.yaml"
"""What every folder of a rosbag2 bag has."""


def is_motion(path: Path) -> bool:
    """Whether a file or a folder is a designed motion and no log of a robot."""
    if path.is_dir():
        return (path / TRAJECTORY).exists() and not (path / BAG).exists()
    if path.suffix == ".csv":
        return True
    if path.suffix != ".mcap":
        return False
    types = {topic.type_name.replace("/msg/", "/") for topic in log_info(path).topics}
    return "trajectory_msgs/JointTrajectory" in types and "sensor_msgs/JointState" not in types


def motion_scene(path: Path, urdf: Path | None) -> Scene:
    """Reads what a motion shows, with the base at rest.

    Args:
        path: The folder that ``tactid excite`` wrote, its ``trajectory.mcap`` or a CSV file.
        urdf: The robot.
    """
    if urdf is None:
        raise LogError(f"{path} has joints, but no robot: give its `urdf`", option="urdf")
    names, time, positions = read_motion(path, RATE_HZ, MOST)
    text = read_urdf(urdf)
    robot = Manipulator.from_urdf(text, "fixed")
    columns = {name: column for column, name in enumerate(robot.joint_names)}
    unknown = [name for name in names if name not in columns]
    if unknown:
        raise ArgumentError(
            f"{path} moves {abridged(unknown)}, which the robot of `urdf` does not have; it has"
            f" {abridged(list(columns))}",
            option="urdf",
        )
    every = step(robot, len(time))
    time, positions = time[::every], positions[::every]
    q = np.zeros((len(time), robot.dof))
    for name, column in zip(names, positions.T, strict=True):
        q[:, columns[name]] = column
    frames, of_frames = moving_frames(robot, time, q, np.eye(4))
    shapes, of_shapes = robot_shapes(text, urdf, frames)
    moved = set(names)
    absent = [name for name in columns if name not in moved]
    notes = of_frames + of_shapes
    if absent:
        notes.append(f"Not in the motion, shown at zero: {abridged(absent)}.")
    return Scene(
        start_ns=0,
        frames=frames,
        shapes=shapes,
        forces=[],
        is_robot=True,
        stands=True,
        notes=notes,
    )
