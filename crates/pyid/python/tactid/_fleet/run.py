"""The identification of many recordings on Dask, into one table."""

import glob
import hashlib
import json
import os
import signal
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager, suppress
from fnmatch import fnmatch
from importlib import import_module
from itertools import groupby, islice
from multiprocessing import resource_tracker
from operator import attrgetter
from pathlib import Path
from typing import Any

from tactid import _native
from tactid._base.errors import ArgumentError, LogError, TactidError
from tactid._base.files import is_urdf_text
from tactid._fleet import rows
from tactid._fleet.recordings import Recording, content_of, find
from tactid._fleet.rows import Row, Task
from tactid._fleet.table import new_or_changed, rows_at
from tactid._fleet.work import identify_recording
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, Options, collect
from tactid._read.descriptions import with_urdf
from tactid._read.packages import package
from tactid._read.recordings import file_options

WINDOW = 16
"""Recordings that the scheduler knows at once; four for each thread of workers if that is more."""

ATTEMPTS = 20
"""How often a recording is submitted whose scheduler loses the connection meanwhile."""

RECONNECTION_S = 60.0
"""Time to wait for a scheduler that has lost the connection, s."""

CONNECTION_S = 10.0
"""Time to wait for the first answer of a scheduler, s."""

ROBOT_KEYS = ("pattern", "robot")
"""What an entry of ``robots`` has besides options."""


@with_options(OPTIONS, "log")
def fleet(
    urls: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    /,
    *,
    out: str | os.PathLike[str] | None = None,
    client: Any = None,
    robots: Sequence[Mapping[str, Any]] = (),
    split: bool = False,
    options: Options | None = None,
    progress: Callable[[int, int], object] | None = None,
    **keywords: Any,
) -> list[dict[str, Any]]:
    """Identifies the payload of each of many recordings, and returns a row for each.

    The recordings are those of files, folders, patterns (``logs/**/*.mcap``), addresses in stores
    (``s3://``, ``gs://``, ``az://``, ``https://``), and text files with a path or an address a
    line. A bag is one recording, and so is each episode of a data set of LeRobot. Of an MCAP file
    in a store, only the messages that are needed are read. Credentials come from the environment.

    Dask does the work: processes of this computer, or a cluster. A script that calls this function
    without a ``client`` does so below ``if __name__ == "__main__":``, because the processes import
    it. A recording that cannot be identified has a row, too, with an outcome and an error.

        rows = tactid.fleet("logs/", out="payloads.parquet", urdf="arm.urdf", tip="tool0")
        payloads = pandas.DataFrame(rows)

    Args:
        urls: Where the recordings are, one place or several.
        out: Where the rows are stored: a folder of Parquet files, to which a later call adds what
            is new or has changed; or a ``.csv`` file, which is written anew.
        client: The ``distributed.Client`` of a cluster, or the address of its scheduler. Default:
            a process for each core of this computer.
        robots: What differs between recordings: for each robot a mapping of a ``pattern`` of
            addresses (with ``*``), the name of the ``robot``, and options. The first match counts.
        split: Cut each recording where its wrenches show that the payload changes: a row is then
            that of a segment, from ``begin_s`` to ``end_s``, and not of the recording. What no
            body explains, such as the contact while something is grasped, is between segments.
        options: Options to start from; keywords replace them.
        progress: Called after each recording with the number of those that are done, and of all.
        **keywords: The fields of :class:`tactid.Options`, as follows. The topics are those of a
            log.

            <options>

    Returns:
        A dictionary for each recording, or with ``split`` for each of its segments, in the order of
        addresses and times. Its keys are those of the JSON document of a result, joined by dots,
        and those of the recording, such as ``address``, ``outcome`` and ``error``.

    Raises:
        ArgumentError: There is no recording at an address, an option does not apply, or a package
            is missing.
        OSError: A store or the scheduler cannot be reached.
    """
    own = ("out", "client", "robots", "split", "options", "progress")
    collected = collect(options, keywords, "log", own)
    given = [urls] if isinstance(urls, str | os.PathLike) else urls
    if not given:
        raise ArgumentError("there is no recording: `urls` is empty")
    if not isinstance(split, bool):
        raise ArgumentError(f"`split` is {split!r}: expected True or False")
    recordings = find(given)
    tasks = tasks_of(recordings, collected, robots, split=split)
    return completed(tasks, out, client, progress)


def completed(
    tasks: Sequence[Task],
    out: str | os.PathLike[str] | None,
    client: Any,
    progress: Callable[[int, int], object] | None,
) -> list[Row]:
    """Runs tasks into a table, and returns their rows: what :func:`fleet` and a study share."""
    table = rows_at(None if out is None else Path(out), (task.recording for task in tasks))
    run(tasks, table, client, progress)
    return rows.rows_of(table.all(), tasks)


def tasks_of(
    recordings: Iterable[Recording],
    options: Options,
    robots: Sequence[Mapping[str, Any]] = (),
    *,
    split: bool = False,
) -> list[Task]:
    """Returns what to do for recordings: the options of each, with their hash.

    Raises:
        ArgumentError: An option does not apply, or its file is not there.
    """
    if options.estimator == "nlms":
        raise ArgumentError(
            "`estimator` is the paper's filter, which has no intervals: the rows of a fleet do",
            option="estimator",
        )
    besides = {"split": True} if split else {}
    prepared = [
        (entry, _of_entry(number, entry, options, besides))
        for number, entry in enumerate(robots, start=1)
    ]
    default: tuple[Options, str] | None = None
    tasks = []
    for recording in recordings:
        entry, of_robot = next((one for one in prepared if _matches(recording, one[0])), ({}, None))
        if of_robot is None:
            of_robot = default = default or _prepared(options, besides)
        chosen, digest = of_robot
        if chosen.episode is None or recording.episode in (None, chosen.episode):
            robot = str(entry.get("robot") or "")
            tasks.append(Task(recording, chosen, digest, robot, split))
    if not tasks:
        raise ArgumentError(
            f"`episode` is {options.episode}, which no data set has", option="episode"
        )
    return tasks


def _of_entry(
    number: int, entry: Mapping[str, Any], options: Options, besides: dict[str, Any]
) -> tuple[Options, str]:
    """Returns the options of the recordings of an entry; errors say which entry it is."""
    try:
        return _prepared(options.replace(**_options(entry)), besides)
    except TactidError as error:
        place = getattr(entry, "place", f"entry {number} of `robots`")
        error.message = f"{place}: {error.message}"
        raise


def without_recording(
    recordings: Sequence[Recording], robots: Sequence[Mapping[str, Any]]
) -> dict[str, bool]:
    """Returns the patterns of robots that are those of no recording.

    The value says whether a pattern matches recordings, which earlier ones match, too.
    """
    found = {}
    left = list(recordings)
    for entry in robots:
        others = [each for each in left if not _matches(each, entry)]
        if len(others) == len(left):
            found[str(entry["pattern"])] = any(_matches(each, entry) for each in recordings)
        left = others
    return found


def without_robot(
    recordings: Sequence[Recording], robots: Sequence[Mapping[str, Any]]
) -> list[str]:
    """Returns the addresses of recordings that no pattern of robots matches."""
    return [
        each.address for each in recordings if not any(_matches(each, entry) for entry in robots)
    ]


def _matches(recording: Recording, entry: Mapping[str, Any]) -> bool:
    """Returns whether a pattern is that of a recording, or of a folder that it is in.

    That of a path may be a relative one.
    """
    pattern = str(entry["pattern"]).rstrip("/")
    absolute = os.path.join(glob.escape(os.getcwd()), pattern)
    patterns = (each for one in (pattern, absolute) for each in (one, f"{one}/*"))
    return any(fnmatch(recording.address, each) for each in patterns)


def _options(entry: Mapping[str, Any]) -> dict[str, Any]:
    if "pattern" not in entry:
        raise ArgumentError(
            "an entry of `robots` has no `pattern`: which addresses are those of the robot"
        )
    given = {name: value for name, value in entry.items() if name not in ROBOT_KEYS}
    return dict(collect(None, given, "log", ROBOT_KEYS).given)


def _prepared(options: Options, besides: dict[str, Any]) -> tuple[Options, str]:
    """Returns options that need no file of the robot, and the hash of all that they say."""
    options = with_urdf(options)
    if options.urdf is not None and not is_urdf_text(options.urdf):
        try:
            options = options.replace(urdf=Path(options.urdf).read_text(encoding="utf-8"))
        except (OSError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or "it is no text"
            raise ArgumentError(f"cannot read {options.urdf}: {reason}", option="urdf") from None
    _check(options)
    said: dict[str, Any] = options.plain() | besides
    for name, value in said.items():
        if isinstance(value, str | os.PathLike) and name != "urdf":
            said[name] = content_of(Path(value))
    text = json.dumps(said, sort_keys=True, default=str)
    return options, hashlib.sha256(text.encode()).hexdigest()


def _check(options: Options) -> None:
    """Checks options once, where each recording would be refused.

    Raises:
        TactidError: A value is wrong, or the file that an option names.
    """
    unloaded = options.unloaded
    if unloaded is not None and not Path(unloaded).exists():
        raise ArgumentError(f"`unloaded` is {unloaded}, which does not exist", option="unloaded")
    plain = options.replace(**dict.fromkeys(file_options(options)), unloaded=None).plain()
    with suppress(LogError):  # options are checked before the log, which is not there
        _native.identify_log(Path(os.devnull, "none"), plain, None)


def run(
    tasks: Sequence[Task],
    table: Any,
    client: Any = None,
    progress: Callable[[int, int], object] | None = None,
    notice: Callable[[str], object] = lambda _: None,
) -> int:
    """Adds the rows of recordings to a table, and returns how many had theirs already.

    Whatever ends the run, such as Ctrl-C, the rows that are done are stored.

    Raises:
        OSError: The scheduler cannot be reached any more.
    """
    pending = new_or_changed(tasks, table.stored())
    groups = [list(each) for _, each in groupby(pending, attrgetter("recording"))]
    before, total = len(tasks) - len(pending), len(tasks)
    if progress is not None:
        progress(before, total)
    is_whole = False
    try:
        if pending:
            done = before
            with _connected(client, len(groups)) as connection:
                if not connection.nthreads():
                    notice("The scheduler has no workers yet.")
                for count, found in _computed(connection, groups):
                    table.add(found)
                    done += count
                    if progress is not None:
                        progress(done, total)
        is_whole = True
    finally:
        table.close(is_whole=is_whole)
    return before


@contextmanager
def _connected(client: Any, count: int) -> Iterator[Any]:
    """Yields a client: the given one, that of a scheduler, or that of processes of this machine."""
    distributed = _distributed()
    if client is not None and not isinstance(client, str):
        yield client
        return
    if isinstance(client, str):
        check_scheduler(client, "`client`")
        with distributed.Client(client, set_as_default=False) as connection:
            yield connection
        return
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    with ExitStack() as stack:
        with _interruption_delayed():
            local = distributed.LocalCluster(
                n_workers=min(cores or 1, count),
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",
                silence_logs="CRITICAL",
            )
            stack.enter_context(local)
        yield stack.enter_context(distributed.Client(local, set_as_default=False))


@contextmanager
def _interruption_delayed() -> Iterator[None]:
    """Blocks Ctrl-C in the block, and in the processes that it starts for as long as they run.

    A terminal interrupts all processes, and each would say so; the cluster ends its own.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # it unblocks signals where it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def check_scheduler(address: str | None, name: str) -> None:
    """Checks that a scheduler listens at an address, which ``name`` states.

    Raises:
        ArgumentError: It is no such address.
        OSError: Nothing listens there, or something else.
    """
    if address is None:
        return
    scheme, _, rest = address.rpartition("://")
    _distributed()  # brings the configuration of Dask
    scheme = scheme or import_module("dask").config.get("distributed.comm.default-scheme", "tcp")
    host, _, port = rest.strip("/").rpartition(":")
    if scheme not in ("tcp", "tls"):
        if scheme in ("http", "https"):
            raise ArgumentError(f"{name} is {address}: expected tcp://HOST:PORT, not a web page")
        return
    if not host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
        raise ArgumentError(
            f"{name} is {address}: expected the address of a scheduler of Dask with its port, such"
            " as tcp://localhost:8786"
        )
    try:
        with socket.create_connection((host.strip("[]"), int(port)), CONNECTION_S) as connection:
            # A scheduler speaks first, and the client would wait for others for minutes.
            if scheme == "tcp" and not connection.recv(1):
                raise OSError
    except OSError as error:
        reason = error.strerror or "no scheduler of Dask answers"
        raise OSError(f"{name} is {address}, which cannot be reached: {reason}") from None


def _computed(client: Any, groups: Sequence[list[Task]]) -> Iterator[tuple[int, list[Row]]]:
    """Yields the number of tasks of each recording, and their rows, as it is done.

    A worker that is killed loses what it has begun, which the scheduler gives to another one; a
    connection that is lost loses what the scheduler knows, which is submitted again.
    """
    distributed = _distributed()
    waiting, running, attempts = iter(groups), {}, Counter[Recording]()
    completed = distributed.as_completed(loop=client.loop)

    def submit(tasks: list[Task]) -> None:
        attempts[tasks[0].recording] += 1
        future = client.submit(identify_recording, *tasks, pure=False)
        running[future] = tasks
        completed.add(future)

    for tasks in islice(waiting, max(WINDOW, 4 * sum(client.nthreads().values()))):
        submit(tasks)
    while running:
        future = next(completed)
        tasks = running.pop(future)
        found = _rows_of(future, tasks)
        if found is None and attempts[tasks[0].recording] < ATTEMPTS:
            _wait_for_scheduler(client)
            submit(tasks)
            continue
        if found is None:
            lost = OSError("the scheduler lost it again and again")
            found = [rows.failed(task, lost) for task in tasks]
        yield len(tasks), found
        for tasks in islice(waiting, 1):
            submit(tasks)


def _rows_of(future: Any, tasks: list[Task]) -> list[Row] | None:
    """Returns the rows of tasks; None where they are lost, also while they are fetched."""
    with suppress(CancelledError):
        if future.status == "finished":
            found: list[Row] = future.result()
            return found
        if future.status == "error":
            error = _failure(future.exception())
            return [rows.failed(task, error) for task in tasks]
    return None


def _distributed() -> Any:
    return package("distributed", "this is a fleet of recordings", does="runs")


def _failure(error: BaseException) -> BaseException:
    """Returns the error of a task that Dask has given up."""
    if type(error).__name__ == "KilledWorker":
        return OSError("each worker that read it was killed, as where memory is exhausted")
    return error


def _wait_for_scheduler(client: Any) -> None:
    """Waits until a client that has lost its scheduler has it again.

    Raises:
        OSError: The scheduler does not come back.
    """
    end = time.monotonic() + RECONNECTION_S
    while client.status != "running":
        if client.status == "closed" or time.monotonic() > end:
            raise OSError("the scheduler is gone: the rows that are done are stored")
        time.sleep(0.1)
