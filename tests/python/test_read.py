"""A topic as whole arrays: every number of the log, in its place."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import tactid
from bags import header, joints, message, odometry, vector, wrench, write_bag

NAN = float("nan")


def rosbags_columns(log: Path, topic: str, *fields: str) -> np.ndarray:
    """Fields of every message of a topic, side by side, as `rosbags` reads them."""
    rows = []
    with AnyReader([log], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        connections = [one for one in reader.connections if one.topic == topic]
        for connection, _, data in reader.messages(connections):
            content = reader.deserialize(data, connection.msgtype)
            row: list[float] = []
            for field in fields:
                value = content
                for name in field.split("."):
                    value = getattr(value, name)
                row += np.atleast_1d(value).tolist()
            rows.append(row)
    return np.array(rows)


def xyz(*paths: str) -> list[str]:
    return [f"{path}.{axis}" for path in paths for axis in "xyz"]


def test_every_number_is_read_as_rosbags_reads_it(log: Path) -> None:
    state = tactid.read(log, "/joint_states")
    for name in ("position", "velocity", "effort"):
        np.testing.assert_array_equal(state[name], rosbags_columns(log, "/joint_states", name))
    assert state.names[:2] == ["joint_1", "joint_2"]
    assert state.type_name == "sensor_msgs/msg/JointState"
    stamps = rosbags_columns(
        log, "/joint_states", "header.stamp.sec", "header.stamp.nanosec"
    ).astype(int)
    assert state.start_ns == stamps[0] @ [10**9, 1]
    expected = (stamps @ [10**9, 1] - state.start_ns) * 1e-9
    np.testing.assert_allclose(state.time, expected, rtol=0, atol=1e-12)

    felt = tactid.read(log, "/finger_left/wrench")
    expected = rosbags_columns(log, "/finger_left/wrench", *xyz("wrench.force", "wrench.torque"))
    np.testing.assert_array_equal(felt["wrench"], expected)
    assert felt.frame_id == "finger_left_link"

    moved = tactid.read(log, "/base/odom")
    pose = [*xyz("pose.pose.position", "pose.pose.orientation"), "pose.pose.orientation.w"]
    np.testing.assert_array_equal(moved["pose"], rosbags_columns(log, "/base/odom", *pose))
    twist = xyz("twist.twist.linear", "twist.twist.angular")
    np.testing.assert_array_equal(moved["twist"], rosbags_columns(log, "/base/odom", *twist))
    assert (moved.frame_id, moved.child_frame_id) == ("world", "base_link")

    imu = tactid.read(log, "/base/imu")
    for name in ("angular_velocity", "linear_acceleration"):
        np.testing.assert_array_equal(imu[name], rosbags_columns(log, "/base/imu", *xyz(name)))
    assert set(imu.keys()) == {"orientation", "angular_velocity", "linear_acceleration"}
    # Its covariance says that the orientation is not measured.
    assert np.isnan(imu["orientation"]).all()

    assert tactid.read(log, "/robot_description").text == [tactid.Experiment.paper().urdf]


def test_joints_keep_their_columns_whatever_the_order_of_a_message(tmp_path: Path) -> None:
    bag = write_bag(
        tmp_path / "bag",
        [
            ("/joints", 10, joints(10, ["a", "b"], [1, 2], [10, 20])),
            ("/joints", 20, joints(20, ["b", "a"], [4, 3])),
            ("/joints", 30, joints(30, ["c"], [5], effort=[7])),
            ("/joints", 40, joints(40, ["c", "a", "b"], [8, 6])),
        ],
    )
    found = tactid.read(bag, "/joints")
    assert found.names == ["a", "b", "c"]
    np.testing.assert_array_equal(
        found["position"], [[1, 2, NAN], [3, 4, NAN], [NAN, NAN, 5], [6, NAN, 8]]
    )
    np.testing.assert_array_equal(found["velocity"][0], [10, 20, NAN])
    assert np.isnan(found["velocity"][1:]).all()
    assert np.nansum(found["effort"]) == found["effort"][2, 2] == 7


def test_other_types(tmp_path: Path) -> None:
    body = message(
        "geometry_msgs/msg/Inertia",
        m=1.0,
        com=vector(2, 3, 4),
        ixx=5.0,
        ixy=6.0,
        ixz=7.0,
        iyy=8.0,
        iyz=9.0,
        izz=10.0,
    )
    accel = message("geometry_msgs/msg/Accel", linear=vector(1, 2, 3), angular=vector(4, 5, 6))
    bag = write_bag(
        tmp_path / "bag",
        [
            (
                "/payload",
                10,
                message("geometry_msgs/msg/InertiaStamped", header=header(10, "tip"), inertia=body),
            ),
            (
                "/accel",
                10,
                message("geometry_msgs/msg/AccelStamped", header=header(10, "tip"), accel=accel),
            ),
        ],
    )
    assert tactid.read(bag, "/payload")["values"].tolist() == [list(range(1, 11))]
    assert tactid.read(bag, "/accel")["acceleration"].tolist() == [[1, 2, 3, 4, 5, 6]]
    assert tactid.read(bag, "/accel").frame_id == "tip"


def test_a_stamp_of_zero_is_none_and_log_time_counts(tmp_path: Path) -> None:
    start = 1_700_000_000_123_456_789
    messages = [
        ("/force", start, wrench(0, "tip", [1, 2, 3], [4, 5, 6])),
        ("/force", start + 5_000_000_000, wrench(start + 250_000_000, "tip", [0, 0, 0], [0, 0, 0])),
    ]
    found = tactid.read(write_bag(tmp_path / "bag", messages), "/force")
    assert found.start_ns == start
    assert found.time.tolist() == [0.0, 0.25]


def test_every_thins_out(log: Path) -> None:
    whole = tactid.read(log, "/joint_states")
    few = tactid.read(log, "/joint_states", every=0.02)
    assert len(whole) == 3000
    assert len(few) == 150
    assert few.start_ns == whole.start_ns
    np.testing.assert_array_equal(few["position"], whole["position"][::20])
    assert len(tactid.read(log, "/joint_states", every=1e6)) == 1


def test_every_keeps_each_publisher(tmp_path: Path) -> None:
    """Arm and gripper take turns on one topic: thinning must not lose one of them."""
    arm = [("/joints", t, joints(t, ["arm"], [t])) for t in range(1, 100_000_000, 1_000_000)]
    hand = [("/joints", t + 1, joints(t + 1, ["hand"], [t])) for _, t, _ in arm]
    bag = write_bag(tmp_path / "bag", sorted(arm + hand, key=lambda one: one[1]))
    found = tactid.read(bag, "/joints", every=0.01)
    assert np.isfinite(found["position"]).sum(axis=0).tolist() == [10, 10]


def test_a_truncated_log_is_read_as_far_as_it_goes(tmp_path: Path, log: Path) -> None:
    data = log.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) // 2])
    found = tactid.read(cut, "/joint_states")
    assert 1000 < len(found) < 2000
    assert len(found.damage) == 1
    assert tactid.read(log, "/joint_states").damage == []


def test_what_cannot_be_read_is_refused(tmp_path: Path, log: Path) -> None:
    with pytest.raises(tactid.LogError, match=r"no topic /joints; it has .*/joint_states"):
        tactid.read(log, "/joints")
    with pytest.raises(tactid.LogError, match=r"/tf holds tf2_msgs/msg/TFMessage.*WrenchStamped"):
        tactid.read(log, "/tf")
    with pytest.raises(tactid.LogError, match=r"missing\.mcap"):
        tactid.read(tmp_path / "missing.mcap", "/tf")
    with pytest.raises(tactid.ArgumentError, match='no array "force"; it has wrench'):
        tactid.read(log, "/finger_left/wrench")["force"]
    for every in (-1.0, NAN, float("inf")):
        with pytest.raises(tactid.ArgumentError, match="every"):
            tactid.read(log, "/joint_states", every=every)
    moves = [
        ("/force", 10, wrench(10, "tip", [0, 0, 0], [0, 0, 0])),
        ("/force", 20, wrench(20, "wrist", [0, 0, 0], [0, 0, 0])),
    ]
    with pytest.raises(tactid.LogError, match=r"`tip`.*`wrist`"):
        tactid.read(write_bag(tmp_path / "bag", moves), "/force")


def test_odometry_of_a_child(tmp_path: Path) -> None:
    bag = write_bag(
        tmp_path / "bag", [("/odom", 10, odometry(10, "sensor", [1, 2, 3], [0, 0, 0, 1]))]
    )
    found = tactid.read(bag, "/odom")
    assert found["pose"].tolist() == [[1, 2, 3, 0, 0, 0, 1]]
    assert found["twist"].tolist() == [[1, 2, 3, 4, 5, 6]]
    assert found.child_frame_id == "sensor"
