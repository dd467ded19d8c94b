"""Tables of results: in a terminal, as plain text and in a notebook."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tactid._base.text_table import as_text, empty_table
from tactid._base.values import (
    KINDS,
    MOMENT_NAMES,
    MOMENT_UNIT,
    UNITS,
    Interval,
    Observability,
    Values,
    digits_of,
)
from tactid._native import VALUE_NAMES
from tactid._results.paper_values import PAPER_ERRORS, PAPER_VALUES, is_the_papers
from tactid._results.truth import Truth

if TYPE_CHECKING:
    from rich.table import Table

MOST_WRITTEN_OUT = 1e9
"""Numbers from here on have an exponent: no payload is that large."""


OF_SHAPE = "of shape"
"""Title of the column with the fraction of the information that is the shape's."""


@dataclass(frozen=True)
class Column:
    """The result of one identification: the ten values, and the principal moments if there are."""

    title: str
    values: Values
    errors: Sequence[float | None] | None = None
    """Errors in percent; None where the truth is not known."""
    intervals: Sequence[Interval | None] | None = None
    """The 95 % interval of each value; None where the estimator has none."""
    observability: Sequence[Observability] | None = None
    """Why a value is missing; by default it is unobservable."""
    shape_fractions: Sequence[float | None] | None = None
    """Fraction of the information on each value that is the shape's; None without a shape."""

    @property
    def rows(self) -> list["Row"]:
        """The rows of a table, one for each value."""
        names, units = (*VALUE_NAMES, *MOMENT_NAMES), UNITS + (MOMENT_UNIT,) * len(MOMENT_NAMES)
        count = len(self.values)
        columns = (
            self.values,
            self.intervals or [None] * count,
            self.errors or [None] * count,
            self.observability or ["unobservable"] * count,
            self.shape_fractions or [None] * count,
        )
        ends = [kind.stop - 1 for kind in KINDS]
        return [
            Row(names[index], units[index], *entries, ends_kind=index in ends)
            for index, entries in enumerate(zip(*columns, strict=True))
        ]


@dataclass(frozen=True)
class Row:
    """One value of a result, as every table shows it."""

    name: str
    unit: str
    value: float | None
    """None where the value is unobservable, or uncertain without limits."""
    interval: Interval | None
    """The 95 % interval; None where there is none."""
    error: float | None
    """Error in percent; None where it is not known."""
    observability: Observability
    """Whether the motion excites the value, and whether the noise leaves enough of it."""
    shape_fraction: float | None
    """Fraction of the information that is the shape's; None where it is not known."""
    ends_kind: bool
    """Whether the value is the last of its kind: mass, centre of mass or inertia."""

    @property
    def number(self) -> str:
        """The value as a table shows it, or why there is none."""
        return self.observability if self.value is None else number(self.value, self.interval)

    @property
    def around(self) -> str:
        """The 95 % interval as a table shows it: two figures.

        It is half of the interval, or both limits where it is cut at what a body can have.
        """
        if self.value is None or self.interval is None:
            return "–"
        half_width = self.interval.half_width(self.value)
        digits = digits_of(half_width)
        if not self.interval.is_cut(self.value):
            return _written(half_width, digits)
        low, high = (_written(limit, digits) for limit in self.interval)
        return f"{low} .. {high}"

    @property
    def of_shape(self) -> str:
        """The fraction of the information that is the shape's, as a table shows it."""
        return "–" if self.shape_fraction is None else f"{100 * self.shape_fraction:.0f} %"


def number(value: float, interval: Interval | None = None) -> str:
    """A value as a table shows it: as many digits as its interval is worth, and four at least."""
    half_width = interval.half_width(value) if interval is not None else 0.0
    digits = max(4, digits_of(half_width)) if half_width else 4
    return _written(value, digits)


def percent(error: float | None) -> str:
    """An error as a table shows it."""
    return "–" if error is None else _written(error, 4)


def worst(errors: Sequence[float | None]) -> float:
    """The largest error, whatever its sign."""
    return max((abs(error) for error in errors if error is not None), default=float("nan"))


def heading(frame: str) -> str:
    """Says in which frame the values of a table are, and about which point the inertia is."""
    return f"Payload in the frame {frame}, inertia about the centre of mass"


def rich_table(columns: Sequence[Column], truth: Truth | None = None) -> "Table":
    """The table for a terminal: ten rows, and three more where there are principal moments."""
    table = empty_table()
    table.add_column("parameter")
    table.add_column("unit", style="dim")
    with_paper = truth is not None and is_the_papers(truth)
    if truth is not None:
        table.add_column("nominal", justify="right")
    if with_paper:
        table.add_column("paper", justify="right")
        table.add_column("error %", justify="right")
    for column in columns:
        table.add_column(column.title, justify="right", style="bold")
        if column.intervals is not None:
            table.add_column("± 95 %", justify="right")
        if column.shape_fractions is not None:
            table.add_column(OF_SHAPE, justify="right")
        if column.errors is not None:
            table.add_column("error %", justify="right")
    for index, results in enumerate(zip(*(column.rows for column in columns), strict=True)):
        given = _given(index, truth) if truth is not None else []
        cells = [
            cell
            for column, row in zip(columns, results, strict=True)
            for cell in _cells(column, row)
        ]
        first = results[0]
        table.add_row(first.name, first.unit, *given, *cells, end_section=first.ends_kind)
    return table


def _given(index: int, truth: Truth) -> list[str]:
    """Returns the nominal value, and for the paper's payload the paper's value and error."""
    value = (truth.nominal + truth.nominal_moments)[index]
    if not is_the_papers(truth):
        return [number(value)]
    nominal = f"{value:.2f}"
    if index >= len(VALUE_NAMES):
        return [nominal, "–", "–"]
    return [nominal, f"{PAPER_VALUES[index]:.2f}", f"{PAPER_ERRORS[index]:.2f}"]


def _cells(column: Column, row: Row) -> list[str]:
    cells = [row.number]
    if column.intervals is not None:
        cells.append(row.around)
    if column.shape_fractions is not None:
        cells.append(row.of_shape)
    if column.errors is not None:
        cells.append(percent(row.error))
    return cells


def html_table(column: Column, title: str) -> str:
    """Returns a small table for a notebook: the ten values with their 95 % intervals."""
    import html  # its table of entities takes a while to load, and a terminal needs none

    heads, shown = ["parameter", "unit", "value", "± 95 %"], column.rows[: len(VALUE_NAMES)]
    rows = [[row.name, row.unit, row.number, row.around] for row in shown]
    if column.shape_fractions is not None:
        heads.append(OF_SHAPE)
        rows = [[*cells, row.of_shape] for cells, row in zip(rows, shown, strict=True)]
    head = "".join(f"<th>{title}</th>" for title in heads)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>" for cells in rows)
    return (
        f"<table><caption>{html.escape(title)}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{body}</tbody></table>"
    )


def plain_text(columns: Sequence[Column], title: str) -> str:
    """Returns the table of results as text without colours, with a line above it."""
    return f"{title}\n{as_text(rich_table(columns))}"


def _written(value: float, digits: int) -> str:
    """A number with so many digits after the point, without the sign of minus zero."""
    if abs(value) >= MOST_WRITTEN_OUT:
        return f"{value:.6e}"
    return f"{round(value, digits) + 0.0:.{digits}f}"
