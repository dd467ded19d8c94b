"""Random recordings with one fault, with two, and without: is the cause named, is the answer right?

Run by ``python bench/random_faults.py [--faults N] [--sound N] [--pairs N] [--kind NAME]``; needs
``pin``, ``example-robot-data`` and ``rosbags``. Each problem has another arm, body, motion, noise
and rates. A fault is handled if the first command is right, or if it names the cause first and,
with the option that the message names, the answer is right. A wrong answer without a contradiction
counts as wrong.
"""

import argparse
import collections
import re
import shutil
import sysconfig
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import tactid
from tactid._base.values import values_of

Array = NDArray[np.float64]

ROBOTS = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix/share/example-robot-data/robots"
ARMS = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "tool0", 5.0),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", "tool0", 6.0),
    "panda": ("panda_description/urdf/panda.urdf", "panda_link8", 3.0),
    "kinova": ("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector", 2.2),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", "link_eef", 3.5),
}
"""File, tip and largest payload, kg."""

DOWN = np.array([0, 0, -9.81])
NOISE = np.array([0.3, 0.3, 0.3, 0.02, 0.02, 0.02])
LARGEST_ERROR = 3.5
"""Of a value, in its standard deviations."""

START_S = 1_700_000_000.0
STORE = get_typestore(Stores.ROS2_HUMBLE)
ROS1 = get_typestore(Stores.ROS1_NOETIC)
JOINTS, WRENCH = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"
IMU, FRAMES = "sensor_msgs/msg/Imu", "tf2_msgs/msg/TFMessage"


class Arm:
    """A robot of example-robot-data, down to its tip."""

    def __init__(self, name: str) -> None:
        file, self.tip, self.most_kg = ARMS[name]
        self.urdf = chain_to_tip((ROBOTS / file).read_text(), self.tip)
        self.model = pin.buildModelFromXML(self.urdf)
        self.data = self.model.createData()
        self.frame = self.model.getFrameId(self.tip)
        self.joints = [str(joint) for joint in self.model.names[1:]]
        lower, upper = (np.full(len(self.joints), limit) for limit in (-2.8, 2.8))
        for k, joint in enumerate(self.model.joints[1:]):
            if joint.nq == 1:
                lower[k] = max(lower[k], self.model.lowerPositionLimit[joint.idx_q])
                upper[k] = min(upper[k], self.model.upperPositionLimit[joint.idx_q])
        # Joints with limits beyond a turn, as those of Kinova, have their middle at half a turn.
        self.lower, self.upper = lower, np.where(upper > lower, upper, lower + 1)

    def configuration(self, q: Array) -> Array:
        """Returns Pinocchio's coordinates, a cosine and a sine for a continuous joint."""
        parts = [
            [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
            for value, joint in zip(q, self.model.joints[1:], strict=True)
        ]
        return np.concatenate(parts)


def chain_to_tip(text: str, tip: str) -> str:
    """Returns the description with the chain to the tip alone, without shapes."""
    root = ET.fromstring(text)
    joints = {joint.find("child").attrib["link"]: joint for joint in root.findall("joint")}
    links, kept, link = {tip}, [], tip
    while link in joints:
        kept.append(joints[link])
        link = joints[link].find("parent").attrib["link"]
        links.add(link)
    for child in list(root):
        own = child in kept if child.tag == "joint" else child.attrib.get("name") in links
        if child.tag not in ("joint", "link") or not own:
            root.remove(child)
        for shape in child.findall("visual") + child.findall("collision"):
            child.remove(shape)
    return ET.tostring(root, encoding="unicode")


@dataclass
class Recording:
    """What is recorded: motion and wrenches at their times, and how they are published."""

    arm: Arm
    body: tactid.MassProperties
    random: np.random.Generator
    noise: float
    time: Array
    wrench_time: Array
    gravity: Array = field(default_factory=lambda: DOWN)
    has_velocity: bool = True

    def __post_init__(self) -> None:
        arm, random = self.arm, self.random
        count, duration = len(arm.joints), self.time[-1]
        span = arm.upper - arm.lower
        size = np.minimum(random.uniform(0.15, 0.7) * random.uniform(0.7, 1.3, count), 0.3 * span)
        room = 0.5 * span - size - 0.02
        self.middle = 0.5 * (arm.upper + arm.lower) + room * random.uniform(-0.7, 0.7, count)
        shares = random.dirichlet([2, 2, 2], count).T * size
        rates = 2 * np.pi * random.uniform(max(0.1, 1 / duration), 0.55, (3, count))
        self.swings = shares, rates, random.uniform(0, 2 * np.pi, (3, count))
        inertia = pin.Inertia(self.body.mass, np.array(self.body.com), inertia_of(self.body))
        self.inertia = inertia

    def motion(self, time: Array) -> tuple[Array, Array, Array]:
        """Returns positions, velocities and accelerations of the joints."""
        shares, rates, phases = self.swings
        angle = time[:, None, None] * rates + phases
        return (
            self.middle + np.sum(shares * np.sin(angle), axis=1),
            np.sum(shares * rates * np.cos(angle), axis=1),
            -np.sum(shares * rates**2 * np.sin(angle), axis=1),
        )

    def tool(self, time: Array, q: Array | None = None) -> list[tuple[Any, Any, Array]]:
        """Returns velocity, acceleration without gravity, and pose of the tip."""
        arm, found = self.arm, []
        exact, v, a = self.motion(time)
        for at in zip(exact if q is None else q, v, a, strict=True):
            pin.forwardKinematics(arm.model, arm.data, arm.configuration(at[0]), at[1], at[2])
            pin.updateFramePlacement(arm.model, arm.data, arm.frame)
            found.append(
                (
                    pin.getFrameVelocity(arm.model, arm.data, arm.frame, pin.LOCAL),
                    pin.getFrameAcceleration(arm.model, arm.data, arm.frame, pin.LOCAL),
                    arm.data.oMf[arm.frame].homogeneous.copy(),
                )
            )
        return found

    def wrench(self, time: Array, body: Any = None, moves: bool = True) -> Array:
        """Returns the wrench on the sensor of a body, or of its weight alone, without noise."""
        body = body or self.inertia
        # At most 250 Hz are computed: nothing moves faster.
        step = max(1, int(0.004 / max(np.diff(time[:2])[0], 1e-9)))
        coarse = np.append(time[:-1:step], time[-1])
        wrenches = []
        for velocity, acceleration, pose in self.tool(coarse):
            linear = acceleration.linear * moves - pose[:3, :3].T @ self.gravity
            felt = pin.Motion(linear, acceleration.angular * moves)
            force = body * felt
            if moves:
                force = force + velocity.cross(body * velocity)
            wrenches.append(-np.r_[force.linear, force.angular])
        return np.stack([np.interp(time, coarse, row) for row in np.transpose(wrenches)], axis=1)

    def noisy(self, wrench: Array) -> Array:
        """Returns wrenches with the noise of the sensor."""
        return wrench + self.noise * NOISE * self.random.normal(size=wrench.shape)

    def efforts(self, loaded: bool, moves: bool = True) -> Array:
        """Returns the efforts of the arm with or without the body, or those of gravity alone."""
        arm = self.arm
        model = arm.model.copy()
        if loaded:
            frame = arm.model.frames[arm.frame]
            model.appendBodyToJoint(frame.parentJoint, self.inertia, frame.placement)
        data = model.createData()
        rows = [
            pin.rnea(model, data, arm.configuration(q), v * moves, a * moves)
            for q, v, a in zip(*self.motion(self.time), strict=True)
        ]
        return np.array(rows)


def random_turn(random: np.random.Generator) -> Array:
    """Returns a random rotation."""
    numbers = random.normal(size=4)
    return np.asarray(pin.Quaternion(numbers / np.linalg.norm(numbers)).toRotationMatrix())


def quaternion(turn: Array) -> list[float]:
    """Returns the quaternion of a rotation: x, y, z, w."""
    return [float(number) for number in pin.Quaternion(turn).coeffs()]


def inertia_of(body: tactid.MassProperties) -> Array:
    """Returns the inertia of a body about its centre of mass."""
    return np.asarray(body.inertia, dtype=float)


def recording(random: np.random.Generator, **settings: Any) -> Recording:
    """Draws a recording of a random body on a random arm."""
    arm = Arm(settings.pop("arm", None) or str(random.choice(list(ARMS))))
    mass = min(0.3 * 20 ** random.uniform(), arm.most_kg)
    size = random.uniform(0.06, 0.25, 3)
    turn = random_turn(random)
    inertia = mass / 12 * turn @ np.diag(np.sum(size**2) - size**2) @ turn.T
    body = tactid.MassProperties(mass, random.uniform(-1, 1, 3) * [0.06, 0.06, 0.12], inertia)
    duration = settings.pop("duration", None) or float(random.choice([8, 20, 60]))
    rates = settings.pop("rates", None) or [50 * 20 ** random.uniform() for _ in range(2)]
    rates = [min(rate, 12_000 / duration) for rate in rates]
    times = [np.arange(0.0, duration, 1 / rate) for rate in rates]
    times[1] = times[1] + random.uniform(0, 0.5 / rates[1])
    return Recording(arm, body, random, 0.3 * 10 ** random.uniform(), *times, **settings)


# How a recording is written.


@dataclass
class Problem:
    """What a user has: a source, the options of the first command, and the truth."""

    source: Any
    options: dict[str, Any]
    truth: Any
    causes: tuple[str, ...] = ()
    """Patterns of what must be named: a hypothesis, the kind of a finding, or words."""
    remedy: dict[str, Any] | None = None
    """Options with which the answer is right; the message names the first one."""
    tolerance: float = 0.0
    """Relative error of a sensor that is still sound."""
    label: str = ""
    """The faults of a recording that has two."""


def header(time: float, frame: str, store: Any = STORE) -> Any:
    """Returns a header."""
    nanoseconds = round(time * 1e9)
    stamp = store.types["builtin_interfaces/msg/Time"](*divmod(nanoseconds, 10**9))
    number = (0,) if store is ROS1 else ()
    return store.types["std_msgs/msg/Header"](*number, stamp, frame)


def vector(values: Iterable[float], store: Any = STORE) -> Any:
    """Returns a vector."""
    return store.types["geometry_msgs/msg/Vector3"](*map(float, values))


def wrench_message(time: float, frame: str, wrench: Array, store: Any = STORE) -> Any:
    """Returns a message with a wrench."""
    both = store.types["geometry_msgs/msg/Wrench"](
        vector(wrench[:3], store), vector(wrench[3:], store)
    )
    return store.types[WRENCH](header(time, frame, store), both)


def joint_message(
    time: float, names: list[str], q: Array, v: Any = (), e: Any = (), store: Any = STORE
) -> Any:
    """Returns a message with the state of joints."""
    numbers = [np.asarray(each, dtype=float) for each in (q, v, e)]
    return store.types[JOINTS](header(time, "", store), names, *numbers)


def transform(time: float, parent: str, child: str, place: Array, turn: Array) -> Any:
    """A message with one transform."""
    types = STORE.types
    rotation = types["geometry_msgs/msg/Quaternion"](*quaternion(turn))
    both = types["geometry_msgs/msg/Transform"](vector(place), rotation)
    stamped = types["geometry_msgs/msg/TransformStamped"](header(time, parent), child, both)
    return types[FRAMES]([stamped])


Messages = list[tuple[float, str, str, Any]]
Stamp = Callable[[float], float]


def stamped(time: float) -> float:
    """Returns the time of a sample on the clock of the wall."""
    return START_S + time


def joint_messages(
    made: Recording,
    q: Array | None = None,
    effort: Array | None = None,
    stamp: Stamp = stamped,
    logged: Stamp = stamped,
) -> Messages:
    """Returns the messages of the joints."""
    exact, v, _ = made.motion(made.time)
    q = exact if q is None else q
    return [
        (
            logged(time),
            "/joint_states",
            JOINTS,
            joint_message(
                stamp(time),
                made.arm.joints,
                q[k],
                v[k] if made.has_velocity else (),
                () if effort is None else effort[k],
            ),
        )
        for k, time in enumerate(made.time)
    ]


def wrench_messages(
    made: Recording,
    wrench: Array,
    frame: str | None = None,
    stamp: Stamp = stamped,
    logged: Stamp = stamped,
) -> Messages:
    """Returns the messages of the sensor."""
    frame = made.arm.tip if frame is None else frame
    return [
        (logged(time) + 1e-4, "/wrench", WRENCH, wrench_message(stamp(time), frame, wrench[k]))
        for k, time in enumerate(made.wrench_time)
    ]


def written(folder: Path, messages: Messages) -> Path:
    """Writes a bag."""
    bag_folder = folder / "bag"
    with Writer(bag_folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connections: dict[str, Any] = {}
        for time, topic, kind, message in sorted(messages, key=lambda each: each[0]):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=STORE)
            raw = STORE.serialize_cdr(message, kind)
            bag.write(connections[topic], round(time * 1e9), raw)
    return bag_folder


def given(folder: Path, made: Recording, **options: Any) -> dict[str, Any]:
    """Returns the options of the first command."""
    urdf = folder / "arm.urdf"
    urdf.write_text(made.arm.urdf)
    return {"urdf": urdf, "tip": made.arm.tip, **options}


def with_wrench(
    folder: Path, made: Recording, wrench: Array, *causes: str, q: Array | None = None, **more: Any
) -> Problem:
    """Writes a bag of joints and wrenches on the sensor."""
    frame = more.pop("frame", None)
    log = written(folder, joint_messages(made, q=q) + wrench_messages(made, wrench, frame))
    options = given(folder, made, wrench_acts_on="sensor")
    return Problem(log, options, made.body, causes, **more)


# Faults of the sensor and the robot, which are combined in pairs.


@dataclass
class Wrong:
    """What hypotheses change: wrenches and recorded positions."""

    made: Recording
    wrench: Array
    q: Array
    causes: list[str] = field(default_factory=list)
    remedy: dict[str, Any] | None = None


def subtracted_weight(wrong: Wrong) -> None:
    """Subtracts the weight of a configured body."""
    made, random = wrong.made, wrong.made.random
    mass = made.body.mass * random.uniform(0.25, 0.8)
    body = pin.Inertia(mass, random.uniform(-0.05, 0.05, 3), 1e-9 * np.eye(3))
    wrong.wrench -= made.wrench(made.wrench_time, body, moves=False)
    wrong.causes.append("weight")
    wrong.remedy = {"wrench_is": "without-weight"}


def offset(wrong: Wrong) -> None:
    """Adds a constant."""
    scale = wrong.made.random.uniform(2, 20)
    wrong.wrench += scale * np.repeat([1, 0.04], 3) * wrong.made.random.normal(size=6)
    wrong.causes.append("offset")


def zeroed(wrong: Wrong) -> None:
    """Subtracts the first wrench."""
    wrong.wrench -= wrong.wrench[0].copy()
    wrong.causes.append("offset")


def tilted_gravity(wrong: Wrong) -> None:
    """Mounted on a wall or askew: the recording's gravity is drawn before."""
    wrong.causes.append("gravity")
    wrong.remedy = {"gravity": "unknown"}


def one_sign(wrong: Wrong) -> None:
    """Changes the sign of one axis."""
    wrong.wrench[:, wrong.made.random.integers(6)] *= -1
    # A gain of -1 says the same.
    wrong.causes.append("axes|axis_gains")


def all_signs(wrong: Wrong) -> None:
    """Changes the sign of all axes."""
    wrong.wrench *= -1
    wrong.causes.append("axes|negative_mass")
    wrong.remedy = {"wrench_acts_on": "payload"}


def exchanged_axes(wrong: Wrong) -> None:
    """Exchanges axes of forces and of moments together."""
    places = [[1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]]
    order = np.array(places[wrong.made.random.integers(5)])
    turn = np.eye(3)[order]
    if np.linalg.det(turn) < 0:
        turn = -turn
    # A turn by multiples of a right angle is a rotation of the sensor, too.
    wrong.wrench = np.hstack([wrong.wrench[:, :3] @ turn.T, wrong.wrench[:, 3:] @ turn.T])
    wrong.causes.append("axes|sensor_rotation")


def shifted(wrong: Wrong) -> None:
    """Places the sensor elsewhere."""
    direction = wrong.made.random.normal(size=3)
    place = wrong.made.random.uniform(0.01, 0.04) * direction / np.linalg.norm(direction)
    wrong.wrench[:, 3:] -= np.cross(place, wrong.wrench[:, :3])
    wrong.causes.append("sensor_place")
    wrong.remedy = {"sensor_frame": [wrong.made.arm.tip, *place, 0, 0, 0, 1]}


def turned(wrong: Wrong) -> None:
    """Turns the sensor."""
    direction = wrong.made.random.normal(size=3)
    angle = np.radians(wrong.made.random.uniform(5, 90))
    turn = pin.exp3(angle * direction / np.linalg.norm(direction))
    for first in (0, 3):
        axes = slice(first, first + 3)
        wrong.wrench[:, axes] = wrong.wrench[:, axes] @ turn
    wrong.causes.append("sensor_rotation")
    wrong.remedy = {"sensor_frame": [wrong.made.arm.tip, 0, 0, 0, *quaternion(turn)]}


def gain(wrong: Wrong) -> None:
    """Changes the gain of one axis."""
    sign = wrong.made.random.choice([-1, 1])
    factor = 1 + sign * wrong.made.random.uniform(0.05, 0.2)
    wrong.wrench[:, wrong.made.random.integers(6)] *= factor
    wrong.causes.append("axis_gains")


def joint_zero(wrong: Wrong) -> None:
    """Not the first joint's, about the vertical, nor the last one's, which turns the payload."""
    random = wrong.made.random
    joint = random.integers(1, len(wrong.made.arm.joints) - 1)
    wrong.q[:, joint] += random.choice([-1, 1]) * np.radians(random.uniform(2, 10))
    wrong.causes.append("joint_zeros")


def delayed(wrong: Wrong) -> None:
    """Delays the wrenches."""
    made = wrong.made
    delay = made.random.uniform(0.005, 0.06)
    for row in wrong.wrench.T:
        row[:] = np.interp(made.wrench_time - delay, made.wrench_time, row)
    wrong.causes.append("delay")


HYPOTHESES: dict[str, Callable[[Wrong], None]] = {
    "weight subtracted": subtracted_weight,
    "offset": offset,
    "zeroed in pose": zeroed,
    "gravity": tilted_gravity,
    "sign of one axis": one_sign,
    "all signs": all_signs,
    "exchanged axes": exchanged_axes,
    "sensor's place": shifted,
    "sensor's rotation": turned,
    "gain of an axis": gain,
    "joint's zero": joint_zero,
    "delay": delayed,
}


def draw_gravity(random: np.random.Generator) -> Array:
    """Returns gravity in the axes of a base that is tilted, or on a wall."""
    axis = np.append(random.normal(size=2), 0.0)
    axis /= np.linalg.norm(axis)
    angle = np.radians(random.choice([90, random.uniform(5, 60)])) + random.uniform(-0.15, 0.15)
    return np.asarray(pin.exp3(angle * axis) @ DOWN)


def by_hypotheses(folder: Path, random: np.random.Generator, names: list[str]) -> Problem:
    """Writes a recording with some faults of sensor and robot."""
    is_tilted = "gravity" in names
    made = recording(random, gravity=draw_gravity(random) if is_tilted else DOWN)
    wrong = Wrong(made, made.wrench(made.wrench_time), made.motion(made.time)[0])
    for name in sorted(names, key=list(HYPOTHESES).index):
        HYPOTHESES[name](wrong)
    remedy = wrong.remedy if len(names) == 1 else None
    wrench = made.noisy(wrong.wrench)
    return with_wrench(folder, made, wrench, *wrong.causes, q=wrong.q, remedy=remedy)


# What drivers and recorders do.


def efforts(folder: Path, random: np.random.Generator, kind: str) -> Problem:
    """Writes a recording of efforts, which contain all or a part of what moves the arm."""
    made = recording(random)
    effort = made.efforts(loaded=True)
    if kind == "external":
        effort -= made.efforts(loaded=False)
    elif kind == "without-gravity":
        effort -= made.efforts(loaded=False, moves=False)
    effort += 0.2 * made.noise * random.normal(size=effort.shape)
    log = written(folder, joint_messages(made, effort=effort))
    is_sound = kind == "measured"
    causes = () if is_sound else ("efforts.are",)
    remedy = None if is_sound else {"efforts_are": kind}
    return Problem(log, given(folder, made), made.body, causes, remedy)


def attitudes(random: np.random.Generator, count: int, largest_deg: float) -> list[Array]:
    """Returns attitudes about one that points down."""
    turns = np.radians(largest_deg) * random.uniform(-1, 1, (count, 3)) / 1.2
    return [np.diag([1.0, -1, -1]) @ pin.exp3(turn) for turn in turns]


def sensor_zero(random: np.random.Generator) -> Array:
    """Returns a zero that was never set."""
    return random.normal(size=6) * [5, 5, 15, 0.05, 0.05, 0.05]


def weights(body: tactid.MassProperties, turns: Array) -> Array:
    """Returns the wrenches of the weight of a body."""
    force = body.mass * np.einsum("nji,j->ni", turns, DOWN)
    return np.hstack([force, np.cross(np.asarray(body.com), force)])


def offset_hidden(_: Path, random: np.random.Generator) -> Problem:
    """Returns a recording of rests with hysteresis, at 10 Hz and without a robot."""
    made, count = recording(random), int(random.integers(15, 30))
    turns = attitudes(random, count, 110)
    rests = random.normal(size=(count, 6)) * [0.25, 0.25, 0.25, 0.012, 0.012, 0.012] * made.noise
    poses: list[Array] = []
    errors: list[Array] = []
    for k in range(count):
        poses += [turns[k]] * 40
        errors += [rests[k]] * 40
        if k + 1 < count:
            turn = pin.log3(turns[k + 1] @ turns[k].T)
            for u in np.arange(1, 31) / 31:
                u = 3 * u**2 - 2 * u**3
                poses.append(pin.exp3(u * turn) @ turns[k])
                errors.append(rests[k] * (1 - u) + rests[k + 1] * u)
    wrench = weights(made.body, np.array(poses))
    wrench += sensor_zero(random) + errors + 0.07 * NOISE * random.normal(size=wrench.shape)
    place = np.tile([0.4, 0, 0.5], (len(poses), 1))
    options = {"pose": np.hstack([place, [quaternion(pose) for pose in poses]]), "wrench": wrench}
    time = 0.1 * np.arange(len(poses))
    return Problem(time, {**options, "wrench_acts_on": "sensor"}, made.body, ("offset",))


def static_poses(_: Path, random: np.random.Generator) -> Problem:
    """Returns poses at rest, without times."""
    made, count = recording(random), int(random.integers(8, 30))
    turns = [random_turn(random) for _ in range(count)]
    wrench = weights(made.body, np.array(turns)) + sensor_zero(random)
    wrench += 0.1 * made.noise * NOISE * random.normal(size=wrench.shape)
    pose = np.hstack([np.tile([0.4, 0, 0.5], (count, 1)), [quaternion(turn) for turn in turns]])
    return Problem("poses", {"pose": pose, "wrench": wrench, "wrench_acts_on": "sensor"}, made.body)


def wrapped(folder: Path, random: np.random.Generator, velocity: bool, drops: float) -> Problem:
    """Writes a recording of angles that start again after a turn."""
    made = recording(random, arm=str(random.choice(["ur5", "ur10", "kinova"])))
    made.has_velocity = velocity
    arm = made.arm
    turning = [k for k in range(len(arm.joints)) if k % 2 == 0 or random.uniform() < 0.5]
    root = ET.fromstring(arm.urdf)
    for joint in root.findall("joint"):
        if joint.attrib["name"] in [arm.joints[k] for k in turning]:
            joint.attrib["type"] = "continuous"
    # The model of Pinocchio stays: both describe the same arm.
    arm.urdf = ET.tostring(root, encoding="unicode")
    near = random.choice([-np.pi, np.pi], len(turning)) + random.uniform(-0.2, 0.2, len(turning))
    made.middle[turning] = near
    wrench = made.noisy(made.wrench(made.wrench_time))
    q = made.motion(made.time)[0]
    q[:, turning] = (q[:, turning] + np.pi) % (2 * np.pi) - np.pi
    joints = joint_messages(made, q=q)
    joints = [each for each in joints if random.uniform() >= drops]
    log = written(folder, joints + wrench_messages(made, wrench))
    return Problem(log, given(folder, made, wrench_acts_on="sensor"), made.body)


def force_only(folder: Path, random: np.random.Generator, kind: str) -> Problem:
    """Writes a recording of a sensor that measures three forces or one."""
    made = recording(random)
    wrench = made.noisy(made.wrench(made.wrench_time))
    if kind == "one":
        wrench *= np.eye(6)[random.integers(3)]
    else:
        wrench[:, 3:] = 0.0 if kind == "zeros" else np.nan
    return with_wrench(folder, made, wrench)


def aliasing(folder: Path, random: np.random.Generator) -> Problem:
    """Writes a recording of a fast sensor with a vibration near the rate of the joints."""
    rate = float(random.choice([100, 125, 250]))
    made = recording(random, rates=[rate, float(random.choice([1000, 2000, 4000]))], duration=8.0)
    # A rate of 4 kHz is that of more samples than others have.
    made.wrench_time = np.arange(0.0005, 7.99, 1 / float(random.choice([1000, 2000, 4000])))
    frequency = rate + random.uniform(0.2, 1.0)
    swing = np.sin(2 * np.pi * frequency * made.wrench_time)[:, None]
    vibration = swing * random.normal(size=6) * [4, 4, 4, 0.3, 0.3, 0.3]
    return with_wrench(folder, made, made.noisy(made.wrench(made.wrench_time)) + vibration)


def base_axes(folder: Path, random: np.random.Generator, named: bool) -> Problem:
    """Writes a recording of wrenches in the axes of the base about the origin of the tip."""
    made = recording(random)
    wrench = made.wrench(made.wrench_time)
    poses = np.array([pose for _, _, pose in made.tool(made.wrench_time)])
    for first in (0, 3):
        axes = slice(first, first + 3)
        wrench[:, axes] = np.einsum("nij,nj->ni", poses[:, :3, :3], wrench[:, axes])
    base = ET.fromstring(made.arm.urdf)
    children = {joint.find("child").attrib["link"] for joint in base.findall("joint")}
    link = next(
        each.attrib["name"] for each in base.findall("link") if each.attrib["name"] not in children
    )
    if named:
        return with_wrench(folder, made, made.noisy(wrench), "wrench.axes", frame=link)
    remedy = {"wrench_axes": link}
    return with_wrench(folder, made, made.noisy(wrench), "wrench.axes", frame="", remedy=remedy)


def moving_frame(folder: Path, random: np.random.Generator) -> Problem:
    """Writes a recording in which the frame of the sensor is in `/tf` alone."""
    made = recording(random)
    messages = joint_messages(made)
    root = ET.fromstring(made.arm.urdf)
    children = {joint.find("child").attrib["link"] for joint in root.findall("joint")}
    base = next(
        each.attrib["name"] for each in root.findall("link") if each.attrib["name"] not in children
    )
    for (_, _, pose), time in zip(made.tool(made.time), made.time, strict=True):
        turn = pose[:3, :3]
        message = transform(stamped(time), base, "controller_frame", pose[:3, 3], turn)
        messages.append((stamped(time), "/tf", FRAMES, message))
    wrench = made.noisy(made.wrench(made.wrench_time))
    log = written(folder, messages + wrench_messages(made, wrench, "controller_frame"))
    return Problem(log, given(folder, made, wrench_acts_on="sensor"), made.body)


def two_publishers(folder: Path, random: np.random.Generator) -> Problem:
    """Writes a recording in which another publisher sends zeros for the joints."""
    made = recording(random)
    messages = joint_messages(made)
    messages += wrench_messages(made, made.noisy(made.wrench(made.wrench_time)))
    names = [str(name) for name in random.permutation(made.arm.joints)]
    rate = random.uniform(2, 60)
    for time in np.arange(0, made.time[-1], 1 / rate) + 0.003:
        message = joint_message(stamped(time), names, np.zeros(len(names)))
        messages.append((stamped(time), "/joint_states", JOINTS, message))
    log = written(folder, messages)
    options = given(folder, made, wrench_acts_on="sensor")
    return Problem(log, options, made.body, ("positions_jump|publisher",))


def imu(folder: Path, random: np.random.Generator, kind: str) -> Problem:
    """Writes a recording of a sensor with an inertial unit, without a robot."""
    made = recording(random, rates=[float(random.uniform(100, 400))] * 2, duration=20.0)
    made.wrench_time = made.time
    turn, place = np.eye(3), np.zeros(3)
    if kind != "same":
        turn = random_turn(random)
        place = random.uniform(-0.03, 0.03, 3)
    rows = []
    for velocity, acceleration, pose in made.tool(made.time):
        spin = velocity.angular
        felt = acceleration.linear + np.cross(spin, velocity.linear)
        felt = felt + np.cross(acceleration.angular, place) + np.cross(spin, np.cross(spin, place))
        felt = felt - pose[:3, :3].T @ DOWN
        rows.append(np.r_[turn.T @ felt, turn.T @ spin])
    noise = random.normal(size=(len(rows), 6)) * np.repeat([0.05, 0.002], 3)
    rows = np.array(rows) + noise * made.noise
    unknown = np.zeros(9)
    unknown[0] = -1
    messages: Messages = []
    unmeasured = STORE.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 0.0)
    frame = "ft_sensor" if kind == "same" else "ft_imu"
    for time, row in zip(made.time, rows, strict=True):
        message = STORE.types[IMU](
            header(stamped(time), frame),
            unmeasured,
            unknown,
            vector(row[3:]),
            np.zeros(9),
            vector(row[:3]),
            np.zeros(9),
        )
        messages.append((stamped(time), "/ft/imu", IMU, message))
    if kind == "child":
        tree = [("ft_sensor", "ft_imu", place, turn)]
    elif kind == "parent":
        tree = [("ft_imu", "ft_sensor", -turn.T @ place, turn.T)]
    else:
        tree = [
            ("ft_base", "ft_sensor", np.zeros(3), np.eye(3)),
            ("ft_base", "ft_imu", place, turn),
        ]
    for parent, child, at, rotation in tree:
        message = transform(START_S, parent, child, at, rotation)
        messages.append((START_S, "/tf_static", FRAMES, message))
    wrench = made.noisy(made.wrench(made.time))
    log = written(folder, messages + wrench_messages(made, wrench, "ft_sensor"))
    return Problem(log, {"wrench_acts_on": "sensor"}, made.body)


def simulated_time(folder: Path, random: np.random.Generator, kind: str) -> Problem:
    """Writes a recording whose stamps are those of a simulation."""
    made = recording(random)
    factor = 1 + random.uniform(-0.05, 0.05) if kind == "near" else 0.2 * 25 ** random.uniform()
    first = random.uniform(0, 100)

    def logged(time: float) -> float:
        return START_S + time / factor

    def simulated(time: float) -> float:
        return first + time

    def none(_: float) -> float:
        return 0.0

    wrench = made.noisy(made.wrench(made.wrench_time))
    joints = joint_messages(made, stamp=simulated, logged=logged)
    stamp = none if kind == "no stamps" else simulated
    log = written(folder, joints + wrench_messages(made, wrench, stamp=stamp, logged=logged))
    causes = ("stamp|clock",) if kind == "no stamps" else ()
    return Problem(log, given(folder, made, wrench_acts_on="sensor"), made.body, causes)


def no_stamps(folder: Path, random: np.random.Generator) -> Problem:
    """No stamp in either stream, or in one beside stamps of the wall clock."""
    made = recording(random)
    wrench = made.noisy(made.wrench(made.wrench_time))
    without = random.integers(3)
    stamps: list[Stamp] = [(lambda _: 0.0) if without in (k, 2) else stamped for k in range(2)]
    joints = joint_messages(made, stamp=stamps[0])
    log = written(folder, joints + wrench_messages(made, wrench, stamp=stamps[1]))
    return Problem(log, given(folder, made, wrench_acts_on="sensor"), made.body)


def ros1(folder: Path, random: np.random.Generator) -> Problem:
    """Writes a ROS 1 bag."""
    made = recording(random, duration=8.0)
    q, v, _ = made.motion(made.time)
    wrench = made.noisy(made.wrench(made.wrench_time))
    log = folder / "recorded.bag"
    messages = [
        (
            time,
            "/joint_states",
            JOINTS,
            joint_message(stamped(time), made.arm.joints, q[k], v[k], np.zeros(len(q[k])), ROS1),
        )
        for k, time in enumerate(made.time)
    ] + [
        (time, "/wrench", WRENCH, wrench_message(stamped(time), made.arm.tip, wrench[k], ROS1))
        for k, time in enumerate(made.wrench_time)
    ]
    with Rosbag1Writer(log) as bag:
        topics = {"/joint_states": JOINTS, "/wrench": WRENCH}
        connections = {
            topic: bag.add_connection(topic, kind, typestore=ROS1) for topic, kind in topics.items()
        }
        for time, topic, kind, message in sorted(messages, key=lambda each: each[0]):
            raw = ROS1.serialize_ros1(message, kind)
            bag.write(connections[topic], round(stamped(time) * 1e9), raw)
    return Problem(log, given(folder, made, wrench_acts_on="sensor"), made.body)


def sound(folder: Path, random: np.random.Generator, kind: str) -> Problem:
    """Writes a recording without a fault."""
    if kind == "efforts":
        return efforts(folder, random, "measured")
    made = recording(random)
    made.has_velocity = kind != "no velocities"
    wrench = made.wrench(made.wrench_time)
    tolerance = 0.0
    if kind == "cross-talk":
        scale = np.repeat([1, 0.1], 3)
        mixed = 0.005 * random.uniform(-1, 1, (6, 6)) * scale[:, None] / scale
        wrench = wrench + wrench @ mixed.T
        tolerance = 0.03
    return with_wrench(folder, made, made.noisy(wrench), tolerance=tolerance)


Kind = Callable[[Path, np.random.Generator], Problem]

SOUND: dict[str, Kind] = {
    f"sound, {kind}": lambda folder, random, kind=kind: sound(folder, random, kind)
    for kind in ("wrench", "no velocities", "cross-talk", "efforts")
}

FAULTS: dict[str, Kind] = {
    **{
        name: lambda folder, random, name=name: by_hypotheses(folder, random, [name])
        for name in HYPOTHESES
    },
    "external efforts": lambda folder, random: efforts(folder, random, "external"),
    "efforts without gravity": lambda folder, random: efforts(folder, random, "without-gravity"),
    "offset hidden": offset_hidden,
    "static poses": static_poses,
    "wrapped": lambda folder, random: wrapped(folder, random, True, 0.0),
    "wrapped, no velocities": lambda folder, random: wrapped(folder, random, False, 0.0),
    "wrapped, drop-outs": lambda folder, random: wrapped(folder, random, True, 0.05),
    "moments zero": lambda folder, random: force_only(folder, random, "zeros"),
    "moments NaN": lambda folder, random: force_only(folder, random, "NaN"),
    "one axis": lambda folder, random: force_only(folder, random, "one"),
    "aliasing": aliasing,
    "base axes": lambda folder, random: base_axes(folder, random, True),
    "base axes, no frame": lambda folder, random: base_axes(folder, random, False),
    "frame in /tf": moving_frame,
    "two publishers": two_publishers,
    "IMU, same frame": lambda folder, random: imu(folder, random, "same"),
    "IMU, child": lambda folder, random: imu(folder, random, "child"),
    "IMU, parent": lambda folder, random: imu(folder, random, "parent"),
    "IMU, sibling": lambda folder, random: imu(folder, random, "sibling"),
    "simulated time": lambda folder, random: simulated_time(folder, random, "far"),
    "simulated time near": lambda folder, random: simulated_time(folder, random, "near"),
    "simulated, no stamps": lambda folder, random: simulated_time(folder, random, "no stamps"),
    "no stamps": no_stamps,
    "ROS 1": ros1,
}


def pair(folder: Path, random: np.random.Generator) -> Problem:
    """Writes a recording with two faults of different kinds."""
    while True:
        names = [str(name) for name in random.choice(list(HYPOTHESES), 2, replace=False)]
        confused = [
            {"offset", "zeroed in pose"},
            {"sign of one axis", "all signs", "exchanged axes"},
            {"exchanged axes", "sensor's rotation"},
        ]
        if not any(set(names) <= each for each in confused):
            problem = by_hypotheses(folder, random, names)
            problem.label = " and ".join(names)
            return problem


# What comes out.


@dataclass
class Outcome:
    """What a command gives."""

    found: Any
    named: list[str]
    """For each finding that doubts the result or is a cause: its kind, cause and words."""
    refused: bool
    worst: float
    """Largest error of a determined value in its standard deviations."""

    @property
    def is_right(self) -> bool:
        """Whether the truth is within the intervals, and nothing contradicts it."""
        return not self.refused and self.worst < LARGEST_ERROR


def run(problem: Problem, more: dict[str, Any] | None = None) -> Outcome:
    """Runs the first command, or one with further options."""
    options = {**problem.options, **(more or {})}
    try:
        if isinstance(problem.source, str) and problem.source == "poses":
            found = tactid.identify_poses(**options)
        else:
            found = tactid.identify(problem.source, **options)
    except (tactid.TactidError, ValueError, TypeError) as error:
        return Outcome(None, [str(error)], True, np.inf)
    estimate = found.estimate
    known = np.array(estimate.identifiable)
    errors = np.abs(np.asarray(estimate.values) - values_of(problem.truth))
    truth = np.abs(values_of(problem.truth))
    own = problem.tolerance * np.repeat([truth[0], truth[1:4].max(), truth[4:].max()], [1, 3, 6])
    std_devs = np.asarray(estimate.std_devs)
    distance = np.where(known, np.maximum(errors - own, 0) / std_devs, 0.0)
    worst = float(np.nanmax(np.nan_to_num(distance, nan=0.0)))
    # The order in which a reader meets them.
    ranked = sorted(found.findings, key=lambda each: (each.severity == "notes", each.rank))
    measured = any(each.subject == "measurements" for each in ranked)
    named = [words(each) for each in ranked if not (measured and each.subject == "consequence")]
    refused = bool(found.is_contradicted) or not known.any()
    return Outcome(found, named, refused, worst)


def words(finding: Any) -> str:
    """Returns severity, kind and causes of a finding with its words."""
    data = finding.data
    second = data.get("runner_up") if finding.kind == "wrong_assumption" else None
    cause = "/".join(filter(None, [data.get("cause"), second]))
    return f"{finding.severity}:{finding.kind}:{cause}: {finding}"


def names(text: str, pattern: str) -> bool:
    """Returns whether a finding or an error names a cause."""
    return any(
        re.search(
            rf"(:|/|\b){part}(\b|:|/)",
            text.split(": ")[0] if "wrong_assumption" in text and "." not in part else text,
        )
        for part in pattern.split("|")
    )


def judge(problem: Problem, outcome: Outcome) -> tuple[str, Outcome | None]:
    """Returns what a problem with one fault counts as, and the outcome with the option."""
    if outcome.is_right:
        # An effect that is small is no contradiction, and may be named or not.
        return "right", None
    if not problem.causes:
        return ("wrong" if not outcome.refused else "refused"), None
    first = outcome.named[0] if outcome.named else ""
    if not names(first, problem.causes[0]):
        return ("wrong" if not outcome.refused else "other cause"), None
    if problem.remedy is None:
        return ("cause" if outcome.refused else "cause, exit 0"), None
    again = run(problem, problem.remedy)
    option = next(iter(problem.remedy))
    is_named = option in first
    if again.is_right and is_named:
        return ("option" if outcome.refused else "option, exit 0"), again
    return ("option wrong" if is_named else "option not named"), again


def judge_sound(outcome: Outcome) -> str:
    """Returns what a recording without a fault counts as."""
    if outcome.refused:
        return "refused"
    causes = [each for each in outcome.named if not each.startswith("notes:")]
    causes += [each for each in outcome.named if "wrong_assumption" in each]
    if causes:
        return "false cause"
    return "right" if outcome.is_right else "wrong"


def judge_pair(problem: Problem, outcome: Outcome) -> str:
    """Returns what a recording with two faults counts as."""
    found = [any(names(text, cause) for text in outcome.named) for cause in problem.causes]
    if all(found):
        return "both"
    if outcome.is_right:
        return "right"
    if not outcome.refused:
        return "wrong"
    return "one" if any(found) else "none"


def seed_of(name: str, number: int) -> np.random.Generator:
    """Returns the random numbers of a problem."""
    return np.random.default_rng([*name.encode(), number])


def problems(arguments: argparse.Namespace) -> list[tuple[str, Kind, int]]:
    """Returns the problems to run: kind, function and number."""
    kinds = [kind for kind in FAULTS if re.search(arguments.kind, kind)]
    made = [
        (kind, FAULTS[kind], k // len(kinds))
        for kind, k in ((kinds[k % len(kinds)], k) for k in range(arguments.faults if kinds else 0))
    ]
    sounds = [kind for kind in SOUND if re.search(arguments.kind, kind)]
    made += [
        (sounds[k % len(sounds)], SOUND[sounds[k % len(sounds)]], k // len(sounds))
        for k in range(arguments.sound if sounds else 0)
    ]
    made += [("two faults", pair, k) for k in range(arguments.pairs)]
    return made


def main() -> None:
    """Prints the table, and what was not handled."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=200)
    parser.add_argument("--sound", type=int, default=200)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--kind", default="", help="a pattern of the kinds to run")
    parser.add_argument("--number", type=int, help="one problem of each kind, by its number")
    parser.add_argument("--keep", type=Path, help="folder in which recordings are kept")
    arguments = parser.parse_args()
    counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    console = Console(stderr=True)
    for name, kind, number in track(problems(arguments), "problems", console=console):
        if arguments.number is not None and number != arguments.number:
            continue
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            problem = kind(folder, seed_of(name, number))
            outcome, again = run(problem), None
            if name in SOUND:
                verdict = judge_sound(outcome)
            elif name == "two faults":
                verdict = judge_pair(problem, outcome)
            else:
                verdict, again = judge(problem, outcome)
            if arguments.keep:
                shutil.copytree(folder, arguments.keep / f"{name} {number}", dirs_exist_ok=True)
        counts[name][verdict] += 1
        if verdict not in ("right", "option", "cause", "both"):
            report(f"{name} {number}: {verdict}", problem, outcome, again)
    table = Table("kind", *(columns := sorted({key for each in counts.values() for key in each})))
    for name, own in counts.items():
        table.add_row(name, *(str(own[key] or "") for key in columns))
    total = sum(counts.values(), collections.Counter())
    table.add_row("all", *(str(total[key]) for key in columns))
    Console(width=160).print(table)


def report(title: str, problem: Problem, outcome: Outcome, again: Outcome | None) -> None:
    """Prints what was not handled."""
    print(
        f"--- {title}; causes {problem.causes}; mass {problem.truth.mass:.3f} kg;"
        f" {problem.remedy or problem.label}"
    )
    for label, each in (("first", outcome), ("with the option", again)):
        if each is not None:
            mass = "" if each.found is None else f"mass {each.found.estimate.values[0]:.3f} kg"
            print(f"  {label}: refused {each.refused}, worst {each.worst:.1f}, {mass}")
            for text in each.named:
                print(f"    {text}")


if __name__ == "__main__":
    main()
