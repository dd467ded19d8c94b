"""The wrench of the contact in a recording: against the truth, and in a copy of the log."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import Reader, StoragePlugin

import tactid
from conftest import TactidCommand
from recorded_arm import Arm
from recordings import EPOCH_NS, STORE, description, joint_states, state, wrenches, write_bag

NOISE = np.array([0.3] * 3 + [0.02] * 3)
OFFSET = np.array([4, -2, 3, 0.2, 0.3, -0.1])
ALL, FORCES = slice(6), slice(3)


def _touched(time: np.ndarray) -> np.ndarray:
    """A contact of 15 N for 2 s, along axes of the sensor."""
    during = (time > 4) & (time < 6)
    return np.where(during[:, None], [9.0, 0, -12, 0, 0.5, 0], 0.0)


def _record(
    folder: Path, seed: int, contact: float, storage: StoragePlugin, channels: slice = ALL
) -> Path:
    s = state(Arm(), 10.0, 200.0)
    noise = np.random.default_rng(seed).normal(size=s.wrench.shape) * NOISE
    measured = np.zeros_like(s.wrench)
    measured[:, channels] = (s.wrench + OFFSET + noise + contact * _touched(s.time))[:, channels]
    messages = [description(), *joint_states(s), *wrenches(s.time, measured)]
    return write_bag(folder, messages, storage=storage)


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A recording without contact, and one with a contact."""
    folder = tmp_path_factory.mktemp("contact")
    clean = _record(folder / "clean", 0, 0.0, StoragePlugin.MCAP)
    return clean, _record(folder / "touched", 1, 1.0, StoragePlugin.SQLITE3)


@pytest.fixture(scope="module")
def result(bags: tuple[Path, Path]) -> tactid.Identification:
    return tactid.identify(bags[0], cutoff_hz=10)


@pytest.fixture(scope="module")
def payload(result: tactid.Identification, bags: tuple[Path, Path]) -> Path:
    path = bags[0].parent / "payload.json"
    result.write_result(path)
    return path


def test_a_contact_is_what_acts_on_the_payload(
    bags: tuple[Path, Path], payload: Path, result: tactid.Identification
) -> None:
    found = tactid.compensate(bags[1], payload)
    time = found.times_s + (found.start_ns - EPOCH_NS) * 1e-9
    away = np.isfinite(found.contact[:, 0]) & (np.abs(np.abs(time - 5) - 1) > 0.1)
    assert away.sum() > 0.95 * len(time)
    error = (found.contact - _touched(time))[away]
    filtered = NOISE * np.sqrt(35 / 18 / (200 * 0.926 / found.cutoff_hz))
    assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 1.2 * filtered)
    assert 0.92 < np.mean(np.abs(error) < 1.96 * found.std_devs[away]) < 0.98
    assert (found.point, found.axes, found.acts_on) == ("tool0", "tool0", "payload")
    assert "contact_throughout" not in [finding.kind for finding in found.findings]
    # What is measured is the sum of its parts, and a result knows its own recording.
    own = result.contact_wrench()
    rest = own.measured - own.load - own.contact
    assert result.fit.wrench_offset is not None
    assert np.nanmax(np.abs(rest - result.fit.wrench_offset.values)) < 1e-9
    assert np.nanmax(np.abs(own.contact[:, :3])) < 1.0


def test_a_payload_that_does_not_fit_is_named(bags: tuple[Path, Path], payload: Path) -> None:
    found = tactid.compensate(bags[0], payload, wrench_acts_on="sensor")
    assert "contact_throughout" in [finding.kind for finding in found.findings]
    saved = payload.with_name("saved.json")
    saved.write_text('{"schema": "tactid.live/1", "estimate": {"frame": "tool0"}}')
    with pytest.raises(tactid.ArgumentError, match="live session has saved without an offset"):
        tactid.compensate(bags[0], saved)


def test_a_delay_of_the_payloads_recording_is_corrected(payload: Path, tmp_path: Path) -> None:
    s = state(Arm(), 10.0, 200.0)
    arrays = {"urdf": description().message.data, "q": s.q, "qd": s.v, "wrench": s.wrench + OFFSET}
    late = tmp_path / "late.json"
    late.write_text(json.dumps(json.loads(payload.read_bytes()) | {"delay_s": 0.012}))
    assert tactid.compensate(s.time, late, cutoff_hz=25, **arrays).delay_s == 0.012
    assert tactid.compensate(s.time, late, delay_s=0.003, **arrays).delay_s == 0.003


def test_arrays_and_axes(result: tactid.Identification, payload: Path) -> None:
    s = state(Arm(), 10.0, 200.0)
    arrays = {"urdf": description().message.data, "q": s.q, "qd": s.v, "wrench": s.wrench + OFFSET}
    found = tactid.compensate(s.time, result, **arrays)
    turned = tactid.compensate(s.time, payload, point="wrist_3_link", axes="world", **arrays)
    assert np.nanmax(np.abs(found.contact[:, :3])) < 0.2
    sizes = [np.linalg.norm(each.load[:, :3], axis=1) for each in (found, turned)]
    assert np.allclose(*sizes, rtol=1e-6, equal_nan=True)
    with pytest.raises(tactid.ArgumentError, match="point`: the link `base_link` moves relative"):
        tactid.compensate(s.time, result, point="base_link", **arrays)
    with pytest.raises(tactid.ArgumentError, match="axes`: the robot has no link `wrld`"):
        tactid.compensate(s.time, result, axes="wrld", **arrays)
    with pytest.raises(tactid.ArgumentError, match="in the frame tool0, but the tip is"):
        tactid.compensate(s.time, result, tip="wrist_3_link", **arrays)
    by_efforts = {"urdf": arrays["urdf"], "q": s.q, "qd": s.v, "effort": s.effort}
    efforts = tactid.identify(s.time, method="effort", **by_efforts)
    with pytest.raises(tactid.ArgumentError, match="without an offset and a load"):
        tactid.compensate(s.time, efforts, **arrays)
    with pytest.raises(tactid.ArgumentError, match="expected the JSON file of an earlier result"):
        tactid.compensate(s.time, __file__, **arrays)
    with pytest.raises(tactid.IdentificationError, match="wrench"):
        tactid.compensate(s.time, result, **by_efforts)


def _messages(folder: Path) -> Iterator[tuple[str, int, bytes]]:
    with Reader(folder) as bag:
        for connection, log_ns, data in bag.messages():
            yield connection.topic, log_ns, bytes(data)


def test_a_copy_of_the_log_has_the_wrenches(
    bags: tuple[Path, Path], payload: Path, command: TactidCommand, tmp_path: Path
) -> None:
    """Every message stays as it is, of an SQLite bag, too; the new ones are those of Python."""
    done = command("compensate", bags[1], "--payload", payload, "--out", "out")
    assert done.returncode == 0, done.stderr
    assert "greatest force of the contact is 15" in done.stderr
    out = tmp_path / "out"
    assert {each.name for each in tmp_path.iterdir()} == {"out"}
    assert {each.name for each in out.iterdir()} == {
        *("out_0.mcap", "metadata.yaml", "contact_wrench.png")
    }
    copied = list(_messages(out))
    assert [each for each in copied if "_wrench" not in each[0]] == list(_messages(bags[1]))
    found = tactid.compensate(bags[1], payload)
    contact = [data for topic, _, data in copied if topic == "/wrench/contact_wrench"]
    rows = np.isfinite(found.contact[:, 0])
    assert len(contact) == rows.sum()
    for data, row, time in zip(contact, found.contact[rows], found.times_s[rows], strict=True):
        message = STORE.deserialize_cdr(data, "geometry_msgs/msg/WrenchStamped")
        assert message.header.frame_id == "tool0"
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        assert abs(stamp - found.start_ns - round(time * 1e9)) < 2
        force = message.wrench.force
        assert [force.x, force.y, force.z] == row[:3].tolist()
    with (out / "out_0.mcap").open("rb") as file:
        schemas = {
            channel.topic: (schema.name, schema.encoding)
            for schema, channel, _ in make_reader(file).iter_messages()
            if schema is not None
        }
    target = ("geometry_msgs/msg/WrenchStamped", "ros2msg")
    assert schemas["/wrench/load_wrench"] == schemas["/wrench"] == target
    for log, to, reason in (
        (bags[1], bags[1] / "in", "is in the folder of the log"),
        (out, "twice", "has the topic /wrench/load_wrench already"),
    ):
        options = ("--wrench-topic", "/wrench", "--payload", payload, "--out", to)
        done = command("compensate", log, *options)
        assert done.returncode == 2
        assert reason in done.stderr
    assert {each.name for each in tmp_path.iterdir()} == {"out"}


def test_a_sensor_without_moments_has_a_greatest_force(
    payload: Path, command: TactidCommand, tmp_path: Path
) -> None:
    bag = _record(tmp_path / "forces", 1, 1.0, StoragePlugin.MCAP, FORCES)
    done = command("compensate", bag, "--payload", payload, "--out", "out")
    assert done.returncode == 0, done.stderr
    assert "greatest force of the contact is 15" in done.stderr
    assert "greatest moment" not in done.stderr
    assert done.stdout.count("not measured") == 3


def test_what_a_copy_lacks_of_another_topic_is_named(
    bags: tuple[Path, Path], payload: Path, command: TactidCommand, tmp_path: Path
) -> None:
    """A damaged chunk of a topic that the compensation does not read."""
    (recorded,) = bags[0].glob("*.mcap")
    log = tmp_path / "damaged.mcap"
    with recorded.open("rb") as source, log.open("wb") as file:
        writer = Writer(file, chunk_size=4096, compression=CompressionType.NONE)
        writer.start("ros2", "test")
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(source).iter_messages():
            assert schema is not None
            if channel.id not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, "cdr", known)
            times = message.log_time, message.publish_time
            writer.add_message(channels[channel.id], times[0], message.data, times[1])
        note = writer.register_channel("/note", "cdr", 1)
        for part in (b"whole", 1000 * b"damaged"):
            writer.add_message(note, times[0], 10_000 * b"-" + part, times[1])
        writer.finish()
    content = log.read_bytes()
    log.write_bytes(content.replace(b"damaged", b"changed", 1))
    done = command("compensate", log, "--payload", payload, "--out", "out")
    assert done.returncode == 0, done.stderr
    assert "damaged.mcap is damaged at byte" in " ".join(done.stderr.split())
