"""A URDF without masses is enough for wrenches; the methods that need more name what is wrong."""

import re
from pathlib import Path

import numpy as np
import pytest

import tactid
from conftest import TactidCommand


@pytest.fixture
def massless(urdf: str) -> str:
    return re.sub(r"<inertial>.*?</inertial>", "", urdf, flags=re.DOTALL)


def test_wrenches_need_no_masses(massless: str, log: Path) -> None:
    found = tactid.identify(log, urdf=massless)
    assert found.method == "tactile"
    expected = tactid.identify(log).estimate.values
    np.testing.assert_allclose(found.estimate.values, expected, atol=1e-12)


def test_other_methods_name_the_link_and_a_method_without(
    command: TactidCommand, massless: str, log: Path, tmp_path: Path
) -> None:
    message = "the effort method needs the masses of the robot: the floating base `base_link` has"
    with pytest.raises(tactid.IdentificationError, match=message):
        tactid.identify(log, urdf=massless, method="effort")
    (tmp_path / "arm.urdf").write_text(massless)
    done = command("identify", log, "--urdf", "arm.urdf", "--method", "combined")
    assert done.returncode == 2
    assert "or use the tactile method, which needs none; --method chooses the method" in done.stderr


def test_dynamics_need_masses_and_kinematics_do_not(massless: str) -> None:
    robot = tactid.Manipulator.from_urdf(massless, "fixed")
    q = np.zeros(robot.dof)
    assert robot.kinematics("tool0", q).pose.shape == (4, 4)
    for compute in (robot.inverse_dynamics, robot.momentum, robot.base_acceleration):
        with pytest.raises(tactid.ModelError, match="no link that moves has a mass, from `sho"):
            compute(q)


@pytest.fixture
def defective(urdf: str) -> str:
    """The robot with an impossible inertia and a number that is missing."""
    link = re.search(r'<link name="forearm_link">.*?</link>', urdf, flags=re.DOTALL)
    assert link
    changed = re.sub(r'ixx="[^"]*"', 'ixx="9"', link[0])
    hand = re.search(r'<link name="gripper_link">.*?</link>', urdf, flags=re.DOTALL)
    assert hand
    without = re.sub(r'izz="[^"]*"', 'izz="unknown"', hand[0])
    return urdf.replace(link[0], changed).replace(hand[0], without)


def test_defects_are_reported_by_the_methods_that_they_matter_for(
    command: TactidCommand, defective: str, log: Path, tmp_path: Path
) -> None:
    robot = tactid.Manipulator.from_urdf(defective)
    impossible, unknown = robot.findings
    assert (impossible.kind, impossible.data["link"]) == ("impossible_inertia", "forearm_link")
    assert (unknown.kind, unknown.data["attributes"]) == ("unknown_numbers", ["izz"])
    kinds = {"impossible_inertia", "unknown_numbers"}
    runs = (("effort", "least-squares"), ("combined", "least-squares"), ("joint-sensing", "nlms"))
    for method, estimator in runs:
        found = tactid.identify(log, urdf=defective, method=method, estimator=estimator)
        assert kinds <= {finding.kind for finding in found.findings}
    assert not kinds & {finding.kind for finding in tactid.identify(log, urdf=defective).findings}
    (tmp_path / "arm.urdf").write_text(defective)
    done = command("identify", log, "--urdf", "arm.urdf", "--method", "effort")
    said = " ".join((done.stdout + done.stderr).split())
    assert "Link `forearm_link`: no rigid body has its inertia, with the principal moments" in said


def test_the_online_identifier_reports_defects_before_the_first_sample(defective: str) -> None:
    robot = tactid.Manipulator.from_urdf(defective, base="floating")
    for method in ("joint-sensing", "effort"):
        identifier = tactid.Identifier(robot, tip="tool0", method=method)
        kinds = [finding.kind for finding in identifier.findings()]
        assert kinds == ["impossible_inertia", "unknown_numbers"]
