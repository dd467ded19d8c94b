"""Logs whose messages are not CDR: ROS 1 bags, and MCAP with messages of ROS 1 or in JSON."""

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

import tactid
from conftest import TactidCommand
from recorded_arm import FIXED, JOINTS, PAYLOAD, ur5e
from recordings import state

STORE = get_typestore(Stores.ROS1_NOETIC)
JOINT_STATE, WRENCH = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"
IMAGE = "sensor_msgs/msg/CompressedImage"
EPOCH_NS = 1_700_000_000_000_000_000


def make(name: str, *values: Any) -> Any:
    return STORE.types[name](*values)


def header(time_ns: int, frame: str) -> Any:
    stamp = make("builtin_interfaces/msg/Time", time_ns // 10**9, time_ns % 10**9)
    return make("std_msgs/msg/Header", 7, stamp, frame)


def messages() -> Iterator[tuple[str, str, int, Any]]:
    """Topic, type, time and message, with a picture in between."""
    s = state(FIXED, 8.0, 100.0)
    for k, time in enumerate(s.time):
        ns = EPOCH_NS + round(time * 1e9)
        joints = make(JOINT_STATE, header(ns, ""), JOINTS, s.q[k], s.v[k], np.zeros(0))
        yield "/joint_states", JOINT_STATE, ns, joints
        halves = (make("geometry_msgs/msg/Vector3", *s.wrench[k, at : at + 3]) for at in (0, 3))
        wrench = make("geometry_msgs/msg/Wrench", *halves)
        yield "/ft", WRENCH, ns, make(WRENCH, header(ns, "tool0"), wrench)
    yield "/camera", IMAGE, ns, make(IMAGE, header(ns, ""), "jpeg", np.zeros(9, np.uint8))


def bag(folder: Path) -> Path:
    path = folder / "run.bag"
    with BagWriter(path) as writer:
        topics: dict[str, Any] = {}
        for topic, kind, ns, message in messages():
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(topics[topic], ns, STORE.serialize_ros1(message, kind))
    return path


def mcap(folder: Path, encoding: str, encode: Callable[[Any, str], bytes]) -> Path:
    path = folder / f"{encoding}.mcap"
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros1" if encoding == "ros1" else "")
        topics: dict[str, int] = {}
        for topic, kind, ns, message in messages():
            if topic not in topics:
                schema = writer.register_schema(kind.replace("/msg/", "/"), "", b"")
                topics[topic] = writer.register_channel(topic, encoding, schema)
            writer.add_message(topics[topic], ns, encode(message, kind), ns)
        writer.finish()
    return path


def as_json(message: Any, _: str) -> bytes:
    def plain(value: Any) -> Any:
        if hasattr(value, "__msgtype__"):
            fields = {name: plain(each) for name, each in vars(value).items() if name[0] != "_"}
            # As Foxglove writes the times of ROS 1.
            return {"nsec" if name == "nanosec" else name: each for name, each in fields.items()}
        return value.tolist() if isinstance(value, np.ndarray) else value

    return json.dumps(plain(message)).encode()


FORMS: dict[str, Callable[[Path], Path]] = {
    "bag": bag,
    "ros1": lambda folder: mcap(folder, "ros1", lambda *each: bytes(STORE.serialize_ros1(*each))),
    "json": lambda folder: mcap(folder, "json", as_json),
}


@pytest.mark.parametrize("form", FORMS)
def test_a_log_that_is_not_cdr_gives_the_payload(form: str, tmp_path: Path) -> None:
    path = FORMS[form](tmp_path)
    result = tactid.identify(path, urdf=ur5e(), cutoff_hz=5.0)
    np.testing.assert_allclose(result.estimate.values, PAYLOAD.values, rtol=2e-3, atol=2e-4)
    assert result.inputs["the log"] == path
    assert not result.faults


def test_info_lists_the_topics_of_a_bag(tmp_path: Path, command: TactidCommand) -> None:
    shown = command("info", bag(tmp_path)).stdout.split("\n")
    rows = [line.split() for line in shown if line.strip().startswith("/")]
    assert rows == [
        ["/camera", IMAGE, "1", "–"],
        ["/ft", WRENCH, "800", "100.0"],
        ["/joint_states", JOINT_STATE, "800", "100.0"],
    ]


def test_a_cut_bag_and_wrong_json_are_errors_with_the_path(tmp_path: Path) -> None:
    path = bag(tmp_path)
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(tactid.LogError, match=r"run\.bag cannot be read as a log: "):
        tactid.identify(path, urdf=ur5e())
    path = mcap(tmp_path, "json", lambda message, kind: as_json(message, kind)[:-1])
    with pytest.raises(tactid.LogError, match=r"json\.mcap: message 1 on /joint_states is no"):
        tactid.identify(path, urdf=ur5e())


def test_a_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = bag(tmp_path)
    for module, file in (("rosbags.rosbag1", path), ("rosbags.rosbag2", FORMS["json"](tmp_path))):
        monkeypatch.setitem(sys.modules, module, None)
        with pytest.raises(tactid.ArgumentError, match=r": pip install rosbags mcap$"):
            tactid.identify(file, urdf=ur5e())


def test_nothing_stays_in_the_folder_of_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, temporary = bag(tmp_path), tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    tactid.identify(path, urdf=ur5e())
    assert list(temporary.iterdir()) == []


def test_an_encoding_that_is_not_read_is_named(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("robot.JointState", "protobuf", b"")
        channel = writer.register_channel("/joint_states", "protobuf", schema)
        writer.add_message(channel, EPOCH_NS, b"", EPOCH_NS)
        writer.finish()
    named = r"/joint_states \(robot.JointState; protobuf is not read\)"
    with pytest.raises(tactid.IdentificationError, match=named):
        tactid.identify(path, urdf=ur5e())


def test_efforts_that_a_method_lacks_are_the_cause(tmp_path: Path) -> None:
    cause = "800 messages on /joint_states have no efforts, and none could be used: record them"
    with pytest.raises(tactid.IdentificationError, match=cause):
        tactid.identify(bag(tmp_path), urdf=ur5e(), method="effort")
