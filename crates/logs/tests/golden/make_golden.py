"""Makes the golden files beside it with `rosbags`, an implementation that shares nothing with ours.

    pip install rosbags==0.11.9
    python make_golden.py

- cdr.txt: a message of each type, in both byte orders, as hexadecimal. Every number is different,
  so that two fields that change places are seen.
- bag/: a bag of one file, its chunks not compressed.
- split/: a bag of two files, its chunks compressed by zstd; the second file is listed first.

It also checks that the definitions in ../../schemas belong to ROS 2 Jazzy, by their type hash.
"""

import itertools
import shutil
from pathlib import Path

import numpy as np
from rosbags.interfaces import (
    Nodetype,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = Path(__file__).parent
SCHEMAS = HERE / "../../schemas"
STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = [
    "builtin_interfaces/msg/Time",
    "std_msgs/msg/String",
    "std_msgs/msg/Header",
    "std_msgs/msg/Float64MultiArray",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/PointCloud2",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/AccelStamped",
    "geometry_msgs/msg/WrenchStamped",
    "geometry_msgs/msg/InertiaStamped",
    "geometry_msgs/msg/TransformStamped",
    "nav_msgs/msg/Odometry",
    "tf2_msgs/msg/TFMessage",
]


def filled(kind, count):
    """A value of a field type with numbers that count upwards."""
    node, detail = kind
    if node == Nodetype.BASE:
        name = detail[0]
        if name == "string":
            return f"text {next(count)}"
        if name == "bool":
            return next(count) % 2 == 0
        return next(count) + 0.25 if name.startswith("float") else next(count)
    if node == Nodetype.NAME:
        return message(detail, count)
    element, length = detail
    # A sequence gets three elements, which leaves what follows it in need of padding.
    values = [filled(element, count) for _ in range(length or 3)]
    if element[0] == Nodetype.BASE and element[1][0] != "string":
        return np.array(values, dtype=element[1][0])
    return values


def message(name, count):
    fields = STORE.fielddefs[name][1]
    return STORE.types[name](**{field: filled(kind, count) for field, kind in fields})


def write_messages():
    lines = []
    for name in TYPES:
        value = message(name, itertools.count(1))
        for order, little in (("little", True), ("big", False)):
            data = bytes(STORE.serialize_cdr(value, name, little_endian=little))
            lines.append(f"{name} {order} {data.hex()}\n")
    (HERE / "cdr.txt").write_text("".join(lines))


def check_definitions():
    types = {}
    for path in sorted(SCHEMAS.glob("*/msg/*.msg")):
        name = f"{path.parts[-3]}/msg/{path.stem}"
        types |= get_types_from_msg(path.read_text(), name)
    ours = get_typestore(Stores.EMPTY)
    ours.register(types)
    for name in types:
        assert ours.hash_rihs01(name) == STORE.hash_rihs01(name), name


def write_bag(folder, steps, compressed):
    """Joint states at 100 Hz; a wrench at every other step, 1 ms later."""
    shutil.rmtree(folder, ignore_errors=True)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    if compressed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    forever = QosTime(9223372036, 854775807)
    qos = Qos(
        QosHistory.UNKNOWN,
        0,
        QosReliability.RELIABLE,
        QosDurability.VOLATILE,
        forever,
        forever,
        QosLiveliness.AUTOMATIC,
        forever,
        False,
    )
    with writer:
        topics = [
            ("/joint_states", "sensor_msgs/msg/JointState"),
            ("/wrench", "geometry_msgs/msg/WrenchStamped"),
        ]
        joints, wrench = (
            writer.add_connection(t, n, typestore=STORE, offered_qos_profiles=[qos])
            for t, n in topics
        )
        t = STORE.types
        for k in steps:
            ns = 1_700_000_000_000_000_000 + k * 10_000_000
            stamp = t["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
            header = t["std_msgs/msg/Header"](stamp, "tool0")
            state = t["sensor_msgs/msg/JointState"](
                header, ["a", "b"], np.array([k, -k], float), np.array([0.5 * k, 1.0]), np.array([])
            )
            writer.write(joints, ns, STORE.serialize_cdr(state, joints.msgtype))
            if k % 2 == 0:
                xyz = t["geometry_msgs/msg/Vector3"]
                load = t["geometry_msgs/msg/Wrench"](xyz(k, 0.0, 1.0), xyz(0.0, k, 2.0))
                sample = t["geometry_msgs/msg/WrenchStamped"](header, load)
                writer.write(wrench, ns + 1_000_000, STORE.serialize_cdr(sample, wrench.msgtype))


def write_split_bag():
    """Rosbags writes bags of one file; two of them make one that is split."""
    parts = [HERE / "part_0", HERE / "part_1"]
    write_bag(parts[0], range(20), compressed=True)
    write_bag(parts[1], range(20, 40), compressed=True)
    split = HERE / "split"
    shutil.rmtree(split, ignore_errors=True)
    split.mkdir()
    for part in parts:
        shutil.copy(part / f"{part.name}.mcap", split)
    metadata = (parts[0] / "metadata.yaml").read_text()
    files = "relative_file_paths:\n  - part_1.mcap\n  - part_0.mcap"
    listed = "relative_file_paths:\n  - part_0.mcap"
    assert listed in metadata
    (split / "metadata.yaml").write_text(metadata.replace(listed, files))
    for part in parts:
        shutil.rmtree(part)


check_definitions()
write_messages()
write_bag(HERE / "bag", range(40), compressed=False)
write_split_bag()
