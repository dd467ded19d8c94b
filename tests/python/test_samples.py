"""What drivers and recorders do to samples: rates, order, wrapped angles, absent axes, stamps."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import faulty
import tactid
from recorded_arm import FIXED, JOINTS, PAYLOAD, SENSOR, TIP, TIP_FROM_SENSOR, ur5e
from recordings import (
    EPOCH_NS,
    Logged,
    clock,
    description,
    header,
    joint_states,
    moving,
    state,
    wrenches,
    write_bag,
)

LENGTH = (12.0, 125.0)  # s, Hz
NOISE = np.array([0.3, 0.3, 0.3, 0.02, 0.02, 0.02])  # N and N m


def noisy(wrench: np.ndarray) -> np.ndarray:
    return np.asarray(wrench + np.random.default_rng(3).normal(size=wrench.shape) * NOISE)


def found(tmp_path: Path, messages: Sequence[Logged]) -> tactid.Identification:
    result = tactid.identify(write_bag(tmp_path / "bag", messages))
    assert isinstance(result, tactid.Identification)
    return result


def kinds(result: tactid.Identification) -> list[str]:
    return [each.kind for each in result.findings]


def half_width_kg(result: tactid.Identification) -> float:
    return float(1.96 * result.estimate.std_devs[0])


def assert_mass(result: tactid.Identification) -> None:
    assert not result.is_contradicted, [str(each) for each in result.findings]
    error = abs(result.estimate.values[0] - PAYLOAD.values[0])
    assert error < 2.0 * half_width_kg(result)


def at_joints() -> tuple[np.ndarray, np.ndarray]:
    """Times and noisy wrenches at the rate of the joints."""
    s = state(FIXED, *LENGTH)
    return s.time, noisy(s.wrench)


def test_a_fast_wrench_is_averaged(tmp_path: Path) -> None:
    """A vibration near the rate of the joints would appear as a slow motion of the wrench."""
    fast = FIXED.at(clock(12.0, 2000.0))
    vibration = np.sin(2.0 * np.pi * 125.4 * fast.time)[:, None] * [4, -3, 6, 0.3, 0.4, 0.2]
    slow = found(tmp_path / "slow", [*moving(FIXED, *LENGTH), *wrenches(*at_joints())])
    shaken = noisy(fast.wrench) + vibration
    averaged = found(tmp_path / "fast", [*moving(FIXED, *LENGTH), *wrenches(fast.time, shaken)])
    assert_mass(averaged)
    assert averaged.findings == []
    assert half_width_kg(averaged) < 0.5 * half_width_kg(slow)


@pytest.mark.parametrize("has_velocity", [True, False])
def test_wrapped_angles_are_continued(tmp_path: Path, has_velocity: bool) -> None:
    s = state(FIXED, *LENGTH)
    # The first joint turns about gravity: its zero changes no wrench.
    q = s.q.copy()
    q[:, 0] += np.pi - np.median(q[:, 0])
    q[:, 0] = (q[:, 0] + np.pi) % (2.0 * np.pi) - np.pi
    assert (np.abs(np.diff(q[:, 0])) > 6.0).sum() > 1
    wrapped = replace(s, q=q)
    messages = [description(), *joint_states(wrapped), *wrenches(s.time, noisy(s.wrench))]
    if not has_velocity:
        messages = [
            replace(each, message=replace(each.message, velocity=np.empty(0)))
            if each.topic == "/joint_states"
            else each
            for each in messages
        ]
    result = found(tmp_path, messages)
    assert_mass(result)
    (finding,) = result.findings
    assert finding.kind == "angles_continued"
    assert finding.data["joints"] == [JOINTS[0]]
    assert finding.severity == "notes"


def test_a_second_publisher_of_the_same_joints_is_the_cause(tmp_path: Path) -> None:
    s = state(FIXED, *LENGTH)
    zeros = replace(s, time=s.time[::10] + 0.003, q=0.0 * s.q[::10], v=0.0 * s.v[::10])
    messages = [*moving(FIXED, *LENGTH), *joint_states(zeros), *wrenches(*at_joints())]
    result = found(tmp_path, messages)
    assert result.is_contradicted
    first, *others = sorted(result.findings, key=lambda each: each.rank)
    assert first.kind == "positions_jump"
    assert "two publishers write to /joint_states" in str(first)
    assert all(each.severity == "notes" for each in others), others


@pytest.mark.parametrize("absent", [0.0, np.nan])
@pytest.mark.parametrize("measured", [[1, 1, 1], [0, 0, 1]])
def test_absent_axes_are_left_out(tmp_path: Path, absent: float, measured: list[int]) -> None:
    """A sensor beside the tip that measures three forces, or one."""
    s = state(FIXED, *LENGTH)
    messages = wrenches(s.time, noisy(s.wrench), frame=SENSOR, tip_from_sensor=TIP_FROM_SENSOR)
    is_absent = [not each for each in [*measured, 0, 0, 0]]

    def without(each: Logged) -> Logged:
        wrench = each.message.wrench
        names = [(part, axis) for part in ("force", "torque") for axis in "xyz"]
        parts = {"force": wrench.force, "torque": wrench.torque}
        for (part, axis), gone in zip(names, is_absent, strict=True):
            if gone:
                parts[part] = replace(parts[part], **{axis: absent})
        return replace(each, message=replace(each.message, wrench=replace(wrench, **parts)))

    result = found(tmp_path, [*moving(FIXED, *LENGTH), *map(without, messages)])
    assert_mass(result)
    assert result.faults == []
    (finding,) = result.findings
    assert finding.kind == "constant_channels"
    assert (finding.data["is_left_out"], finding.severity) == (True, "notes")
    assert len(finding.data["channels"]) == sum(is_absent)
    errors = result.estimate.values[1:4] - PAYLOAD.values[1:4]
    assert (np.abs(errors) < 3.0 * result.estimate.std_devs[1:4]).all()


@pytest.mark.parametrize("rate", [0.4, 4.0])
def test_stamps_of_simulated_time_serve_for_a_topic_without_stamps(
    tmp_path: Path, rate: float
) -> None:
    """The simulation runs at another rate than real time, and only the joints have its stamps.

    At four times real time, the first 200 messages take less time than shows a rate.
    """
    messages = []
    for each in [*moving(FIXED, *LENGTH), *wrenches(*at_joints())]:
        if each.topic == "/robot_description":
            messages.append(each)
            continue
        since_ns = each.stamp_ns - EPOCH_NS
        stamp_ns = 0 if each.topic == "/wrench" else 12_000_000_000 + since_ns
        stamped = replace(each.message, header=header(stamp_ns, each.message.header.frame_id))
        log_ns = EPOCH_NS + round(since_ns / rate) + 100_000
        messages.append(replace(each, log_ns=log_ns, message=stamped))
    result = found(tmp_path, messages)
    assert_mass(result)
    (finding,) = result.findings
    assert finding.kind == "stamps_missing"
    assert finding.data["topics"] == ["/wrench"]
    assert finding.data["clock_rate"] == pytest.approx(rate, rel=1e-3)


def test_late_messages_are_put_in_order(tmp_path: Path) -> None:
    messages = [*moving(FIXED, *LENGTH), *wrenches(*at_joints())]
    ordered = found(tmp_path / "ordered", messages)
    hit = faulty.every(messages, "/joint_states", 70)
    late = found(tmp_path / "late", faulty.out_of_order(messages, hit, 0.3))
    np.testing.assert_allclose(late.estimate.values, ordered.estimate.values, rtol=1e-9)
    (fault,) = late.faults
    assert (fault.kind, fault.count) == ("put_in_order", len(hit))


@pytest.mark.parametrize("absent", [0.0, np.nan])
@pytest.mark.parametrize("sensors", [1, 2])
def test_without_moments_the_forces_of_other_sensors_count(absent: float, sensors: int) -> None:
    """A sensor that moves relative to the tip, or two of which one measures no moments."""
    s = state(FIXED, *LENGTH)
    links = ["wrist_1_link", "wrist_3_link"][-sensors:] if sensors == 2 else ["wrist_1_link"]
    arm = tactid.Manipulator.from_urdf(ur5e())
    at = {link: arm.kinematics(link, s.q).pose for link in [TIP, *links]}
    wrench = np.zeros((len(s.time), sensors, 6))
    for place, link in enumerate(links):
        to_link = np.linalg.inv(at[link]) @ at[TIP]
        force, moment = (
            np.einsum("nij,nj->ni", to_link[:, :3, :3], noisy(s.wrench)[:, k : k + 3])
            for k in (0, 3)
        )
        moment += np.cross(to_link[:, :3, 3], force)
        wrench[:, place] = np.hstack([force, moment]) / sensors
    wrench[:, 0, 3:] = absent
    result = tactid.identify(
        s.time, q=s.q, qd=s.v, wrench=wrench, robot=arm, tip=TIP, sensors=links
    )
    assert result.estimate.body.mass == pytest.approx(PAYLOAD.mass, rel=0.01)
    assert result.estimate.not_identifiable == ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]
    (finding,) = result.findings
    assert finding.kind == "constant_channels"
    assert finding.severity == "notes"
    # Those of the only sensor are all listed; of two, the other one has moments, too.
    assert ("all other moments with them" in str(finding)) == (sensors == 2)
    assert "moment x, moment y and moment z in `wrist_1_link` measured nothing" in str(finding)
