"""What the file of a calibration keeps of its recordings: which they are, and what they show."""

from pathlib import Path

import pytest

import tactid
from calibrated_arms import GAINS, KNOWN, OTHER, calibrated, simulated
from conftest import TactidCommand
from recorded_arm import ur5e
from test_cli import assert_refused


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of a simulated arm, its URDF and its calibration."""
    folder = tmp_path_factory.mktemp("again")
    (folder / "arm.urdf").write_text(ur5e(), encoding="utf-8")
    calibrated(folder)
    return folder


def test_a_recording_of_the_calibration_does_not_update_it(
    command: TactidCommand, folder: Path, tmp_path: Path
) -> None:
    loaded, unloaded = simulated(folder, OTHER, 13), simulated(folder, None, 11)
    # Its content decides, not its path.
    copy = tmp_path / "copy"
    copy.symlink_to(unloaded)
    arm = ("--urdf", folder / "arm.urdf", "--calibration", folder / "arm.toml")
    for again in (unloaded, copy):
        done = command("identify", loaded, *arm, "--unloaded", again)
        assert_refused(done, again.name, "has calibrated the arm")
    done = command("identify", loaded, *arm, "--unloaded", simulated(folder, None, 14))
    assert done.returncode == 0, done.stderr


def test_a_payload_that_was_given_is_no_result(folder: Path) -> None:
    arm = tactid.Calibration.read(folder / "arm.toml")
    for payload, seed, is_loaded in ((None, 11, False), (KNOWN, 12, True)):
        log = simulated(folder, payload, seed)
        result = tactid.identify(log, urdf=folder / "arm.urdf", calibration=arm)
        (found,) = (each for each in result.findings if each.kind == "recording_calibrated")
        assert found.data == {"is_loaded": is_loaded}
        assert not result.is_contradicted
    other = tactid.identify(simulated(folder, OTHER, 13), urdf=folder / "arm.urdf", calibration=arm)
    assert "recording_calibrated" not in [each.kind for each in other.findings]


def test_what_contradicts_a_calibration_is_in_every_result(
    command: TactidCommand, folder: Path, tmp_path: Path
) -> None:
    """The efforts are no torques, but count as such."""
    urdf, out = ("--urdf", folder / "arm.urdf"), tmp_path / "wrong.toml"
    unloaded = ("--unloaded", simulated(folder, None, 11))
    done = command("calibrate", *urdf, *unloaded, "--cutoff-hz", 6, "--out", out)
    assert done.returncode == 1, done.stderr
    arm = tactid.Calibration.read(out)
    (found,) = arm.contradictions
    assert found.kind == "gain_contradicted"
    result = tactid.identify(
        simulated(folder, OTHER, 13), urdf=folder / "arm.urdf", calibration=arm
    )
    assert result.is_contradicted
    (repeated,) = (each for each in result.findings if each.kind == "calibration_contradicted")
    assert repeated.data == {**found.data, "assumption": found.kind}
    assert str(found) in str(result)
    done = command("identify", simulated(folder, OTHER, 13), *urdf, "--calibration", out)
    assert done.returncode == 1
    assert "contradicted by its own recordings" in done.stderr


def test_a_gain_far_from_the_given_one_is_named(folder: Path) -> None:
    """The given gains are smaller by a factor of 1.7."""
    arm = tactid.calibrate(
        simulated(folder, None, 11),
        loaded=simulated(folder, KNOWN, 12),
        payload_mass_kg=KNOWN.mass,
        urdf=folder / "arm.urdf",
        cutoff_hz=6.0,
        effort_gain=(GAINS / 1.7).tolist(),
    )
    (found,) = arm.contradictions
    assert found.kind == "gain_improbable"
    assert 0.6 < found.data["size"] < 0.85
    assert found.data["prior_std_dev"] == 0.2
    assert "Usual causes are the URDF of another robot" in str(found)
