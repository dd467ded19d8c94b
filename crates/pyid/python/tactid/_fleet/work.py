"""What a worker does: it identifies one recording and returns its rows."""

import functools
import os
import shutil
import tempfile
import threading
import time
import weakref
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from tactid import _native
from tactid._api.offline import identification, provenance
from tactid._api.result import Identification
from tactid._base.errors import IdentificationError, SimulationError, TactidError
from tactid._fleet import rows, stores
from tactid._fleet.ranges import Ranges
from tactid._fleet.recordings import Recording
from tactid._fleet.rows import Row, Task
from tactid._native import Experiment
from tactid._options.options import Options
from tactid._read.recordings import opened

MOST_DOWNLOADED = 1 << 34
"""Bytes of a recording that is downloaded as a whole, because it cannot be read by ranges."""

BLOCK = 1 << 24
"""Bytes of a request of a download."""


NOT_CDR = 'only "cdr" can be decoded'
"""What an error says of messages in JSON or of ROS 1, which are converted from a file alone."""


def identify_recording(*tasks: Task) -> list[Row]:
    """Returns the row of a recording, or of each of its segments, whatever happens to it.

    A recording that is simulated is identified by several tasks, which differ in their methods.
    """
    begun = time.monotonic()
    recording, read = tasks[0].recording, {"requests": 0, "bytes_read": 0}
    try:
        if recording.cause is not None:
            raise recording.cause
        try:
            with _available(recording, read) as source:
                found = [row for task in tasks for row in _rows_of(source, task)]
        except TactidError as error:
            if not recording.base or NOT_CDR not in error.message:
                raise
            with _available(recording, read, is_whole=True) as source:
                found = [row for task in tasks for row in _rows_of(source, task)]
    except Exception as error:
        found = [task.head() | rows.of_error(error) for task in tasks]
    end = {"finished": datetime.now(timezone.utc), "seconds": time.monotonic() - begun}
    return [row | read | end for row in found]


def _rows_of(source: Any, task: Task) -> list[Row]:
    """Returns the rows of a task; the error of a method leaves the others of a simulation."""
    try:
        return _identified(source, task)
    except Exception as error:
        if task.recording.experiment is None:
            raise
        return [task.head() | rows.of_error(error)]


def _identified(source: Any, task: Task) -> list[Row]:
    """Identifies the payload, or that of each segment, from a path, or from ranges."""
    options = task.options
    if task.recording.episode is not None:
        options = options.replace(episode=task.recording.episode)
    with _worded(source, task), opened([source], options) as ([log], run):
        if not task.split:
            return [task.head() | rows.of_result(_of_part(log, run.options))]
        segments = _native.split_log(log, run.options.plain())
        parts = [{"begin_s": begin_s, "end_s": end_s} for begin_s, end_s in segments]
        return [task.head() | _row_of_part(log, run.options, part) | part for part in parts]


def _row_of_part(log: Any, options: Options, part: dict[str, Any]) -> Row:
    """Returns the columns of a segment; an error is that of this segment alone."""
    try:
        return rows.of_result(_of_part(log, options.replace(**part)))
    except IdentificationError as error:
        return rows.of_error(error)


def _of_part(log: Any, options: Options) -> Identification:
    """Identifies the payload from the part of a log that options name."""
    found = _native.identify_log(log, options.plain(), None)
    # The log is known by its size and tag: its hash would need all of its bytes.
    result = identification(found | provenance({}, options))
    if not isinstance(result, Identification):
        raise IdentificationError("a fleet has intervals, which the paper's filter has not")
    return result


@contextmanager
def _worded(source: Any, task: Task) -> Iterator[None]:
    """Gives errors the address of the recording, and what the store has said."""
    try:
        yield
    except TactidError as error:
        if isinstance(source, Ranges) and source.failure is not None:
            raise source.failure from None
        # What was downloaded has another name in the row.
        if isinstance(source, Path):
            error.message = error.message.replace(str(source), task.recording.address)
        raise


@contextmanager
def _available(
    recording: Recording, read: dict[str, int], *, is_whole: bool = False
) -> Iterator[Any]:
    """Yields what is read of a recording: its path, ranges, or the path of a temporary copy.

    Of what is read as a whole there are no ranges.
    """
    logs = [each for each in recording.objects if not each.name.endswith(".yaml")]
    if recording.experiment is not None:
        with tempfile.TemporaryDirectory(prefix="tactid-") as folder:
            log = Path(folder) / "run.mcap"
            experiment = Experiment.from_toml(recording.experiment)
            try:
                _native.simulate(experiment.replace(seed=recording.seed), log)
            except SimulationError as error:
                # The log of the run up to there goes with the folder.
                error.message = error.message.partition("\nThe log up to there")[0]
                raise
            yield log
    elif not recording.base:
        yield Path(recording.address)
    elif not is_whole and len(logs) == 1 and logs[0].name.endswith(".mcap"):

        def fetch(start: int, end: int) -> bytes:
            return stores.read(recording.base, logs[0], start, end)

        with closing(Ranges(recording.address, logs[0].size, fetch)) as ranges:
            try:
                yield ranges
            finally:
                read |= {"requests": ranges.requests, "bytes_read": ranges.bytes_read}
    elif recording.episode is not None:
        with _LOCK:
            before = _kept_copy.cache_info().misses
            copy = _kept_copy(replace(recording, episode=None))
            if _kept_copy.cache_info().misses > before:
                read |= copy.read
        yield copy.path
    else:
        with tempfile.TemporaryDirectory(prefix="tactid-") as folder:
            yield _downloaded(recording, Path(folder), read)


_LOCK = threading.Lock()
"""Lets one thread download a data set for all."""


class _Copy:
    """A downloaded data set, which is removed once nothing uses it."""

    def __init__(self, recording: Recording) -> None:
        folder = tempfile.mkdtemp(prefix="tactid-")
        self._end = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self.read = {"requests": 0, "bytes_read": 0}
        self.path = _downloaded(recording, Path(folder), self.read)


@functools.lru_cache(maxsize=1)
def _kept_copy(recording: Recording) -> _Copy:
    """Returns the copy of a data set, which is kept for the other episodes in the same files."""
    return _Copy(recording)


def _downloaded(recording: Recording, folder: Path, read: dict[str, int]) -> Path:
    """Downloads the objects of a recording; returns the path of the file, or of their folder.

    Raises:
        IdentificationError: They are larger than what is downloaded.
        OSError: The folder of temporary files of this worker has no room for them.
    """
    if recording.size > MOST_DOWNLOADED:
        raise IdentificationError(
            f"{recording.address} has {recording.size / 1e9:.1f} GB, and a recording that is no"
            f" single MCAP file is downloaded up to {MOST_DOWNLOADED / 1e9:.1f} GB"
        )
    free = shutil.disk_usage(folder).free // 2
    if recording.size > free:
        raise OSError(
            f"{recording.address} has {recording.size / 1e9:.1f} GB, and the folder of temporary"
            f" files of the worker has room for {free / 1e9:.1f} GB: set TMPDIR"
        )
    root = folder / (recording.address.rpartition("/")[2] or "recording")
    below = recording.address.removeprefix(recording.base).strip("/")
    is_file = len(recording.objects) == 1
    for each in recording.objects:
        path = root if is_file else root / os.path.relpath(each.name, below or ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            for start in range(0, each.size, BLOCK):
                end = min(start + BLOCK, each.size)
                file.write(stores.read(recording.base, each, start, end))
                read["requests"] += 1
                read["bytes_read"] += end - start
    return root
