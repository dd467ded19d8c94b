"""Recordings that tactid did not make: a UR5e by Pinocchio, written by rosbags.

That these recordings are right is tested in `test_recorded_arm.py`.
"""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionMode

from conftest import TactidCommand
from expectations import (
    Identify,
    Record,
    assert_within,
    errors,
    half_widths_of,
    remarks_with,
    scales,
    values_of,
)
from faulty import noisy, without_velocities
from recorded_arm import (
    DOWN,
    FIXED,
    FLOATING,
    PAYLOAD,
    SENSOR,
    TIP_FROM_SENSOR,
    TOOL,
    Arm,
    Body,
    State,
    friction,
    ur5e,
)
from recordings import (
    EPOCH_NS,
    STORE,
    Logged,
    accelerations,
    carried,
    clock,
    description,
    driven,
    imu,
    joint_states,
    moving,
    odometry,
    state,
    static_transform,
    wrenches,
    write_bag,
    write_split_bag,
)
from test_cli import assert_refused

TRUTH = PAYLOAD.values
EXACT = 1e-4  # of a recording without noise whose streams are sampled together
ALMOST = 1e-3  # where the streams must be brought together, or differentiated once more
DELAY_S = 0.037

# s, Hz: for tests of what is chosen or refused, not of how accurate it is; those allow `ALMOST`.
SHORT = (6.0, 250.0)


@pytest.fixture(scope="session")
def fixed_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("bags") / "fixed", carried(FIXED))


@pytest.fixture(scope="session")
def driven_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("bags") / "driven", driven(FIXED))


@pytest.fixture(scope="session")
def loaded_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("bags") / "loaded", driven(FIXED, rough=True))


@cache
def apart() -> tuple[list[Logged], State]:
    """Joints, and what a wrench sensor has to measure on a clock of its own.

    437 Hz against 500 Hz, with 10 % of jitter in each period.
    """
    joints = FIXED.at(clock(20, 500, jitter=0.1, seed=1))
    return [description(), *joint_states(joints)], FIXED.at(clock(20, 437, jitter=0.1, seed=2))


def unloaded(arm: Arm, *, start_s: float) -> list[Logged]:
    """The motion without the payload on another day, recorded from another moment of it on."""
    time = clock(20, 500)
    moved = replace(arm.at(time + start_s), time=time)
    effort = moved.unloaded_effort + friction(moved.v)
    other_day = EPOCH_NS + 86_400 * 10**9 + 1234567
    return [description(), *joint_states(moved, effort=effort, epoch_ns=other_day)]


# Accuracy


def test_wrench_on_a_fixed_base(identify: Identify, fixed_bag: Path) -> None:
    record = identify(fixed_bag)
    assert_within(record, TRUTH, EXACT)
    assert record["estimate"]["frame"] == "tool0"
    assert record["estimator"] == "least-squares"
    assert record["estimate"]["is_physical"] is True
    assert not remarks_with(record, "opposite")


def test_wrench_on_a_floating_base(identify: Identify, tmp_path: Path) -> None:
    record = identify(write_bag(tmp_path / "bag", carried(FLOATING)))
    assert_within(record, TRUTH, EXACT)
    assert not remarks_with(record, "opposite")


def test_floating_base_under_gravity(identify: Identify, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", carried(Arm(floating=True, gravity=DOWN), 10.0))
    record = identify(bag, "--gravity", 0, 0, -9.81)
    assert_within(record, TRUTH, EXACT)


def test_imu_on_the_base(identify: Identify, command: TactidCommand, tmp_path: Path) -> None:
    """It tells what odometry with a dead twist does not."""
    arm = Arm(floating=True, gravity=DOWN)
    s = state(arm, 10.0)
    still = np.zeros_like(s.base.velocity)
    dead = odometry(s.time, replace(s.base, velocity=still, angular_velocity=still))
    messages = [description(), *joint_states(s), *dead, *wrenches(s.time, s.wrench)]
    felt = imu(s.time, s.base, DOWN, frame="base_link")
    bag = write_bag(tmp_path / "bag", [*messages, *felt])
    options = ("--gravity", 0, 0, -9.81)
    assert_within(identify(bag, *options, "--imu-topic", "/imu"), TRUTH, EXACT)
    assert np.nanmax(np.abs(errors(identify(bag, *options), TRUTH))) > 10 * EXACT
    elsewhere = imu(s.time, s.base, DOWN, frame="forearm_link")
    bag = write_bag(tmp_path / "elsewhere", [*messages, *elsewhere])
    assert_refused(
        command("identify", bag, *options, "--imu-topic", "/imu"), "forearm_link", "base_link"
    )


def test_efforts(identify: Identify, driven_bag: Path) -> None:
    assert_within(identify(driven_bag), TRUTH, EXACT)


def test_efforts_although_there_is_a_wrench(identify: Identify, tmp_path: Path) -> None:
    """The wrench is nonsense here, and nobody asked for it."""
    s = state(FIXED)
    messages = [*driven(FIXED), *wrenches(s.time, np.ones((len(s.time), 6)))]
    bag = write_bag(tmp_path / "bag", messages)
    assert_within(identify(bag, "--method", "effort"), TRUTH, EXACT)


@pytest.mark.parametrize("rough", [False, True])
def test_wrench_and_efforts_together(identify: Identify, tmp_path: Path, rough: bool) -> None:
    """Two exact sources agree; where the efforts have friction, the wrench has the say."""
    s = state(FIXED)
    messages = [*driven(FIXED, rough=rough), *wrenches(s.time, s.wrench)]
    record = identify(write_bag(tmp_path / "bag", messages), "--method", "combined")
    assert len(record["fit"]["residual_rms"]) == 6 + 6
    assert_within(record, TRUTH, EXACT)


def test_loaded_and_unloaded_with_friction(
    identify: Identify, loaded_bag: Path, tmp_path: Path
) -> None:
    bag = write_bag(tmp_path / "unloaded", unloaded(FIXED, start_s=0.0))
    assert_within(identify(loaded_bag, "--unloaded", bag), TRUTH, ALMOST)
    # What is subtracted matters: alone, the loaded recording gives friction's answer.
    found = errors(identify(loaded_bag, "--method", "effort"), TRUTH)
    assert np.nanmax(np.abs(found)) > 10 * ALMOST


@pytest.mark.parametrize("start_s", [1.7, -1.7, 1.7007])
def test_unloaded_recorded_from_another_moment_on(
    identify: Identify, loaded_bag: Path, tmp_path: Path, start_s: float
) -> None:
    """Also where the samples of the two do not fall together (0.7 ms)."""
    bag = write_bag(tmp_path / "unloaded", unloaded(FIXED, start_s=start_s))
    assert_within(identify(loaded_bag, "--unloaded", bag), TRUTH, ALMOST)


def test_positions_alone(identify: Identify, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", without_velocities(carried(FIXED)))
    assert_within(identify(bag), TRUTH, ALMOST)


def test_noise_stays_within_what_is_said_of_it(identify: Identify, tmp_path: Path) -> None:
    """Errors are of the size of the 95 % intervals, and these are narrow."""
    messages = noisy(carried(FIXED), force=0.3, moment=0.03)
    record = identify(write_bag(tmp_path / "bag", messages))
    half_width = half_widths_of(record)
    ratio = (values_of(record["estimate"]["values"]) - TRUTH) / half_width
    assert np.abs(ratio).max() < 2
    assert (np.abs(ratio) < 1).sum() >= 7
    assert (half_width / scales(TRUTH) < 0.05).all()
    assert np.abs(ratio).max() > 0.05


# Sensors


def test_sensor_elsewhere_in_the_urdf(identify: Identify, tmp_path: Path) -> None:
    s = state(FIXED)
    felt = wrenches(s.time, s.wrench, frame=SENSOR, tip_from_sensor=TIP_FROM_SENSOR)
    bag = write_bag(tmp_path / "bag", [*moving(FIXED), *felt])
    record = identify(bag)
    assert_within(record, TRUTH, EXACT)
    assert record["estimate"]["frame"] == "tool0"


def test_result_in_the_frame_of_another_tip(identify: Identify, fixed_bag: Path) -> None:
    turned = TIP_FROM_SENSOR.actInv(PAYLOAD.spatial)
    there = Body(turned.mass, turned.lever, turned.inertia)
    record = identify(fixed_bag, "--tip", SENSOR)
    assert_within(record, there.values, EXACT)
    assert record["estimate"]["frame"] == SENSOR


def test_two_sensors_share_the_load(identify: Identify, tmp_path: Path) -> None:
    """They squeeze the payload, too; one of them is known from /tf_static only."""
    s = state(FIXED)
    grip = 20 + 5 * np.sin(1.3 * s.time)
    left = 0.6 * s.wrench + np.outer(grip, [0, 1, 0, 0.05, 0, 0.02])
    finger = pin.SE3(pin.rpy.rpyToMatrix(1.2, 0.1, -0.4), np.array([0.0, 0.04, 0.09]))
    messages = [
        *moving(FIXED),
        static_transform("finger_right", finger),
        *wrenches(s.time, left, topic="/left", frame=SENSOR, tip_from_sensor=TIP_FROM_SENSOR),
        *wrenches(
            s.time,
            s.wrench - left,
            topic="/right",
            frame="finger_right",
            tip_from_sensor=finger,
        ),
    ]
    bag = write_bag(tmp_path / "bag", messages)
    assert_within(
        identify(bag, "--wrench-topic", "/left", "--wrench-topic", "/right"), TRUTH, EXACT
    )


def test_wrench_on_the_sensor(identify: Identify, tmp_path: Path) -> None:
    s = state(FIXED)
    messages = [*moving(FIXED), *wrenches(s.time, -s.wrench)]
    record = identify(write_bag(tmp_path / "bag", messages), "--wrench-acts-on", "sensor")
    assert_within(record, TRUTH, EXACT)
    assert not remarks_with(record, "opposite")


def test_known_tool_is_taken_off(identify: Identify, tmp_path: Path) -> None:
    both = PAYLOAD.spatial + TOOL.spatial
    arm = Arm(payload=Body(both.mass, both.lever, both.inertia))
    record = identify(write_bag(tmp_path / "bag", carried(arm)), "--known-tool", TOOL.option)
    assert_within(record, TRUTH, EXACT)


def test_motor_currents_with_known_gains(
    identify: Identify, command: TactidCommand, tmp_path: Path
) -> None:
    s = state(FIXED)
    gains = np.array([13.7, 13.2, 11.9, 9.1, 8.4, 8.0])
    current = joint_states(s, effort=s.effort / gains)
    bag = write_bag(tmp_path / "bag", [description(), *current])
    given = ["--effort-gain", ",".join(map(str, gains))]
    exact = identify(bag, *given, "--effort-gain-std-dev", "0%")
    assert_within(exact, TRUTH, EXACT)
    assert exact["fit"]["noise_fraction"]["mass"] == 1
    assert_refused(command("identify", bag, "--effort-gain", "1,2"), "6")
    # Gains without a standard deviation have one of 5 %. There is no noise: the interval is theirs.
    claimed, halved = identify(bag, *given), identify(bag, *given, "--effort-gain-std-dev", "2.5%")
    widths = [half_widths_of(found)[0] for found in (exact, claimed, halved)]
    assert widths[0] < 1e-3 * widths[1]
    assert widths[2] == pytest.approx(widths[1] / 2, rel=1e-3)
    assert claimed["fit"]["noise_fraction"]["mass"] < 1e-3
    assert claimed["remaining_s"]["each"]["mass"] is None
    text = " ".join(command("identify", bag, *given).stderr.split())
    assert "the uncertainty of the effort gains is in the intervals (0 %, " in text
    assert "The uncertainty of the effort gains alone keeps mass" in text
    each = identify(bag, *given, "--effort-gain-std-dev", "5%,5%,5%,5%,5%,5%")
    assert each["estimate"]["intervals"] == claimed["estimate"]["intervals"]


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("0.05", "--effort-gain-std-dev is '0.05': expected percentages with their sign"),
        ("5%,x", "--effort-gain-std-dev is '5%,x': expected percentages with their sign"),
        ("5%,5%", "--effort-gain-std-dev has 2 entries"),
        ("100%", "--effort-gain-std-dev is '100%': expected 0% or more and less than 100%"),
        ("-5%", "--effort-gain-std-dev is '-5%': expected 0% or more and less than 100%"),
    ],
)
def test_wrong_uncertainties_of_gains_are_named(
    fixed_bag: Path, command: TactidCommand, given: str, sentence: str
) -> None:
    options = ["--method", "effort", "--effort-gain-std-dev", given]
    assert_refused(command("identify", fixed_bag, *options), sentence)


# The motion of the sensor itself


@pytest.mark.parametrize("sources", ["odometry", "odometry and accelerations", "imu"])
def test_motion_of_the_sensor_itself(identify: Identify, tmp_path: Path, sources: str) -> None:
    s = state(FIXED)
    felt = wrenches(s.time, s.wrench, frame="sensor")
    odom = odometry(s.time, s.tip, child="sensor")
    messages = {
        "odometry": [*felt, *odom],
        "odometry and accelerations": [
            *felt,
            *odom,
            *accelerations(s.time, s.tip, frame="sensor"),
        ],
        "imu": [*felt, *imu(s.time, s.tip, DOWN, frame="sensor")],
    }[sources]
    record = identify(write_bag(tmp_path / "bag", messages), "--gravity", 0, 0, -9.81)
    assert_within(record, TRUTH, EXACT)
    assert record["estimate"]["frame"] == "sensor"


# Clocks


def test_streams_with_clocks_of_their_own(identify: Identify, tmp_path: Path) -> None:
    joints, sensor = apart()
    messages = [*joints, *wrenches(sensor.time, sensor.wrench)]
    record = identify(write_bag(tmp_path / "bag", messages))
    assert_within(record, TRUTH, ALMOST)
    assert record["delay_s"] == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("delay_s", [DELAY_S, -0.012, 0.25])
def test_delay_of_the_wrench_is_found(identify: Identify, tmp_path: Path, delay_s: float) -> None:
    """Measured at ``t`` and stamped ``t + delay``."""
    joints, sensor = apart()
    felt = wrenches(sensor.time, sensor.wrench, delay_s=delay_s)
    bag = write_bag(tmp_path / "bag", [*joints, *felt])
    record = identify(bag)
    found = record
    assert found["delay_s"] == pytest.approx(delay_s, abs=1e-3)
    assert 0 <= found["estimated_delay"]["std_dev_s"] < 1e-3
    assert_within(record, TRUTH, 1e-2)
    assert remarks_with(record, "delay")
    # As it is given, and not looked for.
    given = identify(bag, "--delay-s", delay_s)
    assert given["delay_s"] == pytest.approx(delay_s)
    assert_within(given, TRUTH, 1e-2)


def test_delay_under_noise_has_an_honest_standard_deviation(
    identify: Identify, tmp_path: Path
) -> None:
    s = state(FIXED)
    felt = noisy(wrenches(s.time, s.wrench, delay_s=DELAY_S), force=0.5, moment=0.05)
    bag = write_bag(tmp_path / "bag", [*moving(FIXED), *felt])
    found = identify(bag)
    assert found["delay_s"] == pytest.approx(DELAY_S, abs=1e-3)
    assert 0 < found["estimated_delay"]["std_dev_s"] < 1e-3
    assert abs(found["delay_s"] - DELAY_S) < 4 * found["estimated_delay"]["std_dev_s"]


# Signs


def test_wrench_of_opposite_sign_is_suspected(identify: Identify, tmp_path: Path) -> None:
    s = state(FIXED, *SHORT)
    messages = [*moving(FIXED, *SHORT), *wrenches(s.time, -s.wrench)]
    record = identify(write_bag(tmp_path / "bag", messages))
    assert remarks_with(record, "wrench", "opposite") or remarks_with(record, "gravity", "opposite")
    assert_not_switched(record)


def test_gravity_of_opposite_sign_is_suspected(identify: Identify, fixed_bag: Path) -> None:
    record = identify(fixed_bag, "--gravity", 0, 0, 9.81)
    assert remarks_with(record, "gravity", "opposite")
    assert_not_switched(record)


def assert_not_switched(record: Record) -> None:
    """The result is that of the given sign, which here is far from the truth."""
    mass = record["estimate"]["values"]["mass"]
    assert mass is None or abs(mass - PAYLOAD.mass) > 0.5


# What is missing or does not fit


def test_unknown_topics_are_refused_with_those_that_fit(
    command: TactidCommand, fixed_bag: Path
) -> None:
    for option, topic in (("--wrench-topic", "/wrench"), ("--joint-topic", "/joint_states")):
        done = command("identify", fixed_bag, option, "/no/such")
        assert_refused(done, "/no/such", topic)
    # A topic of another type.
    assert_refused(command("identify", fixed_bag, "--wrench-topic", "/joint_states"), "/wrench")


def test_several_topics_that_fit_are_refused_with_the_option(
    identify: Identify, command: TactidCommand, tmp_path: Path
) -> None:
    """The same load twice in one frame: raw, and filtered badly. Nobody wants their sum."""
    s = state(FIXED, *SHORT)
    raw = wrenches(s.time, s.wrench, topic="/ft/raw")
    filtered = wrenches(s.time, 0.9 * s.wrench, topic="/ft/filtered")
    bag = write_bag(tmp_path / "wrenches", [*moving(FIXED, *SHORT), *raw, *filtered])
    assert_refused(command("identify", bag), "/ft/raw", "/ft/filtered", "--wrench-topic")
    assert_within(identify(bag, "--wrench-topic", "/ft/raw"), TRUTH, ALMOST)

    wrong = joint_states(replace(s, q=s.q + 0.5), topic="/joint_commands")
    bag = write_bag(tmp_path / "joints", [*carried(FIXED, *SHORT), *wrong])
    assert_refused(command("identify", bag), "/joint_states", "/joint_commands", "--joint-topic")
    assert_within(identify(bag, "--joint-topic", "/joint_states"), TRUTH, ALMOST)


def test_missing_urdf_is_asked_for(
    identify: Identify, command: TactidCommand, tmp_path: Path
) -> None:
    bag = write_bag(tmp_path / "bag", carried(FIXED, *SHORT)[1:])
    assert_refused(command("identify", bag), "--urdf")
    (tmp_path / "arm.urdf").write_text(ur5e())
    assert_within(identify(bag, "--urdf", tmp_path / "arm.urdf"), TRUTH, ALMOST)
    assert_refused(command("identify", bag, "--urdf", "none.urdf"), "none.urdf")


def test_urdf_as_it_is_published(identify: Identify, tmp_path: Path, fixed_bag: Path) -> None:
    """With a prefix that is nowhere declared, which every URDF parser but ours lets pass."""
    (tmp_path / "arm.urdf").write_text(ur5e(as_published=True))
    assert_within(identify(fixed_bag, "--urdf", tmp_path / "arm.urdf"), TRUTH, EXACT)


def test_unknown_tip_is_refused_with_the_links(command: TactidCommand, fixed_bag: Path) -> None:
    assert_refused(command("identify", fixed_bag, "--tip", "hand"), "hand", "tool0", SENSOR)


def test_what_is_measured_nowhere_is_refused(command: TactidCommand, tmp_path: Path) -> None:
    s = state(FIXED, *SHORT)
    only_joints = write_bag(tmp_path / "joints", moving(FIXED, *SHORT))
    assert_refused(command("identify", only_joints), "wrench", "effort")
    assert_refused(command("identify", only_joints, "--method", "effort"), "effort")
    only_wrench = write_bag(tmp_path / "wrench", wrenches(s.time, s.wrench))
    assert_refused(command("identify", only_wrench), "/wrench")
    unknown_frame = wrenches(s.time, s.wrench, frame="nowhere")
    bag = write_bag(tmp_path / "frame", [*moving(FIXED, *SHORT), *unknown_frame])
    assert_refused(command("identify", bag), "nowhere", "tool0")


def test_unloaded_recording_of_another_motion_is_refused(
    command: TactidCommand, loaded_bag: Path, tmp_path: Path
) -> None:
    bag = write_bag(tmp_path / "unloaded", unloaded(Arm(seed=8), start_s=0.0))
    done = command("identify", loaded_bag, "--unloaded", bag)
    assert_refused(done, "unloaded")
    mismatch = re.findall(r"(\d+\.?\d*(?:e-?\d+)?) ?(rad|deg|°|%)", done.stderr)
    assert mismatch, done.stderr


# Files


@pytest.mark.parametrize("how", ["split", "zstd", "file alone"])
def test_bags_of_every_make(identify: Identify, tmp_path: Path, how: str) -> None:
    bag = tmp_path / "bag"
    if how == "split":
        write_split_bag(bag, carried(FIXED, *SHORT), 11)
    else:
        chunks = CompressionMode.STORAGE if how == "zstd" else CompressionMode.NONE
        write_bag(bag, carried(FIXED, *SHORT), compression=chunks)
    if how == "file alone":
        bag = (bag / "bag.mcap").rename(tmp_path / "alone.mcap")
    assert_within(identify(bag), TRUTH, ALMOST)


def test_estimates_are_a_log(identify: Identify, fixed_bag: Path, tmp_path: Path) -> None:
    path = tmp_path / "estimates.mcap"
    record = identify(fixed_bag, "--estimates", path)
    with AnyReader([path], default_typestore=STORE) as reader:
        (connection,) = (
            c for c in reader.connections if c.msgtype == "geometry_msgs/msg/InertiaStamped"
        )
        read = [
            (log_ns, reader.deserialize(data, connection.msgtype))
            for _, log_ns, data in reader.messages([connection])
        ]
    assert len(read) >= 20
    log_ns, last = read[-1]
    assert last.header.frame_id == record["estimate"]["frame"]
    inertia, com = last.inertia, last.inertia.com
    entries = [getattr(inertia, f"i{at}") for at in ("xx", "xy", "xz", "yy", "yz", "zz")]
    written = np.array([inertia.m, com.x, com.y, com.z, *entries])
    np.testing.assert_allclose(written, values_of(record["estimate"]["values"]), rtol=1e-9)
    # Beside the recording it is of, so that both can be looked at together.
    stamp_ns = last.header.stamp.sec * 10**9 + last.header.stamp.nanosec
    assert 19.5e9 < stamp_ns - EPOCH_NS < 20.5e9
    assert 19.5e9 < log_ns - EPOCH_NS < 20.5e9


def test_result_has_the_series(identify: Identify, fixed_bag: Path, tmp_path: Path) -> None:
    printed = identify(fixed_bag, "--result", tmp_path / "result.json")
    assert "history" not in printed
    assert "measured" not in printed["fit"]
    record = json.loads((tmp_path / "result.json").read_text())
    fit, history = record["fit"], record["history"]
    assert len(fit["channels"]) == 6
    measured, predicted = (np.array(fit[key]) for key in ("measured", "predicted"))
    assert measured.shape == predicted.shape == (len(fit["times_s"]), 6)
    assert len(fit["held_out"]) == len(fit["weights"]) == len(measured)
    assert np.abs(measured - predicted).max() < 1e-2
    assert values_of(record["estimate"]["values"]) == pytest.approx(history["values"][-1], rel=1e-3)
