"""Recordings in any form that is read, as logs of ROS 2, for whatever identifies or calibrates.

A table becomes a log of joint states and of wrenches, whose topics have the names of the columns,
so that all that holds for logs holds for tables, too. It is written to the folder of temporary
files.
"""

import itertools
import os
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tactid import _native
from tactid._base.errors import ArgumentError, LogError, TactidError
from tactid._base.files import check_no_address
from tactid._base.values import Array
from tactid._options.options import FILE_OPTIONS, Options
from tactid._read import columns, foreign_logs, lerobot
from tactid._read.columns import Quantity
from tactid._read.descriptions import with_urdf
from tactid._read.robot_joints import RobotJoints
from tactid._read.tables import Progress, Table, open_table

LogPath = str | os.PathLike[str]

ARRAYS = ("time", "q", "qd", "effort", "wrench")
"""What a table may have of a recording in motion."""

OTHER_FORMS = (
    "a table (.csv, .npz, .parquet), a data set of LeRobot, a ROS 1 bag (.bag) and MCAP are read,"
    " too; load what is in another form into arrays: docs/how-to/data.md"
)
"""What an error says of a file that is in no form that is read."""


@dataclass
class Opened:
    """Recordings as logs that can be read."""

    options: Options
    """Options for logs: without those of files, and with the robot as URDF."""
    progress: Progress
    """Callback that receives the fraction done of what follows."""
    names: dict[str, str] = field(default_factory=dict)
    """Paths that were given, by those of the logs that stand for them."""

    def original(self, path: LogPath) -> Path:
        """Returns the path that was given for a log."""
        return Path(self.names.get(os.fspath(path), path))


@contextmanager
def opened(
    sources: Sequence[Any],
    options: Options,
    progress: Progress = None,
    *,
    method: str | None = None,
) -> Iterator[tuple[list[Any], Opened]]:
    """Yields logs in place of recordings, for as long as the block runs.

    Errors of the block name what was given.

    Args:
        sources: Paths of recordings; anything else stays as it is.
        options: What is asked for; an ``unloaded`` recording is opened, too.
        progress: Called with the fraction done: half of it is opening, where tables are read.
        method: Which measurements are used; None for those of the option ``method``.

    Raises:
        LogError: A file cannot be read.
        ArgumentError: A column is missing, or a package that reads the file.
    """
    given = file_options(options)
    plain = with_urdf(options.replace(**dict.fromkeys(given)))
    every = [*sources, plain.unloaded]
    reader = _Reader(plain, progress, len(every), method, **given)
    with ExitStack() as stack:
        logs = [reader.log(source, stack) for source in every]
        reader.check_used()
        result = Opened(plain.replace(unloaded=logs.pop()), reader.rest(), reader.names)
        try:
            yield logs, result
        except TactidError as error:
            for log, name in reader.names.items():
                error.message = error.message.replace(log, name)
            raise


def file_options(options: Options) -> dict[str, Any]:
    """Returns the options of recordings that become logs, once their types are checked.

    Raises:
        ArgumentError: ``columns`` is no mapping from arrays to columns, or ``episode`` no number.
    """
    given = {name: options.given[name] for name in FILE_OPTIONS if name in options.given}
    named = given.get("columns", {})
    if not isinstance(named, Mapping) or not all(map(_are_columns, named.values())):
        raise ArgumentError(
            f"`columns` is {named!r}: expected arrays with the names of their columns, such as"
            ' {"q": "joint_*[deg]"}',
            option="columns",
        )
    episode = given.get("episode", 0)
    if not isinstance(episode, int) or isinstance(episode, bool):
        raise ArgumentError(f"`episode` is {episode!r}: expected a whole number", option="episode")
    return given


def _are_columns(given: object) -> bool:
    names = given if isinstance(given, list | tuple) else [given]
    return bool(names) and all(isinstance(name, str) for name in names)


def log_info(path: LogPath) -> Any:
    """Returns the contents of a log, and None for a recording in another form."""
    return None if _form(Path(path), 0) is not None else _native.info(path)


def contents(path: Path) -> Any:
    """Returns the contents of a log, of a ROS 1 bag, or of a table, whose columns are read."""
    check_no_address(path)
    if foreign_logs.is_bag(path):
        return foreign_logs.bag_info(path)
    return table_of(path, 0) or _native.info(path)


def table_of(path: Path, episode: int | None = None) -> Table | None:
    """Returns the table that a path leads to; None for another file."""
    return lerobot.LeRobotTable(path, episode) if lerobot.is_dataset(path) else open_table(path)


def _form(path: Path, episode: int | None) -> Any:
    """Returns what reads a recording: a table, or the opener of a foreign log; None for a log."""
    table = table_of(path, episode)
    return table if table is not None else foreign_logs.opener_of(path, _encodings)


def _encodings(path: Path) -> set[str]:
    return {topic.encoding for topic in _native.info(path).topics}


class _Reader:
    """Turns recordings into logs."""

    def __init__(
        self,
        options: Options,
        progress: Progress,
        count: int,
        method: str | None,
        columns: Any = None,
        episode: int | None = None,
    ) -> None:
        self.names: dict[str, str] = {}
        self._options, self._progress = options, progress
        self._method = method or options.method
        self._columns, self._episode = columns, episode
        self._count, self._done, self._tables = count, 0, 0

    def log(self, source: Any, stack: ExitStack) -> Any:
        """Returns a log in place of a recording."""
        self._done += 1
        if not isinstance(source, str | os.PathLike):
            return source
        check_no_address(source)
        path = Path(source)
        form = _form(path, self._episode)
        if form is None:
            return self._checked(source, path)
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="tactid-")))
        if isinstance(form, Table):
            self._tables += 1
            log = folder / "table.mcap"
            self._write(form, log)
        else:
            log = folder / "log"
            with form(path) as (messages, count):
                foreign_logs.convert(path, messages, count, log, self._advance)
        self.names[str(log)] = str(path)
        return log

    def check_used(self) -> None:
        """Checks that options of tables are given for one."""
        if self._tables == 0:
            for name in FILE_OPTIONS:
                if getattr(self, f"_{name}") is not None:
                    raise ArgumentError(f"`{name}` does not apply to a log", option=name)

    def rest(self) -> Progress:
        """Returns the progress of what follows."""
        progress = self._progress
        if progress is None or not self.names:
            return progress
        return lambda done: progress(0.5 + 0.5 * done)

    def _advance(self, done: float) -> None:
        if self._progress is not None:
            self._progress(0.5 * (self._done - 1 + done) / self._count)

    def _write(self, table: Table, log: Path) -> None:
        """Writes a table as a log.

        Raises:
            LogError: A number cannot be read.
            ArgumentError: Columns are missing or do not fit the robot, or there is no robot.
        """
        options = self._options
        if options.urdf is None:
            names = {array: on for array, on in (self._columns or {}).items() if array == "q"}
            _check_motion(table, columns.find(table, ["q"], names), self._columns)
            raise ArgumentError(
                f"{table.path} is a table, which has no robot whose joints it records: give `urdf`",
                option="urdf",
            )
        joints = RobotJoints.of(options.urdf, options.tip or "tool0")
        found = columns.find(
            table, ARRAYS, self._columns, lambda array: joints.columns(table, array)
        )
        for array, example in (("time", "stamp[ms]"), ("q", "joint_*[deg]")):
            if array not in found:
                _check_motion(table, found, self._columns)
                raise columns.missing(table, array, example)
        _check_load(table, found, self._method)
        _check_efforts(table, found, options, self._method)
        arrays = _values(table, found, self._episode, self._advance)
        time = _seconds(table, found["time"], arrays["time"])
        parts: dict[str, Any] = {"joints": _joints(table, joints, found, arrays, time)}
        if "wrench" in found:
            parts["wrench"] = _wrench(table, found["wrench"], arrays["wrench"], time)
        _native.write_samples(log, **parts)

    @staticmethod
    def _checked(source: Any, path: Path) -> Any:
        """Returns the path of a log, unless a file is of a kind that has no reader."""
        if path.is_file() and path.suffix.lower() in _OTHERS:
            raise LogError(f"{path} is no log: {OTHER_FORMS}")
        return source


def _check_motion(table: Table, found: Mapping[str, Quantity], given: Any) -> None:
    """Refuses a table that has no motion of joints, but poses.

    Raises:
        ArgumentError: The table has attitudes and wrenches.
    """
    is_moving = not found.keys().isdisjoint(("qd", "effort"))
    own = {array: names for array, names in (given or {}).items() if array in _OF_POSES}
    poses = {**columns.find(table, _OF_POSES, own), **found}
    if is_moving or "wrench" not in poses or not ("pose" in poses or "q" in found):
        return
    if "time" not in poses:
        raise ArgumentError(
            f"{table.path} is a table of poses at rest, because it has no times: `tactid identify`"
            " and `identify_poses` take one such table. Put all poses of a payload into one"
        )
    if "q" not in found:
        raise ArgumentError(
            f"{table.path} has times ({poses['time'].words}) beside poses ({poses['pose'].words}),"
            " but a table of a motion has positions of joints, which may have the names of those of"
            " `urdf`. If its rows are poses at rest, leave out the times; a motion of poses is read"
            " from arrays or odometry",
            option="columns",
        )


_OF_POSES = ("time", "pose", "wrench")
"""What a table of poses at rest may have that needs no robot, and the times that it lacks."""

_OTHERS = {
    *(".h5", ".hdf5", ".mat", ".pkl", ".pickle", ".npy", ".xls", ".xlsx", ".json", ".jsonl"),
    *(".feather", ".arrow", ".zarr", ".tfrecord", ".yaml", ".ulg", ".log"),
}
"""Ends of the names of files that are recordings in forms that are not read."""


def _values(
    table: Table,
    found: dict[str, Quantity],
    episode: int | None,
    progress: Callable[[float], object],
) -> dict[str, Array]:
    """Reads the arrays, (N, k), of one episode where the rows of the table have such a number.

    Raises:
        ArgumentError: There are several episodes, or there is no such one.
    """
    names = {name for each in found.values() for name in each.columns if name is not None}
    if lerobot.EPISODE not in table.names:
        if episode is not None:
            raise ArgumentError(
                f"{table.path} has no column `{lerobot.EPISODE}`: it is one recording",
                option="episode",
            )
        values = table.read(sorted(names), progress)
    else:
        values = table.read(sorted(names | {lerobot.EPISODE}), progress)
        episodes = values[lerobot.EPISODE]
        there = np.unique(episodes)
        if episode is None and len(there) == 1:
            episode = int(there[0])
        if episode not in there:
            raise ArgumentError(
                f"{table.path} has the episodes {there[0]:g} to {there[-1]:g}: `episode` chooses"
                " one of them",
                option="episode",
            )
        values = {name: array[episodes == episode] for name, array in values.items()}
    return {array: quantity.of(values) for array, quantity in found.items()}


def _check_load(table: Table, found: Mapping[str, Quantity], method: str | None) -> None:
    """Refuses a table without what measures the load.

    Raises:
        ArgumentError: The array that the method needs is missing; without a method, all are.
    """
    if method in (None, "tactile") and "wrench" not in found:
        others = ["effort"] if method is None else []
        if found.keys().isdisjoint(others):
            raise columns.missing(table, "wrench", "f*", *others)
    if method == "effort" and "effort" not in found:
        raise columns.missing(table, "effort", "torque_*")


def _check_efforts(
    table: Table, found: dict[str, Quantity], options: Options, method: str | None
) -> None:
    """Leaves out efforts that nobody needs, and refuses currents without gains."""
    effort = found.get("effort")
    if effort is None:
        return
    method = method or ("tactile" if "wrench" in found else "effort")
    if method in ("tactile", "joint-sensing"):
        del found["effort"]
        return
    is_current = any(unit is not None and unit.dimension == "current" for unit in effort.units)
    is_current |= any("current" in str(name).lower() for name in effort.columns)
    if is_current and options.effort_gain is None and options.calibration is None:
        raise ArgumentError(
            f"{table.path}: {effort.words} are currents: `effort_gain` gives the torque of each"
            " joint for one ampere",
            option="effort_gain",
        )


SLOWEST_S = 1.0
"""Longest time between two rows that is believed to be in s without a unit: a motion that is
recorded once a second determines nothing, and one of milliseconds at 1 kHz looks like it."""

_EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Times since 1970 from which on they can only be in ns, µs and ms: as s they are later than the
year 5000, and as the next smaller unit earlier than 1974."""


def _seconds(table: Table, quantity: Quantity, values: Array) -> Array:
    """Returns the times of the rows, s, the first of them later than zero.

    Raises:
        LogError: A row has no time.
        ArgumentError: The unit is not stated, and seconds would be too slow.
    """
    if values.shape[1] != 1:
        raise ArgumentError(
            f"{table.path}: {quantity.words} are {values.shape[1]} numbers a row for `time`:"
            " expected one",
            option="columns",
        )
    time = values[:, 0]
    if not np.isfinite(time).all():
        row = int(np.flatnonzero(~np.isfinite(time))[0]) + 1
        raise LogError(f"{table.path}, column {quantity.words}: row {row} has no time")
    if quantity.units[0] is None:
        largest = float(np.abs(time).max())
        time = time * next((unit for least, unit in _EPOCHS if largest > least), 1.0)
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        if step >= SLOWEST_S:
            name = quantity.columns[0]
            raise ArgumentError(
                f"{table.path}: {quantity.words} advances by {step:g} a row, which is slow for"
                f" seconds: state its unit in `columns`, such as time={name}[ms], or"
                f" time={name}[s]",
                option="columns",
            )
    # A stamp of zero is none.
    return time - np.floor(time.min()) + 1.0 if time.min() <= 0 else time


def _joints(
    table: Table,
    joints: RobotJoints,
    found: dict[str, Quantity],
    arrays: dict[str, Array],
    time: Array,
) -> tuple[str, list[str], Array, Array, Array | None, Array | None]:
    """Returns the topic of the joints, their names, and the rows that have some of them.

    Efforts are part of the topic's name, by which those of known drivers are recognized.
    """
    q = arrays["q"]
    names = joints.named(table, found["q"], q.shape[1])
    rows = np.isfinite(q).any(axis=1)
    others: dict[str, Array] = {}
    for array in {"qd", "effort"} & found.keys():
        own = joints.named(table, found[array], arrays[array].shape[1])
        others[array] = np.full(q.shape, np.nan)
        for place, name in enumerate(own):
            if name in names:
                others[array][:, names.index(name)] = arrays[array][:, place]
    qd, effort = (others[each][rows] if each in others else None for each in ("qd", "effort"))
    topics = {_topic(found[each]): None for each in ("q", "effort") if each in found}
    return "".join(topics), names, time[rows], q[rows], qd, effort


def _wrench(
    table: Table, quantity: Quantity, values: Array, time: Array
) -> tuple[str, Array, Array]:
    """Returns the topic of the wrench, and the rows that have one."""
    if values.shape[1] not in (3, 6):
        raise ArgumentError(
            f"{table.path}: {quantity.words} are {values.shape[1]} numbers a row for `wrench`:"
            " expected three forces and three moments",
            option="columns",
        )
    six = np.full((len(values), 6), np.nan)
    six[:, : values.shape[1]] = values
    rows = np.isfinite(six).any(axis=1)
    return _topic(quantity), time[rows], six[rows]


def _topic(quantity: Quantity) -> str:
    """Returns the name of a topic: what the names of its columns begin with."""
    names = [name for name in quantity.columns if name is not None]
    first, last = min(names), max(names)
    same = (a == b for a, b in zip(first, last, strict=False))
    shared = first[: len(list(itertools.takewhile(bool, same)))]
    shared = re.sub(r"\W+", "_", shared).strip("_")
    if not shared or shared[0].isdigit() or not shared.isascii():
        shared = {"q": "joint_states"}.get(quantity.array, quantity.array)
    return f"/{shared}"
