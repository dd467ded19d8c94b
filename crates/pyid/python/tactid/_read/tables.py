"""Tables of numbers in files: named columns of CSV, ``.npz`` and Parquet."""

import zipfile
import zlib
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tactid._base.errors import ArgumentError, LogError
from tactid._base.naming import abridged, counted
from tactid._base.values import Array
from tactid._read.csv_table import Layout, layout_of, read_columns
from tactid._read.packages import package

Progress = Callable[[float], object] | None
"""Callback that receives the fraction done; an exception that it raises stops the reading."""


class Table(ABC):
    """A table in a file: rows with a time each, or a pose at rest each, and named columns."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self.path = path
        self.names = list(names)
        """Names of the columns that may have numbers, in the file's order."""
        if twice := [name for name, count in Counter(names).items() if count > 1]:
            raise LogError(f"{path} has two columns with the name `{twice[0]}`")

    @abstractmethod
    def read(self, names: Sequence[str], progress: Progress = None) -> dict[str, Array]:
        """Reads columns: each (N,), or (N, k) where an entry is a list of k numbers.

        Raises:
            LogError: The file cannot be read, a number is a text, or rows differ in length.
        """

    def unknown(self, name: str) -> ArgumentError:
        """Returns the error of a column that the table does not have."""
        return ArgumentError(f"{self.path} has no column `{name}`: {self.listed}", option="columns")

    @property
    def listed(self) -> str:
        """The columns, as a sentence lists them."""
        columns = [f"`{name}`" for name in self.names]
        return f"its columns are {abridged(columns, 24)}" if columns else "it has no columns"


class CsvTable(Table):
    """A text file with a line of names, and a line of numbers for each row."""

    def __init__(self, path: Path) -> None:
        self._layout: Layout = layout_of(path)
        super().__init__(path, self._layout.names)

    def read(self, names: Sequence[str], progress: Progress = None) -> dict[str, Array]:
        """Reads columns: see :meth:`Table.read`."""
        return read_columns(self.path, self._layout, names, progress)


NPZ_ERRORS = (ValueError, zipfile.BadZipFile, EOFError, MemoryError, zlib.error)
"""Errors of NumPy for a damaged file, whose arrays may claim any size."""


class NpzTable(Table):
    """Arrays by their names, as ``numpy.savez`` stores them."""

    def __init__(self, path: Path) -> None:
        try:
            with np.load(path, allow_pickle=False) as file:
                super().__init__(path, file.files)
        except NPZ_ERRORS as error:
            raise LogError(f"{path} cannot be read as .npz: {error}") from None

    def read(self, names: Sequence[str], progress: Progress = None) -> dict[str, Array]:
        """Reads arrays, each with one row a sample: see :meth:`Table.read`."""
        found = {}
        with np.load(self.path, allow_pickle=False) as file:
            for done, name in enumerate(names):
                if progress is not None:
                    progress(done / len(names))
                try:
                    found[name] = _numbers(self.path, name, file[name])
                except NPZ_ERRORS as error:
                    raise LogError(f"{self.path}, array `{name}`: {error}") from None
        rows = {name: len(array) if array.ndim else 1 for name, array in found.items()}
        for name, count in rows.items():
            if count != rows[names[0]]:
                raise LogError(
                    f"{self.path}: `{name}` has {counted(count, 'row')}, but `{names[0]}` has"
                    f" {rows[names[0]]}: arrays of one recording have a row for each time"
                )
        return found


class ParquetTable(Table):
    """Columns of a Parquet file, or of the files of a folder; lists are of one length each.

    Args:
        path: The file or folder that is read.
        filters: Which rows are read, as ``pyarrow.parquet.read_table`` takes it.
    """

    def __init__(self, path: Path, filters: Any = None) -> None:
        self._filters = filters
        arrow, parquet = _pyarrow(path)
        with _arrow_errors(path, arrow):
            schema = parquet.ParquetDataset(path).schema
        self._stamps = {field.name for field in schema if arrow.types.is_timestamp(field.type)}
        super().__init__(path, [field.name for field in schema if _is_numeric(arrow, field.type)])

    def read(self, names: Sequence[str], progress: Progress = None) -> dict[str, Array]:
        """Reads columns: see :meth:`Table.read`."""
        arrow, parquet = _pyarrow(self.path)
        found: dict[str, Array] = {}
        for done, name in enumerate(names):
            if progress is not None:
                progress(done / len(names))
            with _arrow_errors(self.path, arrow):
                read = parquet.read_table(self.path, columns=[name], filters=self._filters)
                found[name] = self._values(name, read.column(name).combine_chunks())
        return found

    def _values(self, name: str, column: Any) -> Array:
        """Returns the numbers of a column; NaN stands where there is none."""
        arrow, _ = _pyarrow(self.path)
        if name in self._stamps:
            nanoseconds = column.cast(arrow.timestamp("ns")).cast(arrow.int64())
            return np.asarray(nanoseconds.to_numpy(zero_copy_only=False), float) * 1e-9
        if not _is_list(arrow, column.type):
            numbers = column.cast(arrow.float64()).to_numpy(zero_copy_only=False)
            return np.asarray(numbers, float)
        lengths = arrow.compute.list_value_length(column).to_numpy(zero_copy_only=False)
        if lengths.size and not (lengths == lengths[0]).all():
            row = int(np.flatnonzero(lengths != lengths[0])[0])
            raise LogError(
                f"{self.path}, column `{name}`: row {row + 1} has {_count(lengths[row])}, but the"
                f" first has {_count(lengths[0])}"
            )
        numbers = column.flatten().cast(arrow.float64()).to_numpy(zero_copy_only=False)
        return np.asarray(numbers, float).reshape(
            len(lengths), int(lengths[0] if lengths.size else 0)
        )


def open_table(path: Path) -> Table | None:
    """Returns the table in a file, which its first bytes or its name show; None for another file.

    A folder whose name is that of a Parquet file is a table that was written in parts.

    Raises:
        LogError: The file cannot be read as what it seems to be.
        ArgumentError: It is Parquet, and pyarrow is missing.
    """
    if path.is_dir() and path.suffix.lower() == ".parquet":
        return ParquetTable(path)
    if not path.is_file():
        return None
    with path.open("rb") as file:
        beginning = file.read(4)
    if beginning == b"PAR1":
        return ParquetTable(path)
    if beginning == b"PK\x03\x04" and path.suffix.lower() == ".npz":
        return NpzTable(path)
    if path.suffix.lower() in TEXTS:
        return CsvTable(path)
    return None


TEXTS = (".csv", ".tsv", ".txt")
"""Ends of the names of text files with a table."""

TABLES = (*TEXTS, ".npz", ".parquet")
"""Ends of the names of tables, and of the files of a data set."""


def _pyarrow(path: Path) -> tuple[Any, Any]:
    """Imports pyarrow, with its functions, and its part for Parquet."""
    what = f"{path} is Parquet"
    package("pyarrow.compute", what)
    return package("pyarrow", what), package("pyarrow.parquet", what)


class _arrow_errors:  # noqa: N801 - used as a function
    """Makes errors of pyarrow those of a log, with its path."""

    def __init__(self, path: Path, arrow: Any) -> None:
        self._path, self._errors = path, arrow.ArrowException

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: Any, _: Any) -> None:
        if isinstance(error, self._errors | OSError):
            raise LogError(f"{self._path} cannot be read: {error}") from None


def _is_list(arrow: Any, kind: Any) -> bool:
    types = arrow.types
    return bool(types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind))


def _is_numeric(arrow: Any, kind: Any) -> bool:
    types = arrow.types
    value = kind.value_type if _is_list(arrow, kind) else kind
    is_number = types.is_floating(value) or types.is_integer(value) or types.is_decimal(value)
    return bool(is_number or types.is_timestamp(value))


def _count(length: float) -> str:
    return "no list" if np.isnan(length) else f"{int(length)} numbers"


def _numbers(path: Path, name: str, array: Any) -> Array:
    """Returns an array as numbers."""
    if not (np.issubdtype(array.dtype, np.number) or array.dtype == bool) or np.iscomplexobj(array):
        raise LogError(f"{path}, array `{name}`: its entries are {array.dtype}, and not numbers")
    return np.asarray(array, float)
