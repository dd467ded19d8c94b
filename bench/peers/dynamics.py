"""Kernels of the dynamics beside Pinocchio's in C++, on a UR5e."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import airo_models
import numpy as np

from peers.harness import Array, Comparison, Contender, peer
from peers.native import OWN_PROCESSOR, Kernel, handle, pointer, robot_library, tactid_library

TOOL = "tool0"
SECONDS = 0.02
"""Time of one measurement."""

SINGLE = 64
"""States that single calls go through in turn."""

BATCH = 4096

# Pinocchio has Iyy before Ixz.
PARAMETERS = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]


@dataclass
class States:
    """Random states: bases in world axes, and joints."""

    pose: Array
    twist: Array
    acceleration: Array
    joints: Array

    @classmethod
    def random(cls, count: int, dof: int, *, floating: bool) -> "States":
        """Draws states, the same in every run."""
        rng = np.random.default_rng(14)
        pose = np.tile([0.0, 0, 0, 0, 0, 0, 1], (count, 1))
        twist, acceleration = np.zeros((2, count, 6))
        if floating:
            pose = rng.normal(size=(count, 7))
            pose[:, 3:] /= np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)
            twist, acceleration = rng.normal(size=(2, count, 6))
        return cls(pose, twist, acceleration, rng.normal(size=(count, 3, dof)) * 1.5)

    def rotations(self) -> Array:
        """world_from_base of each state."""
        return rotations(self.pose[:, 3:])

    def ours(self) -> Array:
        """A row of each state in tactid's terms."""
        flat = self.joints.reshape(len(self.joints), -1)
        return np.hstack([self.pose, self.twist, self.acceleration, flat])

    def pinocchio(self, *, floating: bool) -> Array:
        """A row of each state in Pinocchio's terms: the base in its own axes, spatially."""
        q, v, a = (self.joints[:, k] for k in range(3))
        if floating:
            back = np.swapaxes(self.rotations(), 1, 2)
            turn = lambda vectors: np.einsum("kij,kj->ki", back, vectors)  # noqa: E731
            linear, angular = turn(self.twist[:, :3]), turn(self.twist[:, 3:])
            spatial = turn(self.acceleration[:, :3]) - np.cross(angular, linear)
            q = np.hstack([self.pose, q])
            v = np.hstack([linear, angular, v])
            a = np.hstack([spatial, turn(self.acceleration[:, 3:]), a])
        return np.ascontiguousarray(np.hstack([q, v, a]))


def kernel_of(function, made: int, name: str, out: Array) -> Kernel:
    """A kernel of a robot, a row of results for each state, repeated for the time that is given."""
    robot = handle(made, "the robot")

    def run(name: bytes, repetitions: ctypes.c_size_t, out: Array) -> bool:
        return function(robot, name, repetitions, pointer(out), ctypes.c_size_t(out.size))

    kernel = Kernel(run, name, len(out), out)
    kernel.repetitions = max(1, round(SECONDS / (kernel() * len(out))))
    return kernel


class Robot:
    """The UR5e and random states of it, for all libraries."""

    def __init__(self, count: int, *, floating: bool) -> None:
        self.urdf = Path(airo_models.get_urdf_path("ur5e")).read_text()
        self.floating, self.count, self.dof = floating, count, 6
        self.states = States.random(count, self.dof, floating=floating)

    def tactid(self, name: str, width: int) -> Kernel:
        """A kernel of tactid."""
        library = tactid_library()
        states = self.states.ours()
        made = library.tactid_dynamics_new(
            self.urdf.encode(),
            ctypes.c_bool(self.floating),
            TOOL.encode(),
            pointer(states),
            ctypes.c_size_t(self.count),
        )
        return kernel_of(library.tactid_dynamics_run, made, name, np.zeros((self.count, width)))

    def pinocchio(self, name: str, width: int, *flags: str) -> Kernel:
        """A kernel of Pinocchio in C++, compiled with further flags."""
        pin = peer("pinocchio", "pin")
        library = robot_library("pinocchio", *flags)
        root = (pin.JointModelFreeFlyer(),) if self.floating else ()
        model = pin.buildModelFromXML(self.urdf, *root)
        states = self.states.pinocchio(floating=self.floating)
        made = library.pinocchio_new(
            *model_arguments(model), pointer(states), ctypes.c_size_t(self.count)
        )
        return kernel_of(library.pinocchio_run, made, name, np.zeros((self.count, width)))


def model_arguments(model) -> list:
    """A model of Pinocchio as the plain numbers of which `robot.hpp` makes it again."""
    kinds, parents, numbers = [], [], []
    for joint in range(1, model.njoints):
        kinds.append(model.joints[joint].shortname().encode())
        parents.append(model.parents[joint])
        axis = getattr(model.joints[joint].extract(), "axis", np.zeros(3))
        inertia = model.inertias[joint].toDynamicParameters()
        numbers.append(np.hstack([placement(model.jointPlacements[joint]), axis, inertia]))
    frame = model.frames[model.getFrameId(TOOL)]
    return [
        ctypes.c_size_t(len(kinds)),
        (ctypes.c_char_p * len(kinds))(*kinds),
        (ctypes.c_size_t * len(parents))(*parents),
        c_numbers(np.array(numbers)),
        ctypes.c_size_t(frame.parentJoint),
        c_numbers(placement(frame.placement)),
    ]


def c_numbers(numbers: Array) -> ctypes.Array:
    """A copy of numbers for a C function, which lives as long as the argument."""
    return (ctypes.c_double * numbers.size)(*numbers.ravel())


def rotations(quaternions: Array) -> Array:
    """Rotation matrices of quaternions x, y, z, w."""
    vectors, reals = quaternions[:, :3], quaternions[:, 3]
    axes = np.eye(3)[None, :, :]
    crossed = np.cross(vectors[:, None, :], axes)  # A row for each axis.
    turned = axes + 2 * (reals[:, None, None] * crossed + np.cross(vectors[:, None, :], crossed))
    return np.swapaxes(turned, 1, 2)


def placement(pose) -> Array:
    """A placement of Pinocchio: rotation row by row, then translation."""
    return np.hstack([pose.rotation.ravel(), pose.translation])


@dataclass
class Task:
    """A task: its kernels in both libraries, and what makes their results comparable."""

    name: str
    ours: str
    theirs: str
    widths: tuple[int, int]
    bar: float
    floating: bool = False
    count: int = SINGLE


TASKS = [
    Task("inverse dynamics, fixed base", "inverse_dynamics", "inverse_dynamics", (6, 6), 2.2),
    Task(
        "inverse dynamics, floating base",
        "floating_inverse_dynamics",
        "inverse_dynamics",
        (12, 12),
        2.5,
        floating=True,
    ),
    Task("tool kinematics", "tool_kinematics", "tool_kinematics", (19, 24), 2.0),
    Task("payload rows", "payload_rows", "payload_rows", (60, 60), 2.2),
    Task("torque regressor of the arm", "torque_regressor", "torque_regressor", (360, 360), 2.2),
    Task(
        "4096 inverse dynamics, baseline",
        "baseline_series_inverse_dynamics",
        "inverse_dynamics",
        (6, 6),
        4.0,
        count=BATCH,
    ),
    Task(
        "4096 inverse dynamics, widest unit",
        "series_inverse_dynamics",
        "inverse_dynamics",
        (6, 6),
        9.0,
        count=BATCH,
    ),
    Task(
        "4096 payload rows, baseline",
        "baseline_series_payload_rows",
        "payload_rows",
        (60, 60),
        3.0,
        count=BATCH,
    ),
    Task(
        "4096 payload rows, widest unit",
        "series_payload_rows",
        "payload_rows",
        (60, 60),
        5.0,
        count=BATCH,
    ),
]


def comparisons() -> list[Comparison]:
    """All tasks of the dynamics."""
    return [Comparison(task.name, "ns", contenders(task), bar=task.bar) for task in TASKS]


def contenders(task: Task) -> dict[str, Callable[[], Contender]]:
    """Both libraries, and the builds of Pinocchio."""
    return {
        "tactid": partial(in_rust, task),
        "Pinocchio C++ -O3": partial(in_cxx, task),
        f"Pinocchio C++ -O3 {OWN_PROCESSOR}": partial(in_cxx, task, OWN_PROCESSOR),
    }


def in_rust(task: Task) -> Contender:
    """The task by tactid."""
    robot = Robot(task.count, floating=task.floating)
    kernel = robot.tactid(task.ours, task.widths[0])
    return Contender(kernel, our_result(task, robot, kernel.out))


def in_cxx(task: Task, *flags: str) -> Contender:
    """The task by Pinocchio, compiled with further flags."""
    robot = Robot(task.count, floating=task.floating)
    kernel = robot.pinocchio(task.theirs, task.widths[1], *flags)
    return Contender(kernel, their_result(task, kernel.out))


def our_result(task: Task, robot: Robot, out: Array) -> Array:
    """Results of tactid in terms that both can have."""
    if task.ours == "tool_kinematics":
        return np.hstack([out[:, :3], rotations(out[:, 3:7]).reshape(-1, 9), out[:, 7:]])
    if task.floating:
        back = np.swapaxes(robot.states.rotations(), 1, 2)
        force, moment = (np.einsum("kij,kj->ki", back, out[:, s]) for s in (slice(3), slice(3, 6)))
        return np.hstack([force, moment, out[:, 6:]])
    return out.copy()


def their_result(task: Task, out: Array) -> Array:
    """Results of Pinocchio in the same terms."""
    if task.theirs == "tool_kinematics":
        rotations = np.swapaxes(out[:, 3:12].reshape(-1, 3, 3), 1, 2)  # It was column by column.
        return np.hstack([out[:, :3], rotations.reshape(-1, 9), out[:, 12:]])
    if task.theirs == "payload_rows":
        return out.reshape(-1, 10, 6)[:, PARAMETERS].reshape(-1, 60)
    if task.theirs == "torque_regressor":  # Six columns a link; ours are rows of joints.
        columns = out.reshape(-1, 6, 10, 6)[:, :, PARAMETERS]
        return columns.transpose(0, 3, 1, 2).reshape(-1, 360)
    return out.copy()
