"""Limits of designed motions: durations, speeds and distances."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import tactid
from conftest import TactidCommand

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


@pytest.mark.parametrize(
    ("keywords", "expected"),
    [
        ({"limit_scale": 1.001}, "`limit_scale` is 1.001, but must be more than 0, and at most 1"),
        ({"least_distance": 0.0601}, "`least_distance` is 0.0601, but must be .* at most 0.06"),
    ],
)
def test_limits_that_cannot_hold_are_refused(keywords: dict[str, float], expected: str) -> None:
    with pytest.raises(tactid.ArgumentError, match=expected):
        _design(duration=2.0, **keywords)


def test_pairs_that_start_too_close_are_reported_with_their_distance() -> None:
    motion = _design(duration=2.0, rate=100.0, least_distance=0.05)
    reduced = [
        finding
        for finding in motion.collision_findings or ()
        if "in place of 50.0 mm" in finding.text
    ]
    pairs = {tuple(finding.pairs[0]) for finding in reduced}
    assert len(pairs) == len(reduced) > 0
    for margin in motion.margins:
        if margin.distance_m is None:
            continue
        is_reduced = any(f"{a} and {b}" in margin.limit for a, b in pairs)
        assert margin.distance_m > (0.0 if is_reduced else 0.0499), margin


@pytest.mark.parametrize("moments", [(0.1, -0.1, 0.1), (0.1, 0.1, 5.0)])
def test_a_payload_that_is_no_body_is_refused(moments: tuple[float, float, float]) -> None:
    payload = tactid.MassProperties(2.0, [0.0, 0.0, 0.1], np.diag(moments))
    robot = tactid.Manipulator.from_urdf(URDF)
    with pytest.raises(tactid.ArgumentError, match="the inertia of the expected payload"):
        tactid.design_excitation(robot, start=START, duration=2.0, payload=payload)


def test_efforts_hold_without_a_payload() -> None:
    motion = _design(duration=2.0, rate=100.0)
    robot = tactid.Manipulator.from_urdf(URDF)
    efforts, _ = robot.inverse_dynamics(motion.q, motion.qd, motion.qdd, gravity=[0, 0, -9.81])
    used = {margin.limit: margin.used for margin in motion.margins}
    limits = [float(each.get("effort", 0)) for each in ElementTree.parse(URDF).iter("limit")]
    for joint in range(6):
        share = np.abs(efforts[:, joint]).max() / limits[joint]
        assert share <= used[f"the effort of joint joint_{joint + 1}"] * (1 + 1e-3)


def test_what_the_urdf_does_not_say_is_printed(command: TactidCommand, tmp_path: Path) -> None:
    """Limits of torque are missing, or are computed without the masses of the links."""
    text = URDF.read_text().replace('effort="', 'no_effort="')
    robot = ElementTree.fromstring(text)
    for link in robot.iter("link"):
        for inertial in link.findall("inertial"):
            link.remove(inertial)
    urdf = tmp_path / "arm.urdf"
    urdf.write_bytes(ElementTree.tostring(robot))
    start = ",".join(map(str, START))
    limits = ("--payload-mass-max", "2", "--payload-box=-0.1,-0.1,0,0.1,0.1,0.2", "--duration", "2")
    motion = ("--tip", "tool0", f"--from={start}", *limits, "--out", tmp_path / "motion")
    done = command("excite", "--urdf", urdf, *motion)
    assert done.returncode == 0, done.stderr
    assert "no effort limit for joint_1, joint_2" in done.stderr
    assert "has no mass" in done.stderr or "have no mass" in done.stderr
