"""The table of a fleet: a folder of Parquet files to which rows are added, or a CSV file."""

import csv
import io
import json
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from tactid._base.errors import ArgumentError
from tactid._base.files import atomic_path, write_atomically
from tactid._fleet.rows import (
    COLUMNS,
    HEAD,
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
"""Time after which rows are written in any case, s: what a killed run loses."""


class Rows(Protocol):
    """Where rows go."""

    def stored(self) -> dict[Key, tuple[Any, ...]]:
        """Returns the state of each recording whose rows are there; an empty one repeats it."""

    def add(self, rows: Sequence[Row]) -> None:
        """Adds the rows of a recording, in place of its earlier ones."""

    def close(self) -> None:
        """Writes what is not yet written."""

    def all(self) -> list[Row]:
        """Returns all rows, in any order."""


def rows_at(out: Path | None) -> "Rows":
    """Returns the table at a path: a CSV file, or else a folder of Parquet files."""
    if out is None:
        return MemoryRows()
    return CsvRows(out) if out.suffix.lower() == ".csv" else ParquetRows(out)


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

    def close(self) -> None:
        """Does nothing."""

    def all(self) -> list[Row]:
        """Returns the rows."""
        return self.rows


class CsvRows(MemoryRows):
    """A CSV file, written at the end as a whole: for some hundred rows."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path

    def close(self) -> None:
        """Writes the file, the rows in the order of their addresses."""
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
        self._arrow = package("pyarrow", f"{folder} is Parquet")
        self._parquet = package("pyarrow.parquet", f"{folder} is Parquet")
        self._folder, self._schema = folder, arrow_schema(self._arrow)
        self._rows: list[Row] = []
        self._written = time.monotonic()
        self._check()
        folder.mkdir(exist_ok=True)
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
            if path.name.startswith(".tactid-"):  # of a run that was killed
                continue
            raise ArgumentError(
                f"{self._folder} has {path.name}, which tactid has not written: give another name"
            )

    def stored(self) -> dict[Key, tuple[Any, ...]]:
        """Returns the state of each recording whose rows are there; an empty one repeats it."""
        found: dict[Key, tuple[Any, ...]] = {}
        latest: dict[Key, Any] = {}
        for path in self._paths():
            table = self._parquet.read_table(
                path, columns=["address", "episode", "finished", "outcome", *STATE]
            )
            for row in table.to_pylist():
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

    def close(self) -> None:
        """Writes what is not yet written, and takes out the rows that others replace."""
        self._flush()
        for path, keys in self._outdated.items():
            table = self._parquet.read_table(path)
            heads = table.select(["address", "episode"]).to_pylist()
            kept = table.filter(self._arrow.array([key_of(head) not in keys for head in heads]))
            if kept.num_rows:
                self._write(path, kept)
            else:
                path.unlink()
        self._outdated = {}

    def all(self) -> list[Row]:
        """Returns all rows, those of earlier runs included."""
        return read_rows(self._folder)


def read_rows(out: Path, columns: Sequence[str] | None = None) -> list[Row]:
    """Returns all rows of a table of Parquet, or some of their columns, in order of the addresses.

    Raises:
        ArgumentError: There is no such table.
    """
    parquet = package("pyarrow.parquet", f"{out} is Parquet")
    files = sorted(out.glob("*.parquet")) if out.is_dir() else [out]
    if not files or not all(path.is_file() for path in files):
        raise ArgumentError(f"there is no table at {out}: tactid fleet writes one")
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
    there = set(parquet.read_schema(path).names)
    chosen = None if columns is None else [name for name in columns if name in there]
    rows: list[Row] = parquet.read_table(path, columns=chosen).to_pylist()
    return rows


def new_or_changed(tasks: Iterable[Task], stored: Mapping[Key, tuple[Any, ...]]) -> list[Task]:
    """Returns the tasks that have no row, or that of another state."""
    return [task for task in tasks if stored.get(task.recording.key) != task.state]
