"""Recordings of the arm as a robot would leave them: rosbag2 directories written by ``rosbags``.

A recording is a list of `Logged` messages, which `faulty.py` spoils before they are written.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from recorded_arm import JOINTS, TIP, Arm, Frames, State, friction, pose_values, ur5e, wrench_about

STORE = get_typestore(Stores.ROS2_JAZZY)
EPOCH_NS = 1_700_000_000_123_456_789
IDENTITY = pin.SE3.Identity()
NO_TIME = QosTime(0, 0)
LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    NO_TIME,
    NO_TIME,
    QosLiveliness.AUTOMATIC,
    NO_TIME,
    avoid_ros_namespace_conventions=False,
)


@dataclass(frozen=True)
class Logged:
    """One message with the time at which the recorder got it."""

    topic: str
    log_ns: int
    message: Any

    @cached_property
    def data(self) -> bytes:
        """In CDR, made once."""
        return bytes(STORE.serialize_cdr(self.message, self.type_name))

    @property
    def type_name(self) -> str:
        return str(self.message.__msgtype__)

    @property
    def stamp_ns(self) -> int:
        """Of the header."""
        stamp = self.message.header.stamp
        return int(stamp.sec) * 10**9 + int(stamp.nanosec)


@cache
def _type(name: str) -> Any:
    packages = ("std_msgs", "sensor_msgs", "geometry_msgs", "nav_msgs", "tf2_msgs")
    full = (f"{package}/msg/{name}" for package in packages)
    return STORE.types[next(each for each in full if each in STORE.types)]


def message(type_name: str, **fields: object) -> Any:
    """``message("Wrench", ...)`` of whichever of the packages has it."""
    return _type(type_name)(**fields)


def header(stamp_ns: int, frame: str = "") -> Any:
    sec, nanosec = divmod(int(stamp_ns), 10**9)
    stamp = STORE.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return message("Header", stamp=stamp, frame_id=frame)


def vector(values: Sequence[float] | np.ndarray) -> Any:
    x, y, z = map(float, values)
    return message("Vector3", x=x, y=y, z=z)


def quaternion(values: Sequence[float] | np.ndarray) -> Any:
    x, y, z, w = map(float, values)
    return message("Quaternion", x=x, y=y, z=z, w=w)


def clock(
    duration_s: float, rate_hz: float, *, jitter: float = 0.0, start_s: float = 0.0, seed: int = 0
) -> np.ndarray:
    """Times of a stream, each a whole number of ns; jitter is a part of the period."""
    count = int(duration_s * rate_hz)
    late = np.random.default_rng(seed).uniform(-jitter, jitter, count)
    return np.round((start_s + (np.arange(count) + late) / rate_hz) * 1e9) * 1e-9


def stamps(time: np.ndarray, epoch_ns: int = EPOCH_NS) -> list[int]:
    return [epoch_ns + int(t) for t in np.round(time * 1e9)]


def received(stamp_ns: Sequence[int]) -> list[int]:
    """When the recorder got what was stamped: a little later, and never in a straight line."""
    delay = np.random.default_rng(7).uniform(0.2e6, 1.5e6, len(stamp_ns))
    return [stamp + int(d) for stamp, d in zip(stamp_ns, delay, strict=True)]


def description(urdf: str | None = None, epoch_ns: int = EPOCH_NS) -> Logged:
    text = ur5e() if urdf is None else urdf
    return Logged("/robot_description", epoch_ns, message("String", data=text))


def static_transform(child: str, pose: pin.SE3, parent: str = TIP) -> Logged:
    """A frame that the URDF does not have."""
    xyzw = pin.SE3ToXYZQUAT(pose)
    transform = message("Transform", translation=vector(xyzw[:3]), rotation=quaternion(xyzw[3:]))
    stamped = message(
        "TransformStamped",
        header=header(EPOCH_NS, parent),
        child_frame_id=child,
        transform=transform,
    )
    return Logged("/tf_static", EPOCH_NS, message("TFMessage", transforms=[stamped]))


def joint_states(
    state: State,
    *,
    topic: str = "/joint_states",
    effort: np.ndarray | None = None,
    joints: Sequence[str] = JOINTS,
    epoch_ns: int = EPOCH_NS,
) -> list[Logged]:
    """The joints' positions and velocities; efforts if they are given."""
    columns = [JOINTS.index(name) for name in joints]
    stamp_ns, out = stamps(state.time, epoch_ns), []
    for k, (stamp, log_ns) in enumerate(zip(stamp_ns, received(stamp_ns), strict=True)):
        body = message(
            "JointState",
            header=header(stamp),
            name=list(joints),
            position=state.q[k, columns],
            velocity=state.v[k, columns],
            effort=np.empty(0) if effort is None else effort[k, columns],
        )
        out.append(Logged(topic, log_ns, body))
    return out


def wrenches(
    time: np.ndarray,
    wrench: np.ndarray,
    *,
    topic: str = "/wrench",
    frame: str = TIP,
    tip_from_sensor: pin.SE3 = IDENTITY,
    delay_s: float = 0.0,
) -> list[Logged]:
    """Wrenches at the tip, as a sensor measures them that stamps late by a delay."""
    stamp_ns, out = stamps(time + delay_s), []
    there = wrench_about(tip_from_sensor, wrench)
    for values, stamp, log_ns in zip(there, stamp_ns, received(stamp_ns), strict=True):
        body = message("Wrench", force=vector(values[:3]), torque=vector(values[3:]))
        stamped = message("WrenchStamped", header=header(stamp, frame), wrench=body)
        out.append(Logged(topic, log_ns, stamped))
    return out


def odometry(
    time: np.ndarray, frames: Frames, *, child: str = "base_link", topic: str = "/odom"
) -> list[Logged]:
    """Pose in the world, twist in the child's own axes."""
    stamp_ns, out = stamps(time), []
    unknown = np.zeros(36)
    for k, (stamp, log_ns) in enumerate(zip(stamp_ns, received(stamp_ns), strict=True)):
        x, y, z, *xyzw = pose_values(frames.pose[k])
        pose = message(
            "Pose", position=message("Point", x=x, y=y, z=z), orientation=quaternion(xyzw)
        )
        linear, angular = vector(frames.velocity[k]), vector(frames.angular_velocity[k])
        twist = message("Twist", linear=linear, angular=angular)
        odom = message(
            "Odometry",
            header=header(stamp, "world"),
            child_frame_id=child,
            pose=message("PoseWithCovariance", pose=pose, covariance=unknown),
            twist=message("TwistWithCovariance", twist=twist, covariance=unknown),
        )
        out.append(Logged(topic, log_ns, odom))
    return out


def accelerations(
    time: np.ndarray, frames: Frames, *, frame: str, topic: str = "/accel"
) -> list[Logged]:
    """Acceleration of the frame's origin without gravity, in its own axes."""
    stamp_ns, out = stamps(time), []
    for k, (stamp, log_ns) in enumerate(zip(stamp_ns, received(stamp_ns), strict=True)):
        linear, angular = frames.acceleration[k], frames.angular_acceleration[k]
        accel = message("Accel", linear=vector(linear), angular=vector(angular))
        stamped = message("AccelStamped", header=header(stamp, frame), accel=accel)
        out.append(Logged(topic, log_ns, stamped))
    return out


def imu(
    time: np.ndarray, frames: Frames, gravity: np.ndarray, *, frame: str, topic: str = "/imu"
) -> list[Logged]:
    """What an accelerometer feels: at rest, the reaction to gravity."""
    stamp_ns, out = stamps(time), []
    unknown = np.zeros(9)
    for k, (stamp, log_ns) in enumerate(zip(stamp_ns, received(stamp_ns), strict=True)):
        felt = frames.acceleration[k] - frames.pose[k, :3, :3].T @ gravity
        body = message(
            "Imu",
            header=header(stamp, frame),
            orientation=quaternion(pose_values(frames.pose[k])[3:]),
            orientation_covariance=unknown,
            angular_velocity=vector(frames.angular_velocity[k]),
            angular_velocity_covariance=unknown,
            linear_acceleration=vector(felt),
            linear_acceleration_covariance=unknown,
        )
        out.append(Logged(topic, log_ns, body))
    return out


@cache
def state(arm: Arm, duration_s: float = 20.0, rate_hz: float = 500.0) -> State:
    """The arm on an even clock; worked out once, as the messages below are made once."""
    return arm.at(clock(duration_s, rate_hz))


@cache
def moving(arm: Arm, duration_s: float = 20.0, rate_hz: float = 500.0) -> tuple[Logged, ...]:
    """The URDF and how the arm moves: joints, and odometry if it floats."""
    s = state(arm, duration_s, rate_hz)
    base = odometry(s.time, s.base) if arm.floating else []
    return (description(), *joint_states(s), *base)


@cache
def carried(arm: Arm, duration_s: float = 20.0, rate_hz: float = 500.0) -> tuple[Logged, ...]:
    """The moving arm with a wrench sensor at its tip, all at the same times."""
    s = state(arm, duration_s, rate_hz)
    return (*moving(arm, duration_s, rate_hz), *wrenches(s.time, s.wrench))


@cache
def driven(
    arm: Arm, duration_s: float = 20.0, rate_hz: float = 500.0, *, rough: bool = False
) -> tuple[Logged, ...]:
    """The arm with its joints' efforts, and no wrench; with friction if it is rough."""
    s = state(arm, duration_s, rate_hz)
    return (description(), *joint_states(s, effort=s.effort + rough * friction(s.v)))


def carried_in_two_parts(
    arm: Arm, topics: tuple[str, str], duration_s: float, rate_hz: float
) -> list[Logged]:
    """Shoulder and elbow from one publisher, the wrist from another that samples 1.3 ms later."""
    now = state(arm, duration_s, rate_hz)
    later = arm.at(clock(duration_s, rate_hz, start_s=0.0013))
    first = joint_states(now, topic=topics[0], joints=JOINTS[:3])
    second = joint_states(later, topic=topics[1], joints=JOINTS[3:])
    return [description(), *first, *second, *wrenches(now.time, now.wrench)]


def write_bag(
    folder: Path,
    messages: Iterable[Logged],
    *,
    storage: StoragePlugin = StoragePlugin.MCAP,
    compression: CompressionMode = CompressionMode.NONE,
    in_order: bool = True,
) -> Path:
    """A bag directory; in the order of the log times, unless the recorder kept none."""
    logged = sorted(messages, key=lambda m: m.log_ns) if in_order else list(messages)
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Connection] = {}
        for each in logged:
            if each.topic not in connections:
                latched = each.topic in ("/robot_description", "/tf_static")
                connections[each.topic] = writer.add_connection(
                    each.topic,
                    each.type_name,
                    typestore=STORE,
                    offered_qos_profiles=[LATCHED] if latched else [],
                )
            writer.write(connections[each.topic], each.log_ns, each.data)
    return folder


def write_split_bag(folder: Path, messages: Iterable[Logged], parts: int) -> Path:
    """A bag of several files, as ``ros2 bag record --max-bag-size`` leaves it.

    Their numbers have no leading zeros: with eleven, the order of the names is not that of time.
    """
    logged = sorted(messages, key=lambda m: m.log_ns)
    folder.mkdir()
    yaml = YAML(typ="safe")
    whole: dict[str, Any] = {}
    edges = np.linspace(0, len(logged), parts + 1).astype(int)
    for number, (first, last) in enumerate(pairwise(edges)):
        name = f"{folder.name}_{number}"
        part = write_bag(folder / "part", logged[first:last])
        (part / "part.mcap").rename(folder / f"{name}.mcap")
        text = (part / "metadata.yaml").read_text().replace("part.mcap", f"{name}.mcap")
        info = yaml.load(text)["rosbag2_bagfile_information"]
        (part / "metadata.yaml").unlink()
        part.rmdir()
        if not whole:
            whole = info
            continue
        whole["message_count"] += info["message_count"]
        whole["relative_file_paths"] += info["relative_file_paths"]
        whole["files"] += info["files"]
        counts = {t["topic_metadata"]["name"]: t for t in whole["topics_with_message_count"]}
        for topic in info["topics_with_message_count"]:
            if (known := counts.get(topic["topic_metadata"]["name"])) is not None:
                known["message_count"] += topic["message_count"]
            else:
                whole["topics_with_message_count"].append(topic)
    whole["duration"]["nanoseconds"] = logged[-1].log_ns - logged[0].log_ns
    with (folder / "metadata.yaml").open("w") as file:
        yaml.dump({"rosbag2_bagfile_information": whole}, file)
    return folder
