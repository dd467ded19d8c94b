"""The recordings that the other tests rely on obey the equations of motion, written out in numpy.

Where one of these fails, the fault is in the recordings and not in tactid.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionMode

from recorded_arm import (
    DOWN,
    FIXED,
    FLOATING,
    JOINTS,
    PAYLOAD,
    PEAK_SPEED,
    TIP,
    TIP_FROM_SENSOR,
    Arm,
    Frames,
    State,
    ur5e,
    wrench_about,
)
from recordings import (
    STORE,
    carried,
    clock,
    imu,
    joint_states,
    state,
    wrenches,
    write_bag,
    write_split_bag,
)

TOLERANCE = 1e-10


def regressor(frames: Frames, gravity: np.ndarray) -> np.ndarray:
    """``[f; n] = Y [m, m c, I about the origin]`` at each time, (N, 6, 10)."""

    def cross(v: np.ndarray) -> np.ndarray:
        x, y, z = v
        return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])

    def product(w: np.ndarray) -> np.ndarray:
        x, y, z = w
        return np.array([[x, y, z, 0, 0, 0], [0, x, 0, y, z, 0], [0, 0, x, 0, y, z]])

    rows = np.zeros((len(frames.pose), 6, 10))
    for k, row in enumerate(rows):
        w, turning = frames.angular_velocity[k], frames.angular_acceleration[k]
        felt = frames.acceleration[k] - frames.pose[k, :3, :3].T @ gravity
        row[:3, 0] = felt
        row[:3, 1:4] = cross(turning) + cross(w) @ cross(w)
        row[3:, 1:4] = -cross(felt)
        row[3:, 4:] = product(turning) + cross(w) @ product(w)
    return rows


def parameters() -> np.ndarray:
    """Of the payload, about the tip's origin, by the parallel axes."""
    m, c = PAYLOAD.mass, PAYLOAD.com
    about_origin = PAYLOAD.inertia + m * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array([m, *(m * c), *about_origin[np.triu_indices(3)]])


@pytest.fixture(scope="module", params=[False, True], ids=["fixed", "floating"])
def moved(request: pytest.FixtureRequest) -> tuple[Arm, State, np.ndarray]:
    arm = FLOATING if request.param else FIXED
    return arm, state(arm), np.zeros(3) if request.param else DOWN


def test_the_payload_is_a_possible_body_without_zeros() -> None:
    moments = np.linalg.eigvalsh(PAYLOAD.inertia)
    assert 0 < moments[0] < moments[1] < moments[2] < moments[0] + moments[1]
    assert np.abs(PAYLOAD.values).min() > 5e-4
    np.testing.assert_allclose(PAYLOAD.spatial.inertia, PAYLOAD.inertia, atol=1e-15)


def test_the_wrench_is_that_of_the_payload(moved: tuple[Arm, State, np.ndarray]) -> None:
    _, s, gravity = moved
    predicted = regressor(s.tip, gravity) @ parameters()
    assert np.abs(s.wrench - predicted).max() < TOLERANCE * np.abs(s.wrench).max()


def test_the_motion_determines_all_ten(moved: tuple[Arm, State, np.ndarray]) -> None:
    """Least squares on what is recorded is exact, and well conditioned in the payload's size."""
    _, s, gravity = moved
    rows = regressor(s.tip, gravity).reshape(-1, 10)
    solved = np.linalg.lstsq(rows, s.wrench.reshape(-1), rcond=None)[0]
    np.testing.assert_allclose(solved, parameters(), rtol=0, atol=TOLERANCE)
    size = np.array([1, *[0.1] * 3, *[0.01] * 6])
    assert np.linalg.cond(rows / size) < 400


def test_velocities_and_accelerations_are_derivatives(
    moved: tuple[Arm, State, np.ndarray],
) -> None:
    arm, _, _ = moved
    h = 1e-4
    before, now, after = (arm.at(np.array([1.0, 7.3, 15.9]) + dt) for dt in (-h, 0, h))
    np.testing.assert_allclose((after.q - before.q) / (2 * h), now.v, atol=1e-6)
    np.testing.assert_allclose((after.v - before.v) / (2 * h), now.a, atol=1e-5)
    for f0, f1, f2 in ((b.base, n.base, a.base) for b, n, a in [(before, now, after)]):
        check_frames(f0, f1, f2, h)
    check_frames(before.tip, now.tip, after.tip, h)


def check_frames(before: Frames, now: Frames, after: Frames, h: float) -> None:
    turn = now.pose[:, :3, :3]

    def in_frame(vectors: np.ndarray) -> np.ndarray:
        return np.einsum("nji,nj->ni", turn, vectors)

    def in_world(frames: Frames, vectors: np.ndarray) -> np.ndarray:
        return np.einsum("nij,nj->ni", frames.pose[:, :3, :3], vectors)

    moved = (after.pose - before.pose) / (2 * h)
    np.testing.assert_allclose(in_frame(moved[:, :3, 3]), now.velocity, atol=1e-6)
    spin = np.einsum("nji,njk->nik", turn, moved[:, :3, :3])
    angular = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    np.testing.assert_allclose(angular, now.angular_velocity, atol=1e-6)
    for name, derivative in (
        ("velocity", now.acceleration),
        ("angular_velocity", now.angular_acceleration),
    ):
        change = in_world(after, getattr(after, name)) - in_world(before, getattr(before, name))
        np.testing.assert_allclose(in_frame(change) / (2 * h), derivative, atol=1e-5)


def test_the_payloads_efforts_are_the_wrench_through_the_jacobian(
    moved: tuple[Arm, State, np.ndarray],
) -> None:
    _, s, _ = moved
    model = pin.buildModelFromXML(ur5e())
    data, tip = model.createData(), model.getFrameId(TIP, pin.BODY)
    expected = [
        pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL).T @ wrench
        for q, wrench in zip(s.q, s.wrench, strict=True)
    ]
    error = np.abs(s.effort - s.unloaded_effort - np.array(expected)).max()
    assert error < TOLERANCE * np.abs(s.effort).max()


def test_joints_move_as_people_drive_them() -> None:
    s = state(FIXED)
    assert list(pin.buildModelFromXML(ur5e()).names[1:]) == JOINTS
    fastest = np.abs(s.v).max(axis=0)
    assert (fastest <= 1.001 * PEAK_SPEED).all()
    assert (fastest > 0.6 * PEAK_SPEED).all()
    limits = np.array([150, 150, 150, 28, 28, 28])
    assert (np.abs(s.effort) < limits).all()


def test_a_sensor_elsewhere_feels_the_same_load() -> None:
    wrench = state(FIXED).wrench[:50]
    there = wrench_about(TIP_FROM_SENSOR, wrench)
    expected = [TIP_FROM_SENSOR.actInv(pin.Force(each)).vector for each in wrench]
    np.testing.assert_allclose(there, expected, atol=1e-12)


def test_an_imu_at_rest_feels_the_reaction_to_gravity() -> None:
    still = Frames(np.eye(4)[None], *np.zeros((4, 1, 3)))
    felt = imu(np.zeros(1), still, DOWN, frame="imu")[0].message.linear_acceleration
    assert (felt.x, felt.y, felt.z) == (0, 0, 9.81)


def test_times_are_whole_nanoseconds_with_jitter() -> None:
    time = clock(20, 437, jitter=0.1, seed=5)
    assert len(time) == 8740
    steps = np.diff(time) * 437
    assert 0.8 <= steps.min() < 0.85
    assert 1.15 < steps.max() <= 1.2
    zero = np.zeros((3, 6))
    late, true = (wrenches(time[:3], zero, delay_s=delay) for delay in (0.037, 0.0))
    delays = [m.stamp_ns - t.stamp_ns for m, t in zip(late, true, strict=True)]
    assert delays == [37_000_000] * 3


@pytest.mark.parametrize("how", ["one", "zstd", "split"])
def test_bags_hold_what_was_logged(tmp_path: Path, how: str) -> None:
    messages = carried(FLOATING, 1.0)
    bag = tmp_path / "bag"
    if how == "split":
        write_split_bag(bag, messages, 11)
        assert len(list(bag.glob("bag_*.mcap"))) == 11
    else:
        chunks = CompressionMode.STORAGE if how == "zstd" else CompressionMode.NONE
        write_bag(bag, messages, compression=chunks)
    expected = sorted(messages, key=lambda m: m.log_ns)
    with AnyReader([bag]) as reader:
        assert reader.message_count == len(expected)
        read = list(reader.messages())
    for (connection, log_ns, data), each in zip(read, expected, strict=True):
        assert (connection.topic, log_ns, data) == (each.topic, each.log_ns, each.data)
        decoded: Any = STORE.deserialize_cdr(data, connection.msgtype)
        assert decoded.__msgtype__ == each.type_name


def test_joint_states_leave_out_what_is_not_given() -> None:
    s = state(FIXED, 1.0)
    first = joint_states(s, joints=JOINTS[::-1])[0].message
    assert first.name == JOINTS[::-1]
    np.testing.assert_array_equal(first.position, s.q[0, ::-1])
    assert len(first.effort) == 0
