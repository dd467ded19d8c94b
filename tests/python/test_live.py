"""A live session: a recording that is played message by message."""

import math
import os
import struct
import time
from pathlib import Path

import numpy as np
import pytest

import tactid
from conftest import TactidCommand
from moving_arm import record
from tactid._live.replay import played
from tactid._live.session import Message, Session
from tactid._live.simulated_arm import RATE_HZ, TIP, SimulatedArm


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("arm") / "bag", duration=8.0, joint_hz=100)


def _played(messages: list[list[Message]], **options: object) -> Session:
    session = Session(tactid.Options(tip="tool0", **options), in_background=False)
    for batch in messages:
        session.push(batch)
    session.finish()
    return session


def test_a_played_recording_gives_its_payload(bag: Path) -> None:
    """Every sample counts, and each value is within the interval of that of the recording."""
    session = _played(list(played(bag, rate=None)))
    # Live, the zero of the sensor is an unknown unless the user says that it is set.
    offline = tactid.identify(bag, tip="tool0", wrench_offset="yes")
    estimate = session.estimate()
    assert estimate is not None
    far = np.abs(estimate.values - offline.estimate.values)
    assert np.all(far < 1.96 * offline.estimate.std_devs)
    status = session.status()
    assert status.is_running
    assert status.problem is None
    assert status.messages == 3201
    # An average of the wrenches reaches over the joints beside it.
    assert 797 <= status.samples <= 800
    assert status.topics == offline.setup.topics


def test_arrays_and_messages_of_the_same_samples_give_the_same(tmp_path: Path) -> None:
    """Online, samples that come as arrays and as messages give the same to nine digits."""
    bag = record(tmp_path / "bag", duration=4.0, joint_hz=200)
    messages = [each for batch in played(bag, None) for each in batch]
    times = {ns for name, _, _, ns in messages if name == "/joint_states"}
    # The wrenches at the times of the joint states alone, so that none is averaged.
    messages = [each for each in messages if each[0] != "/wrench" or each[3] in times]
    options = {"cutoff_hz": 10.0, "max_gap_s": 0.1, "wrench_offset": "no"}
    session = _played([messages], delay_s=0.0, **options)
    joints = [data for name, _, data, _ in messages if name == "/joint_states"]
    # Sequences of six numbers end these messages: positions, velocities and no efforts.
    q, qd = (
        np.array([np.frombuffer(data[begin : begin + 48]) for data in joints])
        for begin in (len(joints[0]) - 108, len(joints[0]) - 52)
    )
    wrench = np.array([np.frombuffer(each[2][-48:]) for each in messages if each[0] == "/wrench"])
    seconds = (np.array(sorted(times)) - min(times)) * 1e-9
    robot = tactid.Manipulator.from_urdf(SimulatedArm().urdf)
    identifier = tactid.Identifier(robot, "tool0", tip="tool0", **options)
    identifier.push(seconds, q, qd, wrench[:, None])
    found, expected = session.estimate(), identifier.estimate()
    assert found is not None
    assert found.windows == expected.windows > 100
    np.testing.assert_allclose(found.values, expected.values, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.std_devs, expected.std_devs, rtol=1e-9)


def test_what_is_missing_is_named(bag: Path) -> None:
    messages = [[each for each in batch if "String" not in each[1]] for batch in played(bag, None)]
    with pytest.raises(tactid.TactidError, match="no robot description"):
        _played(messages)
    with pytest.raises(tactid.ArgumentError, match="does not apply to a live session"):
        Session(tactid.Options(known_mass_kg=1.0), in_background=False)


def test_silence_and_new_topics_are_reported(bag: Path) -> None:
    session = _played(list(played(bag, rate=None)))
    session.announce([("/wrist/wrench", "geometry_msgs/msg/WrenchStamped")])
    findings, faults = session.notices(time.time_ns())
    kinds = {finding.kind for finding in findings}
    assert {"topic_silent", "topics_not_used"} <= kinds
    assert faults == []
    session.reset()
    assert session.estimate() is None


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (math.nan, "moment z in `tool0` measured nothing (zero, or no number, in all samples)"),
        (3.3, "moment z in `tool0` is exactly constant in all samples"),
    ],
)
def test_a_constant_channel_is_named_and_the_session_goes_on(
    bag: Path, value: float, words: str
) -> None:
    """A contact has no moment about an axis that the sensor does not measure."""
    played_with = [
        [
            (*each[:2], each[2][:-8] + struct.pack("<d", value), each[3])
            if each[0] == "/wrench"
            else each
            for each in batch
        ]
        for batch in played(bag, None)
    ]
    session = _played(played_with)
    findings, _ = session.notices(played_with[-1][-1][3])
    assert any(words in str(finding) for finding in findings), findings
    contact = session.contact_wrench()
    assert contact is not None
    assert np.isnan(contact.wrench.values).tolist() == [False] * 5 + [math.isnan(value)]
    if math.isnan(value):
        assert not contact.wrench.is_changing
        assert np.all(contact.wrench.std_devs[:3] < 0.5)
        assert np.all(np.abs(contact.wrench.values[:5]) < 6 * contact.wrench.std_devs[:5])


def test_a_rate_is_that_of_the_recording(bag: Path) -> None:
    begun = time.monotonic()
    assert sum(len(batch) for batch in played(bag, rate=16.0)) > 1000
    assert time.monotonic() - begun > 7.5 / 16.0


def test_the_command_prints_a_table(command: TactidCommand, bag: Path) -> None:
    done = command("live", "--replay", bag, "--tip", "tool0")
    assert done.returncode == 0, done.stderr
    assert "Payload in the frame tool0" in done.stdout
    assert "Izz" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--rate", 1], "--rate is the speed of --replay, which is missing"),
        (["--replay", "none", "--rate", 0], "--rate is 0: expected a finite number greater than 0"),
        (["--replay", "none"], "none"),
    ],
)
def test_wrong_input_is_one_line(
    command: TactidCommand, arguments: list[object], message: str
) -> None:
    done = command("live", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("arguments", [("live", "--tip", "tool0"), ("simulate", "--publish")])
def test_without_ros_the_error_says_what_to_do(
    command: TactidCommand,
    arguments: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "rclpy.py").write_text("raise ImportError('there is no ROS')")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    monkeypatch.setenv("PYTHONPATH", path.rstrip(os.pathsep))
    done = command(*arguments)
    assert done.returncode == 2
    assert "source the setup file of ROS 2" in done.stderr


def test_an_arm_that_is_published_is_not_chosen(command: TactidCommand) -> None:
    done = command("simulate", "own.toml", "--publish")
    assert (done.returncode, "leave out others" in done.stderr) == (2, True)


def test_a_simulated_arm_is_pushed() -> None:
    """After half a minute the contact is within 1 N of zero, and within 1 N of the push of 15 N."""
    arm = SimulatedArm()
    robot = tactid.Manipulator.from_urdf(arm.urdf)
    identifier = tactid.Identifier(robot, TIP, tip=TIP, wrench_offset="yes")

    def force_after(seconds: np.ndarray) -> np.ndarray:
        q, qd, wrench = arm.samples(seconds)
        assert identifier.push(seconds, q, qd, wrench[:, None]) > 0
        contact = identifier.contact_wrench(TIP, "world")
        assert contact is not None
        return contact.values[:3]

    parts = np.split(np.arange(40_600) / RATE_HZ, range(30_000, 40_001, 250))
    forces = [force_after(part) for part in parts]
    assert np.linalg.norm(forces[:-1], axis=1).max() < 1
    np.testing.assert_allclose(forces[-1], [0, 0, 15], atol=1)
    # A tare, after the push, takes nothing away from a payload whose weight is known.
    force_after(np.arange(40_600, 42_000) / RATE_HZ)
    before = identifier.estimate().values[0]
    assert identifier.knows_weight()
    assert identifier.hold_payload()
    assert not identifier.tare()
    assert identifier.hold_payload(False)
    assert identifier.tare()
    assert identifier.estimate().values[0] == pytest.approx(before, abs=1e-3)
