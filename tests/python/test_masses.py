"""A URDF without masses is enough for wrenches; the methods that need more name the link."""

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
        with pytest.raises(tactid.ModelError, match="link `shoulder_link` moves but has no mass"):
            compute(q)
