"""Designed motions: the function, the command, and the files that it writes."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

import tactid
from conftest import TactidCommand
from designs import BOX, START, URDF, designed
from tactid._base.output_files import replaced_outputs
from tactid._documents import motion_files


@pytest.fixture
def motion() -> tactid.DesignedMotion:
    return designed()


def test_motion_rests_at_both_ends_and_is_within_limits(motion: tactid.DesignedMotion) -> None:
    assert motion.q.shape == motion.qd.shape == motion.qdd.shape == (len(motion.times_s), 8)
    np.testing.assert_allclose(motion.q[[0, -1], :6], [START, START], atol=1e-9)
    np.testing.assert_allclose(motion.qd[[0, -1]], 0, atol=1e-9)
    assert motion.times_s[-1] == motion.duration_s == 2.0
    assert np.abs(motion.qdd).max() <= 2.0 * (1 + 1e-6)
    assert all(margin.used <= 1 + 1e-6 for margin in motion.margins)
    assert motion.binding_constraints
    # The velocities are the slopes of the positions.
    slopes = np.gradient(motion.q, motion.times_s, axis=0)
    np.testing.assert_allclose(slopes[1:-1], motion.qd[1:-1], atol=1e-4)


def test_efforts_hold_with_every_corner_of_the_box(motion: tactid.DesignedMotion) -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    point = tactid.MassProperties(2.0, BOX[1], np.zeros((3, 3)))
    held = robot.with_payload("tool0", point)
    efforts, _ = held.inverse_dynamics(motion.q, motion.qd, motion.qdd, gravity=[0, 0, -9.81])
    used = np.abs(efforts[:, :6]).max(axis=0)
    margins = {each.limit: each.used for each in motion.margins}
    for joint in range(6):
        limit = margins[f"the effort of joint joint_{joint + 1}"]
        # The corner that needs most may be another one.
        assert used[joint] <= limit * _effort_limit(joint) * (1 + 1e-6)


def _effort_limit(joint: int) -> float:
    found = ElementTree.parse(URDF).getroot().find(f"joint[@name='joint_{joint + 1}']/limit")
    assert found is not None
    return float(found.attrib["effort"])


def test_prediction_is_what_a_noisy_identification_achieves(motion: tactid.DesignedMotion) -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    body = tactid.MassProperties.from_values(motion.expected_payload)
    tool = robot.kinematics("tool0", motion.q, motion.qd, motion.qdd)
    turn = tool.pose[:, :3, :3]
    moved = (
        tool.acceleration + np.array([0, 0, 9.81]),
        tool.angular_velocity,
        tool.angular_acceleration,
    )
    rows = tactid.wrench_regressor(*(np.einsum("nij,ni->nj", turn, each) for each in moved))
    random = np.random.default_rng(3)
    errors = []
    for _ in range(30):
        noise = random.normal(size=(len(motion.times_s), 6)) * ([0.5] * 3 + [0.05] * 3)
        result = tactid.identify(
            motion.times_s,
            robot=robot,
            q=motion.q,
            qd=motion.qd,
            wrench=rows @ body.parameters + noise,
            sensors="tool0",
            tip="tool0",
            cutoff_hz=10.0,
            delay_s=0.0,
        )
        errors.append(result.estimate.values[0] - body.mass)
    rms = float(np.sqrt(np.mean(np.square(errors))))
    assert 0.7 < rms / motion.predicted_std_devs[0] < 1.3


def test_json_is_as_its_schema_says(motion: tactid.DesignedMotion) -> None:
    jsonschema.validate(json.loads(motion.to_json()), tactid.motion_schema())


def test_files_have_the_same_motion(motion: tactid.DesignedMotion, tmp_path: Path) -> None:
    motion.write(tmp_path / "motion", speed=1)
    folder = tmp_path / "motion"
    lines = (folder / "trajectory.csv").read_text().splitlines()
    text = [line for line in lines if not line.startswith("#")]
    assert text[0].startswith("time_s,q_joint_1,q_joint_2")
    rows = np.loadtxt(text[1:], delimiter=",")
    np.testing.assert_allclose(rows[:, 0], motion.times_s, atol=1e-9)
    np.testing.assert_allclose(rows[:, 1:7], motion.q[:, :6], atol=1e-9)
    np.testing.assert_allclose(rows[:, 13:19], motion.qdd[:, :6], atol=1e-9)
    franka = np.loadtxt(folder / "franka.csv", delimiter=",")
    assert franka.shape == (2001, 6)
    script = (folder / "trajectory.script").read_text()
    assert script.count("servoj(") == 1000
    assert "nan" not in script


@pytest.mark.parametrize("rate", [100.0, 125.0, 500.0])
def test_files_for_controllers_are_within_limits_whatever_the_rate(
    rate: float, tmp_path: Path
) -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    motion = tactid.design_excitation(
        robot, start=START, duration=2.0, payload_mass_max=2.0, payload_box=BOX, rate=rate
    )
    motion.write(tmp_path, speed=1)
    positions = np.loadtxt(tmp_path / "franka.csv", delimiter=",")
    places = np.rint(motion.times_s * 1000).astype(int)
    np.testing.assert_allclose(positions[places], motion.q[:, :6], atol=1e-8)
    # Positions have nine decimals: their second differences have an error of 2e-3 rad/s².
    acceleration = np.diff(positions, 2, axis=0) / 1e-6
    assert np.abs(acceleration).max() <= 2.0 * (1 + (0.002 if rate > 100 else 0.02)) + 4e-3
    text = (tmp_path / "moveit.yaml").read_text()
    points = YAML(typ="safe").load(text)["joint_trajectory"]["points"]
    found = [
        np.array([point[name] for point in points]) for name in ("velocities", "accelerations")
    ]
    assert np.abs(found[1]).max() <= 2.0 * 1.02
    steps = np.diff(found[0], axis=0) / 0.02
    np.testing.assert_allclose(steps, (found[1][1:] + found[1][:-1]) / 2, atol=0.02)


@pytest.mark.parametrize(
    ("wrong", "part"),
    [({"duration": 1e7}, "at most 3600"), ({"seed": -1}, "seed"), ({"seed": 2**64}, "seed")],
)
def test_a_motion_of_months_and_a_seed_out_of_range_are_refused(
    wrong: dict[str, Any], part: str
) -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    with pytest.raises(tactid.TactidError, match=part):
        tactid.design_excitation(
            robot, **{"start": START, "payload_mass_max": 2.0, "payload_box": BOX, **wrong}
        )


def test_a_yaml_reader_reads_the_points_for_moveit(
    motion: tactid.DesignedMotion, tmp_path: Path
) -> None:
    motion.write(tmp_path, speed=1)
    text = (tmp_path / "moveit.yaml").read_text()
    found = YAML(typ="safe").load(text)["joint_trajectory"]
    assert found["joint_names"] == motion.moving_joints
    last = found["points"][-1]
    assert last["time_from_start"] == {"sec": 2, "nanosec": 0}
    np.testing.assert_allclose(last["positions"], START, atol=1e-8)


def test_times_of_points_increase_to_the_end() -> None:
    for hundredths in range(50, 2001):
        motion = SimpleNamespace(duration_s=hundredths / 100)
        times = motion_files._times(motion, 0.02)  # type: ignore[arg-type]
        assert np.diff(times).min() > 1e-6, motion
        assert (times[0], times[-1]) == (0, motion.duration_s)


def test_mcap_ros2_support_reads_the_trajectory(
    motion: tactid.DesignedMotion, tmp_path: Path
) -> None:
    motion.write(tmp_path, speed=1)
    with (tmp_path / "trajectory.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        ((_, channel, _, trajectory),) = reader.iter_decoded_messages()
    assert channel.topic == "/joint_trajectory"
    assert list(trajectory.joint_names) == motion.moving_joints
    assert len(trajectory.points) == len(motion.times_s)
    middle = trajectory.points[500]
    assert middle.time_from_start.sec == 1
    np.testing.assert_allclose(middle.velocities, motion.qd[500, :6])


def test_rosbags_reads_every_number_of_the_trajectory(
    motion: tactid.DesignedMotion, tmp_path: Path
) -> None:
    motion.write(tmp_path, speed=1)
    # The definitions are the log's own: there are none to fall back on.
    empty = get_typestore(Stores.EMPTY)
    with AnyReader([tmp_path / "trajectory.mcap"], default_typestore=empty) as reader:
        ((connection, _, data),) = reader.messages()
        trajectory = reader.deserialize(data, connection.msgtype)
    assert connection.msgtype == "trajectory_msgs/msg/JointTrajectory"
    assert trajectory.joint_names == motion.moving_joints
    stamps = [point.time_from_start for point in trajectory.points]
    nanoseconds = [stamp.sec * 1_000_000_000 + stamp.nanosec for stamp in stamps]
    assert nanoseconds == np.round(motion.times_s * 1e9).astype(int).tolist()
    columns = [motion.joints.index(name) for name in motion.moving_joints]
    for name, values in (
        ("positions", motion.q),
        ("velocities", motion.qd),
        ("accelerations", motion.qdd),
    ):
        found = np.array([getattr(point, name) for point in trajectory.points])
        np.testing.assert_array_equal(found, values[:, columns])


def test_progress_rises_and_an_exception_in_it_stops_the_design() -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    seen: list[float] = []

    def stop(done: float) -> None:
        seen.append(done)
        if len(seen) == 3:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tactid.design_excitation(
            robot, start=START, payload_mass_max=2.0, payload_box=BOX, progress=stop
        )
    assert seen == sorted(seen)


@pytest.mark.parametrize(
    ("keywords", "expected"),
    [
        ({}, "the payload is missing: give the expected one as `payload`, or its largest mass"),
        ({"payload_mass_max": 1.0}, "`payload_box` is missing"),
        (
            {"payload_mass_max": 1.0, "payload_box": [1, 2]},
            "`payload_box` is .*: expected the least",
        ),
        ({"duration": 1.0, "within": 0.1}, "`duration` and `within` are both given"),
        ({"start": [0, 0], "payload_mass_max": 1.0, "payload_box": BOX}, "expected 6, one for"),
        (
            {"limit_scale": -1.0, "payload_mass_max": 1.0, "payload_box": BOX},
            "`limit_scale` is -1, but must be more than 0",
        ),
        ({"base_attitude": 0.1, "payload_mass_max": 1.0, "payload_box": BOX}, "base is fixed"),
        ({"beta": 0.1}, "`beta` does not apply to the design of a motion"),
        ({"wrong": 0.1}, "there is no keyword `wrong`"),
    ],
)
def test_bad_arguments_are_errors(keywords: dict[str, object], expected: str) -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    with pytest.raises(tactid.ArgumentError, match=expected):
        tactid.design_excitation(robot, **keywords)  # type: ignore[arg-type]


ARM = ("excite", "--urdf", str(URDF), "--from", "0,-1.2,1.6,-0.4,1.5,0")


def test_command_writes_a_folder(command: TactidCommand, tmp_path: Path) -> None:
    out = tmp_path / "motion"
    box = ("--payload-mass-max", "2", "--payload-box", "-0.1", "-0.1", "0", "0.1", "0.1", "0.2")
    done = command(
        *ARM, *box, "--duration", "2", "--wrench-noise", "1,1,1,.1,.1,.1", "--out", str(out)
    )
    assert done.returncode == 0, done.stderr
    assert "predicted 95 % intervals" in done.stdout
    assert "binds" in done.stdout
    assert "assumed" not in done.stderr
    names = {path.name for path in out.iterdir()}
    assert {"trajectory.mcap", "trajectory.csv", "result.json", "report.html"} <= names
    assert len(replaced_outputs({name: out / name for name in names})) == len(names)
    jsonschema.validate(json.loads((out / "result.json").read_text()), tactid.motion_schema())


def test_command_names_the_limit_that_binds_and_writes_nothing(
    command: TactidCommand, tmp_path: Path
) -> None:
    out = tmp_path / "motion"
    heavy = ("--payload", "500,0.5,0,0,10,0,0,20,0,10", "--duration", "2")
    done = command(*ARM, *heavy, "--out", str(out))
    assert done.returncode == 2
    assert "no motion is possible: the effort of joint joint_2 is" in done.stderr
    assert not out.exists()
    grip = "0.22,0,0.075,0,1,0,0.04,10,0.1,0.05"
    held = command(*ARM, "--payload", "1,0.1,0,0,.1,0,0,.1,0,.1", "--grip", grip, "--out", str(out))
    assert held.returncode == 2
    assert "pad" in held.stderr
    assert "--grip" in held.stderr
    assert not out.exists()


def test_simulated_motion_is_identified_as_precisely_as_predicted(
    command: TactidCommand, tmp_path: Path
) -> None:
    """From the design through the simulation and its log to the payload, on a floating base."""
    experiment = tactid.Experiment.paper()
    robot = tactid.Manipulator.from_urdf(experiment.urdf, base="floating")
    noise = [1.0] * 3 + [0.1] * 3
    motion = tactid.design_excitation(
        robot,
        start=START,
        duration=5.0,
        payload=experiment.payload,
        sensors=["finger_left_link", "finger_right_link"],
        wrench_noise=noise,
        acceleration=0.5,
        grip=tactid.Grip([0.22, 0, 0.075], [0, 1, 0], 0.04, 1500, 0.8, 0.05),
        base_attitude=np.radians(0.1),
    )
    assert motion.base_attitude_deg is not None
    assert motion.base_attitude_deg <= 0.1 * (1 + 1e-6)
    motion.write(tmp_path / "motion", speed=1)
    (tmp_path / "noisy.toml").write_text(
        "[noise]\nfinger_force_n = 1.0\nfinger_moment_nm = 0.1\n"
        '[excitation]\nkind = "designed"\nfile = "motion/trajectory.csv"\n'
    )
    for arguments in (["noisy.toml"], ["noisy.toml", "--motion", "motion"]):
        done = command("simulate", *arguments, "--out", "run.mcap")
        assert done.returncode == 0, done.stderr
    result = tactid.identify(tmp_path / "run.mcap", cutoff_hz=10.0, delay_s=0.0)
    achieved = np.array(result.estimate.std_devs)
    predicted = motion.predicted_std_devs
    np.testing.assert_allclose(achieved, predicted, rtol=0.25)
    # The base of the simulation is bounded, too.
    quaternion = tactid.read(tmp_path / "run.mcap", "/base/odom")["pose"][:, 3:]
    cosine = np.abs(quaternion @ quaternion[0]).clip(max=1)
    assert np.degrees(2 * np.arccos(cosine)).max() < 0.11


def test_motion_of_another_robot_or_posture_is_an_error(
    motion: tactid.DesignedMotion, command: TactidCommand, tmp_path: Path
) -> None:
    motion.write(tmp_path / "motion")
    table = tmp_path / "motion" / "trajectory.csv"
    table.write_text(table.read_text().replace("joint_6", "joint_9"))
    done = command("simulate", "--motion", table)
    assert done.returncode == 2
    assert "has the joint joint_6, which the motion lacks; it moves joint_1" in done.stderr
    (tmp_path / "table1.toml").write_text(
        'posture = "table1"\n[excitation]\nkind = "designed"\nfile = "motion"\n'
    )
    done = command("simulate", "table1.toml")
    assert done.returncode == 2
    assert "begins at [0.0, -1.2" in done.stderr
    assert command("simulate", "--motion", tmp_path / "no").returncode == 2


def test_advice_of_identify_ends_with_the_command_that_designs_the_motion(
    command: TactidCommand, log: Path, urdf: str, tmp_path: Path
) -> None:
    (tmp_path / "an arm.urdf").write_text(urdf)
    options = ("--urdf", "an arm.urdf", "--tip", "tool0", "--within", "0.0001%")
    done = command("identify", log, *options)
    assert done.returncode == 0, done.stderr
    expected = (
        "A motion that would determine more: tactid excite --urdf 'an arm.urdf' --tip tool0"
        " --method tactile --payload-mass-max KG"
    )
    assert expected in done.stderr
    assert "tactid excite" not in command("identify", log, "--within", "0.0001%").stderr


def test_the_robot_does_not_touch_itself_or_a_keep_out_box() -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    keywords = {
        "start": START,
        "duration": 2.0,
        "payload": tactid.MassProperties(2.0, [0.02, 0.01, 0.1], 0.01 * np.eye(3)),
        "payload_box": BOX,
    }
    free = tactid.design_excitation(robot, **keywords, collisions=False)
    assert free.collision_findings is None
    assert all(margin.distance_m is None for margin in free.margins)
    assert "The links of the robot are not tested for collisions" in str(free)
    height = robot.kinematics("tool0", free.q[0]).pose[2, 3]
    floor = [[-3.0, -3.0, height - 3.0], [3.0, 3.0, height - 0.25]]
    kept = tactid.design_excitation(robot, **keywords, keep_out={"floor": floor})
    assert kept.collision_findings
    distances = {each.limit: each.distance_m for each in kept.margins if each.distance_m}
    assert distances["the distance between the payload and the keep-out box floor"] >= 0.01 - 1e-7
    # The corner of the payload's box that is the lowest keeps the distance, too.
    pose = robot.kinematics("tool0", kept.q).pose
    corners = np.stack(np.meshgrid(*np.transpose(BOX)), -1).reshape(-1, 3)
    lowest = (pose[:, None, 2, :3] @ corners.T)[:, 0] + pose[:, 2, 3:]
    assert lowest.min() >= floor[1][2] + 0.01 - 1e-6
    reasons = [finding.text for finding in kept.collision_findings]
    assert "not tested for collisions, because one joint connects them" in reasons
    jsonschema.validate(json.loads(kept.to_json()), tactid.motion_schema())


def test_boxes_on_the_command_line(command: TactidCommand, tmp_path: Path) -> None:
    options = ("excite", "--urdf", URDF, "--tip", "tool0", "--duration", 1)
    payload = ("--payload", "2 0.02 0.01 0.1 0.01 0 0 0.01 0 0.01", "--out", tmp_path / "motion")
    wide = ("--keep-out", "room=-5,-5,-5,5,5,5")
    failed = command(*options, *payload, *wide)
    assert "the keep-out box room touch at the start" in failed.stderr
    assert not (tmp_path / "motion").exists()
    failed = command(*options, *payload, "--keep-out", "-5,-5,-5,5,5,5")
    assert "expected a name, an equals sign" in failed.stderr
