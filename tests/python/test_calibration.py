"""An arm is calibrated, and payloads are identified with it: the command, Python, and the file."""

import contextlib
import dataclasses
import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import tactid
from calibrated_arms import (
    COULOMB,
    FRANKA,
    GAINS,
    KNOWN,
    LOAD_FRICTION,
    OTHER,
    UR5,
    UR10,
    VISCOUS,
    Measured,
    calibrated,
    halves,
    simulated,
    write,
)
from conftest import TactidCommand
from expectations import Identify, half_widths_of, values_of
from recorded_arm import Arm, body, ur5e
from recordings import clock
from tactid._base.output_files import replaced_outputs
from tactid._cli import cli
from tactid._documents import calibration_json
from tactid._documents.finding_schemas import calibration_finding_schema, kinds_of
from tactid._results.calibration_data import CalibrationData
from test_cli import assert_refused

ARMS = {"ur10": UR10, "panda": FRANKA}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of a simulated arm, its URDF and its calibration."""
    folder = tmp_path_factory.mktemp("simulated")
    (folder / "arm.urdf").write_text(ur5e(), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def arm(folder: Path) -> tactid.Calibration:
    """The simulated arm, calibrated with one payload of which the mass is known."""
    return calibrated(folder)


def test_gains_and_friction_of_a_simulated_arm_are_found(arm: tactid.Calibration) -> None:
    assert np.abs(arm.gain / GAINS - 1).max() < 0.02
    assert (np.abs(arm.gain - GAINS) < 3 * arm.gain_std_dev).all()
    # The Coulomb friction is that at the rms torque, which the load friction is relative to.
    torque = Arm(seed=11).at(clock(30.0, 25.0)).unloaded_effort
    at_load = COULOMB + LOAD_FRICTION * np.sqrt(np.mean(torque**2, axis=0))
    np.testing.assert_allclose(arm.coulomb * arm.gain, at_load, rtol=0.15)
    np.testing.assert_allclose(arm.viscous * arm.gain, VISCOUS, rtol=0.15)
    assert (arm.residual_after < 0.2 * arm.residual_before).all()


def test_another_payload_of_the_simulated_arm_is_identified(
    identify: Identify, folder: Path, arm: tactid.Calibration
) -> None:
    loaded = simulated(folder, OTHER, 13)
    record = identify(loaded, "--urdf", folder / "arm.urdf", "--calibration", folder / "arm.toml")
    error = values_of(record["estimate"]["values"]) - OTHER.values
    half_width = half_widths_of(record)
    assert abs(error[0]) < 0.01 * OTHER.mass
    # One draw shows gross errors only; Rust tests count how many intervals hold.
    assert (np.abs(error) < 1.5 * half_width).all(), error / half_width
    found = record["calibrated"]
    assert record["files"]["calibration"] == "arm.toml"
    assert not found["updated_by_unloaded"]
    shares = values_of(found["noise_fraction"])
    assert ((shares > 0) & (shares < 1)).all()
    misfits = dict(zip(found["joints"], found["misfit"], strict=True))
    assert len(misfits) == 6
    assert not [each for each in record["findings"] if each["kind"] == "effort_noisier"]
    assert all(0.2 < misfit < 9 for misfit in misfits.values()), misfits
    again = tactid.identify(loaded, urdf=folder / "arm.urdf", calibration=arm)
    np.testing.assert_array_equal(again.estimate.values, values_of(record["estimate"]["values"]))


@pytest.mark.parametrize(("name", "within"), [("ur10", 0.037), ("panda", 0.006 * 3.0)])
def test_a_payload_on_a_measured_arm_is_identified(
    command: TactidCommand, identify: Identify, tmp_path: Path, name: str, within: float
) -> None:
    robot: Measured = ARMS[name]
    payload = body(3.0, [0.1, -0.08, 0.12], [0.02, 0.03, 0.025], [0.3, 0.2, 0.1])
    pairs = halves(robot, tmp_path, payload)
    arm = ("--urdf", robot.urdf, "--tip", robot.tip)
    for calibrating, identified in ((0, 1), (1, 0)):
        out = tmp_path / f"arm{calibrating}.toml"
        unloaded = ("--unloaded", pairs[calibrating][0])
        done = command("calibrate", *arm, *unloaded, "--out", out)
        assert done.returncode == 0, done.stderr
        record = identify(pairs[identified][1], *arm, "--calibration", out)
        error = values_of(record["estimate"]["values"]) - payload.values
        assert abs(error[0]) < within
        assert np.linalg.norm(error[1:4]) < (0.0075 if name == "ur10" else 0.0035)
        half_width = half_widths_of(record)
        known = np.isfinite(error)
        assert known[:4].all()
        assert (np.abs(error) < half_width)[known].all()
        renamed = [each for each in record["findings"] if each["kind"] == "joints_renamed"]
        assert bool(renamed) == (name == "panda")


def test_the_urdf_of_a_similar_robot_is_doubtful(command: TactidCommand, tmp_path: Path) -> None:
    """A measured UR10, with the masses and lengths of a UR5, and with its own."""
    payload = body(5.0, [0.1, -0.08, 0.12], [0.02, 0.03, 0.025], [0.3, 0.2, 0.1])
    (unloaded, loaded), _ = halves(UR10, tmp_path, payload)
    for robot, is_doubtful in ((UR10, False), (UR5, True)):
        arm = ("--urdf", robot.urdf, "--tip", robot.tip)
        out = tmp_path / f"{robot.name}.toml"
        done = command("calibrate", *arm, "--unloaded", unloaded, "--out", out)
        assert done.returncode == 0, done.stderr
        assert ("is this the URDF of this robot?" in done.stderr) == is_doubtful, done.stderr
        done = command("identify", loaded, *arm, "--calibration", out)
        assert ("The calibration is doubtful." in done.stderr) == is_doubtful, done.stderr


def test_the_file_comes_back_bit_by_bit(
    folder: Path, arm: tactid.Calibration, tmp_path: Path
) -> None:
    text = (folder / "arm.toml").read_text(encoding="utf-8")
    back = tactid.Calibration.read(folder / "arm.toml")
    back.write(tmp_path / "again.toml")
    assert replaced_outputs({"--out": tmp_path / "again.toml"})
    assert (tmp_path / "again.toml").read_text(encoding="utf-8") == text
    assert str(back).splitlines()[:11] == str(arm).splitlines()[:11]
    loaded, urdf = simulated(folder, OTHER, 13), folder / "arm.urdf"
    first, second = (
        tactid.identify(loaded, urdf=urdf, calibration=each).estimate for each in (arm, back)
    )
    np.testing.assert_array_equal(first.values, second.values)
    np.testing.assert_array_equal(first.std_devs, second.std_devs)


def test_the_unloaded_recording_of_the_day_updates_the_calibration(
    folder: Path, arm: tactid.Calibration
) -> None:
    loaded, urdf = simulated(folder, OTHER, 13), folder / "arm.urdf"
    unloaded = simulated(folder, None, 14)  # another motion
    without = tactid.identify(loaded, urdf=urdf, calibration=arm)
    updated = tactid.identify(loaded, urdf=urdf, calibration=arm, unloaded=unloaded)
    assert updated.calibrated is not None
    assert updated.calibrated.updated_by_unloaded
    assert not updated.subtracts_unloaded
    assert (updated.estimate.std_devs < without.estimate.std_devs).all()
    assert "updated by the unloaded recording" in str(updated)


def test_the_command_prints_what_was_found(
    command: TactidCommand, folder: Path, tmp_path: Path
) -> None:
    out, report = tmp_path / "out.toml", tmp_path / "report.html"
    unloaded, held = simulated(folder, None, 11), simulated(folder, None, 14)
    arguments = ("calibrate", "--urdf", folder / "arm.urdf", "--unloaded", unloaded)
    done = command(
        *arguments, "--hold-out", held, "--cutoff-hz", 6, "--out", out, "--report", report
    )
    # The recorded efforts are no torques, which is the one contradiction.
    assert done.returncode == 1, done.stderr
    assert "fit far better" in done.stderr
    assert "elbow_joint" in done.stdout
    assert "Efforts count as torques" in done.stderr
    assert re.search(
        r"Held out, simulated14: rms residual shoulder_pan_joint [\d.]+ → ", done.stderr
    )
    assert report.read_text(encoding="utf-8").count("<img") == 6
    done = command(*arguments, "--effort-gain", *GAINS, "--cutoff-hz", 6, "--out", out, "--json")
    record = json.loads(done.stdout)
    assert "known to 5 % before" in " ".join(record["remarks"])
    jsonschema.validate(record, tactid.calibration_schema())
    assert [each["faults"] for each in record["recordings"]] == [[]]
    lag = next(line for line in record["remarks"] if line.startswith("Efforts "))
    assert re.fullmatch(r"Efforts (show no delay:|lag the motion by) [\d.]+ ± [\d.]+ ms\.", lag)
    shown = np.array(record["effort_gain"])
    np.testing.assert_array_equal(shown, GAINS)


def test_shortages_are_sentences() -> None:
    cases = {
        "joint_still": ({"joint": "elbow", "max_velocity": 0.001}, "elbow does not move"),
        "joint_one_direction": (
            {"joint": "elbow", "is_positive": False},
            "negative direction only",
        ),
        "gain_uncertain": ({"joint": "elbow", "std_dev": 0.1}, "± 20 %"),
    }
    assert set(cases) < set(kinds_of(calibration_finding_schema()))
    for kind, (data, part) in cases.items():
        assert part in str(tactid.Finding(kind, data))


def test_contradictions_are_sentences() -> None:
    data = {
        "std_dev": 0.0035,
        "joint": "elbow",
        "payload": 1,
        "prior_std_dev": 0.2,
        "shown": [0.34237, -0.12345, -9.80402],
    }
    cases = [
        ("gravity_tilted", 0.0349, "by 2 ± 0.39 degrees, at 0.342 -0.123 -9.8 m/s², which the"),
        ("joint_zero_off", 0.0349, "positions of elbow that are larger by 2 ± 0.39 degrees. "),
        ("joint_zero_off", -0.0349, "positions of elbow that are smaller by 2 ± 0.39 degrees. "),
        ("gain_contradicted", 0.0349, "other gains, most at elbow (+3.5 ± 0.69 %). "),
        ("gain_contradicted", -0.42, "other gains, most at elbow (-42 ± 0.69 %). "),
        ("gain_contradicted", -1.32, "a gain of elbow that is negative, which no gain is. "),
        (
            "payload_com_contradicted",
            0.123,
            "recording 2 120 ± 6.9 mm from the given one, at 0.342",
        ),
        ("gain_improbable", 0.83, "The gain of elbow is 1.8 times the given one, which is 4.1 sta"),
        (
            "links_improbable",
            1.3,
            "The torques of elbow are 2.3 times those that the masses of the",
        ),
        ("gain_improbable", -0.4, "The gain of elbow is 0.6 times the given one, which is 3.3 sta"),
    ]
    shortages = {"joint_still", "joint_one_direction", "gain_uncertain"}
    kinds = set(kinds_of(calibration_finding_schema()))
    assert {kind for kind, *_ in cases} == kinds - shortages
    for kind, size, part in cases:
        assert part in str(tactid.Finding(kind, data | {"size": size}))


def test_json_has_all_findings(arm: tactid.Calibration) -> None:
    data = {"size": 0.07, "std_dev": 0.01, "joint": "elbow", "shown": [0.7, 0.0, -9.78]}
    of_recording = tactid.Finding("unknown_joints", {"joints": ["finger"]})
    fault = tactid.DataFault("/joint_states", "out_of_order", 3, 1.5)
    recording = tactid.CalibrationRecording(
        Path("log.mcap"),
        "unloaded",
        1.0,
        np.zeros(1),
        *[np.zeros((1, len(arm.joints)))] * 5,
        faults=[fault],
        findings=[of_recording],
        damage=["log.mcap: ends within a chunk"],
    )
    # The calibration itself refuses findings that are not those of its model.
    fields = {each.name: getattr(arm, each.name) for each in dataclasses.fields(CalibrationData)}
    changes = {
        "contradictions": [tactid.Finding("gravity_tilted", data)],
        "shortages": [
            tactid.Finding("joint_still", {"joint": "elbow", "max_velocity": 0.001}),
            tactid.Finding("joint_one_direction", {"joint": "elbow", "is_positive": False}),
            tactid.Finding("gain_uncertain", {"joint": "elbow", "std_dev": 0.1}),
        ],
        "recordings": [recording],
    }
    record = json.loads(calibration_json.to_json(CalibrationData(**fields | changes)))
    jsonschema.validate(record, tactid.calibration_schema())
    found = [*record["contradictions"], *record["shortages"]]
    kinds = [each["kind"] for each in found]
    assert kinds == ["gravity_tilted", "joint_still", "joint_one_direction", "gain_uncertain"]
    assert found[0]["shown"] == data["shown"]
    (written,) = record["recordings"]
    assert written["findings"][0]["joints"] == ["finger"]
    assert written["faults"][0]["count"] == 3
    assert written["damage"] == ["log.mcap: ends within a chunk"]


@pytest.mark.usefixtures("arm")
def test_a_calibration_of_another_robot_is_refused(
    command: TactidCommand, folder: Path, tmp_path: Path
) -> None:
    text = (folder / "arm.toml").read_text(encoding="utf-8")
    other = tmp_path / "other.toml"
    other.write_text(text.replace('name = "elbow_joint"', 'name = "knee_joint"'), encoding="utf-8")
    loaded = simulated(folder, OTHER, 13)
    done = command("identify", loaded, "--urdf", folder / "arm.urdf", "--calibration", other)
    assert_refused(done, "`knee_joint`", "`elbow_joint`")


@pytest.mark.usefixtures("arm")
@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (["--method", "tactile"], ["--method", "calibration"]),
        (["--estimator", "nlms"], ["--estimator", "least squares"]),
        (["--effort-gain", "1,1,1,1,1,1"], ["--effort-gain", "has its own"]),
        (["--cutoff-hz", "3"], ["--cutoff-hz", "has its own"]),
        (["--tip", "wrist_3_link"], ["tool0", "wrist_3_link"]),
    ],
)
def test_what_a_calibration_excludes_is_refused(
    command: TactidCommand,
    folder: Path,
    options: list[str],
    parts: list[str],
) -> None:
    loaded = simulated(folder, OTHER, 13)
    calibrated = ("--urdf", folder / "arm.urdf", "--calibration", folder / "arm.toml")
    assert_refused(command("identify", loaded, *calibrated, *options), *parts)


def test_bad_input_of_the_command_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    unloaded, urdf = simulated(folder, None, 11), folder / "arm.urdf"
    broken = folder / "broken.toml"
    broken.write_text("version = 5\ntool = 3\n", encoding="utf-8")
    run = ("calibrate", "--urdf", urdf, "--out", folder / "unused.toml")
    short = simulated(folder, None, 15, 0.2)
    loaded = (*run, "--loaded", unloaded, "--payload-mass-kg", 1)
    cases: list[tuple[tuple[object, ...], list[str]]] = [
        (run, ["--unloaded is missing"]),
        ((*run, "--unloaded", unloaded, "--loaded", unloaded), ["--payload-mass-kg"]),
        (
            (*run, "--unloaded", unloaded, "--payload-mass-kg", 1),
            ["--payload-mass-kg", "no loaded recording"],
        ),
        ((*run, "--unloaded", unloaded, "--payload-mass-std-dev-kg", 0), ["no loaded recording"]),
        ((*loaded, "--payload-inertia", "1,0,0,1,0,1"), ["--payload-inertia", "centre of mass"]),
        (
            (*loaded, "--payload-com", "0,0,0.1", "--payload-inertia", "1,0,0,1,0,3"),
            ["--payload-inertia", "no body"],
        ),
        ((*run, "--unloaded", unloaded, "--gain-std-dev", "-3%"), ["--gain-std-dev"]),
        ((*run, "--unloaded", folder / "none"), ["none"]),
        ((*run, "--unloaded", short), ["simulated15", "too few windows", "--cutoff-hz"]),
        ((*run, "--unloaded", unloaded, "--rename-joints", "a=b"), ["`a`", "elbow_joint"]),
        ((*run, "--unloaded", unloaded, "--rename-joints", "a"), ["--rename-joints", "pairs"]),
        (("calibrate", "--urdf", urdf, "--unloaded", unloaded, "--out", urdf), ["same file"]),
        (("calibrate", "--unloaded", unloaded, "--out", unloaded / "x.toml"), ["in the folder"]),
        (("identify", unloaded, "--urdf", urdf, "--calibration", broken), ["broken.toml:2"]),
        (("identify", unloaded, "--urdf", urdf, "--calibration", folder / "no"), ["cannot read"]),
    ]
    for arguments, parts in cases:
        monkeypatch.setattr(sys, "argv", ["tactid", *map(str, arguments)])
        assert cli.run() == 2, arguments
        (line,) = capsys.readouterr().err.splitlines()
        assert all(part in line for part in parts), (parts, line)
    assert not (folder / "unused.toml").exists()


def test_an_error_names_the_recording(folder: Path) -> None:
    unloaded = simulated(folder, None, 11)
    short = simulated(folder, None, 15, 0.2)
    with pytest.raises(tactid.IdentificationError, match=re.escape(str(short))):
        tactid.calibrate([unloaded, short], urdf=folder / "arm.urdf", cutoff_hz=6.0)


def test_ctrl_c_leaves_no_file(folder: Path) -> None:
    out = folder / "interrupted.toml"
    unloaded = [simulated(folder, None, seed) for seed in (11, 14, 51, 52, 53, 54)]
    options = [word for recording in unloaded for word in ("--unloaded", str(recording))]
    arguments = ["calibrate", "--urdf", str(folder / "arm.urdf"), *options, "--out", str(out)]
    process = subprocess.Popen(
        [sys.executable, "-m", "tactid", *arguments], stderr=subprocess.PIPE, text=True
    )
    wait_until_open(process, unloaded[2:])
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "interrupted: no calibration" in errors
    assert not out.exists()


def wait_until_open(process: subprocess.Popen[str], folders: list[Path]) -> None:
    """Returns as soon as a process has a file of a folder open; at its end at the latest."""
    opened, targets = Path(f"/proc/{process.pid}/fd"), {str(folder) for folder in folders}
    while process.poll() is None:
        with contextlib.suppress(FileNotFoundError):
            if any(str(link.readlink().parent) in targets for link in opened.iterdir()):
                return
        time.sleep(0.001)


def test_names_of_joints_are_given(folder: Path) -> None:
    urdf = folder / "renamed.urdf"
    urdf.write_text(ur5e().replace("elbow_joint", "knee_joint"), encoding="utf-8")
    unloaded = simulated(folder, None, 11)
    with pytest.raises(tactid.IdentificationError, match="knee_joint"):
        tactid.calibrate(unloaded, urdf=urdf, cutoff_hz=6.0)
    found = tactid.calibrate(
        unloaded, urdf=urdf, cutoff_hz=6.0, rename_joints={"elbow_joint": "knee_joint"}
    )
    assert found.joints[2] == "knee_joint"


def test_a_noisier_effort_is_reported(
    folder: Path, arm: tactid.Calibration, tmp_path: Path
) -> None:
    joints = tactid.read(simulated(folder, OTHER, 13), "/joint_states")
    effort = np.array(joints["effort"])
    effort[:, 1] += 8.0 * np.sin(4.0 * np.array(joints.time))
    names = list(joints.names)
    arrays = (np.array(joints.time), joints["position"], joints["velocity"], effort)
    noisy = write(tmp_path / "noisy", names, *map(np.asarray, arrays))
    found = tactid.identify(noisy, urdf=folder / "arm.urdf", calibration=arm)
    (noisier,) = (each for each in found.findings if each.kind == "effort_noisier")
    assert "shoulder_lift_joint" in noisier.data["joints"]


def test_a_known_inertia_is_kept(folder: Path) -> None:
    com, inertia = KNOWN.values[1:4], KNOWN.values[4:]
    corners = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    found = tactid.calibrate(
        simulated(folder, None, 11),
        loaded=simulated(folder, KNOWN, 12),
        payload_mass_kg=KNOWN.mass,
        payload_com=com,
        payload_inertia=inertia[corners],
        urdf=folder / "arm.urdf",
        cutoff_hz=6.0,
    )
    payload = tactid.MassProperties.from_parameters(found.payloads[0])
    np.testing.assert_allclose(payload.com, com, atol=0.003)
    np.testing.assert_allclose(payload.inertia, inertia[corners], atol=0.002)


@pytest.mark.usefixtures("arm")
def test_a_reversed_effort_is_named(folder: Path, tmp_path: Path) -> None:
    joints = tactid.read(simulated(folder, OTHER, 13), "/joint_states")
    effort = np.array(joints["effort"])
    effort[:, 2] *= -1.0
    arrays = (np.array(joints.time), joints["position"], joints["velocity"], effort)
    reversed_ = write(tmp_path / "reversed", list(joints.names), *map(np.asarray, arrays))
    urdf = folder / "arm.urdf"
    with pytest.raises(tactid.CalibrationError, match="`elbow_joint` has the opposite sign"):
        tactid.identify(
            reversed_, urdf=urdf, calibration=tactid.Calibration.read(folder / "arm.toml")
        )
    with pytest.raises(tactid.TactidError, match=r"reversed.*`elbow_joint`.*negative effort gain"):
        tactid.calibrate(reversed_, urdf=urdf, cutoff_hz=6.0)
    signs = [1.0, 1.0, -1.0, 1.0, 1.0, 1.0]
    found = tactid.calibrate(reversed_, urdf=urdf, cutoff_hz=6.0, effort_gain=signs)
    assert (found.residual_after < found.residual_before).all()
