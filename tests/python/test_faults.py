"""What goes wrong in real recordings leaves the result right and is reported, or is refused.

Every recording here is 15 s at 250 Hz of an arm whose payload is known. Where messages are lost or
wrong, the bar is looser than on clean ones by what is lost, and it stands beside each test.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import faulty
from conftest import TactidCommand
from expectations import Identify, Record, assert_within, mentions, remarks_with
from recorded_arm import FIXED, JOINTS, PAYLOAD
from recordings import Logged, carried, carried_in_two_parts, driven, write_bag
from test_cli import assert_refused

TRUTH = PAYLOAD.values
LENGTH = (15.0, 250.0)  # s, Hz
CLEAN = 1e-3
FAULTY = 1e-2


def with_wrench() -> Sequence[Logged]:
    return carried(FIXED, *LENGTH)


def with_efforts() -> Sequence[Logged]:
    return driven(FIXED, *LENGTH)


def reported(record: Record) -> str:
    """The faults and remarks, for a failing test to show."""
    return f"faults: {record['faults']}; remarks: {record['remarks']}"


def test_a_clean_recording_has_no_faults(identify: Identify, tmp_path: Path) -> None:
    for name, messages in (("wrench", with_wrench()), ("efforts", with_efforts())):
        record = identify(write_bag(tmp_path / name, messages))
        assert_within(record, TRUTH, CLEAN)
        assert record["faults"] == []
        assert record["damage"] == []


# Numbers that are none


def test_nan_in_efforts(identify: Identify, tmp_path: Path) -> None:
    messages = with_efforts()
    hit = faulty.every(messages, "/joint_states", 50)
    record = identify(write_bag(tmp_path / "bag", faulty.nan_efforts(messages, hit)))
    assert_within(record, TRUTH, CLEAN)
    assert mentions(record, "/joint_states", "effort", "finite", "nan", count=len(hit)), reported(
        record
    )


def test_nan_in_all_efforts_of_a_joint_is_no_matter_for_the_wrench(
    identify: Identify, command: TactidCommand, tmp_path: Path
) -> None:
    """Drivers fill what they do not measure with NaN."""
    efforts = [m for m in with_efforts() if m.topic == "/joint_states"]
    unmeasured = faulty.nan_efforts(efforts, range(len(efforts)))
    others = [m for m in with_wrench() if m.topic != "/joint_states"]
    bag = write_bag(tmp_path / "bag", [*others, *unmeasured])
    assert_within(identify(bag), TRUTH, CLEAN)
    assert_refused(command("identify", bag, "--method", "effort"), "effort", JOINTS[2])


def test_nan_in_wrenches(identify: Identify, tmp_path: Path) -> None:
    messages = with_wrench()
    hit = faulty.every(messages, "/wrench", 40)
    record = identify(write_bag(tmp_path / "bag", faulty.nan_wrenches(messages, hit)))
    assert_within(record, TRUTH, CLEAN)
    assert mentions(record, "/wrench", "finite", "nan", count=len(hit)), reported(record)


def test_out_of_range_wrenches(identify: Identify, tmp_path: Path) -> None:
    messages = with_wrench()
    hit = faulty.every(messages, "/wrench", 300)
    record = identify(write_bag(tmp_path / "bag", faulty.out_of_range_wrenches(messages, hit)))
    assert_within(record, TRUTH, CLEAN)
    assert mentions(record, "/wrench", count=len(hit)), reported(record)


def test_out_of_range_positions(identify: Identify, tmp_path: Path) -> None:
    messages = with_wrench()
    hit = faulty.every(messages, "/joint_states", 300)
    record = identify(write_bag(tmp_path / "bag", faulty.out_of_range_positions(messages, hit)))
    assert_within(record, TRUTH, FAULTY)
    assert mentions(record, "/joint_states", count=len(hit)), reported(record)


# Joints


def test_joint_states_without_velocities(identify: Identify, tmp_path: Path) -> None:
    messages = faulty.without_velocities(with_wrench())
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, FAULTY)
    assert mentions(record, "/joint_states", "velocit") or remarks_with(record, "velocit"), (
        reported(record)
    )


def test_velocities_of_zero_while_the_joints_move(identify: Identify, tmp_path: Path) -> None:
    messages = faulty.without_velocities(with_wrench())
    derived = identify(write_bag(tmp_path / "derived", messages))
    zero = faulty.zero_velocities(with_wrench())
    record = identify(write_bag(tmp_path / "zero", zero))
    assert record["estimate"] == derived["estimate"]
    (finding,) = record["findings"]
    assert (finding["cause"], finding["severity"]) == ("not_measured", "notes")
    assert finding["joints"] == JOINTS


@pytest.mark.parametrize("source", ["wrench", "efforts"])
def test_joints_in_any_order(identify: Identify, tmp_path: Path, source: str) -> None:
    messages = with_wrench() if source == "wrench" else with_efforts()
    record = identify(write_bag(tmp_path / "bag", faulty.in_changing_order(messages)))
    assert_within(record, TRUTH, CLEAN)


def test_joints_from_two_publishers_on_two_topics(identify: Identify, tmp_path: Path) -> None:
    topics = ("/arm/joint_states", "/wrist/joint_states")
    bag = write_bag(tmp_path / "bag", carried_in_two_parts(FIXED, topics, *LENGTH))
    record = identify(bag, "--joint-topic", topics[0], "--joint-topic", topics[1])
    assert_within(record, TRUTH, CLEAN)


def test_joints_from_two_publishers_on_one_topic(identify: Identify, tmp_path: Path) -> None:
    topics = ("/joint_states", "/joint_states")
    bag = write_bag(tmp_path / "bag", carried_in_two_parts(FIXED, topics, *LENGTH))
    assert_within(identify(bag), TRUTH, CLEAN)


def test_a_joint_that_the_urdf_does_not_have(identify: Identify, tmp_path: Path) -> None:
    for name, messages in (("wrench", with_wrench()), ("efforts", with_efforts())):
        bag = write_bag(tmp_path / name, faulty.with_a_finger(messages))
        record = identify(bag)
        assert_within(record, TRUTH, CLEAN)
        assert mentions(record, "finger_joint"), reported(record)


def test_a_joint_that_nobody_publishes(command: TactidCommand, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", faulty.without_joint(with_wrench(), 4))
    assert_refused(command("identify", bag), JOINTS[4])


# Streams


@pytest.mark.parametrize("topic", ["/wrench", "/joint_states"])
def test_a_stream_that_stops_half_way(identify: Identify, tmp_path: Path, topic: str) -> None:
    bag = write_bag(tmp_path / "bag", faulty.stopped(with_wrench(), topic, 8.0))
    record = identify(bag)
    assert_within(record, TRUTH, FAULTY)
    assert mentions(record, topic), reported(record)
    assert record["duration_s"] == pytest.approx(8.0, abs=0.2)


@pytest.mark.parametrize("topic", ["/wrench", "/joint_states"])
def test_a_gap(identify: Identify, tmp_path: Path, topic: str) -> None:
    """Across it nothing is interpolated: the joints go far in two seconds."""
    bag = write_bag(tmp_path / "bag", faulty.with_gap(with_wrench(), topic, 6.0, 2.0))
    record = identify(bag)
    assert_within(record, TRUTH, CLEAN)
    assert mentions(record, topic, "gap", count=1), reported(record)


def test_a_stream_that_has_ended_before_the_other_begins(
    command: TactidCommand, tmp_path: Path
) -> None:
    messages = faulty.stopped(with_wrench(), "/wrench", 7.0)
    messages = faulty.with_gap(messages, "/joint_states", 0.0, 8.0)
    bag = write_bag(tmp_path / "bag", messages)
    assert_refused(command("identify", bag), "/wrench", "/joint_states")


def test_impacts(identify: Identify, tmp_path: Path) -> None:
    """Five half sines of 200 N and 20 ms; mass times acceleration stays below 40 N."""
    messages = faulty.with_impacts(with_wrench(), [1.5, 4.2, 6.6, 10.1, 13.3])
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, FAULTY)
    words = ("outlier", "impact", "weight", "contact")
    assert any(remarks_with(record, word) for word in words) or mentions(record, "/wrench", *words)


@pytest.mark.parametrize("topic", ["/wrench", "/joint_states"])
def test_out_of_order(identify: Identify, tmp_path: Path, topic: str) -> None:
    """Some messages reach the recorder 50 ms late, with their stamps in order."""
    messages = with_wrench()
    hit = faulty.every(messages, topic, 100)
    bag = write_bag(tmp_path / "bag", faulty.out_of_order(messages, hit, 0.05))
    record = identify(bag)
    assert_within(record, TRUTH, CLEAN)
    assert mentions(record, topic, "order", count=len(hit)), reported(record)


def test_a_file_that_is_not_in_order(identify: Identify, tmp_path: Path) -> None:
    """Joint states first, wrenches after them: log times go back once, stamps never do."""
    bag = write_bag(tmp_path / "bag", with_wrench(), in_order=False)
    assert_within(identify(bag), TRUTH, CLEAN)


def test_stamps_of_zero_on_both(identify: Identify, tmp_path: Path) -> None:
    """The log's time is used, and it is reported."""
    messages = faulty.without_stamps(with_wrench(), "/wrench")
    messages = faulty.without_stamps(messages, "/joint_states")
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, CLEAN)
    mentioned = mentions(record, "/wrench", "stamp") and mentions(record, "/joint_states", "stamp")
    assert mentioned or remarks_with(record, "stamp"), reported(record)


def test_stamps_of_zero_on_one(identify: Identify, tmp_path: Path) -> None:
    messages = with_wrench()
    bag = write_bag(tmp_path / "bag", faulty.without_stamps(messages, "/wrench"))
    record = identify(bag)
    assert_within(record, TRUTH, CLEAN)
    count = sum(m.topic == "/wrench" for m in messages)
    assert mentions(record, "/wrench", "stamp", count=count), reported(record)


@pytest.mark.parametrize("topic", ["/wrench", "/joint_states"])
@pytest.mark.parametrize("shift_s", [3600.0, -3600.0])
def test_stamps_of_another_clock_on_one(
    command: TactidCommand, tmp_path: Path, topic: str, shift_s: float
) -> None:
    messages = faulty.shifted_stamps(with_wrench(), topic, shift_s)
    bag = write_bag(tmp_path / "bag", messages)
    assert_refused(command("identify", bag), f"messages on {topic} with a stamp far from")


def test_stamps_of_another_clock_on_both(identify: Identify, tmp_path: Path) -> None:
    messages = faulty.shifted_stamps(with_wrench(), "/wrench", 3600.0)
    messages = faulty.shifted_stamps(messages, "/joint_states", 3600.0)
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, CLEAN)
    assert record["faults"] == []


def test_a_clock_that_is_set_back(identify: Identify, tmp_path: Path) -> None:
    """What comes after it is not joined to what came before, and nothing else is blamed."""
    messages = with_wrench()
    for topic in ("/wrench", "/joint_states"):
        messages = faulty.shifted_stamps(messages, topic, -3.0, from_s=6.0)
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, CLEAN)
    assert record["findings"] == []
    for topic in ("/wrench", "/joint_states"):
        assert mentions(record, topic, "clock of the stamps went back", count=1), reported(record)
        (left_out,) = (
            fault["count"]
            for fault in record["faults"]
            if (fault["topic"], fault["kind"]) == (topic, "out_of_order")
        )
        assert left_out == pytest.approx((3.0 + 1.0) * 250, abs=1)


# Files


@pytest.mark.parametrize("part", [0.45, 0.8])
def test_a_truncated_file(
    identify: Identify, command: TactidCommand, tmp_path: Path, part: float
) -> None:
    """The ``metadata.yaml`` still describes the whole."""
    bag = faulty.truncate(write_bag(tmp_path / "bag", with_wrench()), part)
    record = identify(bag)
    assert_within(record, TRUTH, FAULTY)
    assert record["damage"], reported(record)
    assert command("identify", bag).stderr.startswith("tactid: note: ")


def test_a_file_that_ends_before_its_first_message(command: TactidCommand, tmp_path: Path) -> None:
    bag = faulty.truncate(write_bag(tmp_path / "bag", with_wrench()), 0.0001)
    assert_refused(command("identify", bag), "bag")


def test_a_part_of_the_bag_that_is_missing(command: TactidCommand, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", with_wrench())
    (bag / "bag.mcap").unlink()
    assert_refused(command("identify", bag), "bag.mcap")


def test_all_at_once(identify: Identify, tmp_path: Path) -> None:
    """NaN, impacts, another order, a finger, late messages and noise in one recording."""
    messages = faulty.noisy(with_wrench(), force=0.1, moment=0.01)
    messages = faulty.with_impacts(messages, [2.5, 9.2])
    messages = faulty.nan_wrenches(messages, hit := faulty.every(messages, "/wrench", 90))
    messages = faulty.out_of_order(messages, faulty.every(messages, "/joint_states", 70), 0.03)
    messages = faulty.in_changing_order(faulty.with_a_finger(messages))
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, 5e-2)
    assert mentions(record, "/wrench", count=len(hit)), reported(record)
    assert np.isfinite(record["delay_s"])
