"""Wrong input that once passed in silence, or with advice that did not help."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tactid
from conftest import TactidCommand
from expectations import Identify, assert_within, remarks_with
from recorded_arm import FIXED, PAYLOAD, SENSOR, TIP_FROM_SENSOR, pose_values, ur5e
from recordings import carried, moving, state, wrenches, write_bag
from test_cli import assert_refused
from wrist import BODY, PERIOD, about

SHORT = (6.0, 250.0)
ALMOST = 1e-3
RATE = 100.0


def swinging() -> dict[str, np.ndarray]:
    """A sensor that turns about two axes and carries a body: its time, pose, twist and wrench."""
    time = np.arange(0.0, 8.0, 1 / RATE)
    swing = 2 * np.pi / PERIOD
    turn = about(2, 1.5 * np.sin(swing * time)) @ about(1, 1.2 * np.sin(2 * swing * time))
    spin = np.gradient(turn, time, axis=0) @ np.swapaxes(turn, 1, 2)
    rate = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    own = np.einsum("nji,nj->ni", turn, rate)
    felt = np.swapaxes(turn, 1, 2) @ [0.0, 0.0, 9.81]
    wrench = tactid.wrench_regressor(felt, own, np.gradient(own, time, axis=0)) @ BODY.parameters
    pose = np.zeros((len(time), 4, 4))
    pose[:, :3, :3], pose[:, 3, 3] = turn, 1.0
    zero = np.zeros_like(rate)
    return {
        "time": time,
        "pose": pose,
        "wrench": wrench,
        "twist": np.hstack([zero, rate]),
        "own": np.hstack([zero, own]),
    }


def identified(**changed: object) -> tactid.Identification:
    given = {name: swinging()[name] for name in ("time", "pose", "wrench")} | changed
    time = given.pop("time")
    return tactid.identify(time, **given)  # type: ignore[arg-type]


def test_a_twist_in_the_wrong_axes_is_reported() -> None:
    right = identified(twist=swinging()["twist"])
    assert not [finding for finding in right.findings if finding.kind == "twist_contradicted"]
    wrong = identified(twist=swinging()["own"])
    (finding,) = (each for each in wrong.findings if each.kind == "twist_contradicted")
    assert finding.data["better_axes"] == "body"
    sentence = str(finding)
    assert sentence.startswith("twist: the twist is not the derivative of the pose")
    assert "axes of the moving body, but must be in those of the world" in sentence


def test_times_in_another_unit_are_named() -> None:
    for factor, unit in ((1e3, "milliseconds"), (1e9, "nanoseconds")):
        with pytest.raises(tactid.IdentificationError, match=f"seem to be in {unit}"):
            identified(time=factor * swinging()["time"])


def test_times_that_do_not_increase_are_named() -> None:
    with pytest.raises(tactid.IdentificationError, match=r"799 times of `time` are not later"):
        identified(time=swinging()["time"][::-1])


def test_a_gap_that_is_too_short_is_named() -> None:
    what = r"longer than 0.001 s.*every 0.01 s.*max_gap"
    with pytest.raises(tactid.IdentificationError, match=what):
        identified(max_gap_s=0.001)


def test_a_dead_channel_is_reported() -> None:
    wrench = swinging()["wrench"].copy()
    wrench[:, 4] = 0.0
    (finding,) = (
        each for each in identified(wrench=wrench).findings if each.kind == "constant_channels"
    )
    assert "moment y in `sensor` measured nothing" in str(finding)


def test_the_frame_of_a_sensor_can_be_placed(
    identify: Identify, command: TactidCommand, tmp_path: Path
) -> None:
    s = state(FIXED, *SHORT)
    felt = wrenches(s.time, s.wrench, frame="nowhere", tip_from_sensor=TIP_FROM_SENSOR)
    bag = write_bag(tmp_path / "bag", [*moving(FIXED, *SHORT), *felt])
    assert_refused(command("identify", bag), "nowhere", "--sensor-frame")
    pose = pose_values(TIP_FROM_SENSOR.homogeneous).tolist()
    given = ",".join(["tool0", *(f"{number:.9f}" for number in pose)])
    assert_within(identify(bag, "--sensor-frame", given), PAYLOAD.values, ALMOST)
    for frame in (("tool0", *pose), ["tool0", pose]):
        found = tactid.identify(bag, sensor_frame=frame)
        np.testing.assert_allclose(found.estimate.values, PAYLOAD.values, atol=ALMOST)
    assert_refused(command("identify", bag, "--sensor-frame", "hand,0,0,0,0,0,0,1"), "hand", SENSOR)
    for short in ("tool0", "tool0,0,0,0.04"):
        what = f"--sensor-frame is '{short}': expected the name of a link, then the seven numbers"
        assert_refused(command("identify", bag, "--sensor-frame", short), what)
    wrong = (
        ("tool0", "expected a link"),
        (("tool0", 0, 0, 0), "expected a link"),
        (
            ("tool0", 0, 0, 0, 1, 1, 1, 1),
            "qw\\) of `sensor_frame` has the norm 2, but must have the norm 1",
        ),
    )
    for frame, message in wrong:
        with pytest.raises(tactid.ArgumentError, match=message):
            tactid.identify(bag, sensor_frame=frame)


def test_wrenches_of_unrelated_sensors_must_be_named(
    identify: Identify, command: TactidCommand, tmp_path: Path
) -> None:
    s = state(FIXED, *SHORT)
    other = wrenches(s.time, 0.5 * s.wrench, frame="base_link", topic="/pedestal")
    bag = write_bag(tmp_path / "bag", [*carried(FIXED, *SHORT), *other])
    refused = command("identify", bag)
    assert_refused(refused, "/wrench in `tool0`", "/pedestal in `base_link`", "--wrench-topic")
    record = identify(bag, "--wrench-topic", "/wrench")
    assert_within(record, PAYLOAD.values, ALMOST)
    assert not remarks_with(record, "are summed")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([""], "the argument after identify is empty: is a variable of the shell not set?"),
        (["run.mcap", "--urdf", ""], "the argument after --urdf is empty"),
        (["run.mcap", "--result="], "--result is empty"),
    ],
)
def test_an_empty_argument_is_no_folder(
    command: TactidCommand, arguments: list[str], message: str
) -> None:
    assert_refused(command("identify", *arguments), message)


def test_options_that_cannot_be_right_are_named(tmp_path: Path, command: TactidCommand) -> None:
    bag = write_bag(tmp_path / "bag", carried(FIXED, *SHORT))
    for options, messages in (
        (["--imu-topic", "/nope"], ["/nope", "sensor_msgs/msg/Imu"]),
        (["--acceleration-topic", "/nope"], ["/nope", "geometry_msgs/msg/AccelStamped"]),
        (["--known-tool=" + ",".join("0" * 10)], ["--known-tool is '0,0", "`mass` is zero"]),
        (
            ["--wrench-noise=1e-308,1,1,1,1,1"],
            ["--wrench-noise is ", "must be a standard deviation between 1e-30 and 1e30"],
        ),
    ):
        assert_refused(command("identify", bag, *options), *messages)


def test_a_urdf_from_a_pipe_is_read_once(command: TactidCommand, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", carried(FIXED, *SHORT))
    (tmp_path / "arm.urdf").write_text(ur5e())
    os.mkfifo(tmp_path / "pipe")
    with subprocess.Popen("cat arm.urdf > pipe", shell=True, cwd=tmp_path):
        done = command("identify", bag, "--urdf", "pipe", "--result", "result.json")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "result.json").is_file()


def test_a_urdf_that_is_none_is_no_fault_of_a_recording(
    command: TactidCommand, tmp_path: Path
) -> None:
    bag = write_bag(tmp_path / "bag", carried(FIXED, *SHORT))
    (tmp_path / "arm.urdf").write_text("mass = 1")
    urdf = ("--urdf", "arm.urdf", "--tip", "tool0")
    for arguments in (
        ("calibrate", *urdf, "--unloaded", bag, "--out", "arm.toml"),
        ("identify", bag, bag.parent, *urdf),
    ):
        assert_refused(command(*arguments), "tactid: error: --urdf: not a URDF: line 1")
