"""The table of a fleet: a folder of Parquet files to which rows are added, or a CSV file."""

import csv
import io
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import IO, Any, Protocol

from tactid._base.errors import ArgumentError
from tactid._base.files import atomic_path, check_no_address, write_atomically
from tactid._base.output_files import check_outputs, replaced_outputs
from tactid._fleet.recordings import LOGS, Recording
from tactid._fleet.rows import (
    COLUMNS,
    HEAD,
    KEY,
    STATE,
    Key,
    Row,
    Task,
    arrow_schema,
    key_of,
    place_of,
)
from tactid._read.packages import package

FLUSH_ROWS = 500
"""Rows that are written together."""

FLUSH_S = 10.0
"""Time after which the next row is written with those before it, s, however few they are."""

DATA = (".json", ".jsonl", ".xlsx", ".xls", ".ods", ".tsv", ".feather", ".arrow", ".sqlite", ".db")
"""Ends of the names of other tables."""

NOT_WRITTEN = (*DATA, *LOGS, ".npz", ".txt", ".html", ".htm", ".pdf", ".gz", ".zip")
"""Ends of names that promise what is not written, and of recordings."""

LOCK = ".tactid-lock"
"""File of a folder that is locked while a run writes there; readers of data sets skip it."""


class Rows(Protocol):
    """Where rows go."""

    def stored(self) -> dict[Key, tuple[Any, ...]]:
        """Returns the state of each recording whose rows are there; an empty one repeats it."""

    def add(self, rows: Sequence[Row]) -> None:
        """Adds the rows of a recording, in place of its earlier ones."""

    def close(self, *, is_whole: bool = True) -> None:
        """Writes what is not yet written; a run that failed or was stopped is not whole."""

    def all(self) -> list[Row]:
        """Returns all rows, in any order."""


def rows_at(out: Path | None, recordings: Iterable[Recording] = ()) -> "Rows":
    """Returns the table at a path: a CSV file, or else a folder of Parquet files.

    Raises:
        ArgumentError: The path is that of a recording, or of what tactid has not written.
    """
    if out is None:
        return MemoryRows()
    check_no_address(out)
    if out.suffix.lower() in NOT_WRITTEN:
        raise ArgumentError(
            f"the table {out}: expected a name that ends in .csv, or that of a folder of Parquet"
            " files, such as payloads.parquet"
        )
    if out.suffix.lower() != ".csv":
        return ParquetRows(out)
    target = Path(os.path.realpath(out))
    places = {Path(os.path.realpath(each.address)) for each in recordings if not each.base}
    same = places.intersection((target, *target.parents))
    check_outputs({"the table": out}, {"the recording": next(iter(same), None)})
    replaced_outputs({"the table": out})
    return CsvRows(out)


class MemoryRows:
    """Rows that are not stored."""

    def __init__(self) -> None:
        self.rows: list[Row] = []

    def stored(self) -> dict[Key, tuple[Any, ...]]:
        """Returns nothing."""
        return {}

    def add(self, rows: Sequence[Row]) -> None:
        """Adds the rows of a recording."""
        self.rows += rows

    def close(self, *, is_whole: bool = True) -> None:
        """Does nothing."""

    def all(self) -> list[Row]:
        """Returns the rows."""
        return self.rows


class CsvRows(MemoryRows):
    """A CSV file, written at the end as a whole: for some hundred rows."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path

    def close(self, *, is_whole: bool = True) -> None:
        """Writes the file, the rows in the order of their addresses.

        A run that is not whole leaves the rows of an earlier one that it has not replaced.
        """
        if not is_whole:
            if not self.rows:
                return
            added = set(map(key_of, self.rows))
            if self._path.is_file():
                self.rows += [row for row in read_rows(self._path) if key_of(row) not in added]
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        names = [*HEAD, *COLUMNS]
        writer.writerow(names)
        for row in sorted(self.rows, key=place_of):
            writer.writerow([_cell(row.get(name)) for name in names])
        write_atomically(self._path, text.getvalue())


def _cell(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, list | Mapping) else value


class ParquetRows:
    """A folder of Parquet files, which any reader of data sets opens.

    A row whose recording has changed is taken out of its file once the new row is written. If the
    process is killed between the two, the later row counts.
    """

    def __init__(self, folder: Path) -> None:
        self._arrow = package("pyarrow", f"{folder} is Parquet", extra="fleet")
        self._parquet = package("pyarrow.parquet", f"{folder} is Parquet", extra="fleet")
        self._folder, self._schema = folder, arrow_schema(self._arrow)
        self._rows: list[Row] = []
        self._written = time.monotonic()
        self._check()
        folder.mkdir(exist_ok=True)
        self._lock = locked(folder)
        self._places: dict[Key, Path] = {}
        self._outdated: dict[Path, set[Key]] = {}

    def _check(self) -> None:
        """Checks that rows may be written here.

        Raises:
            ArgumentError: The path is a file, or a folder that tactid has not written.
        """
        if self._folder.exists() and not self._folder.is_dir():
            raise ArgumentError(
                f"{self._folder} is a file: expected a new folder, or one of an earlier run"
            )
        if not self._folder.parent.is_dir():
            raise ArgumentError(f"there is no folder {self._folder.parent}")
        if not self._folder.exists():
            return
        for path in self._folder.iterdir():
            if path.suffix == ".parquet":
                metadata = self._parquet.read_schema(path).metadata or {}
                if b"tactid" in metadata:
                    continue
            if path.name.startswith(".tactid-"):  # the lock, or of a run that was killed
                continue
            raise ArgumentError(
                f"{self._folder} has {path.name}, which tactid has not written: give another name"
            )

    def stored(self) -> dict[Key, tuple[Any, ...]]:
        """Returns the state of each recording whose rows are there; an empty one repeats it."""
        found: dict[Key, tuple[Any, ...]] = {}
        latest: dict[Key, Any] = {}
        for path in self._paths():
            for row in _read(self._parquet, path, [*KEY, "finished", "outcome", *STATE]):
                key, finished = key_of(row), row["finished"]
                if key in latest and (latest[key], self._places[key]) != (finished, path):
                    older = path if latest[key] >= finished else self._places[key]
                    self._outdated.setdefault(older, set()).add(key)
                    if older == path:
                        continue
                    found.pop(key)
                latest[key], self._places[key] = finished, path
                state = tuple(row[name] for name in STATE)
                is_done = row["outcome"] != "unreachable" and found.get(key) != ()
                found[key] = state if is_done else ()
        return found

    def _paths(self) -> list[Path]:
        return sorted(self._folder.glob("*.parquet"))

    def add(self, rows: Sequence[Row]) -> None:
        """Adds the rows of a recording, which are written together, with others."""
        self._rows += rows
        if len(self._rows) >= FLUSH_ROWS or time.monotonic() - self._written > FLUSH_S:
            self._flush()

    def _flush(self) -> None:
        self._written = time.monotonic()
        if not self._rows:
            return
        path = self._folder / f"part-{time.time_ns():020d}.parquet"
        self._write(path, self._arrow.Table.from_pylist(self._rows, schema=self._schema))
        for key in set(map(key_of, self._rows)):
            if key in self._places:
                self._outdated.setdefault(self._places[key], set()).add(key)
            self._places[key] = path
        self._rows = []

    def _write(self, path: Path, table: Any) -> None:
        with atomic_path(path) as temporary:
            self._parquet.write_table(table, temporary, compression="zstd")

    def close(self, *, is_whole: bool = True) -> None:  # noqa: ARG002 - rows of earlier runs stay
        """Writes what is not yet written, and takes out the rows that others replace."""
        with self._lock:
            self._write_all()

    def _write_all(self) -> None:
        self._flush()
        for path, keys in self._outdated.items():
            table = self._parquet.read_table(path)
            heads = _read(self._parquet, path, KEY)
            kept = table.filter(self._arrow.array([key_of(head) not in keys for head in heads]))
            if kept.num_rows:
                self._write(path, kept)
            else:
                path.unlink()
        self._outdated = {}

    def all(self) -> list[Row]:
        """Returns all rows, those of earlier runs included."""
        return read_rows(self._folder)


def locked(folder: Path) -> IO[bytes]:
    """Returns an open file of a folder, which locks the folder until it is closed.

    The system unlocks it when the process ends, also where it is killed.

    Raises:
        ArgumentError: Another process has locked the folder.
    """
    file = (folder / LOCK).open("ab")
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        file.close()
        raise ArgumentError(
            f"another run writes to {folder}: wait until it ends, or give another name"
        ) from None
    except OSError:  # a file system without locks
        pass
    return file


def read_rows(out: Path, columns: Sequence[str] | None = None) -> list[Row]:
    """Returns all rows of a table, or some of their columns, in order of the addresses.

    Raises:
        ArgumentError: There is no such table, or tactid has not written it.
    """
    if out.suffix.lower() == ".csv" and out.is_file():
        return _read_csv(out)
    files = sorted(out.glob("*.parquet")) if out.is_dir() else [out]
    if not files or not all(path.is_file() for path in files):
        raise ArgumentError(f"there is no table at {out}: tactid fleet writes one")
    parquet = package("pyarrow.parquet", f"{out} is Parquet", extra="fleet")
    found: dict[Key, list[Row]] = {}
    for row in (row for path in files for row in _read(parquet, path, columns)):
        earlier = found.setdefault(key_of(row), [])
        if earlier and earlier[0]["finished"] < row["finished"]:
            earlier.clear()
        if not earlier or earlier[0]["finished"] == row["finished"]:
            earlier.append(row)
    return sorted((row for rows in found.values() for row in rows), key=place_of)


def _read(parquet: Any, path: Path, columns: Sequence[str] | None) -> list[Row]:
    """Reads the rows of a file, with the columns that it has: another version may have others."""
    try:
        schema = parquet.read_schema(path)
    except ValueError:  # of Arrow, where it is no Parquet
        schema = None
    if schema is None or b"tactid" not in (schema.metadata or {}):
        raise ArgumentError(f"{path} is no table that tactid fleet has written")
    there = set(schema.names)
    chosen = None if columns is None else [name for name in columns if name in there]
    rows: list[Row] = parquet.read_table(path, columns=chosen).to_pylist()
    return rows


def _read_csv(path: Path) -> list[Row]:
    """Reads the rows of a CSV file, with the types of their columns.

    Raises:
        ArgumentError: It is none that tactid has written.
    """
    types = HEAD | COLUMNS
    try:
        with path.open(encoding="utf-8", newline="") as file:
            lines = csv.DictReader(file)
            if not {"address", "options_sha256"} <= set(lines.fieldnames or ()):
                raise ValueError
            return [
                {name: _typed(text, types.get(name)) for name, text in line.items()}
                for line in lines
            ]
    except (ValueError, TypeError, csv.Error):
        raise ArgumentError(f"{path} is no table that tactid fleet has written") from None


def _typed(text: str, kind: Any) -> Any:
    """Returns the value of a cell of CSV: see :func:`_cell`."""
    if not text:
        return None
    if isinstance(kind, list | Mapping):
        return json.loads(text)
    words: dict[str, Callable[[str], Any]] = {
        "number": float,
        "integer": int,
        "boolean": "True".__eq__,
        "time": datetime.fromisoformat,
    }
    return words[kind](text) if kind in words else text


def new_or_changed(tasks: Iterable[Task], stored: Mapping[Key, tuple[Any, ...]]) -> list[Task]:
    """Returns the tasks that have no row, or that of another state."""
    return [task for task in tasks if stored.get(task.key) != task.state]
