"""Changes of an experiment's fields, and a simulation on the ground."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

import pages
import tactid
from conftest import TactidCommand
from tactid._base.values import values_of
from tactid._show.run_report import active_text, base_text

PAPER = tactid.Experiment.paper()

BENCH = """
duration_s = 8.0
[robot]
base = "fixed"
[payload]
mass_kg = 4.0
center_of_mass_m = [0.25, 0.01, 0.08]
inertia_kg_m2 = [0.02, 0.001, 0.0, 0.03, 0.0, 0.02]
[excitation]
mode = "together"
[[excitation.joints]]
name = "joint_3"
frequency_hz = 0.5
[[excitation.joints]]
name = "joint_5"
frequency_hz = 0.7
amplitude_rad_s2 = 4.0
[[excitation.joints]]
name = "joint_6"
frequency_hz = 0.9
amplitude_rad_s2 = 8.0
"""


def test_nested_fields_are_replaced_and_the_others_stay() -> None:
    body = tactid.MassProperties(50, [0.3, 0, 0.01], np.diag([4.0, 5.0, 6.0]))
    changed = PAPER.replace(
        duration=np.float32(2.0),
        step=0.002,
        seed=np.int64(7),
        payload={"mass_kg": 50, "handle": {"size_m": (0.1, 0.04, 0.1)}},
        noise={"finger_force_n": 0.5, "base_position_m": np.full(3, 1e-5)},
        excitation={"mode": "together", "joints": [{"name": "joint_1", "frequency_hz": 0.5}]},
    )
    text = changed.to_toml()
    for line in (
        "duration_s = 2.0",
        "step_s = 0.002",
        "seed = 7",
        "mass_kg = 50.0",
        "size_m = [0.1, 0.04, 0.1]",
        "center_m = [0.22, 0.0, 0.075]",
        "finger_force_n = 0.5",
        "friction = 0.8",
    ):
        assert line in text
    assert changed.to_dict()["noise"]["base_position_m"] == [1e-5] * 3
    assert "joint_3" not in text
    assert changed.payload.mass == 50
    assert changed.payload.com[0] == 0.5
    assert PAPER.replace(payload=body).payload == body
    assert PAPER.replace(frequency=0.5).to_toml().count("frequency_hz = 0.5") == 3
    assert PAPER.replace(payload=None, seed=None) == PAPER
    assert PAPER.replace() == PAPER


def test_the_dictionary_has_the_fields_of_the_file() -> None:
    """Changing an experiment by its own dictionary changes nothing, and tables are dictionaries."""
    fields = PAPER.to_dict()
    tables = {name: fields[name] for name in re.findall(r"^\[(\w+)\]$", PAPER.to_toml(), re.M)}
    assert {"robot", "payload", "gripper", "excitation", "noise", "bounds"} <= tables.keys()
    assert PAPER.replace(payload={"mass_kg": 7}).replace(**tables) == PAPER
    assert PAPER.replace(payload={"mass_kg": 7}).to_dict()["payload"]["mass_kg"] == 7.0
    assert fields["excitation"]["joints"][0]["name"] == "joint_3"
    assert fields["duration_s"] == PAPER.duration
    assert "urdf" not in fields["robot"]
    assert PAPER.replace(robot={"urdf": Path("arm.urdf")}).to_dict()["robot"]["urdf"] == "arm.urdf"


def test_a_base_on_the_ground_has_gravity() -> None:
    assert PAPER.base == "floating"
    assert not PAPER.gravity.any()
    fixed = PAPER.replace(robot={"base": "fixed"})
    assert fixed.base == "fixed"
    assert fixed.gravity.tolist() == [0, 0, -9.81]
    moon = fixed.replace(gravity=np.array([0, 0, -1.62]))
    assert moon.gravity.tolist() == [0, 0, -1.62]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"mass": 3}, "no field `mass`; it has frequency, posture, seed, duration, step, gravity,"),
        ({"payload": {"mass": 3}}, "unknown field `mass`, expected one of `mass_kg`, `center"),
        ({"noise": {"force": 1}}, "unknown field `force`, expected one of `joint_position_rad`"),
        ({"payload": {"mass_kg": -1}}, "payload.mass_kg = -1.0: must be positive"),
        ({"payload": {"mass_kg": "heavy"}}, "invalid type"),
        ({"payload": 100}, "payload = 100: expected a dictionary of its fields"),
        ({"payload": {3: 4}}, "payload = 3: expected names of fields"),
        ({"gripper": {"friction": True}}, "gripper.friction = True: expected a number"),
        ({"gripper": {"friction": object}}, "gripper.friction = <class 'object'>"),
        ({"duration": "long"}, "invalid type"),
        ({"frequency": "fast"}, "frequency = 'fast': expected a number"),
        ({"seed": 2**70}, "seed = 1180591620717411303424: expected an integer"),
        ({"posture": "table2"}, 'expected "identifiable", "table1" or a list'),
        (
            {"gravity": [0, 0, -9.81]},
            "gravity_m_s2 = [0.0, 0.0, -9.81]: a floating base would",
        ),
    ],
)
def test_wrong_fields_are_refused(fields: dict[str, object], message: str) -> None:
    with pytest.raises(tactid.ExperimentError, match=re.escape(message)) as refused:
        PAPER.replace(**fields)  # type: ignore[arg-type]
    assert "\n" not in str(refused.value)


def test_an_arm_on_the_ground_is_identified_without_options(
    command: TactidCommand, tmp_path: Path
) -> None:
    """As well as the same arm with the same payload on a spacecraft."""
    worst = {}
    for base in ("floating", "fixed"):
        (tmp_path / "bench.toml").write_text(BENCH.replace('"fixed"', f'"{base}"'))
        done = command("simulate", "bench.toml")
        assert done.returncode == 0, done.stderr
        assert ("not checked on a fixed base" in done.stderr) == (base == "fixed")
        attempts = tactid.compare(tmp_path / "run.mcap")
        truth = np.array([4.0, 0.25, 0.01, 0.08, 0.02, 0.001, 0, 0.03, 0, 0.02])
        scale = np.repeat([4.0, 0.25, 0.03], [1, 3, 6])
        for attempt in attempts:
            if attempt.result is not None and attempt.estimator == "least-squares":
                error = np.abs(attempt.result.estimate.values - truth) / scale
                worst[base, attempt.method] = error.max()
    assert ("fixed", "joint-sensing") not in worst
    for method in ("tactile", "effort"):
        assert worst["fixed", method] < max(worst["floating", method], 1e-3), worst


def test_a_broken_experiment_names_its_file(command: TactidCommand, tmp_path: Path) -> None:
    for text, what in (("duration_s = [", "line 1"), ("duration_s = -1.0", "duration_s")):
        (tmp_path / "broken.toml").write_text(text, encoding="utf-8")
        done = command("simulate", "broken.toml")
        assert done.returncode == 2
        assert done.stderr.startswith("tactid: error: broken.toml: "), done.stderr
        assert what in done.stderr


def test_the_motion_of_a_table_is_followed(tmp_path: Path) -> None:
    """Posture and duration become those of the motion, and the log begins in its first posture."""
    joints = [f"joint_{k}" for k in range(1, 7)]
    header = ["time_s", *(f"q_{name}" for name in joints), *(f"qd_{name}" for name in joints)]
    start = [0.1, -1.0, 1.4, -0.4, 1.5, 0.2]
    rows = [[time, *start, *[0.0] * 6] for time in (0.0, 0.2)]
    lines = [",".join(header), *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "trajectory.csv").write_text("\n".join(lines) + "\n")
    paper = tactid.Experiment.paper()
    experiment = paper.following(tmp_path / "trajectory.csv")
    assert experiment.duration == pytest.approx(0.2)
    log = tmp_path / "run.mcap"
    assert tactid.simulate(experiment, log).steps == 200
    with pytest.raises(tactid.ArgumentError, match="the experiment's motion"):
        tactid.simulate(experiment, tmp_path / "trajectory.csv")
    with pytest.raises(tactid.ExperimentError, match=r"none\.csv"):
        paper.following(tmp_path / "none.csv")


ACTIVE = Path(__file__).parents[2] / "crates" / "sim" / "experiments" / "active.toml"


def test_a_payload_is_identified_actively(command: TactidCommand, tmp_path: Path) -> None:
    """The run of the example ends early, and its log gives what the robot has found on the way."""
    done = command("simulate", ACTIVE)
    assert done.returncode == 0, done.stderr
    assert "All intervals were within their targets after" in done.stderr
    log = tmp_path / "run.mcap"
    joints = tactid.read(log, "/joint_states")
    assert joints.time[-1] < tactid.Experiment.from_file(ACTIVE).duration - 1
    found = tactid.identify(log)
    truth = np.array([100, 0.5, 0, 0, 10, 0, 0, 20, 0, 10])
    scale = np.repeat([100, 0.5, 20], [1, 3, 6])
    np.testing.assert_allclose(found.estimate.values / scale, truth / scale, atol=0.02)


def test_noise_that_hides_the_first_gentle_motions_ends_nothing(tmp_path: Path) -> None:
    """With 1 % of the peak of each channel, several values are unknown for some plans."""
    noise = {
        "joint_position_rad": [0.0005, 0.013, 0.019, 0.005, 0.018, 0.0013, 0.0003, 0.0003],
        "joint_velocity_rad_s": [0.0014, 0.0023, 0.0055, 0.0025, 0.0028, 0.0017, 0.0, 0.0],
        "base_velocity_m_s": [7.5e-5, 3.5e-5, 3.7e-5],
        "base_angular_velocity_rad_s": [7.5e-5, 7.9e-5, 1.3e-4],
        "finger_force_n": [2.5, 3.2, 16.0, 2.9, 3.2, 16.0],
        "finger_moment_nm": [0.057, 0.12, 0.28, 0.057, 0.13, 0.33],
    }
    active = tactid.Experiment.from_file(ACTIVE).replace(noise=noise)
    for seed in range(3):
        report = tactid.simulate(active.replace(seed=seed), tmp_path / "run.mcap").active
        assert report is not None
        assert report.contradictions == []
        assert report.reached_s is not None, report


def test_wrong_bounds_of_the_payload_end_with_1(command: TactidCommand, tmp_path: Path) -> None:
    """The output names each bound with what was found, and how far the base turned beyond its."""
    text = ACTIVE.read_text()
    for field, value in (
        ("mass_kg = [5.0, 150.0]", "mass_kg = [5.0, 20.0]"),
        ("center_of_mass_m = 0.5", "center_of_mass_m = 0.05"),
        ("half_diagonal_m = 0.8", "half_diagonal_m = 0.05"),
    ):
        assert field in text
        text = text.replace(field, value)
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text)
    done = command("simulate", wrong)
    assert done.returncode == 1
    printed = " ".join(done.stderr.split())
    assert "The payload contradicts excitation.active: mass_kg[1] is 20, but " in printed
    assert "center_of_mass_m is 0.05, but 0." in printed
    assert "half_diagonal_m is 0.05, but 0.7" in printed
    assert "beyond its bound of 0.1°) and moved by at most" in printed
    assert (tmp_path / "run.mcap").exists()


def test_the_report_says_how_far_the_base_moved(tmp_path: Path) -> None:
    active = tactid.Experiment.from_file(ACTIVE).replace(duration=1.2)
    report = tactid.simulate(active, tmp_path / "run.mcap")
    odometry = tactid.read(tmp_path / "run.mcap", "/base/odom")
    assert report.base is not None
    turn = odometry["pose"][:, 3:]
    angles = 2 * np.arccos(np.clip(np.abs(turn @ turn[0]), 0, 1))
    assert np.radians(report.base.attitude_deg) == pytest.approx(angles.max(), rel=0.02)
    inside = base_text(report, {"base_attitude_deg": 0.1})
    assert inside is not None
    assert not inside.is_exceeded
    assert "within its bound of 0.1°" in inside.sentence
    outside = base_text(report, {"base_position_m": 1e-6})
    assert outside is not None
    assert outside.is_exceeded
    fixed = tactid.Experiment.paper().replace(duration=0.05, robot={"base": "fixed"})
    on_ground = tactid.simulate(fixed, tmp_path / "run.mcap")
    assert on_ground.base is None
    assert base_text(on_ground, {}) is None


def test_the_example_is_that_of_the_documentation() -> None:
    found = pages.blocks(pages.ROOT / "docs" / "how-to" / "excite.md")
    (text,) = (block.text for block in found if block.title == "active.toml")
    assert tactid.Experiment.from_toml(text) == tactid.Experiment.from_file(ACTIVE)


def test_what_active_identification_has_not_reached_is_reported(tmp_path: Path) -> None:
    active = tactid.Experiment.from_file(ACTIVE).replace(duration=0.5)
    report = tactid.simulate(active, tmp_path / "run.mcap").active
    assert report is not None
    assert report.reached_s is None
    assert report.plans == 1
    assert not report.out_of_reach
    assert active_text(report).endswith("give the run more time.")
    still = dataclasses.replace(
        report, plans=0, binding="the friction of the grip at pad 0", out_of_reach=True
    )
    assert "the friction of the grip at pad 0 is beyond its limit already at rest" in active_text(
        still
    )
    near = dataclasses.replace(report, interval_ratio=0.97)
    assert "all intervals are within their targets, but the arm has not come" in active_text(near)
    paper = tactid.Experiment.paper().replace(duration=0.1)
    assert tactid.simulate(paper, tmp_path / "run.mcap").active is None
    with pytest.raises(tactid.ExperimentError, match=r"active\.within = 0\.01: is used only with"):
        active.replace(excitation={"kind": "cosine"})


def test_intervals_hold_at_the_beginning_of_a_motion(tmp_path: Path) -> None:
    """Without noise, what is left is the compliance of the grasp.

    Errors of the ten values are correlated, so that more than one in twenty may be outside; with
    the noise of the windows alone it was every second one.
    """
    log = tmp_path / "beginning.mcap"
    truth = np.array(values_of(PAPER.payload))
    distances = []
    for seconds in (0.25, 0.4, 0.7, 1.0, 1.6, 2.5, 4.0, 5.5, 7.0, 8.5):
        tactid.simulate(PAPER.replace(duration=seconds), log)
        low, high = np.transpose(tactid.identify(log).estimate.intervals)
        distances.append(np.abs(truth - (low + high) / 2) / ((high - low) / 2))
    outside = np.array(distances) > 1
    assert outside.mean() < 0.2, np.round(distances, 2)
    assert np.max(distances) < 2.5, np.round(distances, 2)
