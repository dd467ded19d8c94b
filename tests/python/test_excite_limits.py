"""Limits of designed motions: durations, speeds and distances."""

from pathlib import Path

import pytest

import tactid

URDF = Path(__file__).parents[2] / "crates" / "sim" / "robots" / "tactid.urdf"
START = [0.0, -1.2, 1.6, -0.4, 1.5, 0.0]
BOX = [[-0.1, -0.1, 0.0], [0.1, 0.1, 0.2]]


def _design(**keywords: object) -> tactid.DesignedMotion:
    robot = tactid.Manipulator.from_urdf(URDF)
    given = {"start": START, "payload_mass_max": 2.0, "payload_box": BOX, **keywords}
    return tactid.design_excitation(robot, **given)  # type: ignore[arg-type]


def test_a_motion_near_the_robot_itself_uses_the_limits_of_its_joints() -> None:
    motion = _design(duration=10.0, rate=100.0)
    used = {margin.limit: margin.used for margin in motion.margins}
    assert any("distance" in limit and share > 0.95 for limit, share in used.items())
    for joint in range(1, 7):
        assert used[f"the acceleration of joint joint_{joint}"] > 0.99
