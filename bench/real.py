"""Payloads that robots have moved: tactid beside a plain fit, from recordings that others publish.

Run by `make bench-real DATA=folder`. docs/real-robots.md says what the folder contains, and from
where each recording is fetched. What is missing is named, and the rest runs.
"""

import json
import sys
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import files
from pathlib import Path
from typing import NamedTuple

import numpy as np
import plain_fit
from plain_fit import Array, Joints
from rich.console import Console
from rich.table import Table

import tactid
from tactid._base.values import values_of

PUBLISHED_GAINS = [14.87, 13.26, 11.13, 10.62, 11.03, 11.47]
"""Torque for a current of 1 A, N m, from the literature that the source of the data cites."""
ROUGH_GAINS = [10.0] * 6


class Row(NamedTuple):
    """One payload: what is true, what tactid finds, and what a plain fit finds."""

    robot: str
    recording: str
    truth: Array
    """Ten values of the payload, NaN where nobody knows them."""
    estimate: tactid.PayloadEstimate
    plain: Array


class MissingError(Exception):
    """Recordings that are not there."""


def need(path: Path, source: str) -> Path:
    """Returns a path that exists."""
    if not path.exists():
        raise MissingError(f"{path} is missing: put it there from {source}")
    return path


# Workshop tools on a wrist sensor

TOOLS = ("c_clamp", "hammer", "ruler", "screwdriver")
UTIAS = "github.com/utiasSTARS/inertial-identification-with-part-segmentation, as bags"


def workshop_tool(data: Path, tool: str) -> Iterator[Row]:
    """A tool in a simulated motion of others, with the strongest noise of their study."""
    bag = need(data / f"utias/{tool}_high", UTIAS)
    known = json.loads((bag / "truth.json").read_text())
    inertia = known["inertia_about_com_kgm2"]
    axes = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    truth = np.array([known["mass_kg"], *known["com_m"], *(inertia[key] for key in axes)])
    gravity = known["gravity_in_world"]
    found = tactid.identify(bag, gravity=gravity)
    yield Row("wrist sensor, simulated", tool, truth, found.estimate, plain_tool(bag, gravity))


def plain_tool(bag: Path, gravity: list[float]) -> Array:
    """Returns the values of the plain fit to every message of a tool, each counting the same."""
    topics = [tactid.read(bag, f"/ft_sensor/{topic}") for topic in ("wrench", "odom", "accel")]
    wrench, pose, twist, acceleration = (
        np.array(topics[k][key])
        for k, key in ((0, "wrench"), (1, "pose"), (1, "twist"), (2, "acceleration"))
    )
    axis, cosine = -pose[:, 3:6], pose[:, 6:]
    across = 2 * np.cross(axis, gravity)
    gravity_in_sensor = gravity + cosine * across + np.cross(axis, across)
    rows = tactid.wrench_regressor(
        acceleration[:, :3] - gravity_in_sensor, twist[:, 3:], acceleration[:, 3:]
    )
    return values(np.linalg.lstsq(rows.reshape(-1, 10), wrench.ravel(), rcond=None)[0])


# Measured arms, to whose efforts the torque of a payload is added

UNISA = "github.com/unisa-acg/inverse-dynamics-solver"
SIDES = np.array([0.1, 0.12, 0.15])
BLOCK = tactid.MassProperties(
    3.0, [0.1, -0.08, 0.12], 3.0 / 12 * np.diag((SIDES**2).sum() - SIDES**2)
)
"""A homogeneous block, 3 kg."""


class Arm(NamedTuple):
    """A robot of which a recording without a payload is published, and its description."""

    name: str
    log: str
    urdf: str
    tip: str
    bandwidth_hz: float
    """Above which the measured motion is noise."""


ARMS = (
    Arm("UR10", "ur10", "ur10_robot.urdf", "tool0", 8.0),
    Arm("Franka", "panda", "panda.urdf", "panda_link8", 5.0),
)


def unloaded_arm(data: Path, arm: Arm) -> Iterator[Row]:
    """Half of a recording calibrates the arm; the other half has the torques of the block, too."""
    path = need(data / f"unisa/{arm.log}_exciting_trajectory.db3", UNISA)
    urdf = described(arm.urdf).read_text().replace('type="prismatic"', 'type="fixed"')
    robot = tactid.Manipulator.from_urdf(urdf)
    joints = joint_states(path, robot)
    added = torques_of_block(robot, arm, joints)
    middle = len(joints.time) // 2
    halves = {"first half": slice(0, middle), "second half": slice(middle, None)}
    for calibrating, carrying in (list(halves), list(halves)[::-1]):
        unloaded, loaded = (
            Joints(*(each[halves[half]] for each in joints)) for half in (calibrating, carrying)
        )
        loaded = loaded._replace(effort=loaded.effort + added[halves[carrying]])
        found = identify(loaded, urdf, tactid.calibrate(unloaded._asdict(), urdf=urdf, tip=arm.tip))
        plain = plain_fit.payload(robot, arm.tip, plain_fit.arm(robot, [unloaded]), loaded)
        truth = np.array(values_of(BLOCK))
        yield Row(f"{arm.name}, torques", carrying, truth, found, values(plain))


def described(urdf: str) -> Path:
    """Returns the description of a robot, of the package example-robot-data."""
    paths = (Path(str(file.locate())) for file in files("example-robot-data") or ())
    return next(path for path in paths if path.name == urdf)


def joint_states(log: Path, robot: tactid.Manipulator) -> Joints:
    """Reads a log in the robot's order of joints."""
    messages = tactid.read(log, "/joint_states")
    names = [name.replace("fer_", "panda_") for name in messages.names]
    order = [names.index(name) for name in robot.joint_names]
    arrays = [np.array(messages[key])[:, order] for key in ("position", "velocity", "effort")]
    return without_repetitions(Joints(np.array(messages.time), *arrays))


def without_repetitions(joints: Joints) -> Joints:
    """Returns a recording without samples that repeat the efforts of the one before."""
    is_new = np.append(True, np.any(np.diff(joints.effort, axis=0) != 0, axis=1))
    return Joints(*(each[is_new] for each in joints))


def torques_of_block(robot: tactid.Manipulator, arm: Arm, joints: Joints) -> Array:
    """Returns the torques that the block takes in a measured motion."""
    states = plain_fit.motion(joints, arm.bandwidth_hz)
    arms = robot.with_payload(arm.tip, BLOCK), robot
    loaded, own = (arm.inverse_dynamics(*states, gravity=plain_fit.GRAVITY)[0] for arm in arms)
    return np.array(loaded - own)


def identify(
    loaded: Joints,
    urdf: str,
    calibration: tactid.Calibration,
    unloaded: Joints | None = None,
) -> tactid.PayloadEstimate:
    """Identifies the payload of a recording with a calibration, and an unloaded one of the day."""
    found = tactid.identify(
        loaded.time,
        q=loaded.q,
        qd=loaded.qd,
        effort=loaded.effort,
        urdf=urdf,
        calibration=calibration,
        unloaded=None if unloaded is None else unloaded._asdict(),
    )
    return found.estimate


# A UR10e with a weighed load, of which currents were recorded

MAMEDOV = "github.com/shamilmamedov/dynamic_calibration"


class Pair(NamedTuple):
    """Recordings without and with a load: the files, their first time, s, and their rows."""

    mass_kg: float
    unloaded: tuple[str, float, int]
    loaded: tuple[str, float, int]


PAIRS = {
    "A": Pair(
        2.602,
        ("ur-19_12_23_free", 446.415, 2036),
        ("ur-20_01_13-load_2600", 316.083, 2025),
    ),
    "B": Pair(
        2.805,
        ("ur-20_01_31-unload", 780.311, 2324),
        ("ur-20_01_31-load", 1114.597, 2512),
    ),
    "C": Pair(
        2.805,
        ("ur-20_02_19_14harm50sec", 840.487, 4772),
        ("ur-20_02_19_14harm50secLoad", 1887.417, 4764),
    ),
}
BAGS = {"A": "A", "B": "B", "C": "14harm"}


def weighed_loads(data: Path) -> Iterator[Row]:
    """Each pair with published gains, and then with the calibration of each other pair."""
    folder = data / "ur10e"
    urdf = need(folder / "ur10e.urdf", MAMEDOV).read_text()
    robot = tactid.Manipulator.from_urdf(urdf)
    pairs = {name: pair_of(folder, name, robot) for name in PAIRS}
    torques = {
        name: [each._replace(effort=each.effort * PUBLISHED_GAINS) for each in pair]
        for name, pair in pairs.items()
    }
    for name, (unloaded, loaded) in pairs.items():
        calibration = tactid.calibrate(unloaded._asdict(), urdf=urdf, effort_gain=PUBLISHED_GAINS)
        found = identify(loaded, urdf, calibration)
        arm = plain_fit.arm(robot, torques[name][:1])
        plain = values(plain_fit.payload(robot, "tool0", arm, torques[name][1]))
        yield Row("UR10e, currents", f"{name}, published gains", weight(name), found, plain)
    for known, recordings in pairs.items():
        calibration = tactid.calibrate(
            recordings[0]._asdict(),
            loaded=recordings[1]._asdict(),
            payload_mass_kg=PAIRS[known].mass_kg,
            urdf=urdf,
            effort_gain=ROUGH_GAINS,
        )
        for name, (unloaded, loaded) in pairs.items():
            if name != known:
                found = identify(loaded, urdf, calibration, unloaded)
                arm = plain_fit.arm(robot, [torques[known][0], torques[name][0]])
                fits = [
                    plain_fit.payload(robot, "tool0", arm, torques[k][1]) for k in (known, name)
                ]
                plain = values(fits[1] * PAIRS[known].mass_kg / fits[0][0])
                yield Row("UR10e, currents", f"{name} by {known}", weight(name), found, plain)


def weight(name: str) -> Array:
    """Returns what is known of the load of a pair: its mass."""
    return np.array([PAIRS[name].mass_kg, *[np.nan] * 9])


def pair_of(folder: Path, name: str, robot: tactid.Manipulator) -> tuple[Joints, Joints]:
    """Reads the recordings of a pair, as published or as bags."""
    found = []
    for kind, (file, first_s, rows) in zip(("bare", "load"), PAIRS[name][1:], strict=True):
        bag = folder / f"{BAGS[name]}_{kind}"
        if bag.is_dir():
            found.append(joint_states(bag, robot))
            continue
        table = np.loadtxt(need(folder / f"{file}.csv", MAMEDOV), delimiter=",")
        begin = int(np.searchsorted(table[:, 0], first_s - 1e-6))
        table = table[begin : begin + rows]
        arrays = (table[:, 0] - table[0, 0], table[:, 1:7], table[:, 7:13], table[:, 13:19])
        found.append(without_repetitions(Joints(*arrays)))
    return found[0], found[1]


# The table


def values(parameters: Array) -> Array:
    """Returns the ten values of linear parameters, also of those that no body has."""
    return np.array(values_of(tactid.MassProperties.from_parameters(parameters)))


def cells(row: Row) -> Iterator[str]:
    """Returns what a row of the table says, errors of a kind of values by their norm.

    The object's size is that of the homogeneous box with its mass and inertia, whose diagonal is
    `sqrt(6 tr(I) / m)`.
    """
    truth = row.truth
    low, high = row.estimate.intervals.T
    diagonal = np.sqrt(6 * truth[[4, 7, 9]].sum() / truth[0])
    yield from (row.robot, row.recording, f"{truth[0]:.3f}")
    errors = row.estimate.values - truth, row.plain - truth
    yield f"{100 * errors[0][0] / truth[0]:+.2f} ± {50 * (high - low)[0] / truth[0]:.2f}"
    yield f"{100 * errors[1][0] / truth[0]:+.2f}"
    com, inertia = slice(1, 4), slice(4, 10)
    for unit, of in ((1e-3, com), (diagonal / 100, com), (norm(truth[inertia]) / 100, inertia)):
        found, half, plain = (
            norm(each[of]) / unit for each in (errors[0], (high - low) / 2, errors[1])
        )
        yield "" if np.isnan(found) else f"{found:.2f} ± {half:.2f}"
        yield "" if np.isnan(plain) else f"{plain:.2f}"
    inside = (low <= truth) & (truth <= high)
    yield f"{inside.sum()} of {(~np.isnan(truth)).sum()}"


def norm(vector: Array) -> float:
    """Returns the length of a vector; of an inertia, its six entries count the same."""
    return float(np.linalg.norm(vector))


SOURCES: list[Callable[[Path], Iterator[Row]]] = [
    weighed_loads,
    *(partial(unloaded_arm, arm=arm) for arm in ARMS),
    *(partial(workshop_tool, tool=tool) for tool in TOOLS),
]


def main(data: Path) -> None:
    """Prints a row for each payload, and a line for each source that is missing."""
    table = Table(title="Errors of tactid with 95 % intervals, and of a plain fit")
    for title in ("robot", "recording", "mass kg", "mass %", "plain", "centre mm", "plain"):
        table.add_column(title, justify="left" if title in ("robot", "recording") else "right")
    for title in ("of the box %", "plain", "inertia %", "plain", "inside"):
        table.add_column(title, justify="right")
    console = Console(width=180)
    for source in SOURCES:
        try:
            for row in source(data):
                table.add_row(*cells(row))
        except MissingError as missing:
            console.print(str(missing), soft_wrap=True)
    console.print(table)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
