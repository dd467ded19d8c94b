"""A calibration is made from arrays, compared, copied and pickled, and refused for other robots."""

import copy
import dataclasses
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactid
from calibrated_arms import GAINS, KNOWN, OTHER, simulated
from recorded_arm import ur5e

SETTINGS: dict[str, Any] = {"tip": "tool0", "cutoff_hz": 6.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("arrays")
    (folder / "arm.urdf").write_text(ur5e(), encoding="utf-8")
    return folder


def arrays_of(log: Path) -> dict[str, np.ndarray]:
    """The joint states of a log, which are in the order of the robot."""
    joints = tactid.read(log, "/joint_states")
    names = {"q": "position", "qd": "velocity", "effort": "effort"}
    return {"time": np.array(joints.time)} | {
        name: np.array(joints[field]) for name, field in names.items()
    }


@pytest.fixture(scope="module")
def robot(folder: Path) -> tactid.Manipulator:
    return tactid.Manipulator.from_urdf(folder / "arm.urdf")


@pytest.fixture(scope="module")
def arm(folder: Path, robot: tactid.Manipulator) -> tactid.Calibration:
    """The simulated arm, calibrated from arrays with a payload of known mass."""
    unloaded, loaded = (arrays_of(simulated(folder, *each)) for each in ((None, 11), (KNOWN, 12)))
    return tactid.calibrate(
        unloaded, loaded=[loaded], payload_mass_kg=KNOWN.mass, robot=robot, **SETTINGS
    )


def test_arrays_give_what_their_logs_give(folder: Path, arm: tactid.Calibration) -> None:
    logs = tactid.calibrate(
        simulated(folder, None, 11),
        loaded=simulated(folder, KNOWN, 12),
        payload_mass_kg=KNOWN.mass,
        urdf=folder / "arm.urdf",
        **SETTINGS,
    )
    assert np.abs(arm.gain / GAINS - 1).max() < 0.02
    np.testing.assert_allclose(arm.gain, logs.gain, rtol=1e-6)
    np.testing.assert_allclose(arm.gain_std_dev, logs.gain_std_dev, rtol=1e-5)
    np.testing.assert_allclose(arm.recordings[0].measured, logs.recordings[0].measured, atol=1e-6)
    assert [str(log.path) for log in arm.recordings] == ["unloaded[0]", "loaded[0]"]
    assert "unloaded[0]" in repr(arm.recordings[0])
    assert '"path": "loaded[0]"' in arm.to_json()
    assert list(arm.inputs) == []


def test_wrong_arrays_are_named(folder: Path, robot: tactid.Manipulator) -> None:
    log = simulated(folder, None, 11)
    whole = arrays_of(log)
    reordered = whole | {"time": np.zeros_like(whole["time"])}
    without = {name: whole[name] for name in ("time", "q")}
    degrees = whole | {"q": np.rad2deg(whole["q"])}
    cases: list[tuple[Any, dict[str, Any], list[str]]] = [
        (without, {"robot": robot}, ["`unloaded[0]` has no `effort`"]),
        (whole | {"efforts": 1}, {"robot": robot}, ["`unloaded[0]` has `efforts`"]),
        ([log, whole | {"q": whole["q"][:, :3]}], {"robot": robot}, ["unloaded[1]: `q`", "(N, 6)"]),
        (whole | {"qd": whole["qd"][1:]}, {"robot": robot}, ["unloaded[0]: `qd` has"]),
        (whole, {}, ["unloaded[0]", "give `robot`"]),
        (log, {"robot": robot}, ["`robot` belongs to arrays"]),
        (
            [whole, dict(whole)],
            {"robot": robot},
            ["unloaded[0] and unloaded[1] are the same", "twice"],
        ),
        (
            whole,
            {"robot": robot, "hold_out": whole},
            ["unloaded[0] and hold_out[0] are", "twice", "check"],
        ),
        (reordered, {"robot": robot}, ["unloaded[0]: ", "`time`"]),
        (degrees, {"robot": robot}, ["unloaded[0]: ", "degrees"]),
        (3, {"robot": robot}, ["`unloaded` is 3", "path", "arrays"]),
        (whole, {"robot": "arm"}, ["`robot` is of type str"]),
    ]
    for unloaded, given, parts in cases:
        with pytest.raises(tactid.TactidError) as error:
            tactid.calibrate(unloaded, **given, **SETTINGS)
        assert all(part in str(error.value) for part in parts), (parts, str(error.value))


def test_degrees_are_refused_where_the_fit_would_not_notice(
    folder: Path, robot: tactid.Manipulator
) -> None:
    arrays = arrays_of(simulated(folder, None, 11))
    arrays = arrays | {"q": np.rad2deg(arrays["q"]), "qd": np.rad2deg(arrays["qd"])}
    with pytest.raises(tactid.IdentificationError, match=r"unloaded\[0\].*_joint.*degrees"):
        tactid.calibrate(arrays, robot=robot, effort_gain=GAINS.tolist(), **SETTINGS)


@pytest.mark.parametrize("name", ["gain", "friction", "delay", "cutoff_hz", "tip"])
def test_numbers_of_the_model_cannot_be_replaced(arm: tactid.Calibration, name: str) -> None:
    others = {"tip": "other", "delay": tactid.Delay(1.0, 1.0)}
    other = others[name] if name in others else 2 * getattr(arm, name)
    with pytest.raises(tactid.ArgumentError, match=f"`{name}` is not that of .*edit the file"):
        dataclasses.replace(arm, **{name: other})
    assert dataclasses.replace(arm, inputs={}) == arm


def test_copies_are_equal(arm: tactid.Calibration, tmp_path: Path) -> None:
    arm.write(tmp_path / "arm.toml")
    read = tactid.Calibration.read(tmp_path / "arm.toml")
    assert tactid.Calibration.read(tmp_path / "arm.toml") == read
    for original in (arm, read):
        for again in (pickle.loads(pickle.dumps(original)), copy.deepcopy(original)):
            assert again == original
            assert str(again) == str(original)
            assert again.model == original.model
        assert copy.copy(original) == original
    assert read == arm
    assert (len(read.recordings), len(arm.recordings)) == (0, 2)
    text = (tmp_path / "arm.toml").read_text(encoding="utf-8")
    (tmp_path / "edited.toml").write_text(
        re.sub(r"reference_torque = .*", "reference_torque = 7.0", text, count=1), encoding="utf-8"
    )
    edited = tactid.Calibration.read(tmp_path / "edited.toml")
    assert edited.model != read.model
    with pytest.raises(TypeError, match="unhashable"):
        hash(arm)


def test_a_result_equals_its_copy(
    folder: Path, robot: tactid.Manipulator, arm: tactid.Calibration
) -> None:
    arrays = arrays_of(simulated(folder, OTHER, 13))
    time = arrays.pop("time")
    options = {"robot": robot, "calibration": arm, "tip": "tool0"}
    result = tactid.identify(time, **arrays, **options)
    again = pickle.loads(pickle.dumps(result))
    assert again == result
    assert again.estimate == result.estimate
    half = slice(0, len(time) // 2)
    part = {name: values[half] for name, values in arrays.items()}
    other = tactid.identify(time[half], **part, **options)
    assert other != result
    assert other.estimate != result.estimate


def test_another_robot_with_the_same_names_is_refused(
    folder: Path, robot: tactid.Manipulator, arm: tactid.Calibration
) -> None:
    arrays = arrays_of(simulated(folder, OTHER, 13))
    time = arrays.pop("time")

    def mass(urdf: str) -> float:
        found = tactid.identify(time, **arrays, urdf=urdf, calibration=arm, tip="tool0")
        return float(found.estimate.values[0])

    text = ur5e()
    mass_of_upper_arm = re.search(r'<mass value="(8\.\d+)"', text)
    assert mass_of_upper_arm is not None
    given = mass_of_upper_arm.group(1)
    heavier = text.replace(f'<mass value="{given}"', '<mass value="12.93"')
    with pytest.raises(
        tactid.CalibrationError,
        match=rf"another robot, whose link `upper_arm_link` has the mass {float(given):.5g} kg"
        r" instead of 12.93 kg",
    ):
        mass(heavier)
    printed = re.sub(r"-?\d+\.\d{7,}", lambda number: f"{float(number.group()):.7g}", text)
    assert printed != text or not re.search(r"\d+\.\d{8,}", text)
    # A camera beyond the tip is part of what the arm holds, in whatever URDF.
    camera = (
        '<link name="camera"><inertial><mass value="0.3"/><inertia ixx="1e-4" ixy="0" ixz="0"'
        ' iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link><joint name="camera_mount" type="fixed">'
        '<parent link="tool0"/><child link="camera"/></joint></robot>'
    )
    known = mass(text)
    assert mass(printed) == pytest.approx(known, rel=1e-4)
    assert mass(text.replace("</robot>", camera)) == pytest.approx(known, rel=1e-4)
    assert robot.joint_names == list(arm.joints)
