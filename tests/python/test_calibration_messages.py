"""What a user of calibrations does wrong is named: the recording, the joint or the option."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import tactid
from calibrated_arms import GAINS, KNOWN, OTHER, calibrated, simulated, write
from recorded_arm import ur5e
from tactid._cli import cli
from tactid._show import calibration_text
from tactid._show.combination_text import combined_remarks
from tactid._show.remarks import remarks

BASE = 0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("messages")
    (folder / "arm.urdf").write_text(ur5e(), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def arm(folder: Path) -> tactid.Calibration:
    return calibrated(folder)


def changed(log: Path, path: Path, **factors: np.ndarray) -> Path:
    """A recording with positions, velocities or efforts times a factor for each joint."""
    joints = tactid.read(log, "/joint_states")
    names = ("position", "velocity", "effort")
    values = [np.array(joints[name]) * factors.get(name, 1.0) for name in names]
    return write(path, list(joints.names), np.array(joints.time), *values)


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one line of an error of ``tactid calibrate``."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["tactid", "calibrate", *map(str, arguments)])
        assert cli.run() == 2, arguments
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_the_command_names_what_is_wrong(
    folder: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    unloaded, loaded = simulated(folder, None, 11), simulated(folder, KNOWN, 12)
    link = tmp_path / "link"
    link.symlink_to(unloaded)
    copy = Path(shutil.copytree(unloaded, tmp_path / "copy"))
    run = ("--urdf", folder / "arm.urdf", "--cutoff-hz", 6, "--out", tmp_path / "out.toml")
    alone = (*run, "--unloaded", unloaded)
    both = (*alone, "--loaded", loaded)
    degrees = changed(unloaded, tmp_path / "degrees", position=np.full(6, 180 / np.pi))
    swapped = ("--unloaded", loaded, "--loaded", unloaded, "--payload-mass-kg", 2.8)
    cases: list[tuple[tuple[object, ...], list[str]]] = [
        ((*alone, "--gain-std-dev", "0.2"), ["--gain-std-dev is '0.2'", "5%"]),
        ((*alone, "--gain-std-dev", "5%,5%"), ["--gain-std-dev", "one percentage"]),
        ((*alone, "--gain-std-dev", "1000%"), ["less than 100%", "positive", "give rough gains"]),
        ((*alone, "--gravity", "0,0,-9", "--gravity", "0,0,-8"), ["--gravity is given 2 times"]),
        ((*alone, "--hold-out", loaded), [f"{loaded}: ", "holds a payload of 2."]),
        ((*alone, "--unloaded", loaded), [f"{loaded}: ", "payload that the other ones do not"]),
        ((*alone, "--gravity", "0,0,-9810"), ["--gravity", "between -50 and 50 m/s²"]),
        ((*alone, "--unloaded", copy), [f"{unloaded} and {copy} are the same", "noise"]),
        ((*alone, "--unloaded", link), [str(link), "twice", "noise"]),
        ((*alone, "--hold-out", unloaded), ["twice", "no independent check"]),
        ((*alone, "--loaded", unloaded, "--payload-mass-kg", 1), ["twice", "payload or not"]),
        (
            (*both, "--payload-mass-kg", "4,8"),
            ["--payload-mass-kg has 2 values for 1 loaded recording:"],
        ),
        ((*both, "--payload-mass-kg", "x"), ["--payload-mass-kg is 'x': expected numbers"]),
        ((*run, "--unloaded", degrees), ["degrees", "limits", "_joint", "rad"]),
        ((*run, *swapped), ["negative", "`shoulder_lift_joint`", "exchanged"]),
        (
            (*alone, "--rename-joints", "elbow_joint=wrist_1_joint,wrist_2_joint=wrist_1_joint"),
            ["`elbow_joint` and `wrist_2_joint`", "`wrist_1_joint`"],
        ),
    ]
    for arguments, parts in cases:
        line = refused(capsys, *arguments)
        assert all(part in line for part in parts), (parts, line)
    assert not (tmp_path / "out.toml").exists()


@pytest.mark.parametrize(
    "amperes",
    [
        np.full(6, 0.01),
        np.array([0.08, 0.09, 0.11, 0.3, 0.33, 0.4]),
    ],
)
def test_gains_of_currents_are_printed_as_an_option(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], amperes: np.ndarray
) -> None:
    """The message has the gains that calibrate the arm when they are given."""
    logs = simulated(folder, None, 11), simulated(folder, KNOWN, 12)
    names = ("unloaded", "loaded")
    unloaded, loaded = (
        changed(log, tmp_path / name, effort=amperes) for log, name in zip(logs, names, strict=True)
    )
    urdf = folder / "arm.urdf"
    run = ("--unloaded", unloaded, "--loaded", loaded, "--payload-mass-kg", KNOWN.mass)
    line = refused(capsys, *run, "--urdf", urdf, "--cutoff-hz", 6, "--out", tmp_path / "out.toml")
    before, flag, gains = line.partition("--effort-gain ")
    assert flag, line
    assert "such as currents" in before
    given = [float(gain) for gain in gains.split(",")]
    found = tactid.calibrate(
        unloaded,
        loaded=loaded,
        payload_mass_kg=KNOWN.mass,
        urdf=urdf,
        cutoff_hz=6.0,
        effort_gain=given,
    )
    assert np.allclose(found.effort_gain * found.gain * amperes, GAINS, rtol=0.02)


def test_a_mass_in_grams_proposes_no_gains(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = ("--unloaded", simulated(folder, None, 11), "--loaded", simulated(folder, KNOWN, 12))
    given = (
        "--payload-mass-kg",
        1000 * KNOWN.mass,
        "--urdf",
        folder / "arm.urdf",
        "--cutoff-hz",
        6,
    )
    line = refused(capsys, *logs, *given, "--out", tmp_path / "out.toml")
    assert "in kg" in line
    assert "--effort-gain" not in line


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ({"unloaded": 3}, ["`unloaded` is 3", "path"]),
        ({"gain_std_dev": [0.1, 0.2]}, ["`gain_std_dev`", "a number"]),
        ({"loaded": "log", "payload_mass_kg": "4"}, ["`payload_mass_kg`", "number"]),
        ({"loaded": {"log": 4.0}}, ["`loaded[0]` has no `time`"]),
        (
            {"loaded": "log", "payload_mass_kg": 4.0, "payload_mass_std_dev_kg": [0.1]},
            ["`payload_mass_std_dev_kg`", "a number"],
        ),
    ],
)
def test_an_argument_of_the_wrong_kind_is_named(
    arguments: dict[str, object], parts: list[str]
) -> None:
    with pytest.raises(tactid.ArgumentError) as error:
        tactid.calibrate(**{"unloaded": "log", **arguments})  # type: ignore[arg-type]
    assert all(part in str(error.value) for part in parts), error.value


def test_a_joint_that_was_still_at_the_calibration_is_named(folder: Path, tmp_path: Path) -> None:
    urdf = folder / "arm.urdf"
    joints = tactid.read(simulated(folder, None, 21), "/joint_states")
    time, effort = np.array(joints.time), np.array(joints["effort"])
    position, velocity = np.array(joints["position"]), np.array(joints["velocity"])
    position[:, BASE], velocity[:, BASE] = position[0, BASE], 0.0
    effort[:, BASE] = 0.1 * np.random.default_rng(21).normal(size=len(time))
    still = write(tmp_path / "still", list(joints.names), time, position, velocity, effort)
    arm = tactid.calibrate(
        still, urdf=urdf, cutoff_hz=6.0, effort_gain=GAINS.tolist(), gain_std_dev=0.0
    )
    assert [each.data["joint"] for each in arm.shortages if each.kind == "joint_still"] == [
        "shoulder_pan_joint"
    ]
    of_joint = {row[0]: row[3:7] for row in calibration_text.rows(arm)}
    assert of_joint["shoulder_pan_joint"] == ["–"] * 4
    assert "–" not in of_joint["elbow_joint"]
    result = tactid.identify(simulated(folder, OTHER, 13), urdf=urdf, calibration=arm)
    named = {each.kind: each.data.get("joint") for each in result.findings}
    assert named.get("joint_uncalibrated") == "shoulder_pan_joint"
    assert named.get("load_unexplained") != "shoulder_pan_joint"
    assert "shoulder_pan_joint moves, but did not move when the arm was calibrated" in str(result)


def test_an_empty_arm_holds_nothing(folder: Path, arm: tactid.Calibration) -> None:
    urdf = folder / "arm.urdf"
    result = tactid.identify(simulated(folder, None, 14), urdf=urdf, calibration=arm)
    (found,) = (each for each in result.findings if each.kind == "nothing_held")
    assert abs(found.data["mass_kg"]) < 3 * found.data["std_dev_kg"] < 0.1
    assert "Rotate" not in str(result)


def test_another_motion_is_no_advice_where_payloads_differ(
    folder: Path, arm: tactid.Calibration
) -> None:
    logs = [simulated(folder, KNOWN, 16), simulated(folder, OTHER, 13)]
    both = tactid.identify(logs, urdf=folder / "arm.urdf", calibration=arm)
    assert not both.agreement.agree
    remarks = " ".join(combined_remarks(both))
    assert "The recordings differ so much that nothing is certain of mass" in remarks
    assert "Accelerate" not in remarks
    assert "Rotate" not in remarks


def test_a_gain_with_a_wide_interval_stays_uncertain(folder: Path) -> None:
    """Without a weight, the links of the wrist hardly show the gains of their joints."""
    unloaded, urdf = simulated(folder, None, 11), folder / "arm.urdf"
    arm = tactid.calibrate(unloaded, urdf=urdf, cutoff_hz=6.0, gain_std_dev=0.2)
    uncertain = {
        each.data["joint"]: each.data["std_dev"]
        for each in arm.shortages
        if each.kind == "gain_uncertain"
    }
    relative = dict(zip(arm.joints, arm.gain_std_dev / arm.gain, strict=True))
    assert {name for name, std_dev in relative.items() if std_dev > 0.1} == set(uncertain)
    assert uncertain
    for name, std_dev in uncertain.items():
        assert std_dev == pytest.approx(relative[name])


def test_a_calibration_without_an_unloaded_recording_says_so(folder: Path) -> None:
    loaded, urdf = simulated(folder, KNOWN, 12), folder / "arm.urdf"
    found = tactid.calibrate([], loaded=loaded, payload_mass_kg=2.8, urdf=urdf, cutoff_hz=6.0)
    assert "No recording is without a payload" in str(found)
    assert "simulated12, loaded" in repr(found.recordings[0])


@pytest.mark.usefixtures("arm")
def test_a_calibration_of_another_tip_is_named(folder: Path, tmp_path: Path) -> None:
    text = (folder / "arm.toml").read_text(encoding="utf-8")
    other = tmp_path / "other.toml"
    other.write_text(text.replace('tool = "tool0"', 'tool = "panda_link8"'), encoding="utf-8")
    with pytest.raises(tactid.CalibrationError, match="tool `panda_link8`"):
        tactid.identify(simulated(folder, OTHER, 13), urdf=folder / "arm.urdf", calibration=other)


def test_efforts_that_are_noisier_are_one_sentence() -> None:
    data = {"joints": ["a", "b"], "noise_ratios": [3.26, 9873.2]}
    sentence = str(tactid.Finding("effort_noisier", data))
    assert sentence.startswith("The efforts of a and b are 3.3 and more than 1000 times as noisy")


def test_degrees_are_the_first_cause_that_is_named(
    arm: tactid.Calibration, folder: Path, tmp_path: Path
) -> None:
    """The gains, the sign and the friction are off because the positions are in degrees."""
    log = simulated(folder, OTHER, 13)
    factor = np.full(6, 180 / np.pi)
    for name, more in (("q", {}), ("qd", {"velocity": factor})):
        degrees = changed(log, tmp_path / name, position=factor, **more)
        result = tactid.identify(degrees, urdf=folder / "arm.urdf", calibration=arm)
        assert result.is_contradicted
        assert "They are in degrees, but must be in rad" in remarks(result)[0]
