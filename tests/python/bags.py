"""Bags written by `rosbags`, which shares nothing with tactid."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)


def message(kind: str, **fields: Any) -> Any:
    """A message of a type such as ``sensor_msgs/msg/JointState``."""
    return STORE.types[kind](**fields)


def header(time_ns: int, frame: str = "") -> Any:
    seconds, rest = divmod(time_ns, 1_000_000_000)
    stamp = message("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
    return message("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def vector(x: float, y: float, z: float) -> Any:
    return message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def joints(
    time_ns: int,
    names: list[str],
    position: list[float],
    velocity: list[float] | None = None,
    effort: list[float] | None = None,
) -> Any:
    return message(
        "sensor_msgs/msg/JointState",
        header=header(time_ns),
        name=names,
        position=np.array(position, dtype=float),
        velocity=np.array(velocity or [], dtype=float),
        effort=np.array(effort or [], dtype=float),
    )


def wrench(time_ns: int, frame: str, force: list[float], torque: list[float]) -> Any:
    return message(
        "geometry_msgs/msg/WrenchStamped",
        header=header(time_ns, frame),
        wrench=message("geometry_msgs/msg/Wrench", force=vector(*force), torque=vector(*torque)),
    )


def odometry(time_ns: int, child: str, position: list[float], quaternion: list[float]) -> Any:
    x, y, z, w = quaternion
    pose = message(
        "geometry_msgs/msg/Pose",
        position=message("geometry_msgs/msg/Point", x=position[0], y=position[1], z=position[2]),
        orientation=message("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w),
    )
    twist = message("geometry_msgs/msg/Twist", linear=vector(1, 2, 3), angular=vector(4, 5, 6))
    none = np.zeros(36)
    return message(
        "nav_msgs/msg/Odometry",
        header=header(time_ns, "world"),
        child_frame_id=child,
        pose=message("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=none),
        twist=message("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=none),
    )


def write_bag(path: Path, messages: Iterable[tuple[str, int, Any]]) -> Path:
    """Writes messages, each with its topic and log time in ns."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connections = {}
        for topic, time_ns, content in messages:
            kind = content.__msgtype__
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=STORE)
            bag.write(connections[topic], time_ns, STORE.serialize_cdr(content, kind))
    return path
