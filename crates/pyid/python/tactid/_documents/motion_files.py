"""The files of a designed motion: for tactid, spreadsheets and the controllers of robots."""

import itertools
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from tactid import _native
from tactid._base.files import atomic_path, new_folder, write_atomically
from tactid._base.terminal import printable
from tactid._base.values import Array
from tactid._documents import motion_json
from tactid._documents.motion_speed import at_speed, speed_of
from tactid._results.records import DesignedMotion
from tactid._show import motion_text

UR_PERIOD_S = 0.002
"""Time between two calls of ``servoj`` on an e-Series robot, s: the manual's default."""

FRANKA_PERIOD_S = 0.001
"""Period of the control loop of libfranka, s."""

MOVEIT_PERIOD_S = 0.02
"""Time between two points for MoveIt, s: controllers interpolate by position, velocity and
acceleration."""

HEAD_WIDTH = 96
"""Largest number of characters of a line at the head of a file, where no name is longer."""


@dataclass(frozen=True)
class _Executable:
    """A motion at the speed of its files, and what each file says at its head."""

    motion: DesignedMotion
    speed: float
    head: list[str]

    def comments(self) -> list[str]:
        """Returns the head as lines of a comment, wrapped."""
        wrapped = (
            textwrap.wrap(line, HEAD_WIDTH, break_long_words=False, break_on_hyphens=False)
            for line in self.head
        )
        return [f"# {line}" for line in itertools.chain.from_iterable(wrapped)]


Writer = Callable[[_Executable, Path], None]


def write(motion: DesignedMotion, folder: Path, speed: float) -> None:
    """Writes all files of a motion into a folder, which is made where it does not exist."""
    speed_of(speed)
    with new_folder(folder, "`folder`"):
        for path, write_file in writers(motion, folder, speed).items():
            write_file(path)


def writers(
    motion: DesignedMotion, folder: Path, speed: float
) -> dict[Path, Callable[[Path], None]]:
    """Returns what writes each file of a motion, by its path."""
    executable = _Executable(at_speed(motion, speed), speed, _head(motion, speed))
    result = partial(_write_result, motion, speed)
    return {
        **{folder / name: partial(writer, executable) for name, writer in WRITERS.items()},
        folder / RESULT: result,
    }


def _head(motion: DesignedMotion, speed: float) -> list[str]:
    """Returns what the files say of a motion at their head, a line each."""
    lines = [
        f"Motion for the payload at {motion.tip}, written by tactid {_native.__version__}.",
        motion_text.speed_line(motion, speed),
        *motion_text.collision_lines(motion),
        f"Joints, in this order: {', '.join(motion.moving_joints)}.",
    ]
    # A name of the URDF may contain a line end, and what follows it would be no comment.
    return [" ".join(printable(line).split()) for line in lines]


def _write_mcap(executable: _Executable, path: Path) -> None:
    motion = executable.motion
    places = _moving(motion)
    states = {name: getattr(motion, name)[:, places] for name in ("q", "qd", "qdd")}
    metadata = {"speed": f"{executable.speed:g}", "head": "\n".join(executable.head)}
    with atomic_path(path) as temporary:
        _native.write_trajectory(
            temporary, joints=motion.moving_joints, time=motion.times_s, **states, metadata=metadata
        )


def _write_csv(executable: _Executable, path: Path) -> None:
    motion = executable.motion
    names = [f"{kind}_{name}" for kind in ("q", "qd", "qdd") for name in motion.moving_joints]
    places = _moving(motion)
    states = [values[:, places] for values in (motion.q, motion.qd, motion.qdd)]
    rows = np.column_stack([motion.times_s, *states])
    lines = [*executable.comments(), ",".join(["time_s", *names])]
    lines += _texts(rows, ",")
    write_atomically(path, "\n".join(lines) + "\n")


def _write_urscript(executable: _Executable, path: Path) -> None:
    """Writes a URScript program.

    ``servoj`` is of the script manual of Universal Robots: universal-robots.com/manuals, "Module
    motion".
    """
    first, *others = _texts(_at(executable.motion, UR_PERIOD_S), ", ")
    calls = [f"  servoj([{q}], 0, 0, {UR_PERIOD_S}, 0.1, 300)" for q in others]
    lines = [
        *executable.comments(),
        "# Positions in rad. The way to the start, by movej, is not tested for collisions.",
        "def tactid_motion():",
        f"  movej([{first}], a=0.5, v=0.3)",
        "  sleep(1.0)",
        *calls,
        "  stopj(2.0)",
        "end",
    ]
    write_atomically(path, "\n".join(lines) + "\n")


def _write_franka(executable: _Executable, path: Path) -> None:
    """Writes a row of joint positions for each period of libfranka's control loop.

    Its example ``generate_joint_position_motion.cpp`` returns such a row as
    ``franka::JointPositions`` from each call of its callback.
    """
    rows = _texts(_at(executable.motion, FRANKA_PERIOD_S), ",")
    lines = [*executable.comments(), *rows]
    write_atomically(path, "\n".join(lines) + "\n")


def _write_moveit(executable: _Executable, path: Path) -> None:
    """Writes a ``moveit_msgs/msg/RobotTrajectory`` as YAML, as ``ros2 topic echo`` prints it."""
    motion = executable.motion
    lines = [
        *executable.comments(),
        "joint_trajectory:",
        "  header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        f"  joint_names: [{', '.join(map(_quoted, motion.moving_joints))}]",
        "  points:",
    ]
    times = _times(motion, MOVEIT_PERIOD_S)
    names = ("positions", "velocities", "accelerations")
    columns = [_texts(values, ", ") for values in _states(motion, times)]
    for time, *states in zip(times.tolist(), *columns, strict=True):
        sec, nanosec = divmod(round(time * 1e9), 1_000_000_000)
        parts = [f"{name}: [{values}]" for name, values in zip(names, states, strict=True)]
        parts += ["effort: []", f"time_from_start: {{sec: {sec}, nanosec: {nanosec}}}"]
        lines.append("  - {" + ", ".join(parts) + "}")
    lines += [
        "multi_dof_joint_trajectory:",
        "  header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        "  joint_names: []",
        "  points: []",
    ]
    write_atomically(path, "\n".join(lines) + "\n")


def _write_result(motion: DesignedMotion, speed: float, path: Path) -> None:
    write_atomically(path, motion_json.to_json(motion, speed))


WRITERS: dict[str, Writer] = {
    "trajectory.mcap": _write_mcap,
    "trajectory.csv": _write_csv,
    "trajectory.script": _write_urscript,
    "franka.csv": _write_franka,
    "moveit.yaml": _write_moveit,
}
"""What writes each file that a robot can execute, by its name."""

RESULT = "result.json"
"""Name of the file with the result of the design."""

NAMES = (*WRITERS, RESULT)
"""Names of all files of a motion."""


def _moving(motion: DesignedMotion) -> list[int]:
    return [motion.joints.index(name) for name in motion.moving_joints]


def _times(motion: DesignedMotion, period_s: float) -> Array:
    """Returns times that increase from the start, once a period, to the end."""
    # The rounding of a quotient must not make a period of no length before the end.
    count = int(np.ceil(motion.duration_s / period_s - 1e-9))
    return np.append(np.arange(count) * period_s, motion.duration_s)


def _at(motion: DesignedMotion, period_s: float) -> Array:
    """Returns the positions of the joints that move, once a period; the last rest at the end."""
    count = int(np.ceil(motion.duration_s / period_s)) + 1
    times = np.minimum(np.arange(count) * period_s, motion.duration_s)
    return _states(motion, times)[0]


def _states(motion: DesignedMotion, times: Array) -> list[Array]:
    """Returns positions, velocities and accelerations of the joints that move, at times.

    Between two samples of the motion they are those of the polynomial of degree five that has the
    position, velocity and acceleration of both (Hermite interpolation). Straight lines would turn
    at once at each sample, which asks a controller with a shorter period for an acceleration far
    beyond the limits.
    """
    places = _moving(motion)
    before = np.clip(
        np.searchsorted(motion.times_s, times, side="right") - 1, 0, len(motion.times_s) - 2
    )
    step = np.diff(motion.times_s)[before, None]
    fraction = (times[:, None] - motion.times_s[before, None]) / step
    (p0, p1), (v0, v1), (a0, a1) = (
        (step**order * values[before][:, places], step**order * values[before + 1][:, places])
        for order, values in enumerate((motion.q, motion.qd, motion.qdd))
    )
    rise = p1 - p0
    coefficients = [
        p0,
        v0,
        a0 / 2,
        10 * rise - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
        -15 * rise + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
        6 * rise - 3 * (v0 + v1) + 0.5 * (a1 - a0),
    ]
    states = []
    for order in range(3):
        powers = enumerate(coefficients)
        states.append(sum(each * fraction**power for power, each in powers) / step**order)
        coefficients = [power * each for power, each in enumerate(coefficients)][1:]
    return states


def _texts(rows: Array, separator: str) -> list[str]:
    """Returns the numbers of each row with a resolution of a nanoradian, without a minus zero."""
    row_format = separator.join(["%.9f"] * rows.shape[1])
    rounded = np.where(np.abs(rows) < 5e-10, 0.0, rows)
    return [row_format % tuple(row) for row in rounded.tolist()]


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"
