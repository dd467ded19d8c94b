"""Every robot of the wheel ``example-robot-data`` loads, and moves as Pinocchio's model of it.

Pinocchio uses impossible inertias and masses as they are written, too, so all torques are compared.
"""

from collections import Counter
from importlib.metadata import files
from pathlib import Path

import numpy as np
import pytest

import tactid
from pinocchio_oracle import Oracle, assert_close, random_state

STATES = 3
GRAVITY = [0.3, -1.2, -9.81]


def _name(path: Path) -> str:
    return f"{path.parents[1].name}/{path.name}"


ROBOTS = {
    _name(path): path
    for path in (Path(str(file.locate())) for file in files("example-robot-data") or ())
    if path.suffix == ".urdf"
}

EMPTY = "ur_description/ur3.urdf"

FINDINGS = {
    "alex_description/alex_psyonic_hands.urdf": {"impossible_inertia": 4, "mimic_not_followed": 8},
    "allegro_hand_description/allegro_left_hand.urdf": {"impossible_inertia": 4},
    "allegro_hand_description/allegro_right_hand.urdf": {"impossible_inertia": 4},
    "anymal_b_simple_description/anymal-kinova.urdf": {"impossible_inertia": 1, "part_ignored": 1},
    "anymal_b_simple_description/anymal.urdf": {"impossible_inertia": 1, "part_ignored": 1},
    "anymal_c_simple_description/anymal.urdf": {"impossible_inertia": 5, "part_ignored": 1},
    "b1_description/b1-z1.urdf": {"impossible_inertia": 1},
    "b1_description/b1.urdf": {"impossible_inertia": 1},
    "bolt_description/bolt.urdf": {"impossible_mass": 2, "part_ignored": 1},
    "go1_description/go1.urdf": {"impossible_inertia": 1},
    "human_description/human.urdf": {"massless": 1},
    "hyq_description/hyq_no_sensors.urdf": {"impossible_inertia": 5, "part_ignored": 1},
    "pr2_description/pr2.urdf": {"impossible_inertia": 2},
    "quadruped_description/quadruped.urdf": {"part_ignored": 1},
    "romeo_description/romeo.urdf": {"massless": 1},
    "romeo_description/romeo_laas_small.urdf": {"impossible_inertia": 5, "massless": 1},
    "romeo_description/romeo_small.urdf": {"impossible_inertia": 2},
    "simple_humanoid_description/simple_humanoid.urdf": {"part_ignored": 1},
    "so_arm_description/so101.urdf": {"part_ignored": 1},
    "solo_description/solo.urdf": {"part_ignored": 1},
    "solo_description/solo12.urdf": {"part_ignored": 1},
    "tiago_description/tiago.urdf": {"impossible_inertia": 2},
    "tiago_description/tiago_dual.urdf": {"impossible_inertia": 2, "part_ignored": 2},
    "tiago_description/tiago_no_hand.urdf": {"impossible_inertia": 2},
    "tiago_pro_description/tiago_pro.urdf": {"part_ignored": 3},
}
"""What is reported of each robot on a floating base, by kind and count; nothing of the others."""

ON_THE_BASE = {
    "anymal_b_simple_description/anymal-kinova.urdf": 1,
    "anymal_b_simple_description/anymal.urdf": 1,
    "anymal_c_simple_description/anymal.urdf": 5,
    "b1_description/b1-z1.urdf": 1,
    "b1_description/b1.urdf": 1,
    "go1_description/go1.urdf": 1,
    "hyq_description/hyq_no_sensors.urdf": 1,
    "romeo_description/romeo_laas_small.urdf": 1,
    "tiago_description/tiago.urdf": 2,
    "tiago_description/tiago_dual.urdf": 2,
    "tiago_description/tiago_no_hand.urdf": 2,
}
"""How many of these inertias are on the base, and do not matter where it is fixed."""


def test_the_wheel_has_the_robots() -> None:
    assert len(ROBOTS) == 69
    assert {*FINDINGS, EMPTY} <= {*ROBOTS}


def test_the_empty_file_is_refused() -> None:
    with pytest.raises(tactid.ModelError, match="there is no link"):
        tactid.Manipulator.from_urdf(ROBOTS[EMPTY])


@pytest.mark.parametrize("name", sorted({*ROBOTS} - {EMPTY}))
def test_published_robots_load_and_move_as_with_pinocchio(name: str) -> None:
    rng = np.random.default_rng(1)
    text = ROBOTS[name].read_text()
    for base in ("fixed", "floating"):
        robot = tactid.Manipulator.from_urdf(ROBOTS[name], base)
        expected = Counter(FINDINGS.get(name, {}))
        if base == "fixed":
            expected -= Counter(impossible_inertia=ON_THE_BASE.get(name, 0))
        assert Counter(finding.kind for finding in robot.findings) == expected
        s = random_state(rng, STATES, robot.dof)
        motion = {"base_pose": s.pose, "base_twist": s.twist, "base_acceleration": s.acceleration}
        given = motion if base == "floating" else {}
        torques, wrench = robot.inverse_dynamics(s.q, s.qd, s.qdd, gravity=GRAVITY, **given)
        their_torques, their_wrench = Oracle(text, robot).inverse_dynamics(s, GRAVITY)
        assert_close(torques, their_torques)
        if their_wrench is not None:
            assert_close(wrench, their_wrench)
