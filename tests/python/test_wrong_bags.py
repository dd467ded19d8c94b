"""Wrong input in a bag: the command line and Python report the same, or refuse it."""

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

import faulty
import tactid
from conftest import TactidCommand
from expectations import Identify
from recorded_arm import FIXED, FLOATING, JOINTS, SENSOR, TIP_FROM_SENSOR
from recordings import (
    EPOCH_NS,
    Logged,
    carried,
    description,
    driven,
    header,
    joint_states,
    moving,
    odometry,
    state,
    wrenches,
    write_bag,
)
from test_cli import assert_refused

SHORT = (6.0, 100.0)
WRONG = (
    "negative_mass",
    "velocities_contradicted",
    "twist_contradicted",
    "positions_beyond_limits",
    "efforts_beyond_limits",
    "efforts_unmeasured",
    "saturated",
    "wrong_assumption",
)
FIRST_OFFSET = np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture
def found(identify: Identify, tmp_path: Path) -> Any:
    """``found(messages, kind, **options)`` returns the finding that both ways report."""

    def run(messages: Iterable[Logged], kind: str, **options: Any) -> dict[str, Any]:
        bag = write_bag(tmp_path / "bag", messages)
        given = [
            entry
            for name, value in options.items()
            for entry in (f"--{name.replace('_', '-')}", *np.atleast_1d(value))
        ]
        record = identify(bag, *given)
        result = tactid.identify(bag, **options)
        assert json.loads(result.to_json())["findings"] == [
            each | {"text": str(noticed)}
            for each, noticed in zip(record["findings"], result.findings, strict=True)
        ]
        (finding,) = (each for each in record["findings"] if each["kind"] == kind)
        assert finding["text"] in record["remarks"]
        wrong = kind in WRONG
        causes = ("load_unexplained", "wrong_assumption")
        unexplained = any(each["kind"] in causes for each in record["findings"])
        assert record["is_contradicted"] == result.is_contradicted
        assert record["is_contradicted"] == wrong or (unexplained and not wrong)
        # The first line says what shows a result to be wrong.
        assert not wrong or finding["text"] == record["remarks"][0]
        return finding  # type: ignore[no-any-return]

    return run


def test_a_twist_in_the_axes_of_the_world(found: Any) -> None:
    s = state(FLOATING, *SHORT)
    turn = s.base.pose[:, :3, :3]
    velocity, rate = (
        np.einsum("nij,nj->ni", turn, own) for own in (s.base.velocity, s.base.angular_velocity)
    )
    base = odometry(s.time, replace(s.base, velocity=velocity, angular_velocity=rate))
    messages = [description(), *joint_states(s), *base, *wrenches(s.time, s.wrench)]
    finding = found(messages, "twist_contradicted")
    assert finding["source"] == "/odom"
    assert finding["better_axes"] == "world"


def test_a_twist_that_is_not_measured_is_the_only_cause(tmp_path: Path) -> None:
    """Zeros of the joints would explain some of the missing accelerations of the base."""
    experiment = (
        "duration_s = 5.0\n"
        "[payload]\nmass_kg = 20.0\ncenter_of_mass_m = [0.3, 0.0, 0.1]\n"
        "inertia_kg_m2 = [1.0, 0.0, 0.0, 2.0, 0.0, 1.0]\n"
        '[excitation]\nmode = "together"\n'
    )
    for joint, frequency in (("joint_3", 1.0), ("joint_5", 1.13), ("joint_6", 1.26)):
        drive = f'name = "{joint}"\namplitude_rad_s2 = 4.0\nfrequency_hz = {frequency}\n'
        experiment += f"[[excitation.joints]]\n{drive}"
    log, unmeasured = tmp_path / "run.mcap", tmp_path / "unmeasured.mcap"
    tactid.simulate(tactid.Experiment.from_toml(experiment), log)
    with log.open("rb") as source, unmeasured.open("wb") as target:
        writer = Writer(target)
        writer.start(profile="ros2")
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(source).iter_messages():
            if channel.id not in channels:
                assert schema is not None
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                encoding = channel.message_encoding
                channels[channel.id] = writer.register_channel(channel.topic, encoding, known)
            data = message.data
            if channel.topic == "/base/odom":  # the six numbers before the covariance of 36
                data = data[: -42 * 8] + bytes(6 * 8) + data[-36 * 8 :]
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time)
        writer.finish()
    kinds = [each.kind for each in tactid.identify(unmeasured).findings]
    assert kinds == ["wrenches_summed", "twist_contradicted"]


def test_velocities_in_degrees(found: Any) -> None:
    s = state(FIXED, *SHORT)
    fast = replace(s, v=np.rad2deg(s.v))
    messages = [description(), *joint_states(fast), *wrenches(s.time, s.wrench)]
    finding = found(messages, "velocities_contradicted")
    assert finding["cause"] == "degrees"


def test_all_of_the_motion_in_degrees(found: Any) -> None:
    """Velocities fit the positions then; only the limits of the URDF show it."""
    s = state(FIXED, *SHORT)
    turned = replace(s, q=np.rad2deg(s.q), v=np.rad2deg(s.v))
    messages = [description(), *joint_states(turned), *wrenches(s.time, s.wrench)]
    finding = found(messages, "positions_beyond_limits")
    assert finding["are_degrees"] is True


def test_efforts_in_newton_millimetres(found: Any) -> None:
    s = state(FIXED, *SHORT)
    messages = [description(), *joint_states(s, effort=1000.0 * s.effort)]
    finding = found(messages, "efforts_beyond_limits")
    assert finding["limits_are_equal"] is False
    assert finding["effort"] > 5.0 * finding["limit"]
    assert "--effort-gain" in finding["text"]


@pytest.mark.parametrize("step", [0.0, 0.1])
def test_a_force_that_exceeds_the_range_of_its_sensor(found: Any, step: float) -> None:
    """It is named first, and nothing is concluded from what it explains."""
    s = state(FIXED, *SHORT)
    measured = np.round(s.wrench / step) * step if step else s.wrench.copy()
    measured[:, 0] = np.clip(measured[:, 0], -6.0, 6.0)
    shares = [np.mean(measured[:, 0] == limit) for limit in (6.0, -6.0)]
    finding = found([*moving(FIXED, *SHORT), *wrenches(s.time, measured)], "saturated")
    assert finding["channels"] == ["force x"] * 2
    assert finding["limits"] == [6.0, -6.0]
    assert finding["fractions"] == pytest.approx(shares, abs=0.01)
    assert finding["source"] == "/wrench"


def test_efforts_that_a_drive_limits(found: Any) -> None:
    s = state(FIXED, *SHORT)
    limit = 0.7 * np.abs(s.effort[:, 1]).max()
    limited = s.effort.copy()
    limited[:, 1] = np.clip(limited[:, 1], -limit, limit)
    finding = found([description(), *joint_states(s, effort=limited)], "saturated")
    assert set(finding["channels"]) == {JOINTS[1]}
    assert f"the effort of {JOINTS[1]} at " in finding["text"]


def test_efforts_that_a_driver_does_not_measure(
    found: Any, command: TactidCommand, tmp_path: Path
) -> None:
    s = state(FIXED, *SHORT)
    measured = s.effort * [1, 0, 1, 1, 1, 0]
    finding = found([description(), *joint_states(s, effort=measured)], "efforts_unmeasured")
    assert finding["joints"] == [JOINTS[1], JOINTS[5]]
    messages = [description(), *joint_states(s, effort=0.0 * s.effort)]
    bag = write_bag(tmp_path / "none", messages)
    assert_refused(command("identify", bag), "/joint_states", "effort", "zero in all samples")


def test_a_channel_that_is_not_measured(found: Any) -> None:
    s = state(FIXED, *SHORT)
    messages = [*moving(FIXED, *SHORT), *wrenches(s.time, s.wrench * [1, 1, 1, 1, 0, 1])]
    finding = found(messages, "constant_channels")
    assert finding["channels"] == ["moment y"]
    assert finding["is_zero"] is True


def test_a_wrench_that_stops(identify: Identify, tmp_path: Path) -> None:
    s = state(FIXED, *SHORT)
    for name, fraction in (("half", 0.5), ("end", 0.8)):
        stopped = s.wrench.copy()
        last = int(fraction * len(stopped)) - 1
        stopped[last:] = stopped[last]
        messages = [*moving(FIXED, *SHORT), *wrenches(s.time, stopped)]
        record = identify(write_bag(tmp_path / name, messages))
        (finding,) = (each for each in record["findings"] if each["kind"] == "constant_channels")
        assert finding["since_s"] == pytest.approx(s.time[last], abs=1e-3)
        assert finding["is_most"] == (name == "half")
        assert name == "end" or record["remarks"][0] == finding["text"]


def test_an_offset_of_two_newtons_with_another_tip(found: Any) -> None:
    s = state(FIXED, *SHORT)
    felt = wrenches(s.time, s.wrench, frame=SENSOR, tip_from_sensor=TIP_FROM_SENSOR)
    shifted = faulty.noisy(faulty.offset(felt, FIRST_OFFSET), force=0.05, moment=0.005)
    messages = [*moving(FIXED, *SHORT), *shifted]
    finding = found(messages, "wrong_assumption", tip="wrist_3_link", wrench_offset="no")
    assert finding["cause"] == "offset"
    assert finding["frame"] == SENSOR
    np.testing.assert_allclose(finding["values"][:3], FIRST_OFFSET[:3], atol=0.2)


def test_a_wrench_of_the_opposite_sign(found: Any) -> None:
    s = state(FIXED, *SHORT)
    finding = found([*moving(FIXED, *SHORT), *wrenches(s.time, -s.wrench)], "negative_mass")
    assert "--wrench-acts-on" in finding["text"]


def test_gravity_of_the_opposite_sign(found: Any) -> None:
    finding = found(carried(FIXED, *SHORT), "wrong_assumption", gravity=(0.0, 0.0, 9.81))
    assert finding["cause"] == "gravity"
    assert finding["values"] == pytest.approx([0.0, 0.0, -9.81], abs=0.05)


def test_friction(found: Any) -> None:
    finding = found(driven(FIXED, *SHORT, rough=True), "load_unexplained")
    assert finding["has_unloaded"] is False
    assert "use --unloaded" in finding["text"]


def test_a_wrench_without_any_motion(command: TactidCommand, tmp_path: Path) -> None:
    s = state(FIXED, *SHORT)
    bag = write_bag(tmp_path / "bag", [description(), *wrenches(s.time, s.wrench)])
    what = "the log has wrenches but no motion"
    assert_refused(command("identify", bag), what)
    with pytest.raises(tactid.IdentificationError, match=what):
        tactid.identify(bag)


@pytest.mark.parametrize("factor", [10**6, 5 * 10**7])
def test_stamps_in_another_unit(command: TactidCommand, tmp_path: Path, factor: int) -> None:
    """A driver that writes microseconds, or still smaller units, into the seconds of its stamps."""

    def stamped(each: Logged) -> Logged:
        late_ns = (each.stamp_ns - EPOCH_NS) * factor
        changed = header(EPOCH_NS + late_ns, each.message.header.frame_id)
        return replace(each, message=replace(each.message, header=changed))

    messages = [description(), *map(stamped, carried(FIXED, *SHORT)[1:])]
    bag = write_bag(tmp_path / "bag", messages)
    what = "stamps must be seconds and nanoseconds of the clock of the recorder"
    assert_refused(command("identify", bag), what)
    with pytest.raises(tactid.IdentificationError, match=what):
        tactid.identify(bag)


def test_a_path_that_does_not_exist_says_what_may_be_meant(
    command: TactidCommand, tmp_path: Path
) -> None:
    (tmp_path / "recording").mkdir()
    bag = tmp_path / "all" / "run1"
    bag.mkdir(parents=True)
    (bag / "metadata.yaml").touch()
    done = command("info", "recordng")
    assert done.returncode == 2
    assert "recordng" in done.stderr
    assert "did you mean recording?" in done.stderr
    done = command("info", tmp_path / "all")
    assert done.returncode == 2
    assert f"metadata.yaml nor an .mcap or .db3 file, as a bag does; did you mean {bag}?" in (
        done.stderr
    )
