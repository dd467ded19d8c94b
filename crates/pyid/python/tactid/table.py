"""Tables of results: in a terminal, as plain text and in a notebook."""

import html
import io
from collections.abc import Sequence
from dataclasses import dataclass

from rich import box
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from tactid._native import LogInfo
from tactid.truth import Truth
from tactid.values import KINDS, MOMENT_NAMES, MOMENT_UNIT, NAMES, UNITS, Values, digits_of

PAPER_NOMINAL = (100.0, 0.5, 0.0, 0.0, 10.0, 0.0, 0.0, 20.0, 0.0, 10.0)
PAPER_VALUES = (101.6, 0.51, 0.0, 0.0, 10.1, 0.0, 0.0, 20.22, 0.0, 10.13)
PAPER_ERRORS = (1.6, 2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.1, 0.0, 1.3)

NOT_IDENTIFIABLE = "not identifiable"


@dataclass(frozen=True)
class Column:
    """The result of one identification: the ten values, and the principal moments if there are."""

    title: str
    values: Values
    errors: Sequence[float | None] | None = None
    """Errors in percent; None where the truth is not known."""
    half_widths: Values | None = None
    """Half of each 95 % interval; None where the estimator has none."""


def number(value: float | None, half_width: float | None = None) -> str:
    """A value as a table shows it: as many digits as its interval is worth, and four at least."""
    if value is None:
        return NOT_IDENTIFIABLE
    digits = max(4, digits_of(half_width)) if half_width else 4
    return f"{_without_minus_zero(value, digits):.{digits}f}"


def around(half_width: float | None) -> str:
    """Half of a 95 % interval as a table shows it: two figures, and no exponent."""
    return "–" if half_width is None else f"{half_width:.{digits_of(half_width)}f}"


def percent(error: float | None) -> str:
    """An error as a table shows it."""
    return "–" if error is None else f"{_without_minus_zero(error, 4):.4f}"


def worst(errors: Sequence[float | None]) -> float:
    """The largest error, whatever its sign."""
    return max((abs(error) for error in errors if error is not None), default=float("nan"))


def is_the_papers(truth: Truth) -> bool:
    """Whether the payload is the one whose identification the paper's table shows."""
    return tuple(truth.nominal) == PAPER_NOMINAL


def heading(frame: str) -> str:
    """Says in which frame the values of a table are, and about which point the inertia is."""
    return f"Payload in the frame {frame}, inertia about the centre of mass"


def rich_table(columns: Sequence[Column], truth: Truth | None = None) -> Table:
    """The table for a terminal: ten rows, and three more where there are principal moments."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
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
        if column.half_widths is not None:
            table.add_column("± 95 %", justify="right")
        if column.errors is not None:
            table.add_column("error %", justify="right")
    names, units = NAMES + MOMENT_NAMES, UNITS + (MOMENT_UNIT,) * 3
    for index, cells in enumerate(_cells(columns, truth, with_paper)):
        last_of_kind = any(index == kind.stop - 1 for kind in KINDS)
        table.add_row(names[index], units[index], *cells, end_section=last_of_kind)
    return table


def _cells(
    columns: Sequence[Column], truth: Truth | None, with_paper: bool
) -> Sequence[Sequence[str]]:
    rows = []
    nominal = [] if truth is None else truth.nominal + truth.nominal_moments
    for index in range(len(columns[0].values)):
        cells = [f"{value:.2f}" for value in nominal[index : index + 1]]
        if with_paper and index < len(NAMES):
            cells += [f"{PAPER_VALUES[index]:.2f}", f"{PAPER_ERRORS[index]:.2f}"]
        elif with_paper:
            cells += ["–", "–"]
        for column in columns:
            half_width = None if column.half_widths is None else column.half_widths[index]
            cells.append(number(column.values[index], half_width))
            if column.half_widths is not None:
                cells.append(around(half_width))
            if column.errors is not None:
                cells.append(percent(column.errors[index]))
        rows.append(cells)
    return rows


def html_table(column: Column, title: str) -> str:
    """Returns a small table for a notebook: the ten values with their 95 % intervals."""
    half_widths = column.half_widths or [None] * len(column.values)
    rows = "".join(
        f"<tr><td>{name}</td><td>{unit}</td><td>{number(value, half)}</td><td>{around(half)}</td>"
        "</tr>"
        for name, unit, value, half in zip(NAMES, UNITS, column.values, half_widths, strict=False)
    )
    heads = "<tr><th>parameter</th><th>unit</th><th>value</th><th>± 95 %</th></tr>"
    return (
        f"<table><caption>{html.escape(title)}</caption><thead>{heads}</thead>"
        f"<tbody>{rows}</tbody></table>"
    )


def whole_width(table: Table, console: Console) -> int:
    """Returns the width at which a console shows a table without truncating or folding cells."""
    return Measurement.get(console, console.options.update(max_width=1000), table).maximum


def plain_text(column: Column, title: str) -> str:
    """Returns the table of one result as text without colours, with a line above it."""
    table = rich_table([column])
    page = io.StringIO()
    console = Console(file=page, color_system=None, force_terminal=False)
    console.width = whole_width(table, console)
    console.print(table)
    lines = [title, *page.getvalue().splitlines()]
    return "\n".join(line.rstrip() for line in lines).rstrip()


def _without_minus_zero(value: float, digits: int) -> float:
    return round(value, digits) + 0.0


def topics_table(info: LogInfo) -> Table:
    """Returns the topics of a log as a table."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("topic", overflow="fold")
    table.add_column("type", overflow="fold")
    table.add_column("messages", justify="right")
    table.add_column("rate / Hz", justify="right")
    for topic in info.topics:
        rate = "–" if topic.frequency is None else f"{topic.frequency:.1f}"
        table.add_row(Text(topic.name), Text(topic.type_name), str(topic.count), rate)
    return table


def info_lines(info: LogInfo) -> list[str]:
    """Returns the duration, the metadata and the damage of a log, a line each."""
    duration = "no messages" if info.duration is None else f"{info.duration:.3f} s"
    records = ", ".join(info.metadata) or "none"
    lines = [f"duration  {duration}", f"metadata  {records}"]
    return lines + [f"damage    {line}" for line in info.damage or ["none"]]
