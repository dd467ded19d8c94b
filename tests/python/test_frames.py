"""Frames that a driver names and the robot's description lacks, and wrenches in axes of the base.

A UR5e by Pinocchio, written by rosbags, as in `test_recordings.py`.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from conftest import TactidCommand
from expectations import Identify, assert_within, remarks_with
from recorded_arm import DOWN, FIXED, PAYLOAD, TIP, State
from recordings import (
    Logged,
    header,
    imu,
    message,
    moving,
    quaternion,
    received,
    stamps,
    state,
    static_transform,
    vector,
    wrenches,
    write_bag,
)

TRUTH = PAYLOAD.values
EXACT, ALMOST = 0.01, 0.03
TOOL_FROM_FRAME = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.2, 0.9), np.array([0.02, -0.03, 0.05]))


def transforms(child: str, s: State, parent: str, tip_from_child: pin.SE3) -> list[Logged]:
    """Poses of a frame that moves with the tip, as a controller publishes them on /tf."""
    out = []
    stamp_ns = stamps(s.time)
    for k, (stamp, log_ns) in enumerate(zip(stamp_ns, received(stamp_ns), strict=True)):
        if k % 5 == 0:
            xyzw = pin.SE3ToXYZQUAT(pin.SE3(s.tip.pose[k]) * tip_from_child)
            transform = message(
                "Transform", translation=vector(xyzw[:3]), rotation=quaternion(xyzw[3:])
            )
            stamped = message(
                "TransformStamped",
                header=header(stamp, parent),
                child_frame_id=child,
                transform=transform,
            )
            out.append(Logged("/tf", log_ns, message("TFMessage", transforms=[stamped])))
    return out


def in_world_axes(s: State) -> np.ndarray:
    """The wrenches about the tip's origin, along the axes of the base."""
    turns = s.tip.pose[:, :3, :3]
    parts = [np.einsum("nij,nj->ni", turns, s.wrench[:, k : k + 3]) for k in (0, 3)]
    return np.hstack(parts)


def test_a_frame_that_only_tf_has_is_followed_to_its_link(
    identify: Identify, tmp_path: Path
) -> None:
    s = state(FIXED)
    frame = "tool0_controller"
    messages = [
        *moving(FIXED),
        *transforms(frame, s, "base_link", TOOL_FROM_FRAME),
        *wrenches(s.time, s.wrench, frame=frame, tip_from_sensor=TOOL_FROM_FRAME),
    ]
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, ALMOST)
    assert remarks_with(record, frame, "/tf shows it fixed to")


def test_a_frame_that_moves_with_no_link_is_an_error_that_says_so(
    command: TactidCommand, tmp_path: Path
) -> None:
    s = state(FIXED, 4.0)
    poses = s.tip.pose.copy()
    poses[:, :3, 3] += 0.1 * np.sin(s.time)[:, None]
    wandering = replace(s, tip=replace(s.tip, pose=poses))
    messages = [
        *moving(FIXED, 4.0),
        *transforms("hand", wandering, "base_link", TOOL_FROM_FRAME),
        *wrenches(s.time, s.wrench, frame="hand"),
    ]
    done = command("identify", write_bag(tmp_path / "bag", messages))
    assert done.returncode == 2
    assert "neither a link nor fixed to one by /tf_static or /tf" in " ".join(done.stderr.split())


@pytest.mark.parametrize("kind", ["child", "parent", "siblings", "no transform"])
def test_an_inertial_unit_in_a_frame_of_its_own(
    identify: Identify, command: TactidCommand, tmp_path: Path, kind: str
) -> None:
    """The sensor carries the unit, or they hang on one body."""
    s = state(FIXED)
    sensor_from_unit = TOOL_FROM_FRAME.inverse()
    fixed = {
        "child": [static_transform("unit", sensor_from_unit, "sensor")],
        "parent": [static_transform("sensor", TOOL_FROM_FRAME, "unit")],
        "siblings": [
            static_transform("sensor", TOOL_FROM_FRAME, "mount"),
            static_transform("unit", pin.SE3.Identity(), "mount"),
        ],
        "no transform": [],
    }[kind]
    # The unit is at the tip, and the sensor elsewhere.
    messages = [
        *fixed,
        *wrenches(s.time, s.wrench, frame="sensor", tip_from_sensor=TOOL_FROM_FRAME),
        *imu(s.time, s.tip, DOWN, frame="unit"),
    ]
    bag = write_bag(tmp_path / "bag", messages)
    if kind == "no transform":
        done = command("identify", bag)
        assert done.returncode == 2
        assert "--sensor-frame" in done.stderr
        return
    record = identify(bag, "--tip", "unit")
    assert_within(record, TRUTH, EXACT)
    assert_within(identify(bag, "--tip", "sensor"), moved(TOOL_FROM_FRAME), EXACT)


def moved(tip_from_frame: pin.SE3) -> np.ndarray:
    there = tip_from_frame.actInv(PAYLOAD.spatial)
    parts = [there.inertia[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
    return np.array([there.mass, *there.lever, *parts])


def test_wrenches_along_the_axes_of_the_base(identify: Identify, tmp_path: Path) -> None:
    """Named by the messages, by the option, and by what the data say."""
    s = state(FIXED)

    def bag(name: str, frame: str) -> Path:
        felt = wrenches(s.time, in_world_axes(s), frame=frame)
        return write_bag(tmp_path / name, [*moving(FIXED), *felt])

    record = identify(bag("named", "base_link"))
    assert_within(record, TRUTH, EXACT)
    assert remarks_with(record, "base_link", "does not move with the tool", TIP)
    assert not record["is_contradicted"]
    unnamed = bag("unnamed", "")
    assert_within(identify(unnamed, "--wrench-axes", "base_link"), TRUTH, EXACT)
    wrong = identify(unnamed)
    assert wrong["is_contradicted"]
    (cause,) = remarks_with(wrong, "the axes of")
    assert "as --wrench-axes" in cause


def test_axes_of_no_link_are_an_error(command: TactidCommand, tmp_path: Path) -> None:
    s = state(FIXED, 2.0)
    messages = [*moving(FIXED, 2.0), *wrenches(s.time, s.wrench)]
    bag = write_bag(tmp_path / "bag", messages)
    done = command("identify", bag, "--wrench-axes", "pedestal")
    assert done.returncode == 2
    assert "pedestal" in done.stderr
    assert "axes" in done.stderr
