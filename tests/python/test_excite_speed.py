"""The speed at which the files of a designed motion run."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from ruamel.yaml import YAML

import tactid
from conftest import TactidCommand
from designs import URDF, designed
from tactid._show.motion_text import lines


@pytest.fixture
def motion() -> tactid.DesignedMotion:
    return designed()


def _table(path: Path) -> np.ndarray:
    text = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return np.loadtxt(text[1:] if "time_s" in text[0] else text, delimiter=",")


@pytest.mark.parametrize(("keywords", "speed"), [({}, 0.5), ({"speed": 0.2}, 0.2)])
def test_every_file_runs_at_a_fraction_of_the_speed(
    keywords: dict[str, float], speed: float, motion: tactid.DesignedMotion, tmp_path: Path
) -> None:
    """Times are longer, velocities smaller by the fraction, and accelerations by its square."""
    motion.write(tmp_path, **keywords)
    rows = _table(tmp_path / "trajectory.csv")
    np.testing.assert_allclose(rows[:, 0], motion.times_s / speed, atol=1e-9)
    np.testing.assert_allclose(rows[:, 1:7], motion.q[:, :6], atol=1e-9)
    np.testing.assert_allclose(rows[:, 7:13], motion.qd[:, :6] * speed, atol=1e-9)
    np.testing.assert_allclose(rows[:, 13:19], motion.qdd[:, :6] * speed**2, atol=1e-9)
    # A row each millisecond, which is the path of the motion at a later time.
    franka = _table(tmp_path / "franka.csv")
    assert franka.shape == (round(2000 / speed) + 1, 6)
    every = round(1000 / 500 / speed)
    np.testing.assert_allclose(franka[::every], motion.q[:, :6], atol=2e-9)
    script = (tmp_path / "trajectory.script").read_text()
    assert script.count("servoj(") == round(1000 / speed)
    text = (tmp_path / "moveit.yaml").read_text()
    points = YAML(typ="safe").load(text)["joint_trajectory"]["points"]
    end = points[-1]["time_from_start"]
    assert end["sec"] + end["nanosec"] * 1e-9 == pytest.approx(2 / speed)
    largest = np.abs([point["accelerations"] for point in points]).max()
    assert largest == pytest.approx(speed**2 * np.abs(motion.qdd).max(), rel=0.02)
    with (tmp_path / "trajectory.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        ((_, _, _, trajectory),) = reader.iter_decoded_messages()
        records = {record.name: record.metadata for record in reader.iter_metadata()}
    stamps = [each.time_from_start for each in trajectory.points]
    times = [stamp.sec + stamp.nanosec * 1e-9 for stamp in stamps]
    np.testing.assert_allclose(times, motion.times_s / speed, atol=1e-9)
    assert records["tactid.motion"]["speed"] == f"{speed:g}"
    said = f"The files run at {100 * speed:g} % of the designed speed, in {2 / speed:g} s"
    assert said in records["tactid.motion"]["head"]
    for name in ("trajectory.csv", "trajectory.script", "franka.csv", "moveit.yaml"):
        head = [line for line in (tmp_path / name).read_text().splitlines() if line[:1] == "#"]
        text = " ".join(line.removeprefix("# ") for line in head)
        assert said in text, name
        assert "Tested for collisions: the links of the robot and the payload's box." in text
        assert "a floor or a table, is not tested" in text
        assert "because one joint connects them: base_link and shoulder_link" in text
        assert all(len(line) <= 100 for line in head)


def test_the_design_stays_at_full_speed_and_says_that_of_the_files(
    motion: tactid.DesignedMotion, tmp_path: Path
) -> None:
    motion.write(tmp_path)
    record = json.loads((tmp_path / "result.json").read_text())
    jsonschema.validate(record, tactid.motion_schema())
    assert record["duration_s"] == 2.0
    assert record["files_speed"] == 0.5
    assert record == json.loads(motion.to_json(speed=0.5))
    assert json.loads(motion.to_json())["files_speed"] is None
    assert record["payload_tested"] is True
    assert record["surroundings"] == []
    motion.report(tmp_path / "report.html", speed=0.5)
    report = (tmp_path / "report.html").read_text()
    assert "The files run at 50 % of the designed speed, in 4 s" in report
    assert "write the files with `speed=1` for these intervals" in report
    motion.report(tmp_path / "alone.html")
    assert "The files run" not in (tmp_path / "alone.html").read_text()


def test_the_whole_speed_needs_no_advice(motion: tactid.DesignedMotion) -> None:
    assert lines(motion, speed=1.0)[-1] == ("The files run at 100 % of the designed speed, in 2 s.")


@pytest.mark.parametrize("wrong", [0.0, 0.0099, 1.001, float("nan"), "50%", True])
def test_a_speed_out_of_range_is_refused(
    wrong: float, motion: tactid.DesignedMotion, tmp_path: Path
) -> None:
    for call in (
        lambda: motion.write(tmp_path / "motion", speed=wrong),
        lambda: motion.report(tmp_path / "report.html", speed=wrong),
        lambda: motion.to_json(speed=wrong),
    ):
        with pytest.raises(tactid.ArgumentError, match=r"`speed` is .*: expected"):
            call()
    assert list(tmp_path.iterdir()) == []


def test_the_command_takes_a_percentage(command: TactidCommand, tmp_path: Path) -> None:
    arm = ("excite", "--urdf", URDF, "--from", "0,-1.2,1.6,-0.4,1.5,0", "--duration", "2")
    box = ("--payload-mass-max", "2", "--payload-box", "-0.1 -0.1 0 0.1 0.1 0.2")
    out = ("--out", tmp_path / "motion")
    for wrong, expected in (("0.5", "percentage"), ("200%", "from 1% to 100%"), ("0%", "positive")):
        done = command(*arm, *box, *out, "--speed", wrong)
        assert done.returncode == 2
        assert f"--speed is '{wrong}': expected a" in done.stderr
        assert expected in done.stderr
    done = command(*arm, *box, *out)
    assert done.returncode == 0, done.stderr
    assert "The files run at 50 % of the designed speed, in 4 s" in done.stderr
    assert "write the files with --speed 100% for these intervals." in done.stderr
    assert "in 4 s" in (tmp_path / "motion" / "report.html").read_text()
    done = command(*arm, *box, *out, "--speed", "100%")
    assert "The files run at 100 % of the designed speed, in 2 s.\n" in done.stderr
    assert _table(tmp_path / "motion" / "trajectory.csv")[-1, 0] == 2.0
