"""Text files of numbers: what separates the columns, and which of them are read."""

import csv
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from tactid._base.errors import LogError
from tactid._base.naming import shortened
from tactid._base.values import Array

MOST_COLUMNS = 10_000
"""Most columns of a table: a file of another kind has lines of any length."""

LONGEST_LINE = 1 << 20
"""Most characters of a line."""

CHECK_EVERY = 1 << 14
"""Lines between two calls of the progress."""


@dataclass(frozen=True)
class Layout:
    """How the lines of a file are to be read."""

    names: list[str]
    """Names of the columns."""
    delimiter: str
    """What separates the columns; a space stands for any white space."""
    first: int
    """Number of lines up to that of the names, which is included."""
    has_decimal_commas: bool
    """Whether a comma stands for a decimal point, as it does between semicolons."""


def layout_of(path: Path) -> Layout:
    """Reads the line of the names: the first one that is neither empty nor a comment.

    A comment begins with ``#``. Where nothing else precedes the numbers, the last comment has the
    names, as ``numpy.savetxt`` writes it.

    Raises:
        LogError: There is no line with names, or they are not those of columns.
    """
    comment, number = None, 0
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(_bounded(path, file), 1):
            text = line.strip()
            if text.startswith("#"):
                comment = (number, text.lstrip("#").strip())
            elif text:
                break
        else:
            raise LogError(f"{path} is empty: it has no line with the names of columns")
    names, delimiter = _split(text)
    if not any(map(_is_number, names)):
        return _layout(path, names, delimiter, number)
    if comment is not None:
        of_comment, _ = _split(comment[1], delimiter)
        if len(of_comment) == len(names):
            return _layout(path, of_comment, delimiter, comment[0])
    raise LogError(
        f"{path} has no names of columns: line {number} has numbers, but the first line must name"
        " each column, such as time,q1,q2"
    )


def _layout(path: Path, names: list[str], delimiter: str, first: int) -> Layout:
    if len(names) > MOST_COLUMNS:
        raise LogError(f"{path} has {len(names)} columns: a table has at most {MOST_COLUMNS}")
    # A delimiter at the end of each line makes a column without a name.
    named = [name or f"column {place}" for place, name in enumerate(names, 1)]
    return Layout(named, delimiter, first, has_decimal_commas=delimiter == ";")


def _split(text: str, delimiter: str | None = None) -> tuple[list[str], str]:
    """Splits a line at its delimiter, which is the first of some that it has."""
    delimiter = delimiter or next((each for each in ",;\t" if each in text), " ")
    if delimiter == " ":
        return text.split(), delimiter
    return [name.strip() for name in next(csv.reader([text], delimiter=delimiter))], delimiter


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_columns(
    path: Path,
    layout: Layout,
    names: Sequence[str],
    progress: Callable[[float], object] | None = None,
) -> dict[str, Array]:
    """Reads some columns, (N,) each; NaN stands for an empty cell.

    Raises:
        LogError: A cell of theirs is a text, a line has another number of cells than the first, or
            there is no row.
    """
    places = [layout.names.index(name) for name in names]
    lines = _rows(path, layout, progress)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of no row, which is an error below
            values = np.loadtxt(
                (line for _, line in lines),
                delimiter=None if layout.delimiter == " " else layout.delimiter,
                usecols=places,
                comments=None,
                quotechar='"',
                ndmin=2,
            )
    except ValueError as error:
        raise _bad_cell(path, layout, places) or LogError(f"{path}: {error}") from None
    if not len(values):
        raise LogError(f"{path} has the names of columns, but no row of numbers")
    return {name: np.ascontiguousarray(values[:, k]) for k, name in enumerate(names)}


def _rows(
    path: Path, layout: Layout, progress: Callable[[float], object] | None = None
) -> Iterator[tuple[int, str]]:
    """Yields each line with numbers and its number, with ``nan`` in place of empty cells."""
    delimiter, count = layout.delimiter, len(layout.names)
    size = max(path.stat().st_size, 1)
    done = 0
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(_bounded(path, file), 1):
            done += len(line)
            if progress is not None and number % CHECK_EVERY == 0:
                progress(min(done / size, 1.0))
            text = line.strip("\r\n")
            if number <= layout.first or not text.strip() or text.startswith("#"):
                continue
            if layout.has_decimal_commas:
                text = text.replace(",", ".")
            cells = _cells(text, delimiter)
            if cells != count:
                raise LogError(
                    f"{path}, line {number}: it has {cells} cells, but there are {count} columns"
                )
            yield number, text if delimiter == " " else _filled(text, delimiter)


def _cells(text: str, delimiter: str) -> int:
    """Returns the number of cells of a line."""
    if delimiter == " ":
        return len(text.split())
    if '"' in text:
        return len(next(csv.reader([text], delimiter=delimiter)))
    return text.count(delimiter) + 1


def _filled(text: str, delimiter: str) -> str:
    """Returns a line with ``nan`` in its empty cells."""
    has_spaces = " " in text or "\t" in text
    if not has_spaces and delimiter * 2 not in text and delimiter not in (text[0], text[-1]):
        return text
    cells = next(csv.reader([text], delimiter=delimiter))
    return delimiter.join(f'"{cell.strip() or "nan"}"' for cell in cells)


def _bad_cell(path: Path, layout: Layout, places: list[int]) -> LogError | None:
    """Returns the error of the first cell of some columns that is no number."""
    for number, line in _rows(path, layout):
        is_spaced = layout.delimiter == " "
        cells = line.split() if is_spaced else next(csv.reader([line], delimiter=layout.delimiter))
        for place in places:
            if not _is_number(cells[place]):
                return LogError(
                    f"{path}, line {number}, column `{layout.names[place]}`:"
                    f" {shortened(cells[place])!r} is no number"
                )
    return None


def _bounded(path: Path, file: TextIO) -> Iterator[str]:
    """Yields the lines of a file; one of another kind may have a line of any length."""
    number = 0
    while line := file.readline(LONGEST_LINE):
        number += 1
        if len(line) == LONGEST_LINE:
            raise LogError(
                f"{path}, line {number}: it has more than {LONGEST_LINE:,} characters, which is no"
                " table"
            )
        yield line
